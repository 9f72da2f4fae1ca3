//! The plots of the page.

use crate::diagnose::{Diagnosis, ForceTrace, Recovered};
use crate::fit::FreeRun;
use crate::report::{Plot, Series, Stroke, Tone};

/// Points of a cloud: more only hide each other.
const POINTS: usize = 3000;

/// One recording, driven through the rig as written, refitted and mended.
pub(super) struct Runs<'a> {
    pub role: &'a str,
    pub written: FreeRun,
    pub before: FreeRun,
    pub after: FreeRun,
}

/// Signal and error of each sensor over one recording, with the mismatch marked.
pub(super) fn runs(diagnosis: &Diagnosis, runs: &Runs<'_>) -> Vec<Plot> {
    let name = &runs.after.recording;
    let bands: Vec<[f64; 2]> = diagnosis
        .location
        .iter()
        .flat_map(|location| &location.intervals)
        .filter(|stretch| stretch.recording == *name)
        .map(|stretch| [stretch.t_start_s, stretch.t_end_s])
        .collect();
    let t = &runs.after.t;
    let mut plots = Vec::new();
    for (index, after) in runs.after.sensors.iter().enumerate() {
        let before = &runs.before.sensors[index];
        let line = |name: &str, stroke: Stroke, tone: Tone, y: Vec<f64>| {
            Series::new(name, stroke, t.clone(), y).tone(tone)
        };
        let measured = &after.measured;
        let error = |simulated: &[f64]| -> Vec<f64> {
            simulated.iter().zip(measured).map(|(s, m)| s - m).collect()
        };
        let mut signal = Plot::over_time(format!("{} of {name} ({})", after.signal, runs.role))
            .y(&after.signal, &after.unit)
            .with(line("measured", Stroke::Solid, Tone::Ink, measured.clone()))
            .with(line(
                "refitted",
                Stroke::Solid,
                Tone::Orange,
                before.simulated.clone(),
            ))
            .with(line(
                "corrected",
                Stroke::Dashed,
                Tone::Blue,
                after.simulated.clone(),
            ));
        let title = format!("{} of {name}: simulated minus measured", after.signal);
        let mut difference = Plot::over_time(title)
            .y("error", &after.unit)
            .with(line(
                "refitted",
                Stroke::Solid,
                Tone::Orange,
                error(&before.simulated),
            ))
            .with(line(
                "corrected",
                Stroke::Solid,
                Tone::Blue,
                error(&after.simulated),
            ));
        let written = &runs.written.sensors[index];
        // A rig that was far off as written would flatten everything else.
        if size(&error(&written.simulated)) < 5.0 * size(&error(&before.simulated)) {
            let written = written.simulated.clone();
            signal = signal.with(line("as written", Stroke::Solid, Tone::Green, written));
        }
        signal.bands.clone_from(&bands);
        difference.bands.clone_from(&bands);
        plots.extend([signal, difference]);
    }
    plots
}

/// Largest magnitude; infinite where something is no number.
fn size(values: &[f64]) -> f64 {
    let finite = values.iter().filter(|v| !v.is_nan());
    finite.fold(0.0, |size: f64, v| size.max(v.abs()))
}

/// The recovered force against velocity, position and time, with the named law on top.
pub(super) fn recovered(recovered: &Recovered) -> Vec<Plot> {
    let velocity_unit = format!("{}/s", recovered.position_unit);
    let at = &recovered.component;
    let mut against_velocity = Plot::over_time(format!("Recovered force at {at} against velocity"))
        .x("velocity", &velocity_unit)
        .y("force", &recovered.unit);
    let mut against_position = Plot::over_time(format!("Recovered force at {at} against position"))
        .x("position", &recovered.position_unit)
        .y("force", &recovered.unit);
    let samples: usize = recovered.traces.iter().map(|trace| trace.t.len()).sum();
    let stride = samples.div_ceil(POINTS).max(1);
    let cloud = |x: fn(&ForceTrace) -> &Vec<f64>, y: fn(&ForceTrace) -> &Vec<f64>| {
        let mut points: Vec<(f64, f64)> = recovered
            .traces
            .iter()
            .flat_map(|trace| x(trace).iter().copied().zip(y(trace).iter().copied()))
            .step_by(stride)
            .filter(|(x, y)| x.is_finite() && y.is_finite())
            .collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        points.into_iter().unzip()
    };
    let mut add = |name: &str, tone: Tone, y: fn(&ForceTrace) -> &Vec<f64>| {
        for (plot, x) in [
            (
                &mut against_velocity,
                (|trace| &trace.velocity) as fn(&ForceTrace) -> &Vec<f64>,
            ),
            (&mut against_position, |trace| &trace.position),
        ] {
            let (x, y): (Vec<f64>, Vec<f64>) = cloud(x, y);
            if !x.is_empty() {
                plot.series
                    .push(Series::new(name, Stroke::Points, x, y).tone(tone));
            }
        }
    };
    add("recovered", Tone::Ink, |trace| &trace.force);
    add("the named law", Tone::Blue, |trace| &trace.law);
    let mut plots = vec![against_velocity, against_position];
    for trace in &recovered.traces {
        let title = format!("Recovered force at {at} over time, {}", trace.recording);
        let line = |name: &str, tone: Tone, y: &Vec<f64>| {
            Series::new(name, Stroke::Solid, trace.t.clone(), y.clone()).tone(tone)
        };
        let mut plot = Plot::over_time(title)
            .y("force", &recovered.unit)
            .with(line("recovered", Tone::Ink, &trace.force));
        if !trace.law.is_empty() {
            plot = plot.with(line("the named law", Tone::Blue, &trace.law));
        }
        plots.push(plot);
    }
    plots
}

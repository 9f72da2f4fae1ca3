//! The plots of the page.

use crate::diagnose::{ForceTrace, Recovered};
use crate::order;
use crate::report::{Plot, Series, Stroke, Tone};

/// Points of a cloud: more only hide each other.
const POINTS: usize = 3000;

/// The recovered force against velocity, position and time; the law called `named` on top.
pub(super) fn recovered(recovered: &Recovered, named: &str) -> Vec<Plot> {
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
        order::sort_up(&mut points, |point| point.0);
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
    add(named, Tone::Blue, |trace| &trace.law);
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
            plot = plot.with(line(named, Tone::Blue, &trace.law));
        }
        plots.push(plot);
    }
    plots
}

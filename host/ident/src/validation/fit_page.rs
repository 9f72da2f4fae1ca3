//! A fit as a page that stands alone.

use sinew_sim::Rig;

use super::chapters::{chapters, fit_table};
use super::free::{Free, Model};
use super::motions::motions;
use crate::error::Result;
use crate::fit::{Fit, FreeRun, SensorFit, fit_text};
use crate::order;
use crate::recording::Recording;
use crate::report::{
    Block, Plot, Provenance, Report, Section, Series, Stroke, Table, Tone, own_interval, quantity,
    significant, unseen, warnings,
};

/// Error as a multiple of the noise from which on it is more than noise.
const ABOVE: f64 = 3.0;
/// Recordings that are drawn at most; the table of errors counts all.
const DRAWN: usize = 8;

/// Parts that a page of a fit is made of.
#[derive(Clone, Debug)]
pub struct FitPage<'a> {
    /// The fit.
    pub found: &'a Fit,
    /// The rig as it came.
    pub written: &'a Rig,
    /// The recordings of the fit, then those that test it, each with its role.
    pub recordings: Vec<(&'a str, &'a Recording)>,
    /// Free runs of the rig as written and refitted, in the order of the recordings.
    pub runs: [&'a [FreeRun]; 2],
    /// The files are tables of rests: there is no time to draw over.
    pub at_rest: bool,
    /// Command line that comes next.
    pub next: String,
}

/// The page.
///
/// # Errors
/// As [`chapters`].
pub fn fit_page(of: &FitPage<'_>, made: &Provenance) -> Result<Report> {
    let model = |name, tone, runs| Model { name, tone, runs };
    let free = Free {
        rig: &of.found.rig,
        recordings: of.recordings.clone(),
        models: vec![
            model("as written", Tone::Orange, of.runs[0]),
            model("refitted", Tone::Blue, of.runs[1]),
        ],
    };
    let tested: Vec<FreeRun> = (of.recordings.iter().zip(of.runs[1]))
        .filter(|((role, _), _)| *role == "test")
        .map(|(_, run)| run.clone())
        .collect();
    let tested = crate::fit::pool(&tested);
    let mut page = Report::new(format!("{}: fit", of.written.name))
        .lead(verdict(of.found))
        .next(of.next.clone());
    for sensor in &of.found.sensors {
        let test = tested.iter().find(|error| error.signal == sensor.signal);
        let [before, after] = sensor.fit_percent();
        let percent =
            |value: Option<f64>| value.map_or_else(|| "no fit".into(), |_| fit_text(value));
        let (role, fit, rms) = match test {
            Some(error) => ("test", error.fit_text(), error.rms),
            None => ("fit", percent(after), sensor.rms),
        };
        page = page.fact(
            format!("{}, {role} recordings", sensor.signal),
            fit,
            format!(
                "RMS {}; noise {}; as written {} on the fit recordings",
                quantity(rms, &sensor.unit),
                quantity(sensor.noise, &sensor.unit),
                percent(before)
            ),
        );
    }
    let mut section = Section::new("Parameters");
    let unseen = unseen(of.found, tested.iter());
    for warning in warnings(of.found).into_iter().chain(unseen) {
        section = section.with(Block::Notice(warning));
    }
    page = page.section(section.with(Block::Table(parameters(of.found))));
    let errors = Section::new("Measured over simulated").text(
        "Free runs: the simulator sees only the inputs, and its start state comes from the first \
         5 % of a recording. Fit is 100 % without an error, and 0 % where the mean of the \
         measurement would do as well.",
    );
    let errors = errors.with(Block::Table(fit_table(&free)));
    if of.at_rest {
        return Ok(page.section(rests(&free, errors)).made(made));
    }
    page = page.section(drawn(&free, errors));
    let page = chapters(&free)?.into_iter().fold(page, Report::section);
    Ok(page.made(&made.clone().seconds(of.found.seconds)))
}

/// The finding in a sentence.
fn verdict(found: &Fit) -> String {
    let names = |all: Vec<&str>| all.join(", ");
    let left: Vec<&str> = (found.sensors.iter().filter(|s| !s.is_explained()))
        .map(|s| s.signal.as_str())
        .collect();
    let open: Vec<&str> = (found.parameters.iter())
        .filter(|p| p.ci95.is_none() && !p.at_bound)
        .map(|p| p.name.as_str())
        .collect();
    let times = |s: &SensorFit| s.rms / s.noise;
    let beyond: Vec<String> = (found
        .sensors
        .iter()
        .filter(|s| s.noise > 0.0 && times(s) > ABOVE))
    .map(|s| {
        format!(
            "{} times its noise of {}",
            significant(times(s), 2),
            s.signal
        )
    })
    .collect();
    let mut text = if left.is_empty() && beyond.is_empty() {
        "The refitted rig explains every signal, to about its noise.".to_owned()
    } else if left.is_empty() {
        format!(
            "The refitted rig explains every signal in the main, and leaves {}: physics may be \
             missing.",
            beyond.join(", ")
        )
    } else {
        let signals = names(left);
        format!("The refitted rig does not explain {signals}: physics may be missing.")
    };
    if !open.is_empty() {
        text += &format!(" The recordings do not determine {}.", names(open));
    }
    text
}

fn parameters(found: &Fit) -> Table {
    let titles = ["parameter", "#as written", "#refitted", "#95 % interval"];
    let table = Table::new("", titles);
    found.parameters.iter().fold(table, |table, p| {
        let interval = match p.ci95 {
            Some([low, high]) => {
                format!("{} to {}", quantity(low, &p.unit), quantity(high, &p.unit))
            }
            None if p.at_bound => "at its bound".into(),
            None => "not determined".into(),
        };
        let table = table.row([
            p.name.clone(),
            quantity(p.as_written, &p.unit),
            quantity(p.value, &p.unit),
            interval,
        ]);
        p.recordings.iter().fold(table, |table, own| {
            let of = format!("{} of {}", p.name, own.recording);
            let value = quantity(own.value, &own.unit);
            table.row([of, String::new(), value, own_interval(own)])
        })
    })
}

/// Plots of the recordings, those of the test first.
fn drawn(free: &Free<'_>, mut section: Section) -> Section {
    let mut order: Vec<usize> = (0..free.recordings.len()).collect();
    order.sort_by_key(|&index| free.recordings[index].0 != "test");
    for &index in order.iter().take(DRAWN) {
        let role = free.recordings[index].0;
        for plot in motions(&free.models, index, role, &[]) {
            section = section.with(Block::Plot(plot));
        }
    }
    if order.len() > DRAWN {
        let rest = order[DRAWN..].iter();
        let rest: Vec<String> = rest.map(|&i| free.recordings[i].1.name()).collect();
        section = section.text(format!("Not drawn: {}.", rest.join(", ")));
    }
    section
}

/// Simulated over measured, a plot a signal: on the line where they are equal.
fn rests(free: &Free<'_>, mut section: Section) -> Section {
    let sensors = free.models[0]
        .runs
        .first()
        .map_or(0, |run| run.sensors.len());
    for sensor in 0..sensors {
        let known = &free.models[0].runs[0].sensors[sensor];
        let mut plot = Plot::over_time(format!("{} at rest", known.signal))
            .x("measured", &known.unit)
            .y("simulated", &known.unit);
        let mut ends = [f64::INFINITY, f64::NEG_INFINITY];
        for model in &free.models {
            let mut points: Vec<(f64, f64)> = (model.runs.iter())
                .flat_map(|run| {
                    let of = &run.sensors[sensor];
                    of.measured
                        .iter()
                        .copied()
                        .zip(of.simulated.iter().copied())
                })
                .filter(|(x, y)| x.is_finite() && y.is_finite())
                .collect();
            order::sort_up(&mut points, |point| point.0);
            for (x, _) in &points {
                ends = [ends[0].min(*x), ends[1].max(*x)];
            }
            let (x, y) = points.into_iter().unzip();
            plot = plot.with(Series::new(model.name, Stroke::Points, x, y).tone(model.tone));
        }
        if ends[0] < ends[1] {
            let line = Series::new("equal", Stroke::Dashed, ends.to_vec(), ends.to_vec());
            plot = plot.with(line.tone(Tone::Ink));
        }
        section = section.with(Block::Plot(plot));
    }
    section
}

//! Looking at a simulation: plots of its inputs and signals, and the shape of the rig over time.

mod animation;

use sinew_sim::{MotionQuantity, Plant, Trajectory};

pub use animation::Animation;
use sinew_ident::report::{Block, Plot, Report, Section, Series, Stroke};

/// Most series in one plot: as many as there are colours that can be told apart.
const SERIES: usize = 5;

/// A column with its unit, SI.
struct Trace {
    name: String,
    unit: String,
    values: Vec<f64>,
}

/// One plot after another, each of up to five columns of one unit.
fn plots(title: &str, stroke: Stroke, t: &[f64], traces: Vec<Trace>) -> Vec<Plot> {
    let mut groups: Vec<(String, Vec<Trace>)> = Vec::new();
    for trace in traces {
        match (groups.iter_mut()).find(|(unit, group)| *unit == trace.unit && group.len() < SERIES)
        {
            Some((_, group)) => group.push(trace),
            None => groups.push((trace.unit.clone(), vec![trace])),
        }
    }
    let plot = |(unit, group): (String, Vec<Trace>)| {
        let names: Vec<&str> = group.iter().map(|trace| trace.name.as_str()).collect();
        let mut plot = Plot::over_time(format!("{title}: {}", names.join(", "))).y("", unit);
        for trace in group {
            plot = plot.with(Series::new(trace.name, stroke, t.to_vec(), trace.values));
        }
        plot
    };
    groups.into_iter().map(plot).collect()
}

/// Plots of everything that went in and came out, SI.
pub fn simulation(
    plant: &Plant,
    t: &[f64],
    inputs: &[Vec<f64>],
    trajectory: &Trajectory<f64>,
) -> Vec<Plot> {
    let signals = plant.sensors().iter().enumerate().map(|(i, sensor)| Trace {
        name: sensor.column.clone(),
        unit: sensor.unit.clone(),
        values: trajectory.column(i),
    });
    let driven = plant
        .inputs()
        .iter()
        .zip(inputs)
        .filter(|(input, _)| matches!(input.motion, None | Some(MotionQuantity::Position)))
        .map(|(input, values)| Trace {
            name: input.column.clone(),
            unit: input.unit().to_owned(),
            values: values.clone(),
        });
    let mut all = plots("Signals", Stroke::Solid, t, signals.collect());
    all.extend(plots("Inputs", Stroke::Steps, t, driven.collect()));
    all
}

/// A page with the plots and, where the rig has a shape, its animation first.
pub fn page(title: &str, lead: String, animation: Option<&Animation>, plots: Vec<Plot>) -> Report {
    let mut report = Report::new(title).lead(lead);
    if let Some(animation) = animation {
        let shape = Section::new("Shape over time").with(Block::Html(animation.to_html()));
        report = report.section(shape);
    }
    let over_time = (plots.into_iter())
        .fold(Section::new("Signals and inputs"), |section, plot| {
            section.with(Block::Plot(plot))
        });
    report.section(over_time)
}

#[cfg(test)]
mod tests;

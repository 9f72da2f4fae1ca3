//! Rests as a page: the readings over the swept input, or the table of one rest.

use sinew_ident::report::{Block, Plot, Provenance, Report, Section, Series, Stroke, Tone, count};

use super::text::{remarks, table};
use super::{Rests, Sweep};

/// The page of a rig's rests.
pub fn page(rests: &Rests, rig: &str, made: &Provenance) -> Report {
    let report = Report::new(format!("Rests of {rig}")).made(made);
    let Some(sweep) = &rests.sweep else {
        let row = &rests.rows[0];
        let section = Section::new("Rest").with(Block::Table(table(rests, row)));
        let lead = "Static equilibrium under constant inputs.";
        return report
            .lead(lead)
            .section(section.text(remarks(rests, row).join("\n\n")));
    };
    let input = &rests.plant.inputs()[sweep.input];
    let lead = format!(
        "Static equilibrium at {} of {}.",
        count(rests.rows.len(), "value"),
        input.column
    );
    let readings = Section::new("Readings at rest");
    let readings = (0..rests.plant.sensors().len())
        .map(|sensor| Block::Plot(plot(rests, sweep, sensor)))
        .fold(readings, Section::with);
    report.lead(lead).section(readings)
}

/// One reading over the input, between the ends of the interval that friction leaves.
fn plot(rests: &Rests, sweep: &Sweep, sensor: usize) -> Plot {
    let plant = &rests.plant;
    let (input, channel) = (&plant.inputs()[sweep.input], &plant.sensors()[sensor]);
    // A sweep downwards is drawn from the left as well.
    let mut rows: Vec<_> = rests.rows.iter().collect();
    rows.sort_by(|a, b| a.inputs[sweep.input].total_cmp(&b.inputs[sweep.input]));
    let x: Vec<f64> = rows.iter().map(|row| row.inputs[sweep.input]).collect();
    let y = rows.iter().map(|row| row.signals[sensor]).collect();
    let unit = sinew_sim::unit::of_column(&input.column);
    let mut plot = Plot::over_time(channel.column.clone())
        .x(input.column.clone(), unit)
        .y("", channel.unit.clone());
    if rows.iter().any(|row| !row.intervals.is_empty()) {
        for (end, name) in ["lowest", "highest"].into_iter().enumerate() {
            let ends = rows
                .iter()
                .map(|row| row.range(plant, sensor)[end])
                .collect();
            let series = Series::new(name, Stroke::Dashed, x.clone(), ends);
            plot = plot.with(series.tone(Tone::Orange));
        }
    }
    plot.with(Series::new("rest", Stroke::Solid, x, y).tone(Tone::Blue))
}

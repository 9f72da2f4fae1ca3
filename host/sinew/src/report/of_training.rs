//! The page of a training, and its chapter in the page of a build.

use sinew_train::train::Epoch;

use crate::pipeline::learned::Record;
use sinew_ident::report::{
    Block, Plot, Provenance, Report, Section, Series, Stroke, Table, Tone, count, quantity,
    significant,
};

/// Share of the first validation loss below which the last passes still gained.
const STILL_FALLING: f64 = 0.02;

/// Learning curves and prediction errors; `signals` are the outputs with their units.
pub(super) fn training(section: Section, record: &Record, signals: &[(&str, &str)]) -> Section {
    let passes: Vec<f64> = (1..=record.history.len()).map(|i| i as f64).collect();
    let of = |f: fn(&Epoch) -> f64| record.history.iter().map(f).collect::<Vec<_>>();
    let kept = record.history.get(record.kept);
    let kept = kept.map_or((vec![], vec![]), |epoch| {
        (vec![record.kept as f64 + 1.0], vec![epoch.validation])
    });
    let curves = Plot::over_time("Learning curves")
        .x("pass", "")
        .y("loss", "")
        .with(Series::new(
            "training",
            Stroke::Solid,
            passes.clone(),
            of(|e| e.training),
        ))
        .with(Series::new(
            "validation",
            Stroke::Solid,
            passes,
            of(|e| e.validation),
        ))
        .with(Series::new("kept", Stroke::Points, kept.0, kept.1).tone(Tone::Red));
    let titles = ["output", "#one step", "#end of the horizon"];
    let caption = format!(
        "Prediction error (RMS) on stretches that trained and chose nothing; horizon {}",
        record.horizon
    );
    let table =
        signals
            .iter()
            .enumerate()
            .fold(Table::new(caption, titles), |table, (i, (name, unit))| {
                table.row([
                    (*name).to_owned(),
                    quantity(record.one_step_rms[i], unit),
                    quantity(record.horizon_rms[i], unit),
                ])
            });
    section
        .text(format!(
            "{} weights; the pass with the best validation loss was kept ({} of {}). Loss 1 is the \
             best linear predictor.",
            record.parameters,
            record.kept + 1,
            record.history.len(),
        ))
        .with(Block::Plot(curves))
        .with(Block::Table(table))
}

/// The page of a training. `sensor` is what is said of a soft sensor, `next` the command line that
/// comes next.
pub fn training_page(
    (rig, record): (&str, &Record),
    signals: &[(&str, &str)],
    (sensor, next): (Option<String>, &str),
    made: &Provenance,
) -> Report {
    let mut page = Report::new(format!("{rig}: training"))
        .lead(verdict(record))
        .next(next)
        .made(made);
    for (i, (name, unit)) in signals.iter().enumerate() {
        page = page.fact(
            format!("{name}, one step ahead"),
            quantity(record.one_step_rms[i], unit),
            format!(
                "{} after {}, on its own predictions",
                quantity(record.horizon_rms[i], unit),
                count(record.horizon, "step")
            ),
        );
    }
    page = page.fact("Weights", record.parameters.to_string(), "");
    let section = training(Section::new("The network"), record, signals);
    page.section(match sensor {
        Some(sensor) => section.text(sensor),
        None => section,
    })
}

/// The training in a sentence or two.
fn verdict(record: &Record) -> String {
    let loss = |at: usize| record.history.get(at).map_or(f64::NAN, |e| e.validation);
    let (first, kept) = (loss(0), loss(record.kept));
    let passes = match record.kept + 1 {
        1 => "the first pass".to_owned(),
        passes => format!("{passes} passes"),
    };
    let mut text = format!(
        "The validation loss fell from {} to {} in {passes}",
        significant(first, 3),
        significant(kept, 3),
    );
    text += if kept < 1.0 {
        ": the network predicts better than the best linear predictor."
    } else {
        ": it predicts no better than the best linear predictor."
    };
    // The passes of the last tenth gained little where it has ended by itself.
    let tenth = record.history.len() / 10;
    let before = loss(record.history.len().saturating_sub(1 + tenth));
    if tenth > 0
        && record.kept + tenth >= record.history.len()
        && before - kept > STILL_FALLING * first
    {
        text += " It was still falling when it ended.";
    }
    text
}

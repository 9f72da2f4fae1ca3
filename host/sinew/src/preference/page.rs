//! The page of one question: two loops side by side.

use sinew_ident::report::{Block, Plot, Provenance, Report, Section, Series, Stroke, Table, Tone};

use crate::closed_loop::scenario::Run;
use crate::preference::loops::Loop;

/// The page of two loops, A and B, with the table of their features.
pub fn pair_page(
    rig: &str,
    loops: [&Loop; 2],
    outputs: &[(&str, &str)],
    inputs: &[(&str, &str)],
    features: Table,
    made: &Provenance,
) -> Report {
    let [a, b] = loops.map(|it| &it.run);
    let column = |rows: &[Vec<f64>], i: usize| rows.iter().map(|row| row[i]).collect::<Vec<f64>>();
    let line = |name: &str, tone: Tone, stroke: Stroke, run: &Run, y: Vec<f64>| {
        Series::new(name, stroke, run.t.clone(), y).tone(tone)
    };
    let mut section = Section::new("Two loops").with(Block::Table(features));
    for (i, (name, unit)) in outputs.iter().enumerate() {
        let plot = Plot::over_time(format!("{name}: asked and done"))
            .y(*name, *unit)
            .with(line("A", Tone::Blue, Stroke::Solid, a, column(&a.y, i)))
            .with(line("B", Tone::Green, Stroke::Solid, b, column(&b.y, i)))
            .with(line(
                "reference",
                Tone::Ink,
                Stroke::Dashed,
                a,
                column(&a.reference, i),
            ));
        let error = |run: &Run| -> Vec<f64> {
            let both = run.y.iter().zip(&run.reference);
            both.map(|(y, r)| y[i] - r[i]).collect()
        };
        let errors = Plot::over_time(format!("{name}: tracking error"))
            .y("error", *unit)
            .with(line("A", Tone::Blue, Stroke::Solid, a, error(a)))
            .with(line("B", Tone::Green, Stroke::Solid, b, error(b)));
        section = section.with(Block::Plot(plot)).with(Block::Plot(errors));
    }
    for (i, (name, unit)) in inputs.iter().enumerate() {
        let plot = Plot::over_time(format!("{name}: command"))
            .y(*name, *unit)
            .with(line("A", Tone::Blue, Stroke::Steps, a, column(&a.u, i)))
            .with(line("B", Tone::Green, Stroke::Steps, b, column(&b.u, i)));
        section = section.with(Block::Plot(plot));
    }
    Report::new(format!("{rig}: two loops"))
        .lead("Which is better, A or B? Answer in the terminal.")
        .made(made)
        .section(section)
}

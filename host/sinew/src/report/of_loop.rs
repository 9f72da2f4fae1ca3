//! The page of one closed loop: processor in the loop.

use crate::closed_loop::setup::DeviceRun;
use sinew_ident::report::{
    Block, Plot, Provenance, Report, Section, Series, Stroke, Table, Tone, count, quantity,
    significant,
};

/// Names and counts of the page, beside the run.
pub struct LoopPage<'a> {
    /// Name of the rig.
    pub rig: &'a str,
    /// Name of the board, or the port.
    pub board: &'a str,
    /// Command line that comes next.
    pub next: &'a str,
    /// Source of the reference.
    pub reference: &'a str,
    /// Outputs with their units.
    pub outputs: &'a [(&'a str, &'a str)],
    /// Inputs with their units.
    pub inputs: &'a [(&'a str, &'a str)],
    /// The commands have the bits of this computer's; `None` where that was not compared.
    pub same_bits: Option<bool>,
    /// Ticks without a sample in time; `None` of a board that does not pace itself.
    pub late: Option<usize>,
}

/// The page of a loop on a device.
pub fn loop_page(of: &LoopPage<'_>, device: &DeviceRun, made: &Provenance) -> Report {
    let (run, score, counts) = (&device.run, &device.score, &device.summary);
    let mut page = Report::new(format!("{}: processor in the loop", of.rig))
        .lead(verdict(of, device))
        .next(of.next)
        .made(made);
    for (i, (signal, unit)) in of.outputs.iter().enumerate() {
        page = page.fact(
            format!("{signal}: tracking error (RMS)"),
            quantity(score.rms[i], unit),
            format!("{} at most", quantity(score.max[i], unit)),
        );
    }
    page = page
        .fact(
            "Late steps",
            counts.deadline_misses.to_string(),
            format!("of {}", counts.steps),
        )
        .fact(
            "Stack",
            format!("{} B", counts.stack_high_water_bytes),
            "at its deepest",
        );
    let column = |rows: &[Vec<f64>], i: usize| rows.iter().map(|row| row[i]).collect::<Vec<f64>>();
    let line = |name: &str, stroke: Stroke, tone: Tone, y: Vec<f64>| {
        Series::new(name, stroke, run.t.clone(), y).tone(tone)
    };
    let mut section = Section::new("The loop").text(format!("Reference: {}.", of.reference));
    for (i, (name, unit)) in of.outputs.iter().enumerate() {
        let (reference, y) = (column(&run.reference, i), column(&run.y, i));
        let measured = column(&run.measured, i);
        let error = y.iter().zip(&reference).map(|(y, r)| y - r).collect();
        let tracking = Plot::over_time(format!("{name}: asked and done"))
            .y(*name, *unit)
            .with(line("measured", Stroke::Points, Tone::Green, measured))
            .with(line("plant", Stroke::Solid, Tone::Blue, y))
            .with(line("reference", Stroke::Dashed, Tone::Ink, reference));
        let difference = Plot::over_time(format!("{name}: tracking error"))
            .y("error", *unit)
            .with(line(
                "plant minus reference",
                Stroke::Solid,
                Tone::Blue,
                error,
            ));
        section = section
            .with(Block::Plot(tracking))
            .with(Block::Plot(difference));
    }
    for (i, (name, unit)) in of.inputs.iter().enumerate() {
        let command = line("command", Stroke::Steps, Tone::Blue, column(&run.u, i));
        let plot = Plot::over_time(format!("{name}: command")).y(*name, *unit);
        section = section.with(Block::Plot(plot.with(command)));
    }
    let mut table = Table::new("Counted by the device", ["", "#count"])
        .row(["control steps", &counts.steps.to_string()])
        .row(["late steps", &counts.deadline_misses.to_string()])
        .row(["samples missed", &counts.missed_samples.to_string()])
        .row(["frames rejected", &counts.frames_rejected.to_string()])
        .row([
            "commands outside the limits",
            &score.outside_limits.to_string(),
        ]);
    if let Some(late) = of.late {
        table = table.row(["ticks without a sample in time", &late.to_string()]);
    }
    for (i, (name, _)) in of.inputs.iter().enumerate() {
        let effort = score.effort.get(i).copied().unwrap_or(f64::NAN);
        let what = format!("{name}: change of the command in a step, RMS");
        table = table.row([what, significant(effort, 3)]);
    }
    section = section.with(Block::Table(table));
    if !device.log.is_empty() {
        section = section.with(Block::Code(device.log.trim_end().to_owned()));
    }
    page.section(section)
}

/// The loop in a sentence or two.
fn verdict(of: &LoopPage<'_>, device: &DeviceRun) -> String {
    let steps = count(device.summary.steps as usize, "step");
    let late = match device.summary.deadline_misses {
        0 => "none of them late".to_owned(),
        late => format!("{late} of them late"),
    };
    let bits = match of.same_bits {
        Some(true) => " Every command has the same bits on this computer.",
        Some(false) => " The commands differ from those of this computer.",
        None => "",
    };
    let outside = match device.score.outside_limits {
        0 => String::new(),
        outside => format!(" {} outside the limits.", count(outside, "command")),
    };
    format!(
        "The controller ran on {} for {steps}, {late}.{bits}{outside}",
        of.board
    )
}

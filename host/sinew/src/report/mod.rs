//! Results of the pipeline for people: the page, the lines that end the terminal's output, and the
//! files beside them.

mod closing;
mod figures;
mod sections;
mod table;

use std::path::Path;

pub use closing::closing_lines;
pub use figures::summary;

use crate::pipeline::build::Outcome;
use crate::pipeline::summary::Summary;
use sections::{conditions, fit_section, loop_section, network_section};
use sinew_ident::error::Result;
use sinew_ident::report::{Report, quantity};

/// The page.
pub fn report(outcome: &Outcome, summary: &Summary, command: &str) -> Report {
    let unit = &summary.tracking.unit;
    let tracking = &summary.tracking;
    let pid_note = |informed: f64, very: f64| match &outcome.pid {
        Ok(_) => format!(
            "PID {} tuned on the same {} rig, {} tuned on the very plant",
            quantity(informed, unit),
            outcome.model_rig.name(),
            quantity(very, unit)
        ),
        Err(reason) => format!("no PID: {reason}"),
    };
    let mut page = Report::new(format!("{}: from recording to controller", outcome.name))
        .lead(lead(outcome, summary))
        .fact(
            "Tracking error (RMS)",
            quantity(tracking.mpc_rms, unit),
            pid_note(tracking.informed_pid_rms, tracking.pid_rms),
        )
        .fact(
            "Largest error",
            quantity(tracking.mpc_max, unit),
            pid_note(tracking.informed_pid_max, tracking.pid_max),
        );
    if let (Some(instructions), Some(flash), Some(ram), Some(stack)) = (
        summary.instructions_per_step,
        summary.flash_bytes,
        summary.ram_bytes,
        summary.stack_bytes,
    ) {
        page = page
            .fact(
                "Instructions a step",
                format!("{:.0}", instructions.mean),
                format!("largest {}, counted in QEMU", instructions.max),
            )
            .fact(
                "Flash",
                format!("{:.1} kB", flash as f64 / 1e3),
                format!("whole image{}", outcome.optimise.note()),
            )
            .fact(
                "RAM",
                format!("{:.1} kB", ram as f64 / 1e3),
                format!(
                    "and {:.1} kB of stack at its deepest",
                    f64::from(stack) / 1e3
                ),
            );
    }
    page = page
        .section(loop_section(outcome))
        .section(fit_section(outcome, summary));
    if let Some(diagnosis) = &outcome.diagnosis {
        page = page.section(sinew_ident::diagnose::output::chapter(diagnosis));
    }
    page.section(network_section(outcome))
        .section(conditions(outcome))
        .footer(format!(
            "{command} · sinew {} · {:.1} s",
            env!("CARGO_PKG_VERSION"),
            outcome.seconds
        ))
}

fn lead(outcome: &Outcome, summary: &Summary) -> String {
    let same = match summary.host_equals_device {
        Some(true) => " Every command has the same bits on this computer.",
        Some(false) => " THE COMMANDS DIFFER FROM THOSE OF THIS COMPUTER.",
        None => "",
    };
    format!(
        "A network of {} weights, trained on the {} rig, controlled the same rig with other numbers \
         from {} at {:.0} Hz for {} steps, {} of them late.{same}",
        summary.network.parameters,
        outcome.model_rig.name(),
        outcome.board.name(),
        summary.rate_hz,
        summary.steps,
        summary.deadline_misses
    )
}

/// Writes `report.html`, `summary.json`, `loop.csv` and `device.log` to `folder`.
///
/// # Errors
/// A file cannot be written.
pub fn write(outcome: &Outcome, summary: &Summary, folder: &Path, command: &str) -> Result<()> {
    report(outcome, summary, command).write(folder.join("report.html"))?;
    summary.write(&folder.join("summary.json"))?;
    sinew_files::write(folder.join("loop.csv"), table::loop_csv(outcome))?;
    Ok(sinew_files::write(
        folder.join("device.log"),
        &outcome.mpc.log,
    )?)
}

//! Results of the pipeline for people: the page, the lines that end the terminal's output, and the
//! files beside them.

mod closing;
mod figures;
mod of_loop;
mod of_training;
mod of_tuning;
mod sections;
mod table;

use std::path::Path;

pub use closing::closing_lines;
pub use figures::summary;
pub use of_loop::{LoopPage, loop_page};
pub use of_training::training_page;
pub use of_tuning::{TuningPage, tuning_page};

use crate::pipeline::build::Outcome;
use crate::pipeline::summary::Summary;
use sections::{conditions, fit_section, loop_section, network_section};
use sinew_ident::error::Result;
use sinew_ident::fit::FreeRun;
use sinew_ident::report::{Provenance, Report, Tone, quantity};
use sinew_ident::validation::{Free, Model, chapters};

/// The page.
///
/// # Errors
/// A column that a recording lacks; the fit has read them all.
pub fn report(outcome: &Outcome, summary: &Summary, made: &Provenance) -> Result<Report> {
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
    let runs = Runs::of(outcome);
    let free = runs.free(outcome);
    page = page
        .next(next(outcome))
        .section(loop_section(outcome))
        .section(fit_section(outcome, &free));
    if let Some(diagnosis) = &outcome.diagnosis {
        page = page.section(sinew_ident::diagnose::output::chapter(diagnosis));
    }
    let page = page.section(network_section(outcome));
    let page = chapters(&free)?.into_iter().fold(page, Report::section);
    Ok(page
        .section(conditions(outcome))
        .made(&made.clone().seconds(outcome.seconds)))
}

/// The step after a build: where something is unexplained, a diagnosis.
fn next(outcome: &Outcome) -> String {
    let unexplained = outcome.fit.sensors.iter().any(|s| !s.is_explained());
    if unexplained && outcome.diagnosis.is_none() {
        return "the rig does not explain its recordings; build again with --diagnose".into();
    }
    let better = outcome.informed_pid.as_ref().is_ok_and(|pid| {
        let first = |values: &[f64]| values.first().copied().unwrap_or(f64::NAN);
        first(&pid.score.rms) < first(&outcome.mpc.score.rms)
    });
    if better {
        "the PID tracks better than the MPC here: tune horizons and weights with `sinew tune`, or \
         keep the PID"
            .into()
    } else {
        "wire the board that is to carry it (`sinew wire`), then `sinew flash`".into()
    }
}

/// Free runs of a build, of each rig together.
struct Runs {
    before: Vec<FreeRun>,
    after: Vec<FreeRun>,
}

impl Runs {
    fn of(outcome: &Outcome) -> Self {
        let all = || outcome.free_runs.iter();
        Self {
            before: all().map(|run| run.before.clone()).collect(),
            after: all().map(|run| run.after.clone()).collect(),
        }
    }

    fn free<'a>(&'a self, outcome: &'a Outcome) -> Free<'a> {
        let model = |name, tone, runs| Model { name, tone, runs };
        Free {
            rig: &outcome.fit.rig,
            recordings: (outcome.free_runs.iter())
                .map(|run| (run.role, &run.recording))
                .collect(),
            models: vec![
                model("as written", Tone::Orange, &self.before[..]),
                model("refitted", Tone::Blue, &self.after),
            ],
        }
    }
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
pub fn write(outcome: &Outcome, summary: &Summary, folder: &Path, made: &Provenance) -> Result<()> {
    report(outcome, summary, made)?.write(folder.join("report.html"))?;
    summary.write(&folder.join("summary.json"))?;
    sinew_files::write(folder.join("loop.csv"), table::loop_csv(outcome))?;
    Ok(sinew_files::write(
        folder.join("device.log"),
        &outcome.mpc.log,
    )?)
}

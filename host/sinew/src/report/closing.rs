//! The lines that a person reads at the end.

use std::path::Path;

use crate::pipeline::build::Outcome;
use crate::pipeline::summary::Summary;
use sinew_ident::report::quantity;

/// The lines that a person reads at the end.
pub fn closing_lines(outcome: &Outcome, summary: &Summary, folder: &Path) -> Vec<String> {
    let mut lines = Lines(Vec::new());
    lines.identification(outcome, summary);
    lines.model(outcome, summary);
    lines.tracking(outcome, summary);
    lines.board(outcome, summary);
    lines.line("report", folder.join("report.html").display().to_string());
    lines.line("figures", folder.join("summary.json").display().to_string());
    lines.0
}

/// Lines, each behind a label.
struct Lines(Vec<String>);

impl Lines {
    fn line(&mut self, label: &str, text: String) {
        self.0.push(format!("{label:<14}{text}"));
    }

    /// Fit of the rig, what warns of it, and the diagnosis.
    fn identification(&mut self, outcome: &Outcome, summary: &Summary) {
        for e in &summary.fit {
            self.line(
                if e.role == "fit" {
                    "fit"
                } else {
                    "held-out fit"
                },
                format!(
                    "{}: free-run error {} as written, {} refitted",
                    e.signal,
                    quantity(e.as_written_rms, &e.unit),
                    quantity(e.fitted_rms, &e.unit)
                ),
            );
        }
        for doubt in &outcome.doubts {
            self.line("warning", doubt.clone());
        }
        if let Some(found) = &summary.diagnosis {
            self.line(
                "diagnosis",
                format!(
                    "{}: free-run error {} refitted, {} corrected",
                    found.found,
                    quantity(found.before_rms, &found.unit),
                    found
                        .after_rms
                        .map_or_else(|| "—".to_owned(), |rms| quantity(rms, &found.unit))
                ),
            );
        }
    }

    /// Network, and its loop on the board.
    fn model(&mut self, outcome: &Outcome, summary: &Summary) {
        let unit = &summary.tracking.unit;
        self.line(
            "network",
            format!(
                "{} weights, {} off after one step, {} after {}",
                summary.network.parameters,
                quantity(summary.network.one_step_rms, unit),
                quantity(summary.network.horizon_rms, unit),
                outcome.record.horizon
            ),
        );
        self.line(
            "loop",
            format!(
                "{} steps at {:.0} Hz on {}, {} late, {} commands outside the limits",
                summary.steps,
                summary.rate_hz,
                summary.board,
                summary.deadline_misses,
                summary.commands_outside_limits
            ),
        );
    }

    /// Errors of the controllers, and the plant that they were run on.
    fn tracking(&mut self, outcome: &Outcome, summary: &Summary) {
        let unit = &summary.tracking.unit;
        let tracking = &summary.tracking;
        let errors = |rms, max| {
            format!(
                "{} RMS ({} at most)",
                quantity(rms, unit),
                quantity(max, unit)
            )
        };
        let basis = outcome.model_rig.name();
        self.line(
            "tracking",
            format!(
                "MPC {}, trained and tuned on the {basis} rig",
                errors(tracking.mpc_rms, tracking.mpc_max)
            ),
        );
        match &outcome.pid {
            Ok(_) => {
                let informed = errors(tracking.informed_pid_rms, tracking.informed_pid_max);
                let very = errors(tracking.pid_rms, tracking.pid_max);
                self.line("", format!("PID {informed}, tuned on the {basis} rig too"));
                self.line(
                    "",
                    format!("PID {very}, tuned on the very plant of the loop"),
                );
            }
            Err(reason) => self.line("", format!("no PID: {reason}")),
        }
        self.line(
            "plant",
            match &outcome.fleet {
                None => format!("the {basis} rig, every free parameter perturbed by 10 to 20 %"),
                Some(fleet) => format!("a device that is drawn from {}", fleet.display()),
            },
        );
    }

    /// Cost of a step, memory, and equality with this computer.
    fn board(&mut self, outcome: &Outcome, summary: &Summary) {
        if let Some(count) = summary.instructions_per_step {
            self.line(
                "step",
                format!(
                    "{:.0} instructions, {} at most (counted in QEMU)",
                    count.mean, count.max
                ),
            );
        }
        if let (Some(flash), Some(ram), Some(stack)) =
            (summary.flash_bytes, summary.ram_bytes, summary.stack_bytes)
        {
            self.line(
                "image",
                format!(
                    "{flash} B flash, {ram} B RAM, {stack} B stack, no heap{}",
                    outcome.optimise.note()
                ),
            );
        }
        match summary.host_equals_device {
            Some(true) => self.line(
                "parity",
                "the same bits on this computer and on the chip".into(),
            ),
            Some(false) => self.line("parity", "THIS COMPUTER AND THE CHIP DIFFER".into()),
            None => {}
        }
    }
}

//! The report of a chain: what a person looks at, and the lines that end the terminal's output.

use std::path::Path;

use super::build::{Fitted, Outcome};
use super::summary::{FitError, NetworkError, Spread, Summary, Tracking};
use crate::compare::closed_loop::Run;
use crate::error::Result;
use crate::fit::pool;
use crate::project::Board;
use crate::report::{
    Block, Plot, Report, Section, Series, Stroke, Table, TableColumn, Tone, quantity, significant,
};

/// Ticks of QEMU's 25 MHz timer last 40 ns and an instruction 32 ns of virtual time (`-icount shift=5`,
/// boards/qemu/run.sh), so that a count is good to one or two instructions.
const INSTRUCTIONS_A_TICK: f64 = 40.0 / 32.0;

/// `summary.json` of an outcome.
pub fn summary(outcome: &Outcome) -> Summary {
    let of = |values: &[f64]| values.first().copied().unwrap_or(f64::NAN);
    let (pid_rms, pid_max, pid_outside) = match &outcome.pid {
        Ok(pid) => (
            of(&pid.score.rms),
            of(&pid.score.max),
            pid.score.outside_limits,
        ),
        Err(_) => (f64::NAN, f64::NAN, 0),
    };
    let on_chip = outcome.board != Board::Host;
    Summary {
        format: "sinew-demo/1",
        rig: outcome.name.clone(),
        board: outcome.board.name().into(),
        rate_hz: 1.0 / outcome.task.period_s,
        steps: outcome.mpc.run.t.len(),
        deadline_misses: outcome.mpc.summary.deadline_misses,
        tracking: Tracking {
            unit: outcome.units.first().cloned().unwrap_or_default(),
            mpc_rms: of(&outcome.mpc.score.rms),
            pid_rms,
            mpc_max: of(&outcome.mpc.score.max),
            pid_max,
        },
        instructions_per_step: on_chip.then(|| instructions(outcome)),
        flash_bytes: outcome.sizes.map(|s| s.flash_bytes),
        ram_bytes: outcome.sizes.map(|s| s.ram_bytes),
        stack_bytes: on_chip.then_some(outcome.mpc.summary.stack_high_water_bytes),
        heap_bytes: outcome.sizes.map(|s| s.heap_bytes),
        host_equals_device: outcome.host_equals_device,
        commands_outside_limits: outcome.mpc.score.outside_limits + pid_outside,
        fit: fit_errors(&outcome.free_runs),
        network: NetworkError {
            parameters: outcome.record.parameters,
            one_step_rms: of(&outcome.record.one_step_rms),
            horizon_rms: of(&outcome.record.horizon_rms),
        },
        diagnosis: None,
        seconds: outcome.seconds,
    }
}

fn instructions(outcome: &Outcome) -> Spread {
    let counts = outcome
        .mpc
        .answers
        .iter()
        .map(|a| f64::from(a.ticks) * INSTRUCTIONS_A_TICK);
    let n = outcome.mpc.answers.len().max(1) as f64;
    Spread {
        mean: counts.clone().sum::<f64>() / n,
        max: counts.fold(0.0, f64::max).round() as u64,
    }
}

fn fit_errors(runs: &[Fitted]) -> Vec<FitError> {
    let mut errors = Vec::new();
    for role in ["fit", "test"] {
        let of_role = || runs.iter().filter(|run| run.role == role);
        let before = pool(&of_role().map(|r| r.before.clone()).collect::<Vec<_>>());
        let after = pool(&of_role().map(|r| r.after.clone()).collect::<Vec<_>>());
        for (before, after) in before.into_iter().zip(after) {
            errors.push(FitError {
                signal: before.signal,
                role,
                unit: before.unit,
                as_written_rms: before.rms,
                fitted_rms: after.rms,
            });
        }
    }
    errors
}

/// The page.
pub fn report(outcome: &Outcome, summary: &Summary, command: &str) -> Report {
    let unit = &summary.tracking.unit;
    let pid_note = match &outcome.pid {
        Ok(_) => format!("PID {}", quantity(summary.tracking.pid_rms, unit)),
        Err(reason) => format!("no PID: {reason}"),
    };
    let mut page = Report::new(format!("{}: from recording to controller", outcome.name))
        .lead(lead(outcome, summary))
        .fact(
            "Tracking error (RMS)",
            quantity(summary.tracking.mpc_rms, unit),
            pid_note,
        )
        .fact(
            "Largest error",
            quantity(summary.tracking.mpc_max, unit),
            format!("PID {}", quantity(summary.tracking.pid_max, unit)),
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
                "whole image",
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
        "A network of {} weights, trained on the fitted rig, controlled a plant with other parameters from \
         {} at {:.0} Hz for {} steps, {} of them late.{same}",
        summary.network.parameters,
        outcome.board.name(),
        summary.rate_hz,
        summary.steps,
        summary.deadline_misses
    )
}

fn column(run: &Run, of: impl Fn(&Run) -> &Vec<Vec<f64>>, i: usize) -> Vec<f64> {
    of(run).iter().map(|row| row[i]).collect()
}

fn loop_section(outcome: &Outcome) -> Section {
    let mut section = Section::new("The loop").text(format!(
        "Reference: {}. Both controllers have the same plant, limits, noise and, if they want it, the same \
         preview of {} steps.",
        outcome.task.reference_source, outcome.task.horizon
    ));
    // The last is drawn on top.
    let pid = outcome.pid.as_ref().ok();
    let runs: Vec<(&str, Tone, &Run)> = pid
        .map(|pid| ("PID", Tone::Orange, &pid.run))
        .into_iter()
        .chain([("MPC", Tone::Blue, &outcome.mpc.run)])
        .collect();
    let add = |plot: Plot, stroke: Stroke, of: &dyn Fn(&Run) -> Vec<f64>| {
        runs.iter().fold(plot, |plot, (name, tone, run)| {
            plot.with(Series::new(*name, stroke, run.t.clone(), of(run)).tone(*tone))
        })
    };
    let asked = &outcome.mpc.run;
    for (i, (name, unit)) in outcome.outputs.iter().zip(&outcome.units).enumerate() {
        let reference = Series::new(
            "reference",
            Stroke::Dashed,
            asked.t.clone(),
            column(asked, |r| &r.reference, i),
        );
        let tracking = Plot::over_time(format!("{name}: asked and done"))
            .y(name, unit)
            .with(reference.tone(Tone::Ink));
        let tracking = add(tracking, Stroke::Solid, &|run| column(run, |r| &r.y, i));
        let error = Plot::over_time(format!("{name}: tracking error")).y("error", unit);
        let error = add(error, Stroke::Solid, &|run| {
            let pairs = run.y.iter().zip(&run.reference);
            pairs.map(|(y, w)| y[i] - w[i]).collect()
        });
        section = section.with(Block::Plot(tracking)).with(Block::Plot(error));
    }
    for (i, name) in outcome.inputs.iter().enumerate() {
        let unit = name.rsplit_once('_').map_or("", |(_, unit)| unit);
        let plot = Plot::over_time(format!("{name}: command")).y(name, unit);
        section = section.with(Block::Plot(add(plot, Stroke::Steps, &|run| {
            column(run, |r| &r.u, i)
        })));
    }
    section.with(Block::Table(scores(outcome)))
}

fn columns(titles: &[(&str, bool)]) -> Vec<TableColumn> {
    titles
        .iter()
        .map(|(title, numeric)| TableColumn {
            title: (*title).into(),
            numeric: *numeric,
        })
        .collect()
}

fn scores(outcome: &Outcome) -> Table {
    let mut rows = Vec::new();
    let mut add = |controller: &str, score: &crate::compare::closed_loop::Score| {
        for (i, (name, unit)) in outcome.outputs.iter().zip(&outcome.units).enumerate() {
            rows.push(vec![
                controller.into(),
                name.clone(),
                quantity(score.rms[i], unit),
                quantity(score.max[i], unit),
                significant(score.effort.get(i).copied().unwrap_or(f64::NAN), 3),
                score.outside_limits.to_string(),
            ]);
        }
    };
    add("MPC", &outcome.mpc.score);
    if let Ok(pid) = &outcome.pid {
        add("PID", &pid.score);
    }
    Table {
        caption:
            "Errors over the whole run; change: root mean square change of the command in one step"
                .into(),
        columns: columns(&[
            ("controller", false),
            ("output", false),
            ("RMS error", true),
            ("largest error", true),
            ("change of command", true),
            ("outside limits", true),
        ]),
        rows,
    }
}

fn fit_section(outcome: &Outcome, summary: &Summary) -> Section {
    let mut section = Section::new("The fit").text(
        "Free runs: the simulator sees only the inputs. Its start state comes from the first 5 % of each recording; \
         the error is taken over the rest. Test recordings chose nothing.",
    );
    let errors = summary.fit.iter().map(|e| {
        vec![
            e.role.to_string(),
            e.signal.clone(),
            quantity(e.as_written_rms, &e.unit),
            quantity(e.fitted_rms, &e.unit),
        ]
    });
    section = section.with(Block::Table(Table {
        caption: "Free-run error (RMS)".into(),
        columns: columns(&[
            ("recordings", false),
            ("signal", false),
            ("rig as written", true),
            ("refitted", true),
        ]),
        rows: errors.collect(),
    }));
    let parameters = outcome.fit.parameters.iter().map(|p| {
        vec![
            p.name.clone(),
            quantity(p.as_written, &p.unit),
            quantity(p.value, &p.unit),
            match p.ci95 {
                Some([low, high]) => {
                    format!("{} to {}", quantity(low, &p.unit), quantity(high, &p.unit))
                }
                None if p.at_bound => "at its bound".into(),
                None => "not determined".into(),
            },
        ]
    });
    section = section.with(Block::Table(Table {
        caption: "Parameters".into(),
        columns: columns(&[
            ("parameter", false),
            ("as written", true),
            ("refitted", true),
            ("95 % interval", true),
        ]),
        rows: parameters.collect(),
    }));
    for run in &outcome.free_runs {
        for (before, after) in run.before.sensors.iter().zip(&run.after.sensors) {
            let t = &run.after.t;
            let plot = Plot::over_time(format!(
                "{} of {} ({})",
                after.signal, run.after.recording, run.role
            ))
            .y(&after.signal, &after.unit)
            .with(
                Series::new("measured", Stroke::Solid, t.clone(), after.measured.clone())
                    .tone(Tone::Ink),
            )
            .with(
                Series::new(
                    "as written",
                    Stroke::Solid,
                    t.clone(),
                    before.simulated.clone(),
                )
                .tone(Tone::Orange),
            )
            .with(
                Series::new(
                    "refitted",
                    Stroke::Dashed,
                    t.clone(),
                    after.simulated.clone(),
                )
                .tone(Tone::Blue),
            );
            let difference = |s: &[f64]| {
                s.iter()
                    .zip(&after.measured)
                    .map(|(a, b)| a - b)
                    .collect::<Vec<_>>()
            };
            let error = Plot::over_time(format!("{}: simulated minus measured", after.signal))
                .y("error", &after.unit)
                .with(
                    Series::new(
                        "as written",
                        Stroke::Solid,
                        t.clone(),
                        difference(&before.simulated),
                    )
                    .tone(Tone::Orange),
                )
                .with(
                    Series::new(
                        "refitted",
                        Stroke::Solid,
                        t.clone(),
                        difference(&after.simulated),
                    )
                    .tone(Tone::Blue),
                );
            section = section.with(Block::Plot(plot)).with(Block::Plot(error));
        }
    }
    section
}

fn network_section(outcome: &Outcome) -> Section {
    let record = &outcome.record;
    let passes: Vec<f64> = (1..=record.history.len()).map(|i| i as f64).collect();
    let of = |f: fn(&crate::train::Epoch) -> f64| record.history.iter().map(f).collect::<Vec<_>>();
    let rows = outcome
        .outputs
        .iter()
        .zip(&outcome.units)
        .enumerate()
        .map(|(i, (name, unit))| {
            vec![
                name.clone(),
                quantity(record.one_step_rms[i], unit),
                quantity(record.horizon_rms[i], unit),
            ]
        });
    Section::new("The network")
        .text(format!(
            "{} weights; trained on short stretches of the fitted rig's motion, rolled out through its own \
             predictions; the pass with the best validation loss was kept ({} of {}). Loss 1 is the best linear \
             predictor.{}",
            record.parameters,
            record.kept + 1,
            record.history.len(),
            if outcome.reused { " Trained in an earlier run on the same files and seed." } else { "" },
        ))
        .with(Block::Plot(
            Plot::over_time("Training")
                .x("pass", "")
                .y("loss", "")
                .with(Series::new("training", Stroke::Solid, passes.clone(), of(|e| e.training)))
                .with(Series::new("validation", Stroke::Solid, passes, of(|e| e.validation))),
        ))
        .with(Block::Table(Table {
            caption: format!("Prediction error (RMS) on stretches that trained and chose nothing; horizon {}", record.horizon),
            columns: columns(&[("output", false), ("one step", true), ("end of the horizon", true)]),
            rows: rows.collect(),
        }))
}

fn conditions(outcome: &Outcome) -> Section {
    let rows = outcome.moved.iter().map(|m| {
        vec![
            m.name.clone(),
            quantity(m.fitted, &m.unit),
            quantity(m.plant, &m.unit),
            format!("{:+.1} %", 100.0 * (m.plant / m.fitted - 1.0)),
        ]
    });
    let control = &outcome.spec.control;
    let mut settings = vec![
        vec![
            "horizon, control horizon".into(),
            format!("{}, {}", control.horizon, control.control_horizon),
        ],
        vec![
            "move suppression".into(),
            format!("{:?}", control.move_suppression),
        ],
        vec![
            "disturbance gain".into(),
            significant(control.disturbance_gain, 3),
        ],
        vec!["Newton iterations".into(), control.iterations.to_string()],
    ];
    if let Ok(pid) = &outcome.pid {
        for (i, t) in pid.tuning.iter().enumerate() {
            let g = &t.gains;
            settings.push(vec![
                format!("PID {i}: kp, ki, kd"),
                format!(
                    "{}, {} /s, {} s",
                    significant(g.kp.into(), 4),
                    significant(g.ki.into(), 4),
                    significant(g.kd.into(), 4)
                ),
            ]);
            settings.push(vec![
                format!("PID {i}: filter, setpoint weights, anti-windup, lead"),
                format!(
                    "{} s, {} and {}, {} s, {} steps",
                    significant(g.filter_s.into(), 3),
                    significant(g.proportional_setpoint.into(), 3),
                    significant(g.derivative_setpoint.into(), 3),
                    significant(g.tracking_time_s.into(), 3),
                    t.lead
                ),
            ]);
        }
    }
    Section::new("Conditions")
        .text(
            "The plant of the loop is the fitted rig with every free parameter moved by 10 to 20 %; neither the \
             network nor the controller's tuning has seen it. The PID is tuned on that very plant, with other \
             references and by the same optimiser and cost.",
        )
        .with(Block::Table(Table {
            caption: "Parameters of the plant".into(),
            columns: columns(&[("parameter", false), ("the model's", true), ("the plant's", true), ("moved", true)]),
            rows: rows.collect(),
        }))
        .with(Block::Table(Table {
            caption: "Settings".into(),
            columns: columns(&[("setting", false), ("value", false)]),
            rows: settings,
        }))
}

/// Writes `report.html`, `summary.json`, `loop.csv` and `device.log` to `folder`.
///
/// # Errors
/// A file cannot be written.
pub fn write(outcome: &Outcome, summary: &Summary, folder: &Path, command: &str) -> Result<()> {
    report(outcome, summary, command).write(folder.join("report.html"))?;
    summary.write(&folder.join("summary.json"))?;
    crate::atomic::write(folder.join("loop.csv"), loop_csv(outcome))?;
    crate::atomic::write(folder.join("device.log"), &outcome.mpc.log)
}

/// The loop as a recording: time, reference, output and command of both controllers.
fn loop_csv(outcome: &Outcome) -> String {
    let mut text = String::from("t");
    for name in &outcome.outputs {
        text += &format!(",ref_{name},mpc_{name},pid_{name}");
    }
    for name in &outcome.inputs {
        text += &format!(",mpc_{name},pid_{name}");
    }
    text.push('\n');
    let mpc = &outcome.mpc.run;
    let pid = outcome.pid.as_ref().ok();
    let of_pid = |of: fn(&Run) -> &Vec<Vec<f64>>, k: usize, i: usize| {
        pid.and_then(|p| of(&p.run).get(k))
            .map_or(String::new(), |row| row[i].to_string())
    };
    for k in 0..mpc.t.len() {
        text += &mpc.t[k].to_string();
        for i in 0..outcome.outputs.len() {
            text += &format!(
                ",{},{},{}",
                mpc.reference[k][i],
                mpc.y[k][i],
                of_pid(|r| &r.y, k, i)
            );
        }
        for i in 0..outcome.inputs.len() {
            text += &format!(",{},{}", mpc.u[k][i], of_pid(|r| &r.u, k, i));
        }
        text.push('\n');
    }
    text
}

/// The ten lines that a person reads at the end.
pub fn closing_lines(outcome: &Outcome, summary: &Summary, folder: &Path) -> Vec<String> {
    let unit = &summary.tracking.unit;
    let mut lines = Vec::new();
    let mut line = |label: &str, text: String| lines.push(format!("{label:<14}{text}"));
    for e in &summary.fit {
        line(
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
    line(
        "network",
        format!(
            "{} weights, {} off after one step, {} after {}",
            summary.network.parameters,
            quantity(summary.network.one_step_rms, unit),
            quantity(summary.network.horizon_rms, unit),
            outcome.record.horizon
        ),
    );
    line(
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
    line(
        "tracking",
        match &outcome.pid {
            Ok(_) => format!(
                "MPC {} RMS ({} at most), tuned PID {} ({})",
                quantity(summary.tracking.mpc_rms, unit),
                quantity(summary.tracking.mpc_max, unit),
                quantity(summary.tracking.pid_rms, unit),
                quantity(summary.tracking.pid_max, unit)
            ),
            Err(reason) => format!(
                "MPC {} RMS ({} at most); no PID: {reason}",
                quantity(summary.tracking.mpc_rms, unit),
                quantity(summary.tracking.mpc_max, unit)
            ),
        },
    );
    if let Some(count) = summary.instructions_per_step {
        line(
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
        line(
            "image",
            format!("{flash} B flash, {ram} B RAM, {stack} B stack, no heap"),
        );
    }
    match summary.host_equals_device {
        Some(true) => line(
            "parity",
            "the same bits on this computer and on the chip".into(),
        ),
        Some(false) => line("parity", "THIS COMPUTER AND THE CHIP DIFFER".into()),
        None => {}
    }
    line("report", folder.join("report.html").display().to_string());
    line("figures", folder.join("summary.json").display().to_string());
    lines
}

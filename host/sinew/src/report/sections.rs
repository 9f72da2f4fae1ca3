//! The chapters of the page.

use sinew_mpc::feedback::pid::PidGains;

use crate::closed_loop::baseline::Tuning;
use crate::closed_loop::scenario::Run;
use crate::pipeline::build::Outcome;
use crate::pipeline::summary::Summary;
use sinew_ident::report::{
    Block, Plot, Section, Series, Stroke, Table, TableColumn, Tone, quantity, significant,
};

fn column(run: &Run, of: impl Fn(&Run) -> &Vec<Vec<f64>>, i: usize) -> Vec<f64> {
    of(run).iter().map(|row| row[i]).collect()
}

pub(super) fn loop_section(outcome: &Outcome) -> Section {
    let mut section = Section::new("The loop").text(format!(
        "Reference: {}. All controllers have the same plant, limits, noise and, if they want it, the same \
         preview of {} steps. The plots show the PID that was tuned on the very plant.",
        outcome.task.reference_source, outcome.task.preview()
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
    for (i, (name, unit)) in outcome.inputs.iter().zip(&outcome.input_units).enumerate() {
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
    let mut add = |controller: &str, score: &crate::closed_loop::scenario::Score| {
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
    if let Ok(pid) = &outcome.informed_pid {
        add("PID, tuned as the MPC", &pid.score);
    }
    if let Ok(pid) = &outcome.pid {
        add("PID, tuned on the plant", &pid.score);
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

pub(super) fn fit_section(outcome: &Outcome, summary: &Summary) -> Section {
    let mut section = Section::new("The fit").text(
        "Free runs: the simulator sees only the inputs. Its start state comes from the first 5 % of each recording; \
         the error is taken over the rest. Test recordings chose nothing.",
    );
    for doubt in &outcome.doubts {
        section = section.with(Block::Notice(doubt.clone()));
    }
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

pub(super) fn network_section(outcome: &Outcome) -> Section {
    let record = &outcome.record;
    let passes: Vec<f64> = (1..=record.history.len()).map(|i| i as f64).collect();
    let of =
        |f: fn(&sinew_train::train::Epoch) -> f64| record.history.iter().map(f).collect::<Vec<_>>();
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
            "{} weights; trained on short stretches of the {} rig's motion, rolled out through its own \
             predictions; the pass with the best validation loss was kept ({} of {}). Loss 1 is the best linear \
             predictor.{}",
            record.parameters,
            outcome.model_rig.name(),
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

pub(super) fn conditions(outcome: &Outcome) -> Section {
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
    if let Some(value) = &control.value {
        settings.push(vec![
            "cost-to-go: rows, reference behind the horizon, points".into(),
            format!("{}, {}, {}", value.rows, value.ahead, value.points.len()),
        ]);
    }
    for (name, pid) in [
        ("PID tuned as the MPC", &outcome.informed_pid),
        ("PID tuned on the plant", &outcome.pid),
    ] {
        settings.extend(pid.iter().flat_map(|pid| gains(name, &pid.tuning)));
    }
    let basis = outcome.model_rig.name();
    let (plant, others) = match &outcome.fleet {
        None => (
            format!("the {basis} rig with every free parameter perturbed by 10 to 20 %"),
            "whose numbers are moved elsewhere",
        ),
        Some(fleet) => (
            format!("a device that is drawn from {}", fleet.display()),
            "that are drawn from the fleet",
        ),
    };
    Section::new("Conditions")
        .text(format!(
            "The plant of the loop is {plant}; neither the network nor the MPC's tuning has seen it. One \
             PID is tuned on the plants that tuned the MPC: the {basis} rig and two {others}. The other is \
             tuned on the very plant. Both have other references, the same optimiser and the same cost."
        ))
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

/// Two rows of settings for each channel of a tuned PID.
fn gains(name: &str, tuning: &[Tuning<PidGains>]) -> Vec<Vec<String>> {
    let rows = tuning.iter().enumerate().flat_map(|(i, t)| {
        let g = &t.gains;
        let [kp, ki, kd] = [g.kp, g.ki, g.kd].map(|gain| significant(gain.into(), 4));
        let [filter, p, d, tracking] = [
            g.filter_s,
            g.proportional_setpoint_weight,
            g.derivative_setpoint_weight,
            g.tracking_time_s,
        ]
        .map(|value| significant(value.into(), 3));
        [
            vec![
                format!("{name}, {i}: kp, ki, kd"),
                format!("{kp}, {ki} /s, {kd} s"),
            ],
            vec![
                format!("{name}, {i}: filter, setpoint weights, anti-windup, lead"),
                format!("{filter} s, {p} and {d}, {tracking} s, {} steps", t.lead),
            ],
        ]
    });
    rows.collect()
}

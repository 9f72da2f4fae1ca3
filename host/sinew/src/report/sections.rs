//! The chapters of the page.

use sinew_mpc::feedback::pid::PidGains;

use crate::closed_loop::baseline::Tuning;
use crate::closed_loop::scenario::Run;
use crate::pipeline::build::Outcome;
use sinew_ident::report::{
    Block, Plot, Section, Series, Stroke, Table, TableColumn, Tone, quantity, significant,
};
use sinew_ident::validation::{Free, fit_table, motions};

use super::of_training::training;

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

pub(super) fn fit_section(outcome: &Outcome, free: &Free<'_>) -> Section {
    let mut section = Section::new("The fit").text(
        "Free runs: the simulator sees only the inputs. Its start state comes from the first 5 % of each recording; \
         the error is taken over the rest. Test recordings chose nothing. Fit is 100 % without an error, and 0 % where \
         the mean of the measurement would do as well.",
    );
    for doubt in &outcome.doubts {
        section = section.with(Block::Notice(doubt.clone()));
    }
    section = section.with(Block::Table(fit_table(free)));
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
    for (index, run) in outcome.free_runs.iter().enumerate() {
        for plot in motions(&free.models, index, run.role, &[]) {
            section = section.with(Block::Plot(plot));
        }
    }
    section
}

pub(super) fn network_section(outcome: &Outcome) -> Section {
    let basis = outcome.model_rig.name();
    let reused = if outcome.reused {
        " Trained in an earlier run on the same files and seed."
    } else {
        ""
    };
    let text = format!(
        "Trained on short stretches of the {basis} rig's motion, rolled out through its own \
         predictions.{reused}"
    );
    let signals: Vec<(&str, &str)> = (outcome.outputs.iter().map(String::as_str))
        .zip(outcome.units.iter().map(String::as_str))
        .collect();
    training(
        Section::new("The network").text(text),
        &outcome.record,
        &signals,
    )
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

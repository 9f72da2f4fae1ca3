//! Controllers side by side on one plant: the same references, limits and noise for each, several
//! loops.

use std::path::Path;

use serde::Serialize;
use serde_json::{Map, Value};

use crate::closed_loop::controller_result::ControllerResult;
use crate::closed_loop::disturbance::Disturbance;
use crate::closed_loop::model_loop::ModelLoop;
use crate::closed_loop::perturbed_plant::PerturbedParameter;
use crate::closed_loop::scenario::{Distance, Run};
use crate::project::Optimise;
use sinew_ident::error::{Error, Result};
use sinew_ident::report::{
    Block, Plot, Provenance, Report, Section, Series, Stroke, Table, Tone, count, quantity,
    significant,
};

/// Colours of the controllers, in the order of the table.
const TONES: [Tone; 5] = [
    Tone::Blue,
    Tone::Orange,
    Tone::Green,
    Tone::Purple,
    Tone::Red,
];

/// `sinew-comparison/1` (docs/reference/results.md): every number in it was measured in the run
/// that wrote it.
#[derive(Serialize)]
pub struct Benchmark {
    format: &'static str,
    /// Rig of the control problem.
    rig: String,
    /// The real rig, or the program that is one; null where the rig was moved.
    plant: Option<String>,
    /// Board of the predictive controllers.
    board: &'static str,
    /// Absent where its image was made for speed.
    #[serde(skip_serializing_if = "Optimise::is_speed")]
    optimise: Optimise,
    rate_hz: f64,
    steps: usize,
    seed: u64,
    disturbance: Disturbance,
    /// Source of the first loop's reference.
    reference: String,
    /// Parameters that differ between model and plant; empty with a real rig.
    moved: Vec<PerturbedParameter>,
    /// Age of the measurements when a controller gets them.
    delay_s: f64,
    /// Interval in which errors, effort and time at limits were judged, seconds; absent where it is
    /// the whole run.
    #[serde(skip_serializing_if = "Option::is_none")]
    judged_s: Option<[f64; 2]>,
    /// Spread of each loop's own plant around the one in `plant`, as a part of each free
    /// parameter; null where all loops have one plant.
    spread: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    fleet: Option<String>,
    /// Evaluations that tuned PID and RISE each. Absent after the default search.
    #[serde(skip_serializing_if = "Option::is_none")]
    evaluations: Option<usize>,
    outputs: Vec<Signal>,
    /// Gains by name, an object a channel, of controllers without a model.
    gains: Map<String, Value>,
    /// In the order of the table.
    pub controllers: Vec<ControllerResult>,
    #[serde(skip)]
    inputs: Vec<Signal>,
    /// Plants that PID and RISE were tuned on, in words.
    #[serde(skip)]
    tuned_on: &'static str,
}

#[derive(Serialize)]
struct Signal {
    signal: String,
    unit: String,
}

impl Benchmark {
    /// Collects the results of `controllers` in `ready`.
    pub fn new(
        ready: &ModelLoop,
        rig: &Path,
        plant: Option<String>,
        board: &'static str,
        controllers: Vec<ControllerResult>,
        gains: Map<String, Value>,
    ) -> Self {
        let sensors = ready
            .task
            .outputs
            .iter()
            .map(|s| &ready.plant.sensors()[*s]);
        let inputs = ready.plant.inputs().iter();
        Self {
            format: "sinew-comparison/1",
            rig: rig.display().to_string(),
            plant,
            board,
            optimise: Optimise::Speed,
            rate_hz: 1.0 / ready.task.period_s,
            steps: ready.task.reference.steps(),
            seed: ready.seed,
            disturbance: ready.disturbance,
            reference: ready.task.reference_source.clone(),
            moved: ready.moved.clone(),
            delay_s: ready.delay_s,
            judged_s: ready.task.judged_s,
            spread: None,
            fleet: None,
            evaluations: None,
            tuned_on: tuned_on(ready),
            outputs: sensors
                .map(|s| Signal {
                    signal: s.column.clone(),
                    unit: s.unit.clone(),
                })
                .collect(),
            gains,
            controllers,
            inputs: inputs
                .map(|i| Signal {
                    signal: i.column.clone(),
                    unit: i.unit().to_owned(),
                })
                .collect(),
        }
    }

    /// Says that each loop has a plant of its own.
    #[must_use]
    pub fn spread(self, spread: Option<f64>) -> Self {
        Self { spread, ..self }
    }

    /// Says that plants are devices of a fleet, by its file.
    #[must_use]
    pub fn fleet(self, fleet: Option<String>) -> Self {
        Self { fleet, ..self }
    }

    /// Says that the controllers without a model were tuned with a budget of its own.
    #[must_use]
    pub fn evaluations(self, evaluations: Option<usize>) -> Self {
        Self {
            evaluations,
            ..self
        }
    }

    /// Conditions of the tuning of PID and RISE, for the terminal and the page.
    pub fn tuning_sentence(&self) -> String {
        let budget = match self.evaluations {
            Some(count) => format!("with {count} evaluations, not the default search"),
            None => "with the default search".into(),
        };
        format!("PID and RISE were each tuned {budget}, {}.", self.tuned_on)
    }

    /// Says what the images were made for.
    #[must_use]
    pub fn optimise(self, optimise: Optimise) -> Self {
        Self { optimise, ..self }
    }

    /// One row a controller and output (docs/explanation/comparison.md, "What is printed").
    pub fn table(&self) -> Table {
        let loops = self.controllers.first().map_or(0, |c| c.loops.len());
        let counted = self.controllers.iter();
        let counted = counted.clone().any(|c| c.instructions_per_step.is_some());
        let ran = match self.board {
            "host" => "on this computer".into(),
            board => {
                let made = match self.optimise {
                    Optimise::Speed => "",
                    Optimise::Size => ", its image made for size,",
                };
                format!("of each MPC on {board}{made} and, with the same bits, on this computer")
            }
        };
        let judged = match self.judged_s {
            Some([from, to]) => format!(", judged from {from} s to {to} s"),
            None => String::new(),
        };
        let steps = count(self.steps, "step");
        let caption = match loops {
            1 => format!("one loop of {steps}{judged}, {ran}"),
            _ => format!("{loops} loops of {steps}{judged}, {ran}"),
        };
        let mut titles = vec!["controller", "output", "#RMS error"];
        titles.extend((loops > 1).then_some("#worst loop"));
        titles.extend(["#largest error", "#command change", "#overshoot"]);
        titles.extend(["#settling", "#at limits", "#outside limits"]);
        titles.extend(counted.then_some("#instructions"));
        let mut table = Table::new(caption, titles);
        for controller in &self.controllers {
            if let Some(row) = self.distances(controller, loops, counted) {
                table = table.row(row);
            }
            for (i, Signal { signal, unit }) in self.outputs.iter().enumerate() {
                let (median, worst) = controller.rms(i);
                let transient = controller.transient(i);
                let outside = controller.loops.iter().map(|l| l.score.outside_limits);
                let effort =
                    |i| controller.over(|l| l.score.effort.get(i).copied().unwrap_or(f64::NAN));
                let mut row = vec![
                    controller.name.clone(),
                    signal.clone(),
                    quantity(median, unit),
                ];
                row.extend((loops > 1).then(|| quantity(worst, unit)));
                row.extend([
                    quantity(controller.over(|l| l.score.max[i]).1, unit),
                    significant(effort(i).0, 3),
                    transient.map_or("-".into(), |t| format!("{:.1} %", 100.0 * t.overshoot)),
                    match transient.map(|t| t.settling_s) {
                        Some(Some(seconds)) => quantity(seconds, "s"),
                        Some(None) => "not settled".into(),
                        None => "-".into(),
                    },
                    quantity(controller.over(|l| l.at_limits_s).0, "s"),
                    outside.sum::<usize>().to_string(),
                ]);
                let instructions = controller.instructions_per_step;
                row.extend(counted.then(|| {
                    instructions.map_or("-".into(), |s| format!("{:.0}, {}", s.mean, s.max))
                }));
                table = table.row(row);
            }
        }
        table
    }

    /// The row of the error of all outputs together, where they share a unit.
    fn distances(&self, of: &ControllerResult, loops: usize, counted: bool) -> Option<Vec<String>> {
        let unit = &self.outputs.first()?.unit;
        of.loops.first()?.distance?;
        let over = |what: fn(Distance) -> f64| of.over(|l| l.distance.map_or(f64::NAN, what));
        let (median, worst) = over(|d| d.rms);
        let mut row = vec![of.name.clone(), "distance".into(), quantity(median, unit)];
        row.extend((loops > 1).then(|| quantity(worst, unit)));
        row.push(quantity(over(|d| d.max).1, unit));
        row.extend(["-"; 5].map(String::from));
        row.extend(counted.then(|| "-".into()));
        Some(row)
    }

    /// The error of each output over the first loop.
    pub fn errors(&self) -> Vec<Plot> {
        let plots = self.outputs.iter().enumerate().map(|(i, output)| {
            let title = format!("{}: tracking error in the first loop", output.signal);
            let plot = Plot::over_time(title).y("error", &output.unit);
            self.drawn(plot, Stroke::Solid, |run| {
                let pairs = run.y.iter().zip(&run.reference);
                pairs.map(|(y, w)| y[i] - w[i]).collect()
            })
        });
        plots.collect()
    }

    /// Each output beside its reference, its error, and each command, over the first loop.
    fn courses(&self) -> Vec<Plot> {
        let column = |rows: &[Vec<f64>], i: usize| rows.iter().map(|row| row[i]).collect();
        let tracking = self.outputs.iter().enumerate().map(|(i, output)| {
            let title = format!("{}: asked and done in the first loop", output.signal);
            let plot = Plot::over_time(title).y(&output.signal, &output.unit);
            let first = self.controllers.first().map(|controller| &controller.first);
            let plot = first.into_iter().fold(plot, |plot, run| {
                let asked = column(&run.reference, i);
                let asked = Series::new("reference", Stroke::Dashed, run.t.clone(), asked);
                plot.with(asked.tone(Tone::Ink))
            });
            self.drawn(plot, Stroke::Solid, |run| column(&run.y, i))
        });
        let commands = self.inputs.iter().enumerate().map(|(i, input)| {
            let title = format!("{}: command in the first loop", input.signal);
            let plot = Plot::over_time(title).y(&input.signal, &input.unit);
            self.drawn(plot, Stroke::Steps, |run| column(&run.u, i))
        });
        tracking.chain(self.errors()).chain(commands).collect()
    }

    /// One line a controller; the first of the table is drawn last, on top.
    fn drawn(&self, plot: Plot, stroke: Stroke, of: impl Fn(&Run) -> Vec<f64>) -> Plot {
        let tones = TONES.into_iter().cycle();
        let each: Vec<_> = self.controllers.iter().zip(tones).collect();
        each.into_iter()
            .rev()
            .fold(plot, |plot, (controller, tone)| {
                let run = &controller.first;
                let series = Series::new(&controller.name, stroke, run.t.clone(), of(run));
                plot.with(series.tone(tone))
            })
    }

    /// Parameters in which the plant differs from the model.
    fn plant_table(&self) -> Option<Table> {
        let titles = vec!["parameter", "#in the model", "#in the plant"];
        let table = Table::new("difference of the plant from the model", titles);
        let rows = self.moved.iter().map(|m| {
            let value = |value: f64| quantity(value, &m.unit);
            vec![m.name.clone(), value(m.fitted), value(m.plant)]
        });
        (!self.moved.is_empty()).then(|| rows.fold(table, Table::row))
    }

    /// The page.
    pub fn report(&self, made: &Provenance) -> Report {
        let load = match self.disturbance {
            Disturbance::None => "no disturbance".into(),
            other => format!("a {} disturbance at the inputs", other.name()),
        };
        let section = Section::new("The loops").text(format!(
            "First loop: {}. {} Every controller has the same ones, with {load}.",
            self.reference,
            match self.spread {
                None if self.fleet.is_some() =>
                    "The plants are devices drawn from a fleet, each with other noise.".into(),
                None => "The others have other moves and other noise.".into(),
                Some(spread) => format!(
                    "Each loop has other noise and a plant of its own: every free parameter up to {} % off.",
                    significant(100.0 * spread, 2)
                ),
            }
        ));
        let section = section.text(format!(
            "{} The MPC knows its model only.",
            self.tuning_sentence()
        ));
        let section = match self.plant_table() {
            Some(table) => section.with(Block::Table(table)),
            None => section,
        };
        let section = section.with(Block::Table(self.table()));
        let plots = self.courses().into_iter().map(Block::Plot);
        let lead = self.outputs.iter().take(1).map(|output| {
            let each = self.controllers.iter().map(|controller| {
                let rms = quantity(controller.rms(0).0, &output.unit);
                format!("{} {rms}", controller.name)
            });
            format!(
                "Root mean square tracking error of {}, median of the loops: {}.",
                output.signal,
                each.collect::<Vec<_>>().join(", ")
            )
        });
        Report::new("Controllers side by side")
            .lead(lead.collect::<String>())
            .section(plots.fold(section, Section::with))
            .made(made)
    }

    /// For programs.
    ///
    /// # Errors
    /// A number that JSON has no word for.
    pub fn value(&self) -> Result<Value> {
        serde_json::to_value(self).map_err(|e| Error::failed(format!("the comparison: {e}")))
    }
}

/// Plants that PID and RISE are tuned on.
pub fn tuned_on(ready: &ModelLoop) -> &'static str {
    match ready.drawn.len() {
        0 => "on the plant that it is judged on",
        1 => "on the plant as written and on the one that it is judged on",
        _ => "on the plant as written and on the first two that it is judged on",
    }
}

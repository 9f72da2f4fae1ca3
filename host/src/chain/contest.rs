//! Controllers side by side on one plant: the same references, limits and noise for each, several loops.

use std::path::Path;

use serde::Serialize;

use super::built::Loop;
use super::side_by_side::{DeviceRun, same_bits};
use super::summary::{Spread, instructions};
use crate::compare::closed_loop::{Run, Score};
use crate::error::{Error, Result};
use crate::report::{Block, Plot, Report, Section, Series, Stroke, Table, quantity, significant};

/// One controller and its loops.
#[derive(Clone, Debug, Serialize)]
pub struct Contestant {
    /// `PID`, or what its model's folder is called.
    pub name: String,
    /// Its score in each loop.
    pub loops: Vec<Score>,
    /// Instructions of a control step over all loops; null where the board does not count them.
    pub instructions_per_step: Option<Spread>,
    /// Every command of the board had the bits of the host's; null where the host is the board.
    pub host_equals_device: Option<bool>,
    /// Its first loop, for plots.
    #[serde(skip)]
    pub first: Run,
}

impl Contestant {
    /// A predictive controller: its loops on this computer, and on the board where that is another.
    ///
    /// # Errors
    /// No loop, or other bits on the board.
    pub fn mpc(name: String, loops: Vec<DeviceRun>, board: Option<&[DeviceRun]>) -> Result<Self> {
        let equal = board.map(|board| {
            let pairs = board.iter().zip(&loops);
            let mut same = pairs.map(|(a, b)| same_bits(&a.answers, &b.answers));
            board.len() == loops.len() && same.all(|same| same)
        });
        if equal == Some(false) {
            return Err(Error::failed(format!(
                "{name}: the board and this computer give different commands"
            )));
        }
        let answers = board.map(|board| board.iter().flat_map(|run| run.answers.clone()));
        let scores = loops.iter().map(|run| run.score.clone()).collect();
        let first = loops
            .into_iter()
            .next()
            .ok_or_else(|| Error::failed("no loop was run"))?;
        Ok(Self {
            name,
            loops: scores,
            instructions_per_step: answers.map(|all| instructions(&all.collect::<Vec<_>>())),
            host_equals_device: equal,
            first: first.run,
        })
    }

    /// The PID.
    ///
    /// # Errors
    /// No loop.
    pub fn pid(loops: Vec<(Score, Run)>) -> Result<Self> {
        let scores = loops.iter().map(|(score, _)| score.clone()).collect();
        let first = loops.into_iter().next();
        Ok(Self {
            name: "PID".into(),
            loops: scores,
            instructions_per_step: None,
            host_equals_device: None,
            first: first.ok_or_else(|| Error::failed("no loop was run"))?.1,
        })
    }

    fn over(&self, of: impl Fn(&Score) -> f64) -> Vec<f64> {
        let mut values: Vec<f64> = self.loops.iter().map(of).collect();
        values.sort_by(f64::total_cmp);
        values
    }

    /// Median and largest over the loops of the root mean square error of output `i`.
    pub fn rms(&self, i: usize) -> (f64, f64) {
        ends(&self.over(|score| score.rms[i]))
    }

    /// Median and largest over the loops of the largest error of output `i`.
    pub fn max(&self, i: usize) -> (f64, f64) {
        ends(&self.over(|score| score.max[i]))
    }

    /// Median over the loops of the root mean square change of the first command in a period.
    pub fn effort(&self) -> f64 {
        ends(&self.over(|score| score.effort.first().copied().unwrap_or(f64::NAN))).0
    }
}

/// Lower median and last of sorted values.
fn ends(sorted: &[f64]) -> (f64, f64) {
    let at = |i: usize| sorted.get(i).copied().unwrap_or(f64::NAN);
    (
        at(sorted.len().saturating_sub(1) / 2),
        at(sorted.len().saturating_sub(1)),
    )
}

/// `sinew-comparison/1` (docs/files.md): every number in it was measured in the run that wrote it.
#[derive(Serialize)]
pub struct Contest {
    format: &'static str,
    /// What the controllers were asked for comes from this rig.
    rig: String,
    /// The real rig; null where the rig was moved.
    plant: Option<String>,
    /// Where the predictive controllers ran.
    board: &'static str,
    rate_hz: f64,
    steps: usize,
    seed: u64,
    outputs: Vec<Output>,
    /// In the order of the table.
    pub controllers: Vec<Contestant>,
    #[serde(skip)]
    reference_source: String,
    #[serde(skip)]
    inputs: Vec<String>,
}

#[derive(Serialize)]
struct Output {
    signal: String,
    unit: String,
}

impl Contest {
    /// What `controllers` did in `ready`.
    pub fn new(
        ready: &Loop,
        rig: &Path,
        plant: Option<&Path>,
        board: &'static str,
        controllers: Vec<Contestant>,
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
            plant: plant.map(|path| path.display().to_string()),
            board,
            rate_hz: 1.0 / ready.task.period_s,
            steps: ready.task.reference.steps(),
            seed: ready.seed,
            outputs: sensors
                .map(|s| Output {
                    signal: s.column.clone(),
                    unit: s.unit.clone(),
                })
                .collect(),
            controllers,
            reference_source: ready.task.reference_source.clone(),
            inputs: inputs.map(|i| i.column.clone()).collect(),
        }
    }

    /// One row a controller and output; the errors are the plant's, without the sensors' noise.
    pub fn table(&self) -> Table {
        let loops = self.controllers.first().map_or(0, |c| c.loops.len());
        let ran = match self.board {
            "host" => "on this computer".into(),
            board => format!("of each MPC on {board} and, with the same bits, on this computer"),
        };
        let caption = format!("{loops} loops of {} steps, {ran}", self.steps);
        let titles = [
            "controller",
            "output",
            "#RMS error",
            "#worst loop",
            "#largest error",
            "#command change",
            "#outside limits",
            "#instructions",
        ];
        let mut table = Table::new(caption, titles);
        for controller in &self.controllers {
            for (i, output) in self.outputs.iter().enumerate() {
                let (median, worst) = controller.rms(i);
                let outside: usize = controller.loops.iter().map(|s| s.outside_limits).sum();
                let counted = controller.instructions_per_step;
                table = table.row([
                    controller.name.clone(),
                    output.signal.clone(),
                    quantity(median, &output.unit),
                    quantity(worst, &output.unit),
                    quantity(controller.max(i).1, &output.unit),
                    significant(controller.effort(), 3),
                    outside.to_string(),
                    counted.map_or("-".into(), |s| format!("{:.0}, {}", s.mean, s.max)),
                ]);
            }
        }
        table
    }

    /// The error of each output over the first loop.
    pub fn plots(&self) -> Vec<Plot> {
        let plots = self.outputs.iter().enumerate().map(|(i, output)| {
            let title = format!("{}: tracking error in the first loop", output.signal);
            let plot = Plot::over_time(title).y("error", &output.unit);
            self.controllers.iter().fold(plot, |plot, controller| {
                let run = &controller.first;
                let errors = run.y.iter().zip(&run.reference).map(|(y, w)| y[i] - w[i]);
                let (t, errors) = (run.t.clone(), errors.collect());
                plot.with(Series::new(&controller.name, Stroke::Solid, t, errors))
            })
        });
        plots.collect()
    }

    /// The page.
    pub fn report(&self, command: &str) -> Report {
        let mut section = Section::new("The loops").text(format!(
            "First loop: {}. The others have other moves and other noise. Every controller has the same ones.",
            self.reference_source
        ));
        section = section.with(Block::Table(self.table()));
        for plot in self.plots() {
            section = section.with(Block::Plot(plot));
        }
        for (i, input) in self.inputs.iter().enumerate() {
            let unit = sinew_sim::unit::of_column(input);
            let plot =
                Plot::over_time(format!("{input}: command in the first loop")).y(input, unit);
            let plot = self.controllers.iter().fold(plot, |plot, controller| {
                let run = &controller.first;
                let u = run.u.iter().map(|u| u[i]).collect();
                plot.with(Series::new(
                    &controller.name,
                    Stroke::Steps,
                    run.t.clone(),
                    u,
                ))
            });
            section = section.with(Block::Plot(plot));
        }
        let lead = self.controllers.iter().zip(&self.outputs).take(1);
        let lead = lead.map(|(_, output)| {
            let each = self.controllers.iter().map(|controller| {
                format!(
                    "{} {}",
                    controller.name,
                    quantity(controller.rms(0).0, &output.unit)
                )
            });
            format!(
                "Root mean square tracking error of {}, median of the loops: {}.",
                output.signal,
                each.collect::<Vec<_>>().join(", ")
            )
        });
        Report::new("Controllers side by side")
            .lead(lead.collect::<String>())
            .section(section)
            .footer(command)
    }

    /// The file for programs.
    ///
    /// # Errors
    /// A number that JSON has no word for.
    pub fn json(&self) -> Result<String> {
        serde_json::to_string_pretty(self)
            .map(|text| text + "\n")
            .map_err(|e| Error::failed(format!("the comparison: {e}")))
    }
}

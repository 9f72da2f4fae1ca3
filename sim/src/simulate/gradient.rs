//! Derivatives of one number by everything: parameters, start and all inputs
//! (docs/explanation/plant.md, eq. 22).

use super::run::Trajectory;
use crate::error::SimulationError;
use crate::input_trajectory::InputTrajectory;
use crate::integrator::Stepper;
use crate::plant::Plant;
use crate::reverse::{self, Reverse};
use crate::scalar::Scalar;
use std::collections::HashMap;

/// Rows that are recorded on a tape at once; between them only states are kept.
const BLOCK: usize = 64;

/// A loss of the signals and its derivatives.
#[derive(Clone, Debug, PartialEq)]
pub struct Gradient {
    /// The loss itself.
    pub loss: f64,
    /// By every parameter, one entry a slot.
    pub parameters: Vec<f64>,
    /// By every state at the start.
    pub start: Vec<f64>,
    /// By every sample of every input: one column an input, one entry a row.
    pub inputs: Vec<Vec<f64>>,
}

/// State of the backward pass: the variables of a block, and the derivatives from the blocks after
/// it.
struct Backward<'a> {
    plant: &'a Plant,
    values: &'a [f64],
    drive: &'a InputTrajectory,
    times: &'a [f64],
    /// Derivatives of the loss by the signals.
    cotangent: &'a [f64],
    /// When the samples were taken, by the stepper's clock.
    clock: Vec<f64>,
    gradient: Gradient,
    /// Derivatives by what is carried into the block after the present one.
    carried: Vec<f64>,
}

impl Plant {
    /// A loss of the signals with its derivatives by all parameters, the start and every sample of
    /// every input, by one pass backwards: its cost does not grow with their number. About ten
    /// plain simulations, and memory for the operations of 64 rows and the state at every 64th.
    ///
    /// `loss` sees the plain trajectory and returns the loss and its derivative by each signal
    /// (row-major, as [`Trajectory::signals`]). The derivatives are those of [`crate::Dual`],
    /// events included.
    ///
    /// ```
    /// # let text = "format='sinew-rig/1'\nname='x'\n[[body]]\nname='m'\nmotion='slide'\ninertia=2.0\n\
    /// # [[actuator]]\nname='a'\ndrives='m'\ninput='u_N'\ngain=1.0\n\
    /// # [[sensor]]\nname='s'\nreads='m.velocity'\nsignal='v_m_s'\n";
    /// use sinew_sim::{InputTrajectory, Plant, Rig};
    /// let plant = Plant::new(&Rig::parse(text, "x.toml")?)?;
    /// let drive = InputTrajectory::new(&plant, 3, &[&[4.0, 4.0, 4.0]])?;
    /// // The last velocity of 2 kg by each force, held for 0.5 s: 0.25 m/s per N, and none by the last.
    /// let last = |run: &sinew_sim::Trajectory<f64>| (run.signal(2, 0), vec![0.0, 0.0, 1.0]);
    /// let gradient =
    ///     plant.gradient(&plant.values(), &[0.0, 0.0], &drive, &[0.0, 0.5, 1.0], last)?;
    /// let near = |(ours, exact): (&f64, f64)| (ours - exact).abs() < 1e-12;
    /// assert!(gradient.inputs[0].iter().zip([0.25, 0.25, 0.0]).all(near));
    /// // A derivative for each signal, or nothing.
    /// let none = |_: &sinew_sim::Trajectory<f64>| (0.0, vec![]);
    /// assert!(plant.gradient(&plant.values(), &[0.0, 0.0], &drive, &[0.0, 0.5, 1.0], none).is_err());
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// As [`Plant::simulate`], and `Shape` where the loss has not one derivative a signal.
    pub fn gradient(
        &self,
        values: &[f64],
        start: &[f64],
        drive: &InputTrajectory,
        times: &[f64],
        loss: impl FnOnce(&Trajectory<f64>) -> (f64, Vec<f64>),
    ) -> Result<Gradient, SimulationError> {
        let sensors = self.sensors().len();
        let mut signals = Vec::with_capacity(sensors * times.len());
        let mut kept: Vec<Stepper<f64>> = Vec::new();
        let mut clock = Vec::with_capacity(times.len());
        let stepper = self.simulate_with(values, start, drive, times, |row, stepper| {
            stepper.read(&mut signals);
            clock.push(stepper.time());
            if row % BLOCK == BLOCK - 1 {
                kept.push(stepper.clone());
            }
        })?;
        let trajectory = Trajectory {
            signals,
            sensors,
            final_state: stepper.state(),
            report: stepper.report(),
        };
        let (loss, cotangent) = loss(&trajectory);
        self.expect(
            "derivatives of the loss",
            times.len() * sensors,
            cotangent.len(),
        )?;
        let mut backward = Backward {
            plant: self,
            values,
            drive,
            times,
            cotangent: &cotangent,
            clock,
            gradient: Gradient {
                loss,
                parameters: vec![0.0; values.len()],
                start: vec![0.0; start.len()],
                inputs: vec![vec![0.0; times.len()]; self.inputs().len()],
            },
            carried: vec![0.0; stepper.carried().len()],
        };
        for block in (0..times.len().div_ceil(BLOCK)).rev() {
            let before = block.checked_sub(1).map(|block| &kept[block]);
            backward.block(block, before, start)?;
        }
        Ok(backward.gradient)
    }
}

impl Backward<'_> {
    /// Goes back through one block of rows; `before` is the plant after the last row before it.
    fn block(
        &mut self,
        block: usize,
        before: Option<&Stepper<f64>>,
        start: &[f64],
    ) -> Result<(), SimulationError> {
        reverse::begin();
        let rows = block * BLOCK..((block + 1) * BLOCK).min(self.times.len());
        let values: Vec<Reverse> = self.values.iter().map(|&v| Reverse::variable(v)).collect();
        let mut inputs: HashMap<(usize, usize), Reverse> = HashMap::new();
        let drive = self.drive;
        let mut input = |row: usize, input: usize| {
            *(inputs.entry((row, input))).or_insert_with(|| Reverse::variable(drive.at(row, input)))
        };
        let times = self.times;
        let mut sample = |row: usize, column: usize| {
            let now = input(row, column);
            let slope = if row + 1 < times.len() {
                (input(row + 1, column) - now) / (times[row + 1] - times[row])
            } else {
                Reverse::constant(0.0)
            };
            (now, slope)
        };
        let columns = self.plant.inputs().len();
        let carried: Vec<Reverse> = match before {
            Some(before) => before
                .carried()
                .into_iter()
                .map(Reverse::variable)
                .collect(),
            None => start.iter().map(|&x| Reverse::variable(x)).collect(),
        };
        let mut stepper = match before {
            Some(before) => {
                let clock = &self.clock;
                let history = |column: usize, time: f64| {
                    if let Some((value, slope)) =
                        drive.past().sampled(column, time, drive.at(0, column))
                    {
                        return (Reverse::constant(value), Reverse::constant(slope));
                    }
                    let row = clock.partition_point(|&t| t < time);
                    sample(row.min(clock.len() - 1), column)
                };
                let mut stepper = before.lifted(self.plant, &values, &carried, history)?;
                for column in 0..columns {
                    let (value, slope) = sample(rows.start - 1, column);
                    stepper.take(column, value, slope);
                }
                stepper
            }
            None => {
                let mut stepper = Stepper::begin(self.plant, &values, &carried)?;
                stepper.replay_history(drive);
                stepper
            }
        };
        let mut seeds: Vec<(Reverse, f64)> = Vec::new();
        let sensors = self.plant.sensors().len();
        for row in rows {
            if row > 0 {
                stepper.step(times[row] - times[row - 1])?;
            }
            for column in 0..columns {
                let (value, slope) = sample(row, column);
                stepper.take(column, value, slope);
            }
            stepper.present();
            for sensor in 0..sensors {
                let seed = self.cotangent[row * sensors + sensor];
                if seed != 0.0 {
                    seeds.push((stepper.sensor_signal(sensor), seed));
                }
            }
        }
        seeds.extend(
            stepper
                .carried()
                .into_iter()
                .zip(self.carried.iter().copied()),
        );
        let adjoints = reverse::adjoints(&seeds);
        for (sum, &value) in self.gradient.parameters.iter_mut().zip(&values) {
            *sum += adjoints.of(value);
        }
        for (&(row, column), &input) in &inputs {
            self.gradient.inputs[column][row] += adjoints.of(input);
        }
        let carried: Vec<f64> = carried.iter().map(|&x| adjoints.of(x)).collect();
        if before.is_some() {
            self.carried = carried;
        } else {
            self.gradient.start = carried;
        }
        Ok(())
    }
}

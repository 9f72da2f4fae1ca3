//! Speed of the simulator, for `cargo xtask bench plant`: devices of
//! `tests/foreign/trajectories` over and over, on one core, and what derivatives cost. Prints one
//! JSON object; times are the best of several rounds.
//!
//! `cargo run --release -p sinew-sim --example plant_speed -- FOLDER NAME...`

use sinew_sim::{Dual, InputTrajectory, Plant, Rig, Scalar, Simulated};
use std::error::Error;
use std::time::Instant;

/// A device, its times and its input.
struct Device {
    plant: Plant,
    times: Vec<f64>,
    input: Vec<f64>,
    start: Vec<f64>,
}

impl Device {
    fn read(folder: &str, name: &str) -> Result<Self, Box<dyn Error>> {
        let path = format!("{folder}/{name}.toml");
        let plant = Plant::new(&Rig::parse(&std::fs::read_to_string(&path)?, &path)?)?;
        let text = std::fs::read_to_string(format!("{folder}/{name}.csv"))?;
        let (mut times, mut input) = (Vec::new(), Vec::new());
        for line in text.lines().filter(|line| !line.starts_with(['#', 't'])) {
            let mut fields = line.split(',');
            for column in [&mut times, &mut input] {
                column.push(fields.next().ok_or("a field is missing")?.parse()?);
            }
        }
        let start =
            plant.initial_state(&plant.values(), &vec![Some(0.0); plant.sensors().len()])?;
        Ok(Self {
            plant,
            times,
            input,
            start,
        })
    }

    /// The same motion asked for `finer` times as often, so in steps that are as much shorter.
    fn finer(&self, finer: usize) -> (Vec<f64>, Vec<f64>) {
        let (mut times, mut input) = (Vec::new(), Vec::new());
        for (row, pair) in self.times.windows(2).enumerate() {
            for part in 0..finer {
                times.push(pair[0] + (pair[1] - pair[0]) * part as f64 / finer as f64);
                input.push(self.input[row]);
            }
        }
        times.extend(self.times.last());
        input.extend(self.input.last());
        (times, input)
    }

    fn positions(
        &self,
        times: &[f64],
        input: &[f64],
        every: usize,
    ) -> Result<Vec<Vec<f64>>, Box<dyn Error>> {
        let drive = InputTrajectory::new(&self.plant, times.len(), &[input])?;
        let run = self
            .plant
            .simulate(&self.plant.values(), &self.start, &drive, times)?;
        let sensors = 0..self.plant.sensors().len();
        Ok(sensors
            .map(|s| run.column(s).into_iter().step_by(every).collect())
            .collect())
    }

    /// Largest difference from steps a tenth as long, over the range of the motion.
    fn error(&self) -> Result<f64, Box<dyn Error>> {
        let (times, input) = self.finer(10);
        let fine = self.positions(&times, &input, 10)?;
        let coarse = self.positions(&self.times, &self.input, 1)?;
        let mut worst: f64 = 0.0;
        for (a, b) in fine.iter().zip(&coarse) {
            let range = a.iter().copied().fold(f64::MIN, f64::max)
                - a.iter().copied().fold(f64::MAX, f64::min);
            worst = a
                .iter()
                .zip(b)
                .fold(worst, |w, (x, y)| w.max((x - y).abs() / range));
        }
        Ok(worst)
    }

    /// Simulated seconds a second.
    fn speed(&self) -> Result<f64, Box<dyn Error>> {
        let drive = InputTrajectory::new(&self.plant, self.times.len(), &[&self.input])?;
        let values = self.plant.values();
        let seconds = best_of(30, || {
            self.plant
                .simulate(&values, &self.start, &drive, &self.times)
                .is_ok()
        });
        Ok((self.times[self.times.len() - 1] - self.times[0]) / seconds)
    }

    /// Seconds of `samples` samples, plain and with `N` derivatives of every output.
    fn derivatives<const N: usize>(&self, samples: usize) -> Result<[f64; 2], Box<dyn Error>>
    where
        Dual<N>: Simulated,
    {
        let step = self.times[1] - self.times[0];
        let times: Vec<f64> = (0..samples).map(|k| step * k as f64).collect();
        let input: Vec<f64> = (0..samples)
            .map(|k| self.input[k % self.input.len()])
            .collect();
        let drive = InputTrajectory::new(&self.plant, samples, &[&input])?;
        let values = self.plant.values();
        let mut dual: Vec<Dual<N>> = values.iter().map(|&v| Dual::constant(v)).collect();
        let mut start: Vec<Dual<N>> = self.start.iter().map(|&x| Dual::constant(x)).collect();
        // Parameters first, then the start.
        for seed in 0..N {
            match dual.get_mut(seed) {
                Some(slot) => *slot = Dual::variable(values[seed], seed),
                None => {
                    let state = seed - values.len();
                    start[state] = Dual::variable(self.start[state], seed);
                }
            }
        }
        // Both in turn, so that what else the machine does falls on both.
        let (mut plain, mut with) = (f64::INFINITY, f64::INFINITY);
        for _ in 0..12 {
            plain = plain.min(best_of(2, || {
                self.plant
                    .simulate(&values, &self.start, &drive, &times)
                    .is_ok()
            }));
            with = with.min(best_of(2, || {
                self.plant.simulate(&dual, &start, &drive, &times).is_ok()
            }));
        }
        Ok([plain, with])
    }
}

fn best_of(rounds: usize, mut run: impl FnMut() -> bool) -> f64 {
    let time = |_| {
        let begun = Instant::now();
        assert!(run(), "the simulation failed");
        begun.elapsed().as_secs_f64()
    };
    (0..rounds).map(time).fold(f64::INFINITY, f64::min)
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let folder = arguments.next().ok_or("which folder?")?;
    let mut devices = Vec::new();
    for name in arguments {
        let device = Device::read(&folder, &name)?;
        let (error, speed) = (device.error()?, device.speed()?);
        devices.push(format!(
            "\"{name}\": {{\"error\": {error:e}, \"seconds_per_second\": {speed:.1}}}"
        ));
    }
    let drive = Device::read(&folder, "two_mass_drive")?;
    let costs = [
        (1, drive.derivatives::<1>(4000)?),
        (2, drive.derivatives::<2>(4000)?),
        (4, drive.derivatives::<4>(4000)?),
        (8, drive.derivatives::<8>(4000)?),
        (12, drive.derivatives::<12>(4000)?),
    ];
    let plain = costs
        .iter()
        .map(|(_, [plain, _])| *plain)
        .fold(f64::INFINITY, f64::min);
    let costs: Vec<String> = (costs.iter())
        .map(|(p, [plain, with])| format!("\"{p}\": {:.3}", with / plain))
        .collect();
    println!(
        "{{\"devices\": {{{}}}, \"two_mass_drive_4000_samples_ms\": {:.4}, \"cost_with_derivatives\": {{{}}}}}",
        devices.join(", "),
        1e3 * plain,
        costs.join(", ")
    );
    Ok(())
}

//! Recordings to be explained and the free parameters that explain them.

use anyhow::{Context, Result, ensure};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use sinew_ident::noise::gaussian;
use sinew_ident::recording::Recording;
use sinew_sim::{Dual, InputTrajectory, Plant, Rig, Scalar, Simulated};
use xtask::process::{data_folder, root};

/// Parameters that derivatives are carried for; the largest problem's.
pub const DERIVATIVES: usize = 12;
/// Simulations after which a search is broken off.
const MOST: usize = 4000;
/// Rows of the axis' recording that are used, 1 ms each.
const ROWS: usize = 10_000;
/// Noise of simulated recordings, beside the spread of each signal.
const NOISE: f64 = 1e-3;

/// Free run of a rig against a recording, by the logarithms of its free parameters over the rig's.
pub struct Problem {
    name: String,
    /// Simulations after which a search is broken off.
    pub most: usize,
    plant: Plant,
    /// Value of every slot, as the rig has it.
    values: Vec<f64>,
    free: Vec<usize>,
    start: Vec<f64>,
    columns: Vec<Vec<f64>>,
    drive: InputTrajectory,
    t: Vec<f64>,
    /// One column a sensor that is judged, in units of its spread.
    measured: Vec<(usize, f64, Vec<f64>)>,
}

impl Problem {
    /// The positioning axis by its own recording, where that is here, else simulated.
    pub fn emps() -> Result<Self> {
        let plant = plant("emps")?;
        let path = data_folder().join("emps/train.csv");
        if !path.is_file() {
            println!(
                "SKIPPED: {} is not here; the axis is simulated",
                path.display()
            );
            return Self::simulated("EMPS, simulated", plant, (4000, 1e-3, 2.0, 0.2));
        }
        let recording = Recording::read(&path)?.rows(0..ROWS)?;
        let inputs = plant.inputs().iter();
        let inputs = inputs.map(|input| Ok(recording.input(input)?.values));
        let inputs = inputs.collect::<Result<Vec<Vec<f64>>>>()?;
        let sensors = plant.sensors().iter();
        let measured = sensors.map(|sensor| Ok(recording.sensor(sensor)?));
        let measured = measured.collect::<Result<Vec<Vec<f64>>>>()?;
        let t = recording.t().to_vec();
        let first: Vec<Option<f64>> = measured.iter().map(|column| Some(column[0])).collect();
        Self::new("EMPS, its recording", plant, (inputs, t), measured, &first)
    }

    /// The drive with its load on a shaft, simulated.
    pub fn two_mass() -> Result<Self> {
        let plant = plant("two-mass-drive")?;
        Self::simulated("two-mass drive, simulated", plant, (2000, 5e-3, 3.0, 0.3))
    }

    /// The tendon platform, simulated; the numbers of its fibres are held.
    pub fn tendon() -> Result<Self> {
        let plant = plant("tendon")?;
        let problem = Self::simulated("tendon platform, simulated", plant, (150, 1e-2, 0.8, 0.4))?;
        // Each takes a hundred times as long as one of the axis.
        Ok(Self {
            most: MOST / 4,
            ..problem
        })
    }

    /// A plant under steps: rows, their interval (s), the largest step, and how long one holds (s).
    fn simulated(
        name: &str,
        plant: Plant,
        (rows, interval, size, hold): (usize, f64, f64, f64),
    ) -> Result<Self> {
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let held = (hold / interval).round() as usize;
        let steps = (plant.inputs().iter()).map(|_| {
            let levels = (0..rows.div_ceil(held)).map(|_| random.random_range(-size..size));
            levels.collect::<Vec<f64>>()
        });
        let steps: Vec<Vec<f64>> = steps.collect();
        let inputs = steps.iter().map(|levels| {
            let column = (0..rows).map(|row| levels[row / held]);
            column.collect::<Vec<f64>>()
        });
        let inputs: Vec<Vec<f64>> = inputs.collect();
        let drive = drive_of(&plant, &inputs, rows)?;
        let t: Vec<f64> = (0..rows).map(|row| interval * row as f64).collect();
        let values = plant.values();
        let unknown = vec![None; plant.sensors().len()];
        let start = plant.initial_state(&values, &unknown)?;
        let run = plant.simulate(&values, &start, &drive, &t)?;
        let measured = (0..plant.sensors().len()).map(|sensor| {
            let clean = run.column(sensor);
            let noise = NOISE * spread(&clean);
            let seen = clean.iter().map(|y| y + noise * gaussian(&mut random));
            seen.collect()
        });
        let measured = measured.collect();
        Self::new(name, plant, (inputs, t), measured, &unknown)
    }

    fn new(
        name: &str,
        plant: Plant,
        (columns, t): (Vec<Vec<f64>>, Vec<f64>),
        measured: Vec<Vec<f64>>,
        first: &[Option<f64>],
    ) -> Result<Self> {
        let values = plant.values();
        let free = plant.parameters().iter().enumerate();
        // Numbers of the fibres, which only sense, are held.
        let senses = |name: &str| name.starts_with("fibre") || name.starts_with("light");
        let free = free.filter(|(_, p)| p.free && !senses(&p.name));
        let free: Vec<usize> = free.map(|(slot, _)| slot).collect();
        ensure!(
            free.len() <= DERIVATIVES && free.iter().all(|&slot| values[slot] > 0.0),
            "{name}: more than {DERIVATIVES} free parameters, or one that is not positive"
        );
        let start = plant.initial_state(&values, first)?;
        let drive = drive_of(&plant, &columns, t.len())?;
        let measured = measured.into_iter().enumerate();
        let moving = measured.filter(|(_, column)| spread(column) > 0.0);
        let measured = moving.map(|(sensor, column)| {
            let unit = spread(&column);
            (sensor, unit, column)
        });
        Ok(Self {
            name: name.into(),
            most: MOST,
            measured: measured.collect(),
            values,
            free,
            start,
            columns,
            drive,
            t,
            plant,
        })
    }

    /// The first of `1 / part` of the rows.
    ///
    /// # Errors
    /// None: fewer rows than there are.
    pub fn beginning(&self, part: usize) -> Result<Self> {
        let rows = self.t.len() / part;
        let measured = self.measured.iter();
        let measured = measured.map(|(sensor, unit, column)| {
            let column = column[..rows].to_vec();
            (*sensor, *unit, column)
        });
        Ok(Self {
            name: self.name.clone(),
            most: self.most,
            measured: measured.collect(),
            values: self.values.clone(),
            free: self.free.clone(),
            start: self.start.clone(),
            columns: self.columns.clone(),
            drive: drive_of(&self.plant, &self.columns, rows)?,
            t: self.t[..rows].to_vec(),
            plant: self.plant.clone(),
        })
    }

    /// Name of the rig and of what explains it.
    pub fn name(&self) -> String {
        format!("{} ({} parameters)", self.name, self.unknowns())
    }

    /// Number of free parameters.
    pub fn unknowns(&self) -> usize {
        self.free.len()
    }

    /// Mean square error over the spread of each signal; infinite where the rig cannot be
    /// simulated.
    pub fn error(&self, at: &[f64]) -> f64 {
        let mut values = self.values.clone();
        for (&slot, x) in self.free.iter().zip(at) {
            values[slot] *= x.exp();
        }
        let Some(residuals) = self.residuals(&values, &self.start) else {
            return f64::INFINITY;
        };
        residuals.iter().map(|r| r * r).sum::<f64>() / residuals.len() as f64
    }

    /// Residuals with their derivatives; `None` where the rig cannot be simulated.
    pub fn linearised(&self, at: &[f64]) -> Option<Vec<Dual<DERIVATIVES>>> {
        let constant = |x: &f64| Dual::constant(*x);
        let mut values: Vec<Dual<DERIVATIVES>> = self.values.iter().map(constant).collect();
        for (k, (&slot, x)) in self.free.iter().zip(at).enumerate() {
            values[slot] = Dual::variable(*x, k).exp() * self.values[slot];
        }
        let start: Vec<Dual<DERIVATIVES>> = self.start.iter().map(constant).collect();
        self.residuals(&values, &start)
    }

    fn residuals<S: Simulated>(&self, values: &[S], start: &[S]) -> Option<Vec<S>> {
        let run = self.plant.simulate(values, start, &self.drive, &self.t);
        let run = run.ok()?;
        let of = |(sensor, unit, column): &(usize, f64, Vec<f64>)| {
            let rows = run.column(*sensor).into_iter().zip(column);
            let left = rows.map(|(simulated, measured)| (simulated - *measured) * (1.0 / unit));
            left.collect::<Vec<S>>()
        };
        Some(self.measured.iter().flat_map(of).collect())
    }
}

/// Inputs over the first rows.
fn drive_of(plant: &Plant, columns: &[Vec<f64>], rows: usize) -> Result<InputTrajectory> {
    let columns: Vec<&[f64]> = columns.iter().map(|column| &column[..rows]).collect();
    Ok(InputTrajectory::new(plant, rows, &columns)?)
}

/// Plant of a shipped rig.
fn plant(name: &str) -> Result<Plant> {
    let path = root().join("rigs").join(name).with_extension("toml");
    let text = std::fs::read_to_string(&path)
        .with_context(|| format!("cannot read {}", path.display()))?;
    let rig = Rig::parse(&text, &path.display().to_string())?;
    Ok(Plant::new(&rig)?)
}

/// Standard deviation.
fn spread(values: &[f64]) -> f64 {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    (squares / values.len() as f64).sqrt()
}

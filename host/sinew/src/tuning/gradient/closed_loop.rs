//! The closed loop in any scalar, and the residuals of the objective
//! (docs/explanation/comparison.md, eq. 3) with their derivatives by the settings.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use sinew_ident::noise::gaussian;
use sinew_model::spec::ModelSpec;
use sinew_sim::{Dual, Simulated, Stepper};

use super::controller::{Controller, Settings};
use crate::closed_loop::baseline::Training;
use crate::closed_loop::scenario::Scenario;
use crate::tuning::objective::Objective;

/// Course of a loop, one row a step.
pub struct Course<S> {
    /// Outputs without noise.
    pub y: Vec<Vec<S>>,
    /// Commands.
    pub u: Vec<Vec<S>>,
}

/// Runs a loop; `None` where the plant diverges or the model has no derivatives here.
pub fn run<S: Simulated>(
    scenario: &Scenario,
    spec: &ModelSpec,
    settings: &Settings<S>,
    mut watch: impl FnMut(&Controller<'_, S>),
) -> Option<Course<S>> {
    let constants = |values: &[f64]| values.iter().map(|v| S::constant(*v)).collect::<Vec<S>>();
    let mut controller = Controller::new(spec, settings.clone())?;
    let (values, start) = (constants(&scenario.values), constants(&scenario.start));
    let mut plant = Stepper::new(&scenario.plant, &values, &start).ok()?;
    let mut random = ChaCha8Rng::seed_from_u64(scenario.seed);
    let read = |plant: &Stepper<S>| -> Vec<S> {
        let sensors = scenario.outputs.iter().chain(&scenario.channels.0);
        sensors.map(|sensor| plant.signal(*sensor)).collect()
    };
    let noise: Vec<f64> = (scenario.noise.iter().chain(&scenario.channels.1))
        .copied()
        .collect();
    let delay = scenario.delay();
    let mut samples = vec![read(&plant)];
    let mut course = Course {
        y: Vec::new(),
        u: Vec::new(),
    };
    for k in 0..scenario.reference.steps() {
        let outputs = scenario.outputs.iter();
        let y: Vec<S> = outputs.map(|sensor| plant.signal(*sensor)).collect();
        let measured: Vec<S> = (samples[k.saturating_sub(delay.whole)].iter().zip(&noise))
            .map(|(y, noise)| *y + *noise * gaussian(&mut random))
            .collect();
        let (of_outputs, of_channels) = measured.split_at(y.len());
        let u = controller.step(k, of_outputs, of_channels, &scenario.reference);
        watch(&controller);
        let loads = scenario.loads(k);
        let loaded: Vec<S> = u.iter().zip(&loads).map(|(u, load)| *u + *load).collect();
        for seconds in [scenario.period_s - delay.part, delay.part] {
            if seconds > 0.0 {
                plant.advance(seconds, &loaded).ok()?;
            }
            if samples.len() == k + 1 {
                samples.push(read(&plant));
            }
        }
        course.y.push(y);
        course.u.push(u);
    }
    Some(course)
}

/// Residuals whose squares add up to the objective of one loop.
pub fn residuals<S: Simulated>(
    course: &Course<S>,
    scenario: &Scenario,
    training: &Training<'_>,
) -> Vec<S> {
    let n = course.y.len().max(1) as f64;
    let error = |k: usize, r: usize| {
        (course.y[k][r] - scenario.reference.row(k)[r]) / training.output_range[r]
    };
    let steps = 0..course.y.len();
    let outputs = 0..scenario.outputs.len();
    let mut all: Vec<S> = match training.objective {
        Objective::Peak => outputs
            .filter_map(|r| {
                let errors = steps.clone().map(|k| error(k, r));
                errors.max_by(|a, b| a.value().abs().total_cmp(&b.value().abs()))
            })
            .collect(),
        Objective::Tracking | Objective::Smooth => steps
            .flat_map(|k| outputs.clone().map(move |r| (k, r)))
            .map(|(k, r)| error(k, r) / n.sqrt())
            .collect(),
    };
    let effort = (training.objective.effort() / n).sqrt();
    for pair in course.u.windows(2) {
        for (c, range) in training.input_range.iter().enumerate() {
            all.push((pair[1][c] - pair[0][c]) * (effort / range));
        }
    }
    all
}

/// Values of residuals, and their derivatives: a row a residual.
pub struct Linear {
    /// Residuals.
    pub residuals: Vec<f64>,
    /// Derivatives of each by every setting that was seeded.
    pub jacobian: Vec<Vec<f64>>,
}

/// Settings as numbers with derivatives: the value of each, and its derivatives by the unknowns
/// from `first` on.
pub trait Seeded {
    /// The settings with `N` of the derivatives.
    fn seeded<const N: usize>(&self, first: usize) -> Settings<Dual<N>>;
    /// The settings alone.
    fn plain(&self) -> Settings<f64>;
}

/// Residuals of a loop; `None` where the plant diverges.
pub fn plain(
    scenario: &Scenario,
    spec: &ModelSpec,
    training: &Training<'_>,
    settings: &impl Seeded,
) -> Option<Vec<f64>> {
    let course = run(scenario, spec, &settings.plain(), |_| ())?;
    Some(residuals(&course, scenario, training))
}

/// Residuals of a loop with their derivatives by unknowns `first` to `first` + `count`, at most
/// [`SEEDS`].
pub fn linear(
    scenario: &Scenario,
    spec: &ModelSpec,
    training: &Training<'_>,
    settings: &impl Seeded,
    first: usize,
    count: usize,
) -> Option<Linear> {
    fn with<const N: usize>(
        (scenario, spec, training): (&Scenario, &ModelSpec, &Training<'_>),
        settings: &impl Seeded,
        (first, count): (usize, usize),
    ) -> Option<Linear>
    where
        Dual<N>: Simulated,
    {
        let course = run(scenario, spec, &settings.seeded::<N>(first), |_| ())?;
        let all: Vec<Dual<N>> = residuals(&course, scenario, training);
        Some(Linear {
            residuals: all.iter().map(|r| r.value).collect(),
            jacobian: (all.iter())
                .map(|r| r.derivative[..count.min(N)].to_vec())
                .collect(),
        })
    }
    let problem = (scenario, spec, training);
    // The sizes that the simulator is compiled for.
    if count <= 4 {
        with::<4>(problem, settings, (first, count))
    } else {
        with::<SEEDS>(problem, settings, (first, count))
    }
}

/// Most derivatives that one loop carries.
pub const SEEDS: usize = 8;

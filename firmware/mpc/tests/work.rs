//! The work of a step is bounded, whatever comes in: predictions and derivatives are counted.

mod common;

use std::cell::Cell;

use common::{Random, Shallow};
use sinew_mpc::controller::{ControlLoop, Settings};
use sinew_mpc::limits::Limits;
use sinew_mpc::model::{Jacobian, Model, Regressor};
use sinew_mpc::scaling::ModelScaling;
use sinew_mpc::sensitivity::Propagate;
use sinew_mpc::{Horizons, MAX_ITERATIONS, Tuning, Work};

const NU: usize = 2;
const NY: usize = 3;
const N: usize = 6;

type Net = Shallow<12, 6, NY>;

/// Counts what is asked of it.
struct Counting<'a> {
    net: Net,
    predictions: &'a Cell<usize>,
    derivatives: &'a Cell<usize>,
}

impl Model<NU, NY, 0, 3, 2> for Counting<'_> {
    type Trace = [f32; 6];
    const TRACE: [f32; 6] = [0.0; 6];

    fn predict(&self, x: &Regressor<NU, NY, 0, 3, 2>, a: &mut [f32; 6]) -> [f32; NY] {
        self.predictions.set(self.predictions.get() + 1);
        self.net.predict(x, a)
    }

    fn jacobian(&self, a: &[f32; 6], jacobian: &mut Jacobian<NU, NY, 3, 2>) {
        self.derivatives.set(self.derivatives.get() + 1);
        Model::<NU, NY, 0, 3, 2>::jacobian(&self.net, a, jacobian);
    }
}

impl Propagate<NU, NY, 0, 3, 2> for Counting<'_> {}
impl Tuning for Counting<'_> {}

/// Mostly ordinary, now and then any bits.
fn hostile(random: &mut Random) -> f32 {
    match (random.unit() * 16.0) as u32 {
        0 => f32::NAN,
        1 => f32::INFINITY * random.signed(),
        2 => f32::from_bits(random.unit().to_bits() ^ random.signed().to_bits()),
        3 => 1e30 * random.signed(),
        _ => random.signed(),
    }
}

#[test]
fn no_input_makes_a_step_longer_than_the_documented_bound() {
    let mut random = Random(81);
    let (mut most, mut least) = (0, usize::MAX);
    for case in 0..300 {
        let (predictions, derivatives) = (Cell::new(0), Cell::new(0));
        let model = Counting {
            net: Net::random(&mut random, case % 2 == 0),
            predictions: &predictions,
            derivatives: &derivatives,
        };
        let iterations = 1 + (case % usize::from(MAX_ITERATIONS)) as u8;
        let settings = Settings {
            tracking_weight: [1.0; NY],
            move_suppression: [0.02; NU],
            disturbance_gain: 0.5,
            iterations,
            max_missing_samples: 3,
        };
        let limits = Limits {
            lower: [-1.0; NU],
            upper: [1.0; NU],
            rate: [0.2; NU],
            safe: [0.0; NU],
        };
        let mut control: ControlLoop<Counting<'_>, NU, NY, 0, 3, 2, N, 3, 6> = ControlLoop::new(
            model,
            ModelScaling::IDENTITY,
            limits,
            settings,
            Horizons::new(1, [1, 2, 3]),
        );
        for _ in 0..40 {
            predictions.set(0);
            derivatives.set(0);
            let quiet = random.unit() < 0.5;
            let mut value = || {
                if quiet {
                    random.signed()
                } else {
                    hostile(&mut random)
                }
            };
            let y = core::array::from_fn(|_| value());
            let reference = core::array::from_fn(|_| core::array::from_fn(|_| value()));
            let step = control.step(&y, &[], &reference);
            assert!(limits.contain(&step.u));
            let iterations = usize::from(iterations);
            let bound = Work::most(iterations as u8, NU, 6);
            let rollouts = bound.rollouts as usize;
            assert!(
                predictions.get() <= 1 + rollouts * N,
                "{}",
                predictions.get()
            );
            assert!(
                derivatives.get() <= bound.derivatives as usize * N,
                "{}",
                derivatives.get()
            );
            assert!(usize::from(step.iterations) <= iterations);
            most = most.max(predictions.get());
            least = least.min(predictions.get());
        }
    }
    println!("{least} to {most} predictions a step");
    assert!(most > 3 * N + 1, "nothing was optimised");
}

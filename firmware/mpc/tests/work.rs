//! The work of a step is bounded, whatever comes in: predictions and derivatives are counted.

mod common;

use std::cell::Cell;

use common::counting::Counting;
use common::{Random, Shallow};
use sinew_mpc::controller::{ControlLoop, Settings};
use sinew_mpc::limits::Limits;
use sinew_mpc::scaling::ModelScaling;
use sinew_mpc::{Horizons, MAX_ITERATIONS, Work};

const NU: usize = 2;
const NY: usize = 3;
const N: usize = 6;

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
    let (mut most, mut least) = (0, u32::MAX);
    for case in 0..300 {
        let (predictions, derivatives) = (Cell::new(0), Cell::new(0));
        let model = Counting {
            net: Shallow::random(&mut random, case % 2 == 0),
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
            let bound = Work::most(iterations, NU, 6);
            assert!(
                predictions.get() <= 1 + bound.rollouts * N as u32,
                "{}",
                predictions.get()
            );
            assert!(
                derivatives.get() <= bound.derivatives * N as u32,
                "{}",
                derivatives.get()
            );
            assert!(step.iterations <= iterations);
            most = most.max(predictions.get());
            least = least.min(predictions.get());
        }
    }
    println!("{least} to {most} predictions a step");
    assert!(most > 3 * N as u32 + 1, "nothing was optimised");
}

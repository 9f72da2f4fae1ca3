//! Limits hold exactly, in real arithmetic, for any bit pattern of anything.

#![allow(
    clippy::needless_range_loop,
    reason = "one index runs through commands, limits and the commands before"
)]

mod common;

use common::{Linear, Random, Shallow, cases};
use proptest::prelude::*;
use sinew_mpc::Horizons;
use sinew_mpc::controller::{ControlLoop, Settings};
use sinew_mpc::feedback::pid::{Pid, PidGains};
use sinew_mpc::feedback::rise::{Rise, RiseGains};
use sinew_mpc::limits::{Limiter, Limits};
use sinew_mpc::scaling::ModelScaling;
use sinew_mpc::status::Status;

/// `|u - before| <= rate` without rounding: the difference of two f32 is a sum of two f64, and
/// two-sum in f64 is exact.
fn within_rate(u: f32, before: f32, rate: f32) -> bool {
    let (u, before, rate) = (f64::from(u), f64::from(before), f64::from(rate));
    let difference = u - before;
    let part = difference - u;
    let error = (u - (difference - part)) + (-before - part);
    let (size, error) = if difference < 0.0 {
        (-difference, -error)
    } else {
        (difference, error)
    };
    size < rate || (size == rate && error <= 0.0)
}

fn any_f32() -> impl Strategy<Value = f32> {
    prop_oneof![
        any::<u32>().prop_map(f32::from_bits),
        -2.0_f32..2.0,
        prop_oneof![
            Just(f32::NAN),
            Just(f32::INFINITY),
            Just(f32::NEG_INFINITY),
            Just(0.0)
        ],
    ]
}

/// Limits that hold something: the contradictory ones have their own test.
fn sound_limits() -> impl Strategy<Value = Limits<2>> {
    let channel = (
        -1e3_f32..1e3,
        0.0_f32..1e3,
        prop_oneof![0.0_f32..1.0, Just(f32::INFINITY)],
        0.0_f32..1.0,
    );
    [channel.clone(), channel].prop_map(|c| Limits {
        lower: c.map(|c| c.0),
        upper: c.map(|c| c.0 + c.1),
        rate: c.map(|c| c.2),
        safe: c.map(|c| c.0 + c.3 * c.1),
    })
}

proptest! {
    #![proptest_config(cases(4000))]

    #[test]
    fn limiter_is_exact(limits in sound_limits(), wishes in prop::collection::vec([any_f32(), any_f32()], 1..30)) {
        let mut limiter = Limiter::new(limits);
        let limits = limiter.limits().to_owned();
        let mut before = *limiter.applied();
        for wish in wishes {
            let u = limiter.limit(&wish);
            for i in 0..2 {
                prop_assert!(limits.lower[i] <= u[i] && u[i] <= limits.upper[i]);
                prop_assert!(within_rate(u[i], before[i], limits.rate[i]));
                if wish[i].is_nan() {
                    prop_assert_eq!(u[i], before[i]);
                }
            }
            before = u;
        }
    }

    #[test]
    fn contradictory_limits_still_give_one_finite_command(bits: [[u32; 4]; 1], wish in any_f32()) {
        let b = bits[0].map(f32::from_bits);
        let limits = Limits { lower: [b[0]], upper: [b[1]], rate: [b[2]], safe: [b[3]] };
        let mut limiter = Limiter::new(limits);
        let sane = *limiter.limits();
        prop_assert!(sane.lower[0] <= sane.safe[0] && sane.safe[0] <= sane.upper[0]);
        prop_assert!(sane.rate[0] >= 0.0 && sane.safe[0].is_finite());
        let before = limiter.applied()[0];
        let u = limiter.limit(&[wish])[0];
        prop_assert!(u.is_finite() && sane.lower[0] <= u && u <= sane.upper[0]);
        prop_assert!(within_rate(u, before, sane.rate[0]));
    }

    /// Everything that can come in over a link or from a sensor, in any bits.
    #[test]
    fn every_command_of_the_loop_is_inside(
        limits in sound_limits(),
        seed: u64,
        samples in prop::collection::vec(([any_f32(), any_f32(), any_f32()], any_f32(), any_f32()), 1..12),
        weights: [u32; 5],
        gain in any_f32(),
        iterations: u8,
    ) {
        let net = Shallow::<13, 6, 3>::random(&mut Random(seed | 1), seed % 2 == 0);
        let w = weights.map(f32::from_bits);
        let settings = Settings {
            tracking_weight: [w[0].abs(), w[1].abs(), w[2]],
            move_suppression: [w[3].abs(), w[4]],
            disturbance_gain: gain,
            iterations,
            max_missing_samples: 3,
        };
        let mut c: ControlLoop<_, 2, 3, 1, 3, 2, 5, 3, 6> =
            ControlLoop::new(net, ModelScaling::IDENTITY, limits, settings, Horizons::every_step());
        // Half of the cases with settings that make sense, so that the optimiser sees the rest.
        if seed % 4 < 2 {
            c.settings_mut().tracking_weight = [1.0; 3];
            c.settings_mut().move_suppression = [0.01; 2];
            c.settings_mut().disturbance_gain = 0.5;
            c.settings_mut().iterations = 2;
        }
        let mut before = c.limits().safe;
        for (k, (y, s, r)) in samples.iter().enumerate() {
            let reference = core::array::from_fn(|j| [*r, y[(j + k) % 3], 0.5]);
            let step = c.step(y, &[*s], &reference);
            for i in 0..2 {
                prop_assert!(limits.lower[i] <= step.u[i] && step.u[i] <= limits.upper[i]);
                prop_assert!(within_rate(step.u[i], before[i], limits.rate[i]), "{step:?}");
            }
            let measured = y.iter().all(|y| y.abs() <= 1e3);
            let asked = reference.as_flattened().iter().all(|r| r.is_finite());
            if step.status.is_controlled() {
                prop_assert!(asked && c.settings().is_valid() && step.cost.is_finite());
                prop_assert!(measured != step.predicted);
            }
            if !asked {
                prop_assert!(matches!(step.status, Status::BadReference | Status::SignalLost));
            }
            before = step.u;
        }
    }

    #[test]
    fn every_command_of_the_pid_is_inside(
        limits in sound_limits(),
        gains: [u32; 7],
        samples in prop::collection::vec(([any_f32(), any_f32()], [any_f32(), any_f32()]), 1..20),
    ) {
        let g = gains.map(f32::from_bits);
        let gains = PidGains {
            kp: g[0], ki: g[1], kd: g[2], filter_s: g[3],
            proportional_setpoint_weight: g[4], derivative_setpoint_weight: g[5], tracking_time_s: g[6],
        };
        let mut pid = Pid::new([gains; 2], 0.01, limits, 3);
        let mut before = limits.safe;
        for (y, r) in &samples {
            let u = pid.step(y, r);
            for i in 0..2 {
                prop_assert!(limits.lower[i] <= u[i] && u[i] <= limits.upper[i]);
                prop_assert!(within_rate(u[i], before[i], limits.rate[i]));
            }
            before = u;
        }
    }

    #[test]
    fn every_command_of_rise_is_inside(
        limits in sound_limits(),
        gains: [u32; 8],
        samples in prop::collection::vec(([any_f32(), any_f32()], [any_f32(), any_f32()]), 1..20),
    ) {
        let g = gains.map(f32::from_bits);
        let gains = RiseGains {
            gain: g[0], alpha1: g[1], alpha2: g[2], beta: g[3], proportional_setpoint_weight: g[4],
            derivative_setpoint_weight: g[5], filter_s: g[6], tracking_time_s: g[7],
        };
        let mut rise = Rise::new([gains; 2], 0.01, limits, 3);
        let mut before = limits.safe;
        for (y, r) in &samples {
            let u = rise.step(y, r);
            for i in 0..2 {
                prop_assert!(limits.lower[i] <= u[i] && u[i] <= limits.upper[i]);
                prop_assert!(within_rate(u[i], before[i], limits.rate[i]));
            }
            before = u;
        }
    }
}

/// 0.1 has no exact f32; a limiter that rounds to nearest breaks this in the first steps.
#[test]
fn rounding_never_oversteps_the_rate() {
    let limits = Limits {
        lower: [-10.0],
        upper: [10.0],
        rate: [0.1],
        safe: [0.0],
    };
    let mut limiter = Limiter::new(limits);
    let (mut before, mut naive_oversteps) = (0.0_f32, 0);
    for _ in 0..95 {
        let u = limiter.limit(&[10.0])[0];
        assert!(within_rate(u, before, 0.1));
        naive_oversteps += usize::from(!within_rate(before + 0.1, before, 0.1));
        before = u;
    }
    assert!(
        naive_oversteps > 10,
        "the naive sum was exact: nothing was tested"
    );
    assert!(before > 9.49);
}

#[test]
fn the_safe_command_is_reached_within_the_rate() {
    let limits = Limits {
        lower: [-1.0],
        upper: [1.0],
        rate: [0.3],
        safe: [-0.5],
    };
    let model = Linear {
        a: 0.9,
        b: 0.2,
        b1: 0.0,
    };
    let settings = Settings {
        tracking_weight: [1.0],
        move_suppression: [0.0],
        disturbance_gain: 0.0,
        iterations: 2,
        max_missing_samples: 0,
    };
    let mut c: ControlLoop<_, 1, 1, 0, 2, 1, 4, 2, 2> = ControlLoop::new(
        model,
        ModelScaling::IDENTITY,
        limits,
        settings,
        Horizons::every_step(),
    );
    for _ in 0..10 {
        let _ = c.step(&[0.0], &[], &[[5.0]; 4]);
    }
    let mut us = Vec::new();
    for _ in 0..7 {
        us.push(c.step(&[f32::NAN], &[], &[[5.0]; 4]).u[0]);
    }
    assert!((us[0] - 0.7).abs() < 1e-6 && us[6] == -0.5, "{us:?}");
}

//! RISE: its own equation in double precision, what it rejects and a PID does not, and its starts
//! and ends.

mod common;

use common::Random;
use sinew_mpc::feedback::pid::{Pid, PidGains};
use sinew_mpc::feedback::rise::{Rise, RiseGains};
use sinew_mpc::feedback::{Feedback, Law};
use sinew_mpc::limits::Limits;

const PERIOD_S: f32 = 0.002;

const GAINS: RiseGains = RiseGains {
    gain: 8.0,
    alpha1: 5.0,
    alpha2: 4.0,
    beta: 2.0,
    proportional_setpoint_weight: 1.0,
    derivative_setpoint_weight: 1.0,
    filter_s: 0.004,
    tracking_time_s: 0.1,
};

/// The same P, I and D as RISE has without its sign: gain (alpha1 + alpha2) and so on.
const PID: PidGains = PidGains {
    kp: 8.0 * (5.0 + 4.0),
    ki: 8.0 * 5.0 * 4.0,
    kd: 8.0,
    filter_s: 0.004,
    proportional_setpoint_weight: 1.0,
    derivative_setpoint_weight: 1.0,
    tracking_time_s: 0.1,
};

const WIDE: Limits<1> = Limits {
    lower: [-50.0],
    upper: [50.0],
    rate: [f32::INFINITY],
    safe: [0.0],
};

/// Largest error of a mass with friction, x'' = u - x' + load(t), over the last tenth of 20 s; the
/// reference is 0.
fn left_over<L: Law>(
    mut controller: Feedback<L, 1>,
    period_s: f32,
    load: impl Fn(f64) -> f64,
) -> f64 {
    let (mut x, mut v) = (0.0_f64, 0.0_f64);
    let steps = (20.0 / period_s) as usize;
    let mut largest = 0.0_f64;
    for k in 0..steps {
        let u = f64::from(controller.step(&[x as f32], &[0.0])[0]);
        for i in 0..10 {
            let h = 0.1 * f64::from(period_s);
            v += h * (u - v + load((10 * k + i) as f64 * h));
            x += h * v;
        }
        if k >= steps * 9 / 10 {
            largest = largest.max(x.abs());
        }
    }
    largest
}

#[test]
fn constant_and_ramp_disturbances_are_rejected_where_a_pid_keeps_an_error_under_the_ramp() {
    let rise = |gains: RiseGains, period_s: f32, load: fn(f64) -> f64| {
        let filter_s = 2.0 * period_s;
        let gains = RiseGains { filter_s, ..gains };
        left_over(Rise::new([gains], period_s, WIDE, 5), period_s, load)
    };
    let pid = |load: fn(f64) -> f64| left_over(Pid::new([PID], PERIOD_S, WIDE, 5), PERIOD_S, load);
    let constant: fn(f64) -> f64 = |_| 3.0;
    let ramp: fn(f64) -> f64 = |t| t;
    assert!(pid(constant) < 1e-6, "a PID rejects a constant");
    // The integral has to rise by 1 a second: a PID's error is 1 / ki, in closed form.
    let closed_form = |kept: f64, of: f64| (kept * f64::from(PID.ki) / of - 1.0).abs() < 1e-2;
    let kept = pid(ramp);
    assert!(closed_form(kept, 1.0), "{kept}");
    for load in [constant, ramp] {
        // What RISE leaves is the ripple of a sign taken once a period, and falls with it.
        let coarse = rise(GAINS, PERIOD_S, load);
        let fine = rise(GAINS, 0.25 * PERIOD_S, load);
        assert!(coarse < 0.1 * kept, "{coarse} beside {kept}");
        assert!(
            fine < 0.35 * coarse,
            "{fine} at a quarter of the period, {coarse}"
        );
    }
    // Without the sign RISE is a PID; with one that the ramp outruns, a PID under what is left of
    // the ramp.
    for (beta, of) in [(0.0, 1.0), (0.5, 0.5)] {
        let kept = rise(RiseGains { beta, ..GAINS }, PERIOD_S, ramp);
        assert!(closed_form(kept, of), "{kept} with beta {beta}");
    }
}

/// Equation 13 again, in double precision and in its published form: sums from the start, nothing
/// recursive but the filter.
fn published(errors: &[f64]) -> Vec<f64> {
    let g = GAINS;
    let [gain, alpha1, alpha2, beta, filter, h] =
        [g.gain, g.alpha1, g.alpha2, g.beta, g.filter_s, PERIOD_S].map(f64::from);
    let mut slope = 0.0;
    let e2: Vec<f64> = (0..errors.len())
        .map(|k| {
            let change = errors[k] - errors[k.saturating_sub(1)];
            slope = (filter * slope + change) / (filter + h);
            slope + alpha1 * errors[k]
        })
        .collect();
    (0..errors.len())
        .map(|k| {
            let integrand =
                |e2: &f64| gain * alpha2 * e2 + beta * if *e2 > 0.0 { 1.0 } else { -1.0 };
            let integral: f64 = e2[1..=k].iter().map(integrand).sum();
            gain * (e2[k] - e2[0]) + h * integral
        })
        .collect()
}

#[test]
fn commands_are_those_of_the_published_equation_in_double_precision() {
    let mut random = Random(7);
    let y: Vec<f32> = (0..400)
        .map(|k| 0.3 * (f64::from(k) * 0.02).sin() as f32 + 0.01 * random.signed())
        .collect();
    let errors: Vec<f64> = y.iter().map(|y| f64::from(0.5 - y)).collect();
    let limits = Limits {
        lower: [-1e6],
        upper: [1e6],
        ..WIDE
    };
    let mut rise = Rise::new([GAINS], PERIOD_S, limits, 5);
    let expected = published(&errors);
    let size = expected.iter().fold(0.0_f64, |m, u| m.max(u.abs()));
    assert!(
        size > 10.0,
        "it commands next to nothing: nothing is compared"
    );
    for (k, (y, expected)) in y.iter().zip(&expected).enumerate() {
        let u = f64::from(rise.step(&[*y], &[0.5])[0]);
        assert!(
            (u - expected).abs() < 1e-5 * size,
            "step {k}: {u} and {expected}"
        );
    }
}

/// A step of the reference by 1 changes the filtered slope by c / (filter + period): in (13) once
/// as it is, and once in the integral.
#[test]
fn the_derivative_weight_scales_the_blow_of_a_reference_step() {
    let limits = Limits {
        lower: [-1e6],
        upper: [1e6],
        ..WIDE
    };
    let after = |derivative_setpoint_weight| {
        let gains = RiseGains {
            derivative_setpoint_weight,
            ..GAINS
        };
        let mut rise = Rise::new([gains], PERIOD_S, limits, 5);
        let _ = rise.step(&[0.0], &[1.0]);
        f64::from(rise.step(&[0.0], &[2.0])[0])
    };
    let part = f64::from(GAINS.gain / (GAINS.filter_s + PERIOD_S));
    let expected = 0.75 * part * f64::from(1.0 + PERIOD_S * GAINS.alpha2);
    let blow = after(1.0) - after(0.25);
    assert!((blow / expected - 1.0).abs() < 1e-5, "{blow}, {expected}");
}

#[test]
fn starts_at_the_applied_command_and_holds_it_over_a_gap() {
    let limits = Limits {
        safe: [0.7],
        ..WIDE
    };
    let mut rise = Rise::new([GAINS], PERIOD_S, limits, 3);
    assert_eq!(
        rise.step(&[0.2], &[1.0]),
        [0.7],
        "an error at the start is no jump"
    );
    let held = rise.step(&[0.21], &[1.0]);
    assert_ne!(held, [0.7]);
    for _ in 0..3 {
        assert_eq!(rise.step(&[f32::NAN], &[1.0]), held);
    }
    assert_eq!(rise.step(&[f32::NAN], &[1.0]), [0.7]);
    assert_eq!(rise.step(&[0.2], &[1.0]), [0.7], "no bump after the gap");
}

#[test]
fn anti_windup_lets_go_of_the_limit() {
    let limits = Limits {
        lower: [-1.0],
        upper: [1.0],
        ..WIDE
    };
    let after = |tracking_time_s| {
        let mut rise = Rise::new(
            [RiseGains {
                tracking_time_s,
                ..GAINS
            }],
            PERIOD_S,
            limits,
            5,
        );
        for _ in 0..2000 {
            let _ = rise.step(&[0.0], &[1.0]);
        }
        // The output passes the reference slowly; how long until the command says so?
        for k in 0..1000 {
            let _ = rise.step(&[1.1e-3 * k as f32], &[1.0]);
        }
        (0..20_000)
            .take_while(|_| rise.step(&[1.1], &[1.0])[0] > 0.0)
            .count()
    };
    let (with, without) = (after(0.1), after(1e9));
    assert!(with < 10 && without > 100, "{with} with, {without} without");
}

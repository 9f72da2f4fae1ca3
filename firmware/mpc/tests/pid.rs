//! The PID as an honest baseline: it settles, it does not wind up, it starts without a bump.

use sinew_mpc::feedback::pid::{Pid, PidGains};
use sinew_mpc::limits::Limits;

const PERIOD_S: f32 = 0.01;

const GAINS: PidGains = PidGains {
    kp: 4.0,
    ki: 3.0,
    kd: 0.4,
    filter_s: 0.02,
    proportional_setpoint_weight: 1.0,
    derivative_setpoint_weight: 0.0,
    tracking_time_s: 0.2,
};

const LIMITS: Limits<1> = Limits {
    lower: [-2.0],
    upper: [2.0],
    rate: [f32::INFINITY],
    safe: [0.0],
};

/// A mass with friction and a constant load: x'' = u - x' + load.
struct Mass {
    x: f32,
    v: f32,
    load: f32,
}

impl Mass {
    fn advance(&mut self, u: f32) {
        for _ in 0..10 {
            self.v += 0.1 * PERIOD_S * (u - self.v + self.load);
            self.x += 0.1 * PERIOD_S * self.v;
        }
    }
}

/// Runs to the reference; largest value of x on the way.
fn run(pid: &mut Pid<1>, mass: &mut Mass, reference: f32, steps: usize) -> f32 {
    let mut peak = f32::NEG_INFINITY;
    for _ in 0..steps {
        let u = pid.step(&[mass.x], &[reference]);
        mass.advance(u[0]);
        peak = if mass.x > peak { mass.x } else { peak };
    }
    peak
}

#[test]
fn settles_without_steady_error_under_load() {
    let mut pid = Pid::new([GAINS], PERIOD_S, LIMITS, 5);
    let mut mass = Mass {
        x: 0.0,
        v: 0.0,
        load: -0.3,
    };
    run(&mut pid, &mut mass, 1.0, 3000);
    assert!((mass.x - 1.0).abs() < 1e-3, "{}", mass.x);
    let mut pid = Pid::new([PidGains { ki: 0.0, ..GAINS }], PERIOD_S, LIMITS, 5);
    let mut mass = Mass {
        x: 0.0,
        v: 0.0,
        load: -0.3,
    };
    run(&mut pid, &mut mass, 1.0, 3000);
    assert!(
        (mass.x - 1.0).abs() > 0.05,
        "the load needs no integral: nothing was tested"
    );
}

#[test]
fn back_calculation_prevents_windup() {
    let overshoot = |tracking_time_s| {
        let gains = PidGains {
            tracking_time_s,
            ..GAINS
        };
        let mut pid = Pid::new([gains], PERIOD_S, LIMITS, 5);
        let mut mass = Mass {
            x: 0.0,
            v: 0.0,
            load: 0.0,
        };
        run(&mut pid, &mut mass, 10.0, 3000) - 10.0
    };
    let (with, without) = (overshoot(0.2), overshoot(1e9));
    assert!(
        with < 0.3 * without && without > 0.5,
        "{with} with, {without} without"
    );
}

#[test]
fn setpoint_weights_take_the_kick_out() {
    let first = |b, c| {
        let gains = PidGains {
            proportional_setpoint_weight: b,
            derivative_setpoint_weight: c,
            ..GAINS
        };
        let mut pid = Pid::new([gains], PERIOD_S, LIMITS, 5);
        let _ = pid.step(&[0.0], &[0.0]);
        pid.step(&[0.0], &[0.3])[0]
    };
    assert!(first(0.0, 0.0) < 0.02 && first(1.0, 0.0) > 1.0);
    assert!(first(1.0, 1.0) > first(1.0, 0.0) + 0.5);
}

#[test]
fn starts_at_the_applied_command_and_holds_it_over_a_gap() {
    let limits = Limits {
        safe: [0.7],
        ..LIMITS
    };
    let mut pid = Pid::new([GAINS], PERIOD_S, limits, 3);
    assert!((pid.step(&[1.0], &[1.0])[0] - 0.7).abs() < 1e-6);
    let held = pid.step(&[0.9], &[1.0]);
    assert!(held[0] > 0.8);
    for _ in 0..3 {
        assert_eq!(pid.step(&[f32::NAN], &[1.0]), held);
    }
    assert_eq!(pid.step(&[f32::NAN], &[1.0]), [0.7]);
    assert!(
        (pid.step(&[1.0], &[1.0])[0] - 0.7).abs() < 1e-6,
        "no bump after the gap"
    );
}

use super::rest;
use crate::mechanisms::{RAMP, SPRING, effect, plant, slide};

#[test]
fn two_springs_in_series_share_the_force() {
    let plant = plant(&format!(
        "[[body]]\nname = \"between\"\nmotion = \"slide\"\ninertia = 0.1\n\
         [[body]]\nname = \"mass\"\nmotion = \"slide\"\ninertia = 1.0\n\
         [[spring]]\nname = \"first\"\nfrom = \"ground\"\nto = \"between\"\nstiffness = 30.0\n\
         rest = 0.1\n\
         [[spring]]\nname = \"second\"\nfrom = \"between\"\nto = \"mass\"\nstiffness = 50.0\n\
         [[sensor]]\nname = \"x\"\nreads = \"mass.position\"\nsignal = \"q_m\"\ngain = 2.0\n{RAMP}"
    ));
    let found = rest(&plant, &[6.0]);
    assert!((found.state[0] - (0.1 + 6.0 / 30.0)).abs() < 1e-14);
    assert!((found.signals[0] - 2.0 * (0.1 + 6.0 / 30.0 + 6.0 / 50.0)).abs() < 1e-14);
    assert_eq!((found.steps, &found.state[2..]), (1, &[0.0, 0.0][..]));
    let certificate = found.contraction.expect("two linear springs");
    assert_eq!(certificate.steps, 1);
}

/// A winch pulls a joint by a tendon over a pulley against gravity and an antagonist, which goes
/// slack: `k r (r q + p) = -a sin q` has its root by bisection.
#[test]
fn a_tendon_over_a_pulley_balances_gravity_and_its_antagonist_is_slack() {
    let plant = plant(
        "[[body]]\nname = \"joint\"\nmotion = \"hinge\"\ninertia = 0.01\n\
         [[gravity]]\nname = \"weight\"\nbody = \"joint\"\namplitude = 1.5\n\
         [[tendon]]\nname = \"flexor\"\npath = [{ body = \"joint\", arm = -0.02 }]\n\
         stiffness = 5000.0\npretension = 10.0\n\
         [[tendon]]\nname = \"extensor\"\npath = [{ body = \"joint\", arm = 0.02 }]\n\
         stiffness = 5000.0\npretension = 10.0\n[[effect]]\nkind = \"tendon_slack\"\n\
         component = \"extensor\"\nslack = 0.03\n\
         [[actuator]]\nname = \"winch\"\ndrives = \"flexor\"\ninput = \"p_m\"\ngain = -1.0\n\
         [[sensor]]\nname = \"q\"\nreads = \"joint.position\"\nsignal = \"q_rad\"\n\
         [[sensor]]\nname = \"force\"\nreads = \"flexor.tension\"\nsignal = \"t_N\"\n",
    );
    let found = rest(&plant, &[0.018]);
    let torque = |q: f64| 0.02 * (10.0 + 5000.0 * (0.018 - 0.02 * q)) - 1.5 * q.sin();
    let (mut low, mut high) = (0.0, 1.5);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if torque(middle) > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    assert!(
        (found.signals[0] - low).abs() < 1e-13,
        "{} {low}",
        found.signals[0]
    );
    assert!((found.signals[1] * 0.02 - 1.5 * low.sin()).abs() < 1e-12);
    assert_eq!(found.slack, ["extensor"]);
}

#[test]
fn a_weight_that_nothing_holds_falls_until_its_tendon_is_taut() {
    let tendon = "[[tendon]]\nname = \"rope\"\npath = [{ body = \"mass\", arm = -1.0 }]\n\
                  stiffness = 981.0\n[[gravity]]\nname = \"weight\"\nbody = \"mass\"\n\
                  amplitude = 9.81\n";
    let slack = effect("tendon_slack", "rope", &[("slack", 3.0)]);
    let found = rest(&slide(0.0, 0.0, &format!("{tendon}{slack}")), &[]);
    assert!(
        (found.signals[0] + 3.01).abs() < 1e-12,
        "{}",
        found.signals[0]
    );
    assert!(found.slack.is_empty() && found.contraction.is_none());
}

/// A pendulum under a torque hangs at `asin(torque / amplitude)`.
#[test]
fn a_pendulum_leans_by_the_sine() {
    let plant = plant(
        "[[body]]\nname = \"mass\"\nmotion = \"hinge\"\ninertia = 0.2\n\
         [[gravity]]\nname = \"weight\"\nbody = \"mass\"\namplitude = 2.0\nzero = 0.3\n\
         [[actuator]]\nname = \"push\"\ndrives = \"mass\"\ninput = \"u_Nm\"\ngain = 1.0\n\
         [[sensor]]\nname = \"q\"\nreads = \"mass.position\"\nsignal = \"q_rad\"\n",
    );
    for torque in [-1.9, -0.5, 0.0, 1.0, 1.999] {
        let found = rest(&plant, &[torque]);
        let exact = 0.3 + (torque / 2.0f64).asin();
        assert!((found.signals[0] - exact).abs() < 1e-12, "{torque}");
        // A pendulum has rests without number: no certificate.
        assert_eq!(found.contraction, None);
    }
}

/// 10 N against 40 N/m and, from 0.1 m on, a stop of 160 N/m: 0.1 + (10 - 4)/200.
#[test]
fn a_stop_takes_its_share_and_is_named() {
    let stop = effect(
        "end_stop",
        "mass",
        &[
            ("position", 0.1),
            ("stiffness", 160.0),
            ("damping", 3.0),
            ("side", 1.0),
        ],
    );
    let plant = slide(0.0, 0.0, &format!("{SPRING}{RAMP}{stop}"));
    let found = rest(&plant, &[10.0]);
    assert!((found.signals[0] - 0.13).abs() < 1e-14);
    assert_eq!(found.pressed, ["mass.end_stop"]);
    let certificate = found.contraction.expect("a spring and a stop have bounds");
    // From 40 to 200 N/m: (1 - 1/5) / (1 + 1/5).
    assert!((certificate.rate - 2.0 / 3.0).abs() < 1e-12);
    assert_eq!(certificate.steps, 69);
    assert!(rest(&plant, &[3.9]).pressed.is_empty());
}

/// Input chain at rest: dead zone, curvature and saturation act, delay and lag have passed.
#[test]
fn inputs_arrive_through_their_static_stages() {
    let stages = [
        ("input_delay", "delay", 0.2),
        ("input_dead_zone", "width", 0.5),
        ("input_curvature", "coefficient", 0.1),
        ("input_saturation", "limit", 7.0),
        ("actuator_lag", "time_constant", 0.3),
    ];
    let effects: String = stages
        .iter()
        .map(|&(kind, name, value)| effect(kind, "push", &[(name, value)]))
        .collect();
    let plant = slide(0.0, 0.0, &format!("{SPRING}{RAMP}{effects}"));
    let found = rest(&plant, &[2.5]);
    assert!((found.signals[0] - (2.0 + 0.1 * 4.0) / 40.0).abs() < 1e-15);
    assert!((rest(&plant, &[-20.0]).signals[0] + 7.0 / 40.0).abs() < 1e-15);
}

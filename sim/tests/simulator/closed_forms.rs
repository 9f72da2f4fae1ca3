//! The plant against solutions that can be written down.

use crate::mechanisms::{DAMPER, RAMP, SPRING, distance, effect, plant, run, slide, times};

#[test]
fn free_decay_of_a_mass_on_a_spring_and_damper() {
    let plant = slide(0.1, 0.0, &format!("{SPRING}{DAMPER}"));
    let times = times(601, 1.0 / 120.0);
    let run = run(&plant, &times, &[]);
    let (decay, omega) = (0.6, (40.0f64 - 0.36).sqrt());
    let exact = |t: &f64| {
        0.1 * (-decay * t).exp() * ((omega * t).cos() + decay / omega * (omega * t).sin())
    };
    let error = distance(&run.column(0), times.iter().map(exact));
    assert!(error < 1e-7, "{error:e}");
    assert_eq!(run.report.events, 0);
}

/// Dry friction on an oscillator: each half cycle is a cosine about +-F/k, the amplitude loses 2
/// F/k each, and the body rests for good at the first turning point within F/k of the middle.
#[test]
fn coulomb_friction_takes_twice_the_level_over_stiffness_each_half_cycle() {
    let (level, start) = (0.5, 0.1);
    let friction = effect("coulomb_friction", "mass", &[("level", level)]);
    let plant = slide(start, 0.0, &format!("{SPRING}{friction}"));
    let times = times(4001, 1e-3);
    let run = run(&plant, &times, &[]);
    let (offset, omega) = (level / 40.0, 40f64.sqrt());
    let half = std::f64::consts::PI / omega;
    // Turning points 0.1, -0.075, 0.05, -0.025, 0: the last is inside +-0.0125, after 4 half
    // cycles.
    let exact = |t: &f64| {
        let cycle = (t / half).floor();
        if cycle >= 4.0 {
            return 0.0;
        }
        let sign = if cycle % 2.0 == 0.0 { 1.0 } else { -1.0 };
        let amplitude = start - 2.0 * offset * cycle;
        sign * (offset + (amplitude - offset) * (omega * (t - cycle * half)).cos())
    };
    let error = distance(&run.column(0), times.iter().map(exact));
    assert!(error < 1e-9, "{error:e}");
    assert_eq!(run.report.events, 4);
    assert_eq!(run.report.fallbacks, 0);
    let stuck = (4.0 * half / 1e-3).ceil() as usize;
    for row in stuck..times.len() {
        assert_eq!(run.signal(row, 1).to_bits(), 0f64.to_bits());
        assert_eq!(run.signal(row, 0).to_bits(), run.signal(stuck, 0).to_bits());
    }
    assert!(run.signal(stuck, 0).abs() < 1e-9);
}

/// A block pulled by a spring whose other end moves steadily: it holds to the bit until the spring
/// is F/k longer, then follows q = v (t - sin(omega t)/omega).
#[test]
fn stick_slip_begins_at_exactly_level_over_stiffness() {
    let friction = effect("coulomb_friction", "mass", &[("level", 3.0)]);
    let plant = slide(
        0.25,
        0.0,
        &format!(
            "[[tendon]]\nname = \"line\"\npath = [{{ body = \"mass\", arm = 1.0 }}]\n\
             stiffness = 40.0\nunilateral = false\n\
             [[actuator]]\nname = \"winch\"\ndrives = \"line\"\ninput = \"p_m\"\nhold = \"linear\"\n\
             gain = 1.0\n{friction}"
        ),
    );
    let speed = 0.1;
    let times = times(1500, 1e-3);
    let end: Vec<f64> = times.iter().map(|t| 0.25 + speed * t).collect();
    let run = run(&plant, &times, &[&end]);
    let onset = 3.0 / 40.0 / speed;
    let omega = 40f64.sqrt();
    let mut moved = 0;
    for (row, t) in times.iter().enumerate() {
        let (q, v) = (run.signal(row, 0), run.signal(row, 1));
        if *t <= onset {
            assert_eq!((q.to_bits(), v.to_bits()), (0.25f64.to_bits(), 0));
        } else {
            let slip = t - onset;
            let exact = 0.25 + speed * (slip - (omega * slip).sin() / omega);
            assert!((q - exact).abs() < 1e-10, "{:e} at {t}", q - exact);
            moved += 1;
        }
    }
    assert!(moved > 700 && run.signal(1499, 0) > 0.3);
    assert_eq!((run.report.events, run.report.fallbacks), (1, 0));
}

#[test]
fn breakaway_of_a_ramped_force_is_a_cubic_from_level_over_slope() {
    for sign in [1.0, -1.0] {
        let friction = effect("coulomb_friction", "mass", &[("level", 2.0)]);
        let plant = slide(0.0, 0.0, &format!("{RAMP}{friction}"));
        // Coarse samples: the breakaway at 0.6667 s lies inside a step.
        let times = times(11, 0.1);
        let force: Vec<f64> = times.iter().map(|t| sign * 3.0 * t).collect();
        let run = run(&plant, &times, &[&force]);
        let exact = |t: &f64| sign * 0.5 * (t - 2.0 / 3.0).max(0.0).powi(3);
        let error = distance(&run.column(0), times.iter().map(exact));
        assert!(error < 1e-14 && run.signal(10, 0).abs() > 0.01, "{error:e}");
    }
}

#[test]
fn a_constant_load_against_drag_reaches_terminal_velocity() {
    let load = effect("constant_load", "mass", &[("level", -9.81)]);
    let drag = effect("quadratic_drag", "mass", &[("coefficient", 0.25)]);
    let plant = slide(0.0, 0.0, &format!("{load}{drag}"));
    let times = times(301, 0.02);
    let run = run(&plant, &times, &[]);
    let terminal = (9.81f64 / 0.25).sqrt();
    let exact = |t: &f64| -terminal * (9.81 * t / terminal).tanh();
    let error = distance(&run.column(1), times.iter().map(exact));
    assert!(error < 1e-6, "{error:e}");
    assert!((run.signal(300, 1) + terminal).abs() < 1e-5 * terminal);
}

/// A pendulum let go at a right angle: a quarter period is K(1/2)/omega_0, with the complete
/// elliptic integral K(1/2) = 1.854 074 677 301 371 918.
#[test]
fn a_pendulum_has_the_period_of_its_amplitude() {
    let plant = plant(
        "[[body]]\nname = \"bob\"\nmotion = \"hinge\"\ninertia = 0.5\nstart = 1.5707963267948966\n\
         [[gravity]]\nname = \"weight\"\nbody = \"bob\"\namplitude = 2.0\n\
         [[sensor]]\nname = \"angle\"\nreads = \"bob.position\"\nsignal = \"q_rad\"\n",
    );
    let quarter = 1.854_074_677_301_371_9 / 2.0;
    let times: Vec<f64> = (0..=400).map(|k| f64::from(k) * quarter / 100.0).collect();
    let run = run(&plant, &times, &[]);
    let right = std::f64::consts::FRAC_PI_2;
    for (row, exact) in [(100, 0.0), (200, -right), (300, 0.0), (400, right)] {
        assert!((run.signal(row, 0) - exact).abs() < 2e-8, "row {row}");
    }
}

/// Different friction each way: v decays to -L/c on each side, and stops where it meets zero.
#[test]
fn direction_dependent_friction_coasts_and_holds_differently_each_way() {
    let parameters = [
        ("level_pos", 2.0),
        ("level_neg", 1.0),
        ("damping_pos", 0.5),
        ("damping_neg", 0.25),
    ];
    let friction = effect("direction_dependent_friction", "mass", &parameters);
    for (velocity, level, damping) in [(1.5f64, 2.0f64, 0.5f64), (-1.5, 1.0, 0.25)] {
        let plant = slide(0.0, velocity, &friction);
        let times = times(200, 0.01);
        let run = run(&plant, &times, &[]);
        let speed = velocity.abs();
        let stop = (1.0 + damping * speed / level).ln() / damping;
        assert!(stop < 1.9);
        let exact = |t: &f64| {
            let t = t.min(stop);
            let v = (speed + level / damping) * (-damping * t).exp() - level / damping;
            velocity.signum() * v.max(0.0)
        };
        let error = distance(&run.column(1), times.iter().map(exact));
        assert!(error < 1e-9, "{error:e}");
        assert_eq!(run.signal(199, 1), 0.0);
    }
    // At rest: 1.5 N forward is held (level 2), backward is not (level 1).
    for (force, moves) in [(1.5, false), (-1.5, true), (2.0, false), (-1.0, false)] {
        let load = effect("constant_load", "mass", &[("level", force)]);
        let run = run(
            &slide(0.0, 0.0, &format!("{friction}{load}")),
            &times(50, 0.01),
            &[],
        );
        assert_eq!(run.signal(49, 0) != 0.0, moves, "{force} N");
    }
}

/// Stribeck friction from a slide that is pushed: the time from one speed to another is the
/// integral of m dv / F(v), which a quadrature gives without stepping in time.
#[test]
fn stribeck_friction_follows_its_curve_and_holds_at_its_static_level() {
    let (fc, fs, vs, push, v0) = (1.0f64, 1.6f64, 0.05f64, 1.5f64, 0.03f64);
    let parameters = [("level", fc), ("static_level", fs), ("velocity", vs)];
    let friction = effect("stribeck_friction", "mass", &parameters);
    let load = effect("constant_load", "mass", &[("level", push)]);
    let times = times(101, 0.01);
    let moving = run(&slide(0.0, v0, &format!("{friction}{load}")), &times, &[]);
    let v1 = moving.signal(100, 1);
    assert!(v1 > 3.0 * vs, "the curve has been passed through: {v1}");
    let net = |v: f64| push - fc - (fs - fc) * (-(v / vs) * (v / vs)).exp();
    let cells = 20_000;
    let width = (v1 - v0) / f64::from(cells);
    let simpson = (0..cells).map(|k| {
        let v = v0 + width * f64::from(k);
        let weight = 1.0 / net(v) + 4.0 / net(v + 0.5 * width) + 1.0 / net(v + width);
        width / 6.0 * weight
    });
    let elapsed: f64 = simpson.sum();
    assert!((elapsed - 1.0).abs() < 1e-6, "{elapsed}");
    let resting = run(&slide(0.0, 0.0, &format!("{friction}{load}")), &times, &[]);
    assert_eq!(
        resting.final_state,
        [0.0, 0.0],
        "1.5 N is within the 1.6 N of rest"
    );
}

/// Kind, component, parameters, and the force that the vocabulary gives.
type Law = (
    &'static str,
    &'static str,
    &'static [(&'static str, f64)],
    f64,
);

/// Every law as the vocabulary writes it, from the change of velocity over a short step.
#[test]
fn laws_are_those_of_the_vocabulary() {
    let (q, v, rest): (f64, f64, f64) = (0.3, -0.7, 0.1);
    let x = q - rest;
    let bell = (-(v / 0.5) * (v / 0.5)).exp();
    let table: [Law; 11] = [
        ("coulomb_friction", "mass", &[("level", 2.0)], 2.0),
        (
            "stribeck_friction",
            "mass",
            &[("level", 2.0), ("static_level", 3.0), ("velocity", 0.5)],
            2.0 + bell,
        ),
        (
            "direction_dependent_friction",
            "mass",
            &[
                ("level_pos", 9.0),
                ("level_neg", 2.0),
                ("damping_pos", 9.0),
                ("damping_neg", 4.0),
            ],
            2.0 + 4.0 * 0.7,
        ),
        ("viscous_damping", "mass", &[("damping", 3.0)], 2.1),
        ("viscous_damping", "coil", &[("damping", 3.0)], 2.1),
        (
            "quadratic_drag",
            "mass",
            &[("coefficient", 3.0)],
            3.0 * 0.49,
        ),
        (
            "cubic_stiffness",
            "coil",
            &[("coefficient", -50.0)],
            50.0 * x * x * x,
        ),
        (
            "quadratic_stiffness",
            "coil",
            &[("coefficient", 50.0)],
            -50.0 * x * x,
        ),
        ("gravity_load", "mass", &[("amplitude", 1.5)], -1.5),
        ("constant_load", "mass", &[("level", 1.5)], 1.5),
        (
            "position_ripple",
            "mass",
            &[("amplitude", 2.0), ("wave_number", 7.0), ("phase", 0.4)],
            2.0 * (7.0 * q + 0.4f64).sin(),
        ),
    ];
    let spring = "[[spring]]\nname = \"coil\"\nfrom = \"ground\"\nto = \"mass\"\nstiffness = 40.0\n\
                  rest = 0.1\n";
    for (kind, component, parameters, expected) in table {
        let tables = format!("{spring}{}", effect(kind, component, parameters));
        let h = 1e-7;
        let run = run(&slide(q, v, &tables), &[0.0, h], &[]);
        let force = (run.signal(1, 1) - v) / h + 40.0 * x;
        assert!(
            (force - expected).abs() < 1e-4,
            "{kind} at {component}: {force} {expected}"
        );
    }
}

//! Laws with memory, gaps and delays against closed solutions.

use crate::mechanisms::{SPRING, distance, effect, plant, run, slide, times};
use sinew_sim::SimulationSettings;

/// A body too heavy to be slowed, so that a spring is drawn out at a constant rate.
fn drawn(rate: f64, more: &str) -> Vec<f64> {
    let spring = "[[spring]]\nname = \"coil\"\nfrom = \"ground\"\nto = \"mass\"\nstiffness = 1.0\n";
    let heavy = format!(
        "[[body]]\nname = \"mass\"\nmotion = \"slide\"\ninertia = 1e14\nstart_velocity = {rate:?}\n\
         {spring}{more}"
    );
    run(&plant(&heavy), &times(301, 0.01), &[]).final_state
}

#[test]
fn a_maxwell_branch_relaxes_with_its_time_constant() {
    let creep = effect(
        "viscoelastic_creep",
        "coil",
        &[("stiffness", 30.0), ("time_constant", 0.8)],
    );
    let exact = 30.0 * 0.8 * 0.2 * (1.0 - (-3.0f64 / 0.8).exp());
    let force = drawn(0.2, &creep)[2];
    assert!((force - exact).abs() < 1e-8 * exact, "{force} {exact}");
}

/// z goes to (beta + gamma)^(-1/n): the strength of the loop is alpha times that.
#[test]
fn hysteresis_reaches_its_limit_strength() {
    let law = |exponent: f64| {
        [
            ("alpha", 30.0),
            ("beta", 6.0),
            ("gamma", 2.0),
            ("exponent", exponent),
        ]
    };
    let z = drawn(0.2, &effect("hysteresis", "coil", &law(1.0)))[2];
    let exact = (1.0 - (-8.0f64 * 0.2 * 3.0).exp()) / 8.0;
    assert!((z - exact).abs() < 1e-8 * exact, "{z} {exact}");
    let z = drawn(2.0, &effect("hysteresis", "coil", &law(2.0)))[2];
    let exact = 0.125f64.sqrt();
    assert!((z - exact).abs() < 1e-6 * exact, "{z} {exact}");
    let z = drawn(-2.0, &effect("hysteresis", "coil", &law(2.0)))[2];
    assert!((z + exact).abs() < 1e-6 * exact, "{z} {exact}");
}

/// A free body that friction stops has lost its kinetic energy on the way x: with s = x / distance,
/// m v0^2 / 2 = level distance (s - 1 + exp(-s)). Before it slips it swings on a spring of the
/// stiffness level / distance.
#[test]
fn presliding_friction_stops_a_body_where_its_energy_is_gone_and_springs_before_it_slips() {
    let (level, distance) = (3.0, 0.02);
    let law = effect(
        "presliding_friction",
        "mass",
        &[("level", level), ("distance", distance)],
    );
    let times = times(2001, 0.0005);
    let fast = slide(0.0, 0.5, &law);
    let mass = fast.values()[fast.slot("mass.inertia").unwrap()];
    let reached = run(&fast, &times, &[]).column(0);
    let reached = reached.into_iter().fold(0.0, f64::max);
    let s = reached / distance;
    let lost = level * distance * (s - 1.0 + (-s).exp());
    let had = 0.5 * mass * 0.25;
    println!("{reached} m: {lost} J of {had} J");
    assert!((lost - had).abs() < 1e-5 * had, "{lost} {had}");
    assert!(s > 1.0, "it slips: {s}");

    let omega = (level / distance / mass).sqrt();
    let slow = slide(0.0, 1e-6, &law);
    let swing = run(&slow, &times, &[]).column(0);
    let exact = times.iter().map(|t| 1e-6 / omega * (omega * t).sin());
    let error = crate::mechanisms::distance(&swing, exact) * omega / 1e-6;
    assert!(error < 1e-3, "{error:e} of the amplitude");
}

/// A body that is drawn in at a constant rate yields after the way `yield_extension` and takes a
/// set: the branch's force is that of an elastic, perfectly plastic body.
#[test]
fn a_branch_that_yields_keeps_its_largest_force() {
    let law = effect(
        "plastic_set",
        "coil",
        &[("stiffness", 30.0), ("yield_extension", 0.04)],
    );
    for (rate, exact) in [(0.01, 0.03), (0.2, 0.04), (-0.2, -0.04)] {
        let z = drawn(rate, &law)[2];
        assert!((z - exact).abs() < 1e-12, "{rate}: {z} {exact}");
    }
}

/// A swinging mass yields until what is left of its energy fits the branch: with a spring k and a
/// branch k1 that yields at e, drawn to x0 > e and let go with the branch unloaded at z = 0, it
/// comes back elastically, yields at x0 - e and turns where the energy is gone:
/// k (x0^2 - x^2) / 2 = k1 e^2 / 2 + k1 e (x0 - e - x).
#[test]
fn a_swinging_mass_turns_where_a_yielding_branch_has_taken_its_energy() {
    let (branch, limit, from) = (25.0, 0.03, 0.2);
    let law = effect(
        "plastic_set",
        "coil",
        &[("stiffness", branch), ("yield_extension", limit)],
    );
    let plant = slide(from, 0.0, &format!("{SPRING}{law}"));
    let stiffness = plant.values()[plant.slot("coil.stiffness").unwrap()];
    let positions = run(&plant, &times(4001, 0.0005), &[]).column(0);
    let turn = positions.into_iter().fold(f64::INFINITY, f64::min);
    let given = 0.5 * stiffness * (from * from - turn * turn);
    let taken = 0.5 * branch * limit * limit + branch * limit * (from - limit - turn);
    println!("turns at {turn} m: {given} J given, {taken} J taken");
    assert!(turn < from - 2.0 * limit, "it yields");
    assert!((given - taken).abs() < 1e-6 * taken, "{given} {taken}");
}

/// A heavy body that slides at a constant speed warms as exp: theta = v / velocity (1 - exp(-t /
/// time_constant)).
#[test]
fn friction_of_steady_sliding_falls_as_its_temperature_rises() {
    let law = effect(
        "warm_up_friction",
        "mass",
        &[("level", 3.0), ("velocity", 0.5), ("time_constant", 0.8)],
    );
    for rate in [0.2, -0.2] {
        let theta = drawn(rate, &law)[2];
        let exact = 0.4 * (1.0 - (-3.0f64 / 0.8).exp());
        assert!((theta - exact).abs() < 1e-8 * exact, "{theta} {exact}");
    }
}

const PUSH: &str = "[[actuator]]\nname = \"push\"\ndrives = \"mass\"\ninput = \"u_N\"\n\
                    gain = { value = 1.0 }\n";

#[test]
fn a_lag_answers_a_step_by_its_exponential() {
    for constant in [0.3, 0.02, 0.0005] {
        let lag = effect("actuator_lag", "push", &[("time_constant", constant)]);
        let plant = slide(0.0, 0.0, &format!("{PUSH}{lag}"));
        let times = times(101, 0.01);
        let step: Vec<f64> = times
            .iter()
            .map(|&t| if t < 0.005 { 0.0 } else { 1.0 })
            .collect();
        let velocity = run(&plant, &times, &[&step]).column(1);
        let exact = times.iter().map(|&t| {
            let t = (t - 0.01).max(0.0);
            t - constant * (1.0 - (-t / constant).exp())
        });
        let error = distance(&velocity, exact);
        println!("lag of {constant} s: error {error:e} m/s");
        assert!(error < 1e-6 * constant.max(0.01), "{constant}: {error:e}");
    }
}

/// A delay of two and a half samples is a shift of five half samples.
#[test]
fn a_delay_shifts_the_input_by_exactly_that_much() {
    for delay in [0.025, 0.0, 0.05, 0.0137] {
        let parts = 1000;
        let shift = (delay / 0.01 * parts as f64).round() as usize;
        let law = effect("input_delay", "push", &[("delay", delay)]);
        let delayed = slide(0.0, 0.0, &format!("{SPRING}{PUSH}{law}"));
        let coarse = times(41, 0.01);
        let input: Vec<f64> = coarse.iter().map(|t| (30.0 * t).sin() + 1.0).collect();
        let ours = run(&delayed, &coarse, &[&input]).column(0);
        let plain = slide(0.0, 0.0, &format!("{SPRING}{PUSH}"));
        let fine = times(40 * parts + 1, 0.01 / parts as f64);
        let shifted: Vec<f64> = (0..fine.len())
            .map(|k| input[k.saturating_sub(shift) / parts])
            .collect();
        let exact = run(&plain, &fine, &[&shifted]).column(0);
        let error = distance(&ours, exact.into_iter().step_by(parts));
        assert!(error < 1e-8, "delay {delay}: {error:e}");
    }
}

/// A supply that sags is no law of its own: a gain and a curvature follow u / (1 + r u) to 0.7 %,
/// where the gain has fallen by a third, and leave a hundredth of what a gain alone does.
#[test]
fn a_curvature_of_the_input_stands_for_a_supply_that_sags() {
    let inputs = times(1001, 0.001);
    let sagging = |u: f64| u / (1.0 + 0.5 * u);
    let product = |a: &dyn Fn(f64) -> f64, b: &dyn Fn(f64) -> f64| -> f64 {
        inputs.iter().map(|&u| a(u) * b(u)).sum()
    };
    // y = gain (u + coefficient u |u|), by least squares.
    let (line, bend) = (|u: f64| u, |u: f64| u * u.abs());
    let [a, b, c] = [
        product(&line, &line),
        product(&line, &bend),
        product(&bend, &bend),
    ];
    let [p, q] = [product(&sagging, &line), product(&sagging, &bend)];
    let (gain, bent) = (
        (p * c - q * b) / (a * c - b * b),
        (q * a - p * b) / (a * c - b * b),
    );
    let push = effect("input_curvature", "push", &[("coefficient", bent / gain)]);
    let plant = slide(0.0, 0.0, &format!("{PUSH}{push}"));
    let slot = plant.slot("push.gain").unwrap();
    let mut values = plant.values();
    values[slot] = gain;
    let velocity = crate::mechanisms::run_with(&plant, &values, &inputs, &[&inputs]).column(1);
    // Held for a millisecond, 1 kg: the force is the change of the velocity.
    let force = velocity.windows(2).map(|pair| (pair[1] - pair[0]) / 0.001);
    let left: f64 = force
        .zip(&inputs)
        .map(|(force, &u)| (force - sagging(u)).powi(2))
        .sum();
    let all = product(&sagging, &sagging);
    let alone = all - p * p / a;
    println!(
        "{:.2e} of the force, {:.2e} of the mismatch",
        (left / all).sqrt(),
        left / alone
    );
    assert!((left / all).sqrt() < 7e-3 && left < 0.01 * alone);
}

/// Below zero a delay, a lag or a gap is none: a fit may try it.
#[test]
fn sizes_below_zero_are_simulated_as_none() {
    let times = times(101, 0.01);
    let input: Vec<f64> = times.iter().map(|t| 2.0 * (9.0 * t).sin()).collect();
    // Exactly, where the others take sub-steps of an error of some 1e-8.
    let bare = slide(0.1, 0.0, &format!("{SPRING}{PUSH}"));
    let bare = run(&bare, &times, &[&input]).column(0);
    let cases = [
        ("input_delay", "push", "delay"),
        ("actuator_lag", "push", "time_constant"),
        ("input_dead_zone", "push", "width"),
        ("backlash", "push", "gap"),
        ("backlash", "coil", "gap"),
    ];
    for (kind, component, name) in cases {
        let plant = slide(
            0.1,
            0.0,
            &(format!("{SPRING}{PUSH}") + &effect(kind, component, &[(name, 0.01)])),
        );
        let mut values = plant.values();
        values[plant.slot(&format!("{component}.{kind}.{name}")).unwrap()] = -0.01;
        let ours = crate::mechanisms::run_with(&plant, &values, &times, &[&input]).column(0);
        let error = distance(&ours, bare.iter().copied());
        assert!(error < 1e-7, "{kind}: {error:e}");
    }
}

/// Into a spring and damper and out where their force falls to zero: d'' = 0 of the damped
/// oscillation.
#[test]
fn a_stop_throws_back_with_the_speed_of_its_closed_form() {
    let (k, c, speed) = (2000.0f64, 20.0f64, 0.7);
    let more = [("position", 0.05), ("stiffness", k), ("damping", c)];
    let plant = slide(
        0.0,
        speed,
        &(effect("end_stop", "mass", &more) + "side = 1.0\n"),
    );
    let out = run(&plant, &times(61, 0.01), &[]);
    let delta = 0.5 * c;
    let omega = (k - delta * delta).sqrt();
    let angle =
        std::f64::consts::PI - (2.0 * delta * omega / (omega * omega - delta * delta)).atan();
    let time = angle / omega;
    let back = speed * (-delta * time).exp() * (angle.cos() - delta / omega * angle.sin());
    let depth = speed / omega * (-delta * time).exp() * angle.sin();
    let exact = 0.05 + depth + back * (0.6 - 0.05 / speed - time);
    assert!(
        (out.signal(60, 1) - back).abs() < 1e-6,
        "{} {back}",
        out.signal(60, 1)
    );
    assert!(
        (out.signal(60, 0) - exact).abs() < 1e-6,
        "{} {exact}",
        out.signal(60, 0)
    );
    assert_eq!(out.report.fallbacks, 0);
}

/// Across the play at constant speed, a half swing of the spring each side.
#[test]
fn a_spring_with_play_has_the_period_of_its_parts() {
    let (gap, start, omega) = (0.04f64, 0.1, 40f64.sqrt());
    let plant = slide(
        start,
        0.0,
        &(SPRING.to_owned() + &effect("backlash", "coil", &[("gap", gap)])),
    );
    let crossing = gap / (omega * (start - 0.5 * gap));
    let period = std::f64::consts::TAU / omega + 2.0 * crossing;
    let out = run(&plant, &times(201, period / 100.0), &[]);
    assert!(
        (out.signal(100, 0) - start).abs() < 1e-7,
        "{}",
        out.signal(100, 0)
    );
    assert!(
        (out.signal(200, 0) - start).abs() < 2e-7,
        "{}",
        out.signal(200, 0)
    );
    assert_eq!(out.report.kinks, 8);
}

/// Friction of a tendon along its path holds two bodies together in the tendon's direction, and
/// lets them go beyond its share of the tension.
#[test]
fn a_tendon_holds_along_its_path_up_to_its_share_of_the_tension() {
    let rig = |force: f64| {
        let body = |name: &str, inertia: f64| {
            format!("[[body]]\nname = \"{name}\"\nmotion = \"slide\"\ninertia = {inertia:?}\n")
        };
        let tendon = "[[tendon]]\nname = \"line\"\npath = [{ body = \"a\", arm = 1.0 }, \
                      { body = \"b\", arm = -1.0 }]\nstiffness = 0.0\npretension = 10.0\n";
        let hold = effect("constant_load", "a", &[("level", 10.0 + force)])
            + &effect("constant_load", "b", &[("level", -10.0 - force)]);
        let friction = effect("load_dependent_friction", "line", &[("coefficient", 0.2)]);
        let text = body("a", 1.0) + &body("b", 3.0) + tendon + &hold + &friction;
        run(&plant(&text), &times(101, 0.01), &[]).final_state
    };
    // Along the path b = (1, -1) the loads push with their force, reduced by nothing: it holds to 2
    // N.
    let held = rig(1.9);
    assert!(held.iter().all(|x| x.abs() < 1e-12), "{held:?}");
    let slid = rig(2.5);
    assert!((slid[0] - 0.5 * 0.5).abs() < 1e-9, "{slid:?}");
    assert!((slid[1] + 0.5 * 0.5 / 3.0).abs() < 1e-9, "{slid:?}");
}

/// A lagged tension starts at the tension, inputs and all.
#[test]
fn a_lagged_tension_starts_at_its_first_value() {
    let text = "[[body]]\nname = \"a\"\nmotion = \"slide\"\ninertia = 1e9\n\
                [[tendon]]\nname = \"line\"\npath = [{ body = \"a\", arm = 1.0 }]\n\
                stiffness = 100.0\npretension = 5.0\n\
                [[actuator]]\nname = \"winch\"\ndrives = \"line\"\ninput = \"u_V\"\ngain = -0.01\n\
                [[sensor]]\nname = \"cell\"\nreads = \"line.tension\"\nsignal = \"t_N\"\n";
    let lag = effect("sensor_lag", "cell", &[("time_constant", 0.1)]);
    let out = run(
        &plant(&(text.to_owned() + &lag)),
        &times(11, 0.01),
        &[&[3.0; 11]],
    );
    for row in 0..11 {
        assert!(
            (out.signal(row, 0) - 8.0).abs() < 1e-6,
            "{}",
            out.signal(row, 0)
        );
    }
}

/// Below an exponent of one the law is steep where its state goes through zero, for no time: a fit
/// that passes there must not find the rig too stiff, nor wrong.
#[test]
fn a_blunt_hysteresis_is_simulated_as_fast_as_a_sharp_one() {
    let times = times(400, 0.01);
    let input: Vec<f64> = times.iter().map(|t| 3.0 * (2.0 * t).sin()).collect();
    let of = |exponent: f64, settings: SimulationSettings| {
        let more = [
            ("alpha", 30.0),
            ("beta", 6.0),
            ("gamma", -1.0),
            ("exponent", exponent),
        ];
        let law = effect("hysteresis", "coil", &more);
        let plant = slide(0.0, 0.3, &format!("{SPRING}{PUSH}{law}"));
        run(&plant.with_settings(settings), &times, &[&input])
    };
    for exponent in [0.98, 0.7] {
        let ours = of(exponent, SimulationSettings::default());
        assert!(ours.report.most_substeps <= 16, "{:?}", ours.report);
        let fine = SimulationSettings {
            rate_step: 0.002,
            ..SimulationSettings::default()
        };
        let error = distance(&ours.column(0), of(exponent, fine).column(0));
        assert!(error < 1e-5, "{exponent}: {error:e}");
    }
}

//! Every kind of the vocabulary at every sort of place where it can sit: its derivatives, through
//! its kinks and jumps, against differences and the complex step, and the same path with and
//! without them.

use crate::complex::Complex;
use crate::mechanisms::{effect, plant, times};
use sinew_sim::effects::Kind;
use sinew_sim::{Dual, InputTrajectory, Plant, Scalar, Simulated, SimulationSettings, Trajectory};

const SEEDS: usize = 24;

/// A driven carriage and a finger that a tendon joins, with every sort of component.
const BENCH: &str = r#"
[[body]]
name = "cart"
motion = "slide"
inertia = { value = 1.2 }
start = { value = 0.13 }
start_velocity = { value = 0.4 }
[[body]]
name = "mass"
motion = "slide"
inertia = { value = 0.6 }
start = { value = -0.07 }
start_velocity = { value = -0.3 }
[[spring]]
name = "coil"
from = "ground"
to = "cart"
stiffness = { value = 40.0 }
rest = { value = 0.02 }
[[spring]]
name = "anchor"
from = "ground"
to = "mass"
stiffness = { value = 25.0 }
[[damper]]
name = "dashpot"
from = "ground"
to = "cart"
damping = { value = 0.3 }
[[tendon]]
name = "line"
path = [{ body = "cart", arm = 0.7 }, { body = "mass", arm = -0.9 }]
stiffness = { value = 30.0 }
damping = { value = 0.2 }
pretension = { value = 0.5 }
unilateral = false
[[tendon]]
name = "string"
path = [{ body = "mass", arm = -0.8 }]
stiffness = { value = 20.0 }
pretension = { value = 3.0 }
unilateral = false
[[actuator]]
name = "push"
drives = "cart"
input = "u_N"
hold = "HOLD"
gain = { value = 1.3 }
[[sensor]]
name = "x"
reads = "cart.position"
signal = "x_m"
gain = { value = 1.1 }
[[sensor]]
name = "v"
reads = "mass.velocity"
signal = "v_m_s"
[[sensor]]
name = "cell"
reads = "line.tension"
signal = "t_N"
offset = { value = 0.2 }
"#;

/// Kind, component, parameters, and whether some branch or mode must change on the way.
type Case = (
    &'static str,
    &'static str,
    &'static [(&'static str, f64)],
    bool,
);

const CASES: &[Case] = &[
    ("coulomb_friction", "cart", &[("level", 0.8)], true),
    (
        "stribeck_friction",
        "mass",
        &[("level", 0.4), ("static_level", 0.7), ("velocity", 0.2)],
        true,
    ),
    (
        "direction_dependent_friction",
        "cart",
        &[
            ("level_pos", 0.5),
            ("level_neg", 0.8),
            ("damping_pos", 0.2),
            ("damping_neg", 0.1),
        ],
        true,
    ),
    (
        "load_dependent_friction",
        "cart",
        &[("coefficient", 0.25)],
        true,
    ),
    (
        "load_dependent_friction",
        "mass",
        &[("coefficient", 0.2)],
        true,
    ),
    (
        "load_dependent_friction",
        "line",
        &[("coefficient", 0.3)],
        true,
    ),
    (
        "load_dependent_friction",
        "string",
        &[("coefficient", 0.2)],
        true,
    ),
    (
        "presliding_friction",
        "cart",
        &[("level", 0.8), ("distance", 0.03)],
        true,
    ),
    (
        "presliding_friction",
        "mass",
        &[("level", 0.5), ("distance", 0.2)],
        true,
    ),
    (
        "warm_up_friction",
        "cart",
        &[("level", 0.8), ("velocity", 0.3), ("time_constant", 0.7)],
        true,
    ),
    ("viscous_damping", "mass", &[("damping", 0.4)], false),
    ("viscous_damping", "coil", &[("damping", 0.4)], false),
    ("quadratic_drag", "cart", &[("coefficient", 1.5)], true),
    ("cubic_stiffness", "coil", &[("coefficient", 900.0)], false),
    (
        "quadratic_stiffness",
        "coil",
        &[("coefficient", 90.0)],
        false,
    ),
    (
        "end_stop",
        "cart",
        &[
            ("position", 0.08),
            ("stiffness", 900.0),
            ("damping", 6.0),
            ("side", 1.0),
        ],
        true,
    ),
    (
        "end_stop",
        "mass",
        &[
            ("position", -0.05),
            ("stiffness", 400.0),
            ("damping", 0.0),
            ("side", -1.0),
        ],
        true,
    ),
    ("backlash", "coil", &[("gap", 0.06)], true),
    ("backlash", "line", &[("gap", 0.08)], true),
    ("backlash", "push", &[("gap", 0.7)], false),
    ("tendon_slack", "line", &[("slack", 0.01)], true),
    (
        "hysteresis",
        "coil",
        &[
            ("alpha", 30.0),
            ("beta", 9.0),
            ("gamma", 5.0),
            ("exponent", 1.0),
        ],
        true,
    ),
    (
        "hysteresis",
        "anchor",
        &[
            ("alpha", 20.0),
            ("beta", 60.0),
            ("gamma", -20.0),
            ("exponent", 1.6),
        ],
        true,
    ),
    (
        "plastic_set",
        "coil",
        &[("stiffness", 30.0), ("yield_extension", 0.03)],
        true,
    ),
    (
        "viscoelastic_creep",
        "coil",
        &[("stiffness", 25.0), ("time_constant", 0.3)],
        false,
    ),
    ("gravity_load", "cart", &[("amplitude", 1.1)], false),
    ("constant_load", "mass", &[("level", 0.7)], false),
    (
        "position_ripple",
        "cart",
        &[("amplitude", 0.8), ("wave_number", 40.0), ("phase", 0.4)],
        false,
    ),
    (
        "hidden_mode",
        "cart",
        &[("inertia", 0.3), ("stiffness", 60.0), ("damping", 0.4)],
        false,
    ),
    ("cross_coupling", "cart+mass", &[("stiffness", 18.0)], false),
    ("input_delay", "push", &[("delay", 0.0237)], false),
    ("actuator_lag", "push", &[("time_constant", 0.05)], false),
    ("actuator_lag", "push", &[("time_constant", 0.0004)], false),
    ("input_dead_zone", "push", &[("width", 0.6)], false),
    ("input_saturation", "push", &[("limit", 1.4)], false),
    ("input_curvature", "push", &[("coefficient", -0.15)], false),
    ("sensor_lag", "x", &[("time_constant", 0.07)], false),
    ("sensor_lag", "v", &[("time_constant", 0.002)], false),
    ("sensor_lag", "cell", &[("time_constant", 0.03)], false),
    (
        "sensor_curvature",
        "x",
        &[("quadratic", 0.9), ("cubic", -2.0)],
        false,
    ),
];

fn bench(hold: &str, (kind, component, parameters): (&str, &str, &[(&str, f64)])) -> Plant {
    let parameters: Vec<(&str, f64)> = parameters.to_vec();
    let (fixed, free): (Vec<_>, Vec<_>) = parameters.iter().partition(|(name, _)| *name == "side");
    let mut text = effect(kind, component, &free);
    for (name, value) in fixed {
        text += &format!("{name} = {value:?}\n");
    }
    plant(&(BENCH.replace("HOLD", hold) + &text))
}

fn force(times: &[f64]) -> Vec<f64> {
    times
        .iter()
        .map(|t| 1.9 * (4.1 * t).sin() + 1.1 * (9.7 * t + 0.4).cos())
        .collect()
}

fn simulate<S: Simulated>(plant: &Plant, values: &[S], times: &[f64]) -> Trajectory<S> {
    let drive = InputTrajectory::new(plant, times.len(), &[&force(times)]).unwrap();
    let start = plant.initial_state(values, &[None, None, None]).unwrap();
    plant.simulate(values, &start, &drive, times).unwrap()
}

fn seeded(plant: &Plant) -> (Vec<usize>, Vec<Dual<SEEDS>>) {
    let slots = plant.free_slots();
    assert!(slots.len() <= SEEDS, "{}", slots.len());
    let mut values: Vec<Dual<SEEDS>> = plant.values().into_iter().map(Dual::constant).collect();
    for (seed, &slot) in slots.iter().enumerate() {
        values[slot] = Dual::variable(values[slot].value, seed);
    }
    (slots, values)
}

/// Derivatives by one parameter, of every signal, by the complex step.
fn complex_step(plant: &Plant, slot: usize, times: &[f64]) -> Vec<f64> {
    let mut values: Vec<Complex> = plant.values().into_iter().map(Complex::constant).collect();
    values[slot].im = 1e-30;
    let run = simulate(plant, &values, times);
    run.signals.iter().map(|s| s.im / 1e-30).collect()
}

/// The same by central differences, extrapolated once (fourth order).
fn differences(plant: &Plant, slot: usize, times: &[f64]) -> Vec<f64> {
    let plain = plant.values();
    let step = 2e-5 * (plain[slot].abs() + 0.01);
    let slope = |step: f64| -> Vec<f64> {
        let beside = |sign: f64| {
            let mut values = plain.clone();
            values[slot] += sign * step;
            simulate(plant, &values, times).signals
        };
        let (ahead, behind) = (beside(1.0), beside(-1.0));
        ahead
            .iter()
            .zip(&behind)
            .map(|(a, b)| (a - b) / (2.0 * step))
            .collect()
    };
    let (coarse, fine) = (slope(step), slope(0.5 * step));
    fine.iter()
        .zip(&coarse)
        .map(|(f, c)| (4.0 * f - c) / 3.0)
        .collect()
}

fn relative(dual: &Trajectory<Dual<SEEDS>>, seed: usize, other: &[f64], name: &str) -> f64 {
    let exact = dual.signals.iter().map(|s| s.derivative[seed]);
    let scale = exact.clone().fold(0.0, |m: f64, d| m.max(d.abs()));
    assert!(scale > 1e-4, "nothing depends on {name}: {scale:e}");
    let difference = exact.zip(other).map(|(a, b)| (a - b).abs());
    difference.fold(0.0, f64::max) / scale
}

#[test]
fn every_kind_is_here() {
    for kind in Kind::ALL {
        let name = kind.description().kind;
        assert!(CASES.iter().any(|case| case.0 == name), "{name}");
    }
}

#[test]
fn derivatives_of_every_kind_agree_with_the_complex_step_and_with_differences() {
    let times = times(161, 0.01);
    let mut failed = Vec::new();
    for &(kind, component, parameters, branches) in CASES {
        for hold in ["zero", "linear"] {
            let plant = bench(hold, (kind, component, parameters));
            let (slots, values) = seeded(&plant);
            let plain = simulate(&plant, &plant.values(), &times);
            let dual = simulate(&plant, &values, &times);
            let label = format!("{kind} at {component}, {hold}");
            assert_eq!(plain.report, dual.report, "{label}");
            for (a, b) in plain.signals.iter().zip(&dual.signals) {
                assert_eq!(a.to_bits(), b.value.to_bits(), "{label}: another path");
            }
            let report = dual.report;
            assert_eq!(report.fallbacks, 0, "{label}: {report:?}");
            let changes = report.events + report.kinks;
            assert!(!branches || changes >= 2, "{label}: {report:?}");
            let (mut worst_step, mut worst_difference) = (0.0f64, 0.0f64);
            for (seed, &slot) in slots.iter().enumerate() {
                let name = format!("{label}: {}", plant.parameters()[slot].name);
                let by_step = relative(&dual, seed, &complex_step(&plant, slot, &times), &name);
                worst_step = worst_step.max(by_step);
                if plant.parameters()[slot]
                    .name
                    .starts_with(&format!("{component}.{kind}."))
                {
                    let other = differences(&plant, slot, &times);
                    worst_difference = worst_difference.max(relative(&dual, seed, &other, &name));
                }
            }
            println!(
                "{label}: {} events, {} kinks, complex step {worst_step:.1e}, differences \
                 {worst_difference:.1e}",
                report.events, report.kinks
            );
            if worst_step > 1e-8 || worst_difference > 2e-6 {
                failed.push(format!("{label}: {worst_step:.1e} {worst_difference:.1e}"));
            }
        }
    }
    assert!(failed.is_empty(), "{failed:#?}");
}

/// Weights of a loss that is a sum over all signals.
fn weights(count: usize) -> Vec<f64> {
    (0..count).map(|k| (0.37 * k as f64).sin()).collect()
}

#[test]
fn the_gradient_backwards_is_the_one_forwards_for_every_kind() {
    let times = times(161, 0.01);
    let input = force(&times);
    for &(kind, component, parameters, _) in CASES {
        let label = format!("{kind} at {component}");
        let plant = bench("linear", (kind, component, parameters));
        let (slots, values) = seeded(&plant);
        let dual = simulate(&plant, &values, &times);
        let weights = weights(dual.signals.len());
        let plain = plant.values();
        let start = plant.initial_state(&plain, &[None, None, None]).unwrap();
        let drive = InputTrajectory::new(&plant, times.len(), &[&input]).unwrap();
        let loss = |run: &Trajectory<f64>| -> f64 {
            run.signals.iter().zip(&weights).map(|(s, w)| s * w).sum()
        };
        let gradient = plant
            .gradient(&plain, &start, &drive, &times, |run| {
                (loss(run), weights.clone())
            })
            .unwrap();
        // The start depends on parameters too; backwards it stands for itself.
        let moved = plant.initial_state(&values, &[None, None, None]).unwrap();
        let forward = |seed: usize| -> f64 {
            let parts = dual.signals.iter().zip(&weights);
            parts.map(|(s, w)| s.derivative[seed] * w).sum()
        };
        let largest = (0..slots.len())
            .map(|seed| forward(seed).abs())
            .fold(0.0, f64::max);
        for (seed, &slot) in slots.iter().enumerate() {
            let by_start = moved.iter().zip(&gradient.start);
            let through: f64 = by_start.map(|(x, g)| x.derivative[seed] * g).sum();
            let (ours, exact) = (gradient.parameters[slot] + through, forward(seed));
            let name = &plant.parameters()[slot].name;
            assert!(
                (ours - exact).abs() < 1e-9 * largest,
                "{label}: {name}: {ours} {exact}"
            );
        }
        // Inputs: differences at three samples.
        for row in [0, 70, 128] {
            let beside = |step: f64| {
                let mut input = input.clone();
                input[row] += step;
                let drive = InputTrajectory::new(&plant, times.len(), &[&input]).unwrap();
                loss(&plant.simulate(&plain, &start, &drive, &times).unwrap())
            };
            let exact = (beside(1e-5) - beside(-1e-5)) / 2e-5;
            let ours = gradient.inputs[0][row];
            let scale = gradient.inputs[0]
                .iter()
                .fold(0.0f64, |m, g| m.max(g.abs()));
            assert!(scale > 1e-4, "{label}: nothing depends on the input");
            assert!(
                (ours - exact).abs() < 1e-5 * scale,
                "{label}: row {row}: {ours} {exact}"
            );
        }
    }
}

/// On the central path the motion goes to that of the hard law as its parameter goes to zero.
#[test]
fn the_smoothed_law_has_the_hard_one_as_its_limit() {
    let times = times(101, 0.01);
    let stop = [("position", 0.08), ("stiffness", 900.0), ("damping", 6.0)];
    let stop = effect("end_stop", "cart", &stop) + "side = 1.0\n";
    let text = BENCH.replace("HOLD", "zero").replace("false", "true")
        + &effect("coulomb_friction", "cart", &[("level", 0.8)])
        + &stop;
    let hard = plant(&text);
    let exact = simulate(&hard, &hard.values(), &times);
    assert!(
        exact.report.events > 2 && exact.report.kinks > 4,
        "{:?}",
        exact.report
    );
    let errors: Vec<f64> = [1e-2, 1e-3, 1e-4, 1e-5]
        .iter()
        .map(|&smoothing| {
            let smooth = hard.with_settings(SimulationSettings {
                smoothing,
                ..SimulationSettings::default()
            });
            let run = simulate(&smooth, &smooth.values(), &times);
            assert_eq!(run.report.events, 0);
            let pairs = run.column(0).into_iter().zip(exact.column(0));
            pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
        })
        .collect();
    println!("smoothing: errors {errors:?} m");
    for pair in errors.windows(2) {
        // The root of it: a contact acts over a distance of sqrt(smoothing / stiffness).
        assert!(pair[1] < 0.4 * pair[0], "{errors:?}");
    }
    assert!(errors[3] < 1e-2 * 0.6, "{errors:?}");
}

/// A tolerance refines until it is met, and reports what that took.
#[test]
fn a_tolerance_refines_the_steps() {
    let times = times(101, 0.02);
    let ripple = CASES.iter().find(|case| case.0 == "position_ripple");
    let &(kind, component, parameters, _) = ripple.unwrap();
    let plant = bench("linear", (kind, component, parameters));
    let with = |tolerance| {
        let settings = SimulationSettings {
            tolerance,
            ..SimulationSettings::default()
        };
        simulate(&plant.with_settings(settings), &plant.values(), &times)
    };
    let fine = with(Some(1e-14));
    let error = |run: &Trajectory<f64>| {
        let pairs = run.column(0).into_iter().zip(fine.column(0));
        pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    let (plain, loose, tight) = (with(None), with(Some(1e-8)), with(Some(1e-11)));
    println!(
        "errors {:e} {:e} {:e}, sub-steps {} {} {}",
        error(&plain),
        error(&loose),
        error(&tight),
        plain.report.substeps,
        loose.report.substeps,
        tight.report.substeps
    );
    assert!(tight.report.substeps > loose.report.substeps);
    assert!(error(&tight) < 0.05 * error(&loose).max(error(&plain)));
    assert!(error(&tight) < 1e-9);
}

//! Position loops in the firmware of an actuator, against closed solutions.

use crate::mechanisms::{distance, plant, run, run_with, times};
use sinew_sim::{Dual, InputTrajectory, Plant, Rig, Scalar};

/// A free mass whose servo goes to the column `goal_m`.
fn servo(start: f64, keys: &str) -> Plant {
    plant(&format!(
        "[[body]]\nname = \"mass\"\nmotion = \"slide\"\ninertia = 2.0\nstart = {start:?}\n\
         [[actuator]]\nname = \"motor\"\ndrives = \"mass\"\ninput = \"goal_m\"\n\
         gain = {{ value = 50.0 }}\nloop = \"position\"\n{keys}\n\
         [[sensor]]\nname = \"x\"\nreads = \"mass.position\"\nsignal = \"x_m\"\n"
    ))
}

#[test]
fn a_loop_without_edges_is_a_spring_to_its_goal() {
    let bare = servo(0.1, "");
    let spring = plant(
        "[[body]]\nname = \"mass\"\nmotion = \"slide\"\ninertia = 2.0\nstart = 0.1\n\
         [[spring]]\nname = \"coil\"\nfrom = \"ground\"\nto = \"mass\"\nstiffness = 50.0\n\
         [[actuator]]\nname = \"motor\"\ndrives = \"mass\"\ninput = \"goal_m\"\ngain = 50.0\n",
    );
    let times = times(401, 0.01);
    let goal: Vec<f64> = times.iter().map(|t| 0.3 * (3.0 * t).sin()).collect();
    let ours = run(&bare, &times, &[&goal]).column(0);
    let exact = run(&spring, &times, &[&goal]).final_state;
    assert!((ours[400] - exact[0]).abs() < 1e-12, "{ours:?} {exact:?}");
}

/// Outside the band the mass swings about its edge, within it flies freely.
#[test]
fn within_its_dead_band_a_loop_lets_go() {
    let (gain, mass, band, start) = (50.0f64, 2.0, 0.02, -0.05);
    let plant = servo(start, &format!("dead_band = {{ value = {band:?} }}"));
    let times = times(601, 0.005);
    let ours = run(&plant, &times, &[&vec![0.0; times.len()]]).column(0);
    let omega = (gain / mass).sqrt();
    let (reach, quarter) = (-band - start, 0.25 * std::f64::consts::TAU / omega);
    let flight = 2.0 * band / (reach * omega);
    let exact = times.iter().map(|&t| {
        // From one turning point to the other and back.
        let half = 2.0 * quarter + flight;
        let (turns, s) = ((t / half).floor(), t % half);
        let side = if turns % 2.0 == 0.0 { -1.0 } else { 1.0 };
        let x = if s < quarter {
            band + reach * (omega * s).cos()
        } else if s < quarter + flight {
            band - reach * omega * (s - quarter)
        } else {
            -band - reach * (omega * (s - quarter - flight)).sin()
        };
        side * x
    });
    let error = distance(&ours, exact);
    assert!(error < 1e-7, "{error:e} m");
}

/// At its limit the force is constant, whatever the gain, and a goal that jumps changes its side at
/// once.
#[test]
fn at_its_limit_a_loop_gives_a_constant_force() {
    let plant = servo(0.0, "effort_limit = { value = 3.0 }");
    let times = times(51, 0.01);
    let goal: Vec<f64> = times
        .iter()
        .map(|&t| if t < 0.245 { 10.0 } else { -10.0 })
        .collect();
    let ours = run(&plant, &times, &[&goal]).column(0);
    let exact = times.iter().map(|&t| {
        let s = (t - 0.25).max(0.0);
        let forward = t.min(0.25);
        0.75 * forward * forward + 1.5 * forward * s - 0.75 * s * s
    });
    let error = distance(&ours, exact);
    assert!(error < 1e-12, "{error:e} m");
}

#[test]
fn derivatives_by_gain_band_and_limit_are_those_of_differences() {
    let plant = servo(
        -0.3,
        "dead_band = { value = 0.03 }\neffort_limit = { value = 4.0 }",
    );
    let times = times(301, 0.01);
    let goal: Vec<f64> = times.iter().map(|t| 0.4 * (2.3 * t).sin()).collect();
    let slots = plant.free_slots();
    assert_eq!(slots.len(), 3);
    let mut values: Vec<Dual<3>> = plant.values().into_iter().map(Dual::constant).collect();
    for (seed, &slot) in slots.iter().enumerate() {
        values[slot] = Dual::variable(values[slot].value, seed);
    }
    let start = plant.initial_state(&values, &[None]).unwrap();
    let drive = InputTrajectory::new(&plant, times.len(), &[&goal]).unwrap();
    let dual = plant.simulate(&values, &start, &drive, &times).unwrap();
    assert!(dual.report.kinks >= 4, "{:?}", dual.report);
    assert_eq!(dual.report.fallbacks, 0);
    for (seed, &slot) in slots.iter().enumerate() {
        let beside = |step: f64| {
            let mut values = plant.values();
            values[slot] *= 1.0 + step;
            run_with(&plant, &values, &times, &[&goal]).column(0)
        };
        let (ahead, behind) = (beside(1e-5), beside(-1e-5));
        let width = 2e-5 * plant.values()[slot];
        let slopes = ahead.iter().zip(&behind).map(|(a, b)| (a - b) / width);
        let exact: Vec<f64> = dual.signals.iter().map(|s| s.derivative[seed]).collect();
        let largest = exact.iter().fold(0.0f64, |most, d| most.max(d.abs()));
        let error = distance(&exact, slopes) / largest;
        assert!(largest > 1e-4 && error < 1e-4, "{slot}: {error:e}");
    }
}

/// Between its spring and its loop a body rests where both are in balance; within the dead band
/// the loop does not hold it, and at its limit it holds no more.
#[test]
fn a_body_rests_between_its_loop_and_its_spring() {
    let spring =
        "[[spring]]\nname = \"coil\"\nfrom = \"ground\"\nto = \"mass\"\nstiffness = 10.0\n";
    let rest = |keys: &str, goal: f64| {
        let plant = servo(0.0, &format!("{keys}\n{spring}"));
        let found = plant.rest(&plant.values(), &[goal], &[0.0, 0.0]).unwrap();
        found.state[0]
    };
    assert!((rest("", 0.6) - 0.5).abs() < 1e-12);
    assert!((rest("dead_band = 0.06", 0.6) - 0.45).abs() < 1e-12);
    assert!(rest("dead_band = 0.06", 0.05).abs() < 1e-12);
    assert!((rest("effort_limit = 2.0", 0.6) - 0.2).abs() < 1e-12);
}

/// A goal in millimetres is converted, and the gain stays a stiffness.
#[test]
fn a_goal_in_another_unit_is_converted_and_the_gain_is_a_stiffness() {
    let text = "[[body]]\nname = \"mass\"\nmotion = \"slide\"\ninertia = 2.0\n\
                [[actuator]]\nname = \"motor\"\ndrives = \"mass\"\ninput = \"goal_mm\"\n\
                unit = \"mm\"\ngain = 50.0\nloop = \"position\"\n";
    let plant = plant(text);
    let gain = &plant.parameters()[plant.slot("motor.gain").unwrap()];
    assert_eq!(gain.unit, "N/m");
    assert_eq!(plant.inputs()[0].column_factor, 1e-3);
}

#[test]
fn a_loop_that_cannot_be_is_refused_with_what_it_needs() {
    let refused = |keys: &str, drives: &str, input: &str| {
        let text = format!(
            "format = \"sinew-rig/1\"\nname = \"x\"\n[[body]]\nname = \"mass\"\nmotion = \"slide\"\n\
             inertia = 2.0\n[[tendon]]\nname = \"cord\"\npath = [{{ body = \"mass\", arm = 1.0 }}]\n\
             stiffness = 5.0\n[[actuator]]\nname = \"motor\"\ndrives = \"{drives}\"\n\
             input = \"{input}\"\ngain = 5.0\n{keys}\n"
        );
        Rig::parse(&text, "x.toml").unwrap_err().to_string()
    };
    let of = |keys: &str| refused(keys, "mass", "goal_m");
    let text = of("dead_band = 0.1");
    assert!(
        text.contains("`dead_band` of actuator `motor` without a `loop`"),
        "{text}"
    );
    let text = of("loop = \"speed\"");
    assert!(text.contains("position"), "{text}");
    let text = of("loop = \"position\"\neffort_limit = -1.0");
    assert!(text.contains("zero or more"), "{text}");
    let text = refused("loop = \"position\"", "cord", "goal_m");
    assert!(text.contains("drives no body"), "{text}");
    let text = refused("loop = \"position\"", "mass", "u_V");
    assert!(text.contains("takes m, and `u_V` is in V"), "{text}");
    let text = refused("loop = \"position\"", "mass", "goal_rad");
    assert!(text.contains("takes m, and `goal_rad` is in rad"), "{text}");
}

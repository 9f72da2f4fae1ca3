//! Derivatives of whole trajectories: against the complex step where the path is smooth, against
//! central differences where it has events, and the same path to the bit as the plain simulation.

use crate::complex::Complex;
use crate::mechanisms::{RAMP, effect, plant, times};
use sinew_sim::{Dual, InputTrajectory, Plant, Scalar, Simulated, Stepper, Trajectory};

const SEEDS: usize = 20;

/// A motor and a load on a shaft, with what the caller adds.
fn two_mass(more: &str) -> Plant {
    plant(&format!(
        "[[body]]\nname = \"motor\"\nmotion = \"hinge\"\ninertia = {{ value = 0.02 }}\n\
         start = {{ value = 0.3 }}\nstart_velocity = {{ value = -0.2 }}\n\
         [[body]]\nname = \"mass\"\nmotion = \"hinge\"\ninertia = {{ value = 0.1 }}\n\
         start = {{ value = -0.1 }}\nstart_velocity = {{ value = 0.4 }}\n\
         [[spring]]\nname = \"shaft\"\nfrom = \"motor\"\nto = \"mass\"\n\
         stiffness = {{ value = 30.0 }}\nrest = {{ value = 0.05 }}\n\
         [[damper]]\nname = \"bearing\"\nfrom = \"ground\"\nto = \"mass\"\n\
         damping = {{ value = 0.05 }}\n\
         [[gravity]]\nname = \"weight\"\nbody = \"mass\"\namplitude = {{ value = 0.8 }}\n\
         zero = {{ value = 0.2 }}\n\
         [[sensor]]\nname = \"a\"\nreads = \"motor.position\"\nsignal = \"a_rad\"\n\
         [[sensor]]\nname = \"b\"\nreads = \"mass.velocity\"\nsignal = \"b_rad_s\"\n\
         gain = {{ value = 1.1 }}\noffset = {{ value = 0.3 }}\n{RAMP}{more}"
    ))
}

fn torque(times: &[f64]) -> Vec<f64> {
    times.iter().map(|t| 1.5 * (3.0 * t).sin()).collect()
}

fn simulate<S: Simulated>(plant: &Plant, values: &[S], times: &[f64]) -> Trajectory<S> {
    let drive = InputTrajectory::new(plant, times.len(), &[&torque(times)]).unwrap();
    let start = plant.initial_state(values, &[None, None]).unwrap();
    plant.simulate(values, &start, &drive, times).unwrap()
}

/// Every free parameter seeded, the starts among them.
fn seeded(plant: &Plant) -> (Vec<usize>, Vec<Dual<SEEDS>>) {
    let slots = plant.free_slots();
    assert!(slots.len() <= SEEDS, "{}", slots.len());
    let mut values: Vec<Dual<SEEDS>> = plant.values().into_iter().map(Dual::constant).collect();
    for (seed, &slot) in slots.iter().enumerate() {
        values[slot] = Dual::variable(values[slot].value, seed);
    }
    (slots, values)
}

/// Largest difference between the derivatives of all signals by `seed` and `other`, over the
/// largest derivative.
fn relative(dual: &Trajectory<Dual<SEEDS>>, seed: usize, other: &[f64], name: &str) -> f64 {
    let exact = dual.signals.iter().map(|s| s.derivative[seed]);
    let scale = exact.clone().fold(0.0, |m: f64, d| m.max(d.abs()));
    assert!(scale > 1e-3, "nothing depends on {name}: {scale:e}");
    let difference = exact.zip(other).map(|(a, b)| (a - b).abs());
    difference.fold(0.0, f64::max) / scale
}

#[test]
fn complex_step_agrees_where_the_path_is_smooth() {
    let cubic = effect("cubic_stiffness", "shaft", &[("coefficient", 40.0)]);
    let ripple = [("amplitude", 0.1), ("wave_number", 6.0), ("phase", 0.3)];
    let ripple = effect("position_ripple", "motor", &ripple);
    let plant = two_mass(&format!("{cubic}{ripple}"));
    let times = times(301, 0.01);
    let (slots, values) = seeded(&plant);
    let dual = simulate(&plant, &values, &times);
    let mut worst = 0.0f64;
    for (seed, &slot) in slots.iter().enumerate() {
        let step = 1e-30;
        let mut values: Vec<Complex> = plant.values().into_iter().map(Complex::constant).collect();
        values[slot].im = step;
        let run = simulate(&plant, &values, &times);
        let slope: Vec<f64> = run.signals.iter().map(|s| s.im / step).collect();
        let name = &plant.parameters()[slot].name;
        let error = relative(&dual, seed, &slope, name);
        assert!(error < 1e-11, "{name}: {error:e}");
        worst = worst.max(error);
    }
    println!(
        "{} parameters, worst relative difference {worst:.1e}",
        slots.len()
    );
}

/// Both bodies stop, stick, break away and turn round, and a tendon goes slack; the time of an
/// event moves with every parameter.
fn sticking() -> Plant {
    let motor = effect("coulomb_friction", "motor", &[("level", 0.25)]);
    let stribeck = [("level", 0.3), ("static_level", 0.5), ("velocity", 0.2)];
    let load = effect("stribeck_friction", "mass", &stribeck);
    let tendon = "[[tendon]]\nname = \"line\"\npath = [{ body = \"motor\", arm = 0.2 }, \
                  { body = \"mass\", arm = -0.3 }]\nstiffness = { value = 40.0 }\n\
                  damping = 0.2\npretension = { value = 0.2 }\n";
    two_mass(&format!("{motor}{load}{tendon}"))
}

#[test]
fn central_differences_agree_through_events() {
    let plant = sticking();
    let times = times(501, 0.01);
    let (slots, values) = seeded(&plant);
    let dual = simulate(&plant, &values, &times);
    assert!(dual.report.events > 12, "{:?}", dual.report);
    assert!(dual.report.kinks > 4, "{:?}", dual.report);
    assert_eq!(dual.report.fallbacks, 0);
    let plain = plant.values();
    let mut worst = 0.0f64;
    for (seed, &slot) in slots.iter().enumerate() {
        let step = 2e-6 * (plain[slot].abs() + 0.01);
        let beside = |sign: f64| {
            let mut values = plain.clone();
            values[slot] += sign * step;
            simulate(&plant, &values, &times).signals
        };
        let (ahead, behind) = (beside(1.0), beside(-1.0));
        let slope: Vec<f64> = (ahead.iter().zip(&behind))
            .map(|(a, b)| (a - b) / (2.0 * step))
            .collect();
        let name = &plant.parameters()[slot].name;
        let error = relative(&dual, seed, &slope, name);
        assert!(error < 2e-6, "{name}: {error:e}");
        worst = worst.max(error);
    }
    println!(
        "{} parameters, {} events, worst relative difference {worst:.1e}",
        slots.len(),
        dual.report.events
    );
}

/// One reversal in closed form: m = 1, level F, pushed back by a constant force P > F. It stops at
/// t1 = v0/(P + F) after v0^2/(2 (P + F)), and returns with P - F.
#[test]
fn derivatives_through_a_reversal_are_those_of_the_closed_form() {
    let friction = effect("coulomb_friction", "mass", &[("level", 2.0)]);
    let load = effect("constant_load", "mass", &[("level", -5.0)]);
    let plant = crate::mechanisms::slide(0.0, 1.0, &format!("{friction}{load}"));
    let slot = |name: &str| plant.slot(name).unwrap();
    let mut values: Vec<Dual<3>> = plant.values().into_iter().map(Dual::constant).collect();
    let names = [
        "mass.start_velocity",
        "mass.coulomb_friction.level",
        "mass.constant_load.level",
    ];
    for (seed, name) in names.iter().enumerate() {
        values[slot(name)] = Dual::variable(values[slot(name)].value, seed);
    }
    let start = plant.initial_state(&values, &[None, None]).unwrap();
    let times = times(5, 0.1);
    let drive = InputTrajectory::new(&plant, 5, &[]).unwrap();
    let run = plant.simulate(&values, &start, &drive, &times).unwrap();
    let (v0, level, push) = (
        Dual::<3>::variable(1.0, 0),
        Dual::<3>::variable(2.0, 1),
        -Dual::<3>::variable(-5.0, 2),
    );
    let stop = v0 / (push + level);
    let back = -stop + 0.4;
    let q = v0 * stop * 0.5 - (push - level) * back * back * 0.5;
    let v = -((push - level) * back);
    for (ours, exact) in run.final_state.iter().zip([q, v]) {
        assert!((ours.value - exact.value).abs() < 1e-14);
        for seed in 0..3 {
            let (ours, exact) = (ours.derivative[seed], exact.derivative[seed]);
            assert!(
                exact.abs() > 1e-3 && (ours - exact).abs() < 1e-12,
                "{ours} {exact}"
            );
        }
    }
}

#[test]
fn derivatives_do_not_change_the_path() {
    let plant = sticking();
    let times = times(501, 0.01);
    let plain = simulate(&plant, &plant.values(), &times);
    let dual = simulate(&plant, &seeded(&plant).1, &times);
    assert_eq!(plain.report, dual.report);
    assert!(plain.report.events > 12);
    for (a, b) in plain.signals.iter().zip(&dual.signals) {
        assert_eq!(a.to_bits(), b.value.to_bits());
    }
}

/// The state after some steps by the inputs of the first, which a predictive controller asks for.
#[test]
fn derivatives_by_an_input_agree_with_differences() {
    let plant = sticking();
    let end = |u: f64| {
        let mut stepper = Stepper::new(&plant, &plant.values(), &[0.3, -0.1, -0.2, 0.4]).unwrap();
        for k in 0..40 {
            stepper
                .advance(0.01, &[if k == 0 { u } else { 0.5 }])
                .unwrap();
        }
        stepper.state()
    };
    let values: Vec<Dual<1>> = plant.values().into_iter().map(Dual::constant).collect();
    let start = [0.3, -0.1, -0.2, 0.4].map(Dual::constant);
    let mut stepper = Stepper::new(&plant, &values, &start).unwrap();
    for k in 0..40 {
        let u = if k == 0 {
            Dual::variable(1.0, 0)
        } else {
            Dual::constant(0.5)
        };
        stepper.advance(0.01, &[u]).unwrap();
    }
    let (ahead, behind) = (end(1.0 + 1e-5), end(1.0 - 1e-5));
    for (index, state) in stepper.state().iter().enumerate() {
        let slope = (ahead[index] - behind[index]) / 2e-5;
        assert!(
            slope.abs() > 1e-4,
            "state {index} does not depend on the input"
        );
        let error = (state.derivative[0] - slope).abs() / slope.abs();
        assert!(
            error < 1e-6,
            "state {index}: {} {slope}",
            state.derivative[0]
        );
    }
}

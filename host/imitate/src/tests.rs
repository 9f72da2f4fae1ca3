//! The gradient against differences, the inverse against a closed form, folding, and limits.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use sinew_sim::{Plant, Rig};

use crate::commands::inverse;
use crate::limits::Limits;
use crate::network::Network;
use crate::policy::{Memory, Policy};
use crate::rollout::Conditions;
use crate::train::rms;
use crate::view::View;

/// A mass on a spring that stiffens, so that the matrices of a period depend on the state.
const RIG: &str = "format = 'sinew-rig/1'\nname = 'mass'\n\
    [[body]]\nname = 'm'\nmotion = 'slide'\ninertia = 1.0\n\
    [[spring]]\nname = 'k'\nfrom = 'ground'\nto = 'm'\nstiffness = 40.0\n\
    [[damper]]\nname = 'd'\nfrom = 'ground'\nto = 'm'\ndamping = 1.2\n\
    [[actuator]]\nname = 'a'\ndrives = 'm'\ninput = 'u_N'\ngain = 1.0\n\
    [[sensor]]\nname = 's'\nreads = 'm.position'\nsignal = 'q_m'\n\
    [[effect]]\nkind = 'cubic_stiffness'\ncomponent = 'k'\ncoefficient = 900.0\n";

const PERIOD_S: f64 = 1.0 / 120.0;
const VIEW: View = View {
    outputs: 1,
    inputs: 1,
    past_outputs: 4,
    past_inputs: 3,
    ahead: 5,
};

fn plant(text: &str) -> Plant {
    Plant::new(&Rig::parse(text, "rig.toml").expect("a rig")).expect("a plant")
}

/// A minimum-jerk move of `length` in `steps` periods, then rest.
fn moved(length: f64, steps: usize, rows: usize) -> Vec<Vec<f64>> {
    let row = |k: usize| {
        let s = (k as f64 / steps as f64).min(1.0);
        vec![length * s * s * s * (10.0 - 15.0 * s + 6.0 * s * s)]
    };
    (0..rows).map(row).collect()
}

fn limits(rate: f64) -> Limits {
    Limits {
        lower: vec![-20.0],
        upper: vec![20.0],
        rate: vec![rate],
        safe: vec![0.0],
    }
}

/// A policy whose weights are all drawn.
fn policy(rate: f64, wanted: &[Vec<f64>]) -> Policy {
    let mut random = ChaCha8Rng::seed_from_u64(5);
    let mut network = Network::new(&[VIEW.len(), 6, 4, 1], &mut random);
    for weight in &mut network.weights {
        *weight += random.random_range(-0.1..0.1);
    }
    let commands: Vec<Vec<f64>> = wanted.iter().map(|y| vec![40.0 * y[0]]).collect();
    Policy::new(VIEW, network, limits(rate), (wanted, &commands))
}

/// Gradient of the sum of weighted outputs of a loop, and the same by central differences.
fn gradients(rate: f64) -> Vec<(f64, f64)> {
    let plant = plant(RIG);
    let (values, wanted) = (plant.values(), moved(0.15, 30, 50));
    let mut policy = policy(rate, &wanted);
    let conditions = Conditions {
        plant: &plant,
        values: &values,
        start: vec![0.0, 0.0],
        memory: Memory::resting(&VIEW, &[0.0], &[0.0]),
        outputs: &[0],
        reference: &wanted,
        steps: 40,
        period_s: PERIOD_S,
        noise: &[1e-4],
        load: vec![0.5],
        seed: 3,
    };
    let weight = |k: usize| 1.0 + (k as f64).sin();
    let tape = conditions.record(&policy).expect("it does not diverge");
    let by_y: Vec<Vec<f64>> = (0..=40).map(|k| vec![weight(k)]).collect();
    let mut gradient = vec![0.0; policy.network.weights.len()];
    tape.backward(&policy, &by_y, &mut gradient);
    let mut sum_at = |at: usize, shift: f64| {
        policy.network.weights[at] += shift;
        let course = conditions.run(&policy).expect("it does not diverge");
        policy.network.weights[at] -= shift;
        let outputs = course.y.iter().enumerate();
        outputs.map(|(k, y)| weight(k) * y[0]).sum::<f64>()
    };
    let h = 1e-5;
    let differences = |at| (sum_at(at, h) - sum_at(at, -h)) / (2.0 * h);
    let count = gradient.len();
    gradient
        .into_iter()
        .zip((0..count).map(differences))
        .collect()
}

#[test]
fn the_gradient_through_plant_and_policy_is_that_of_differences() {
    let pairs = gradients(f64::INFINITY);
    let largest = pairs.iter().map(|(g, _)| g.abs()).fold(0.0, f64::max);
    assert!(
        largest > 1e-3,
        "the gradient vanished: this point tests nothing"
    );
    for (at, (g, difference)) in pairs.iter().enumerate() {
        let error = (g - difference).abs();
        assert!(error < 1e-5 * largest, "weight {at}: {g} and {difference}");
    }
}

#[test]
fn the_gradient_knows_commands_that_their_rate_holds() {
    let (free, held) = (gradients(f64::INFINITY), gradients(0.12));
    assert!(
        free.iter()
            .zip(&held)
            .any(|(a, b)| (a.1 - b.1).abs() > 1e-3 * a.1.abs())
    );
    let largest = held.iter().map(|(g, _)| g.abs()).fold(0.0, f64::max);
    for (at, (g, difference)) in held.iter().enumerate() {
        let error = (g - difference).abs();
        assert!(error < 1e-4 * largest, "weight {at}: {g} and {difference}");
    }
}

#[test]
fn commands_of_a_motion_are_those_of_the_equation_of_motion() {
    let text = RIG.replace("coefficient = 900.0", "coefficient = 0.0");
    let plant = plant(&text);
    let wanted = moved(0.1, 120, 160);
    let limits = limits(f64::INFINITY);
    let found = inverse(
        &plant,
        &plant.values(),
        &[0.0, 0.0],
        &[0],
        &wanted,
        &[1e-7],
        &limits,
        PERIOD_S,
    )
    .expect("it does not diverge");
    assert!(rms(&found.y, &wanted) < 1e-6, "{}", rms(&found.y, &wanted));
    // m a + d v + k q in the middle of each period, whose command is held.
    for (k, u) in found.u.iter().enumerate().skip(10).take(100) {
        let t = (k as f64 + 0.5) / 120.0;
        let q = 0.1 * t.powi(3) * (10.0 - 15.0 * t + 6.0 * t * t);
        let v = 0.1 * t * t * (30.0 - 60.0 * t + 30.0 * t * t);
        let a = 0.1 * t * (60.0 - 180.0 * t + 120.0 * t * t);
        let expected = a + 1.2 * v + 40.0 * q;
        assert!(
            (u[0] - expected).abs() < 0.01,
            "{k}: {} and {expected}",
            u[0]
        );
    }
}

#[test]
fn commands_of_a_motion_keep_their_limits() {
    let plant = plant(RIG);
    let wanted = moved(0.15, 20, 60);
    let limits = limits(0.4);
    let found = inverse(
        &plant,
        &plant.values(),
        &[0.0, 0.0],
        &[0],
        &wanted,
        &[1e-5],
        &limits,
        PERIOD_S,
    )
    .expect("it does not diverge");
    let mut before = 0.0;
    let mut fastest = 0.0_f64;
    for u in &found.u {
        fastest = fastest.max((u[0] - before).abs());
        before = u[0];
    }
    assert!((0.399..=0.4 + 1e-12).contains(&fastest), "{fastest}");
}

#[test]
fn a_folded_network_takes_raw_numbers_and_gives_changes_in_si() {
    let wanted = moved(0.15, 30, 50);
    let policy = policy(3.0, &wanted);
    let folded = policy.folded();
    let mut random = ChaCha8Rng::seed_from_u64(8);
    let raw: Vec<f64> = (0..VIEW.len())
        .map(|_| random.random_range(-0.1..0.1))
        .collect();
    let (mut kept, mut change) = (Vec::new(), vec![0.0]);
    folded.forward(&raw, &mut kept, &mut change);
    let asked = raw[VIEW.input(1, 0)] + change[0];
    let expected = policy.commands(&raw)[0];
    assert!(
        (expected - raw[VIEW.input(1, 0)]).abs() < 3.0,
        "the rate holds it: nothing is tested"
    );
    assert!((asked - expected).abs() < 1e-9, "{asked} and {expected}");
}

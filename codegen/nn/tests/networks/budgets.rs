//! Budgets of the networks of the reference problem on a Cortex-M4F: numbers that a person chose.
//! The best peer takes 1,343, 15,351 and 1,494 instructions forward.

use sinew_nn::{Op, store};
use std::path::Path;

use sinew_nn::emit::{Accuracy, Options};

use super::bench::Case;
use super::judge::Errors;
use super::random;

/// Name, instructions of `predict`, and of `predict_with_jacobian` relative to these. The goal of
/// the latter is 2.5, which P misses by 0.1 where more than six of its eight units are open.
const BUDGETS: [(&str, u64, f64); 7] = [
    ("reference-s", 700, 2.5),
    ("reference-l", 6_500, 2.5),
    ("reference-p", 750, 2.5),
    ("reference-p-4-open", 750, 2.1),
    ("reference-p-6-open", 750, 2.5),
    ("reference-p-7-open", 750, 2.6),
    ("reference-p-8-open", 750, 2.6),
];

/// Open units of P in the cases of these names.
const OPEN: [usize; 4] = [4, 6, 7, 8];

/// The network S with every tanh that a tolerance may choose; the quick one is among the budgets.
const TOLERANCES: [(&str, Accuracy); 5] = [
    ("reference-s-precise", Accuracy::Precise),
    ("reference-s", Accuracy::Quick),
    ("reference-s-coarse", Accuracy::Coarse),
    ("reference-s-rough", Accuracy::Rough),
    ("reference-s-rougher", Accuracy::Rougher),
];

/// The networks of the reference problem, written by a test of `sinew-model`.
pub fn cases() -> Vec<Case> {
    let network = |name: &str| {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/reference");
        store::load(&folder.join(format!("reference-{name}"))).expect("the folder is committed")
    };
    let exact = ["s", "l", "p"].map(|name| random::case(network(name), Options::default()));
    let others = TOLERANCES
        .into_iter()
        .filter(|(_, accuracy)| *accuracy != Accuracy::default());
    let others = others.map(|(name, accuracy)| {
        let mut network = network("s");
        network.name = name.into();
        let options = Options {
            accuracy,
            ..Options::default()
        };
        random::case(network, options)
    });
    let open = OPEN.map(|count| {
        let mut case = random::case(network("p").folded(), Options::default());
        leave_open(&mut case, count);
        case
    });
    exact.into_iter().chain(others).chain(open).collect()
}

/// Moves the biases of the first layer so that its rectifier leaves this many units open at the
/// first input, which is the one that is measured.
fn leave_open(case: &mut Case, count: usize) {
    let dense = case
        .network
        .nodes
        .iter_mut()
        .find_map(|node| match &mut node.op {
            Op::Dense(dense) => Some(dense),
            _ => None,
        });
    let dense = dense.expect("the network has layers");
    let (x, units) = (&case.inputs[0], dense.bias.len());
    for (h, (bias, row)) in dense
        .bias
        .iter_mut()
        .zip(dense.weights.chunks(x.len()))
        .enumerate()
    {
        let sum: f32 = row.iter().zip(x).map(|(w, x)| w * x).sum();
        // Five and eight have no common divisor: these are `count` units, and not the first ones.
        let level = if 5 * h % units < count { 0.5 } else { -0.5 };
        *bias = level - sum;
    }
    // What another program computed is of the biases as they were.
    case.network.golden.clear();
    case.network.name += &format!("-{count}-open");
}

/// Holds what QEMU counted against the budgets; nothing where there is no QEMU.
pub fn judge(errors: &[Errors]) {
    for (name, most, ratio) in BUDGETS {
        let one = errors
            .iter()
            .find(|one| one.name == name)
            .expect("the network is among the cases");
        let (Some((predict, _)), Some((jacobian, _))) =
            (one.said.cost.get("predict"), one.said.cost.get("jacobian"))
        else {
            continue;
        };
        println!("{name}: {predict} instructions, {jacobian} with derivatives");
        assert!(
            *predict <= most,
            "{name}: {predict} instructions, the budget is {most}"
        );
        let found = *jacobian as f64 / *predict as f64;
        assert!(
            found <= ratio,
            "{name}: derivatives take {found:.2} times a prediction, the budget is {ratio}"
        );
    }
    tolerances(errors);
}

/// A looser tolerance takes fewer instructions and moves the outputs more; the precise tanh's
/// instructions depend on its argument.
fn tolerances(errors: &[Errors]) {
    let mut before: Option<(u64, f64)> = None;
    for (name, accuracy) in TOLERANCES {
        let one = errors
            .iter()
            .find(|one| one.name == name)
            .expect("the network is among the cases");
        let instructions = |call: &str| one.said.cost.get(call).map_or(0, |cost| cost.0);
        let (predict, jacobian) = (instructions("predict"), instructions("jacobian"));
        println!(
            "tanh within {:e}: {predict} instructions, {jacobian} with derivatives; {:.1e} off, {:.1e} of derivatives",
            accuracy.error(),
            one.output,
            one.jacobian
        );
        if let Some((instructions, error)) = before {
            assert!(
                one.output > error,
                "{name}: {:e} after {error:e}",
                one.output
            );
            assert!(
                predict < instructions || accuracy == Accuracy::Quick || predict == 0,
                "{name}: {predict} after {instructions}"
            );
        }
        before = Some((predict, one.output));
    }
}

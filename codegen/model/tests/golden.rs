//! The evaluator against the double precision of another program, and its Jacobian against
//! differences of itself.

mod support;

use std::path::Path;

use sinew_model::evaluate;
use sinew_model::spec::{Activation, ModelSpec, OutputForm, gru_cell, lstm_cell};
use sinew_model::to_network;

fn wide(x: &[f32]) -> Vec<f64> {
    x.iter().copied().map(f64::from).collect()
}

#[test]
fn outputs_are_those_of_the_program_that_trained_the_network() {
    for name in ["S", "L", "P"] {
        let spec = support::reference(name);
        assert_eq!(spec.golden.len(), 8, "{name}");
        let mut worst = 0.0_f64;
        for golden in &spec.golden {
            let y = evaluate::predict(&spec, &wide(&golden.x));
            assert!(
                y.iter().any(|y| y.abs() > 1e-2),
                "{name}: this point tests nothing"
            );
            for (y, expected) in y.iter().zip(&golden.y) {
                worst = worst.max((y - expected).abs());
            }
        }
        assert!(worst < 1e-6, "{name}: largest difference {worst:e}");
    }
}

#[test]
fn the_jacobian_is_the_derivative() {
    let deep = |name, form| {
        let layers = [
            (5, Activation::Tanh),
            (4, Activation::Relu),
            (2, Activation::Tanh),
        ];
        support::network(name, form, 1, &layers)
    };
    let single = [(2, Activation::Tanh)];
    for spec in [
        support::reference("S"),
        support::reference("L"),
        support::reference("P"),
        support::tiny(),
        support::with_shortcut(),
        deep("deep", OutputForm::Absolute),
        deep("deep-increment", OutputForm::Increment),
        support::network("single", OutputForm::Increment, 0, &single),
        support::recurrent("gru", gru_cell(), 3, 1, &[(2, Activation::Linear)]),
        support::recurrent("lstm", lstm_cell(), 2, 0, &[(2, Activation::Linear)]),
    ] {
        let name = &spec.name;
        for point in points(&spec) {
            let evaluation = evaluate::predict_with_jacobian(&spec, &point);
            assert_eq!(evaluation.y, evaluate::predict(&spec, &point), "{name}");
            let largest = evaluation
                .jacobian
                .iter()
                .flatten()
                .fold(0.0_f64, |m, d| m.max(d.abs()));
            assert!(
                largest > 1e-3,
                "{name}: gradient vanished, this point tests nothing"
            );
            let rows = evaluation.jacobian.iter();
            let rows: Vec<_> = rows.chain(&evaluation.hidden_state_jacobian).collect();
            for column in 0..point.len() {
                let difference = central_difference(&spec, &point, column);
                assert_eq!(rows.len(), difference.len());
                for (row, expected) in rows.iter().zip(difference) {
                    let error = (row[column] - expected).abs();
                    assert!(
                        error < 1e-7 * (1.0 + largest),
                        "{name}, column {column}: {error:e}"
                    );
                }
            }
        }
    }
}

/// The golden inputs, or three points away from the kinks of a rectifier.
fn points(spec: &ModelSpec) -> Vec<Vec<f64>> {
    if !spec.golden.is_empty() {
        return spec.golden.iter().map(|golden| wide(&golden.x)).collect();
    }
    let point = |k: usize| {
        let x = (0..spec.point_len()).map(|i| ((7 * i + 5 * k + 3) % 11) as f64 / 6.0 - 0.8);
        x.collect()
    };
    (0..3).map(point).collect()
}

/// `(f(x + h) - f(x - h)) / 2h` with h the cube root of the type's epsilon.
fn central_difference(spec: &ModelSpec, x: &[f64], column: usize) -> Vec<f64> {
    let h = 6e-6;
    let at = |step: f64| {
        let mut x = x.to_vec();
        x[column] += step;
        let (y, memory) = evaluate::advance(spec, &x);
        [y, memory].concat()
    };
    let pairs = at(h).into_iter().zip(at(-h));
    pairs
        .map(|(above, below)| (above - below) / (2.0 * h))
        .collect()
}

/// The tests of `sinew-nn` read the networks of the reference problem from its own folder.
#[test]
fn the_committed_reference_networks_are_those_of_the_models() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../nn/tests/reference");
    for name in ["S", "L", "P"] {
        let network = to_network::network(&support::reference(name)).unwrap();
        let folder = folder.join(&network.name);
        if std::env::var("SINEW_SNAPSHOTS").is_ok_and(|mode| mode == "bless") {
            sinew_nn::store::save(&folder, &network).unwrap();
        }
        for (file, contents) in sinew_nn::store::print(&network).unwrap() {
            let committed = std::fs::read(folder.join(file)).expect("each network is committed");
            assert!(committed == contents, "{name}: {file} is another");
        }
    }
}

#[test]
fn a_network_behind_a_soft_sensor_is_one_without_channels() {
    let spec = support::sensed("sensed", support::reference("S"));
    let network = to_network::network(&spec).unwrap();
    let plain = to_network::network(&support::reference("S")).unwrap();
    assert_eq!(network.inputs(), plain.inputs());
    let x: Vec<f64> = (0..plain.inputs()).map(|i| 0.1 * i as f64).collect();
    let of = |network| sinew_nn::evaluate::run(network, &x);
    assert_eq!(of(&network), of(&plain));
}

/// A model as the network of `sinew size` and `--c-abi`: scaling inside, its hidden state the
/// network's state.
#[test]
fn a_model_that_remembers_is_a_network_with_state() {
    for (name, cell) in [("gru", gru_cell()), ("lstm", lstm_cell())] {
        let mut spec = support::recurrent(name, cell, 3, 1, &[(2, Activation::Linear)]);
        spec.inputs[0].span = 4.0;
        spec.outputs[1].offset = -2.0;
        spec.outputs[1].span = 0.5;
        let network = to_network::network(&spec).unwrap();
        assert_eq!(network.state(), spec.hidden_state_len());
        let (mut state, mut memory) = (
            vec![0.0; spec.hidden_state_len()],
            vec![0.0; spec.hidden_state_len()],
        );
        for k in 0..4 {
            let x: Vec<f64> = (0..7)
                .map(|i| ((5 * i + 3 * k) % 7) as f64 / 4.0 - 0.8)
                .collect();
            let mut physical = x.clone();
            physical[0] *= 4.0;
            physical[2] *= 4.0;
            physical[5] = 0.5 * physical[5] - 2.0;
            let call = sinew_nn::evaluate::call(&network, &physical, &state);
            let (y, next) = evaluate::advance(&spec, &[x, memory].concat());
            let expected = [y[0], 0.5 * y[1] - 2.0];
            for (found, expected) in call.y.iter().zip(expected) {
                assert!(
                    (found - expected).abs() < 1e-6,
                    "{name}: {found} for {expected}"
                );
            }
            (state, memory) = (call.state, next);
        }
        assert!(
            memory.iter().any(|h| h.abs() > 0.05),
            "{name} remembers nothing"
        );
    }
}

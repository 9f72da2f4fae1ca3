//! Models that several tests use.
#![allow(dead_code)] // each test program uses some of them

use std::path::{Path, PathBuf};

use sinew_model::reference;
use sinew_model::spec::{
    Activation, ControlSpec, Dense, Golden, Layer, ModelSpec, OutputForm, Parameter, Signal,
    SoftSensorSpec, State, StateSpec, ValueSpec, WatchSpec, unfilled,
};
use sinew_nn::{Cell, Recurrent};

/// The directory of committed models.
pub fn models() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models")
}

/// The reference network S, L or P with the reference problem.
pub fn reference(name: &str) -> ModelSpec {
    let read = |file: &str| std::fs::read_to_string(models().join("reference").join(file)).unwrap();
    let network = read(&format!("{name}.json"));
    reference::import(&network, &read("problem.json"), 10, &[2, 2, 3, 3]).unwrap()
}

/// A model small enough to be read whole: one input, one output, one channel, 3 -> 2 -> 1.
pub fn tiny() -> ModelSpec {
    ModelSpec {
        name: "tiny".into(),
        period_s: 0.01,
        inputs: vec![signal("u_V", "V", 12.0, 0.0)],
        outputs: vec![signal("q_m", "m", 0.05, 0.1)],
        channels: vec![signal("tension_N", "N", 40.0, 5.0)],
        past_inputs: 1,
        past_outputs: 1,
        form: OutputForm::Increment,
        skip: None,
        layers: vec![
            dense(3, 2, Activation::Tanh, 0.4),
            dense(2, 1, Activation::Linear, 0.25),
        ],
        control: control(1, 1),
        state: None,
        soft_sensor: None,
        golden: vec![],
    }
}

/// [`tiny`] with a linear path beside its network.
pub fn with_shortcut() -> ModelSpec {
    ModelSpec {
        name: "shortcut".into(),
        skip: Some(vec![0.375, -0.125, 0.0625]),
        ..tiny()
    }
}

/// `spec` behind a soft sensor of three channels.
pub fn sensed(name: &str, spec: ModelSpec) -> ModelSpec {
    let n_y = spec.outputs.len();
    let weights = |n: usize, size: f32| -> Vec<f32> {
        (0..n * n_y)
            .map(|i| size * f64::from(3 * i as u32 + 1).sin() as f32)
            .collect()
    };
    ModelSpec {
        name: name.into(),
        channels: (1..=3)
            .map(|i| signal(&format!("light_{i}"), "1", 0.25 * f64::from(i), 0.5))
            .collect(),
        soft_sensor: Some(SoftSensorSpec {
            error: vec![1e-3; n_y],
            bias: weights(1, 0.125),
            linear: weights(3, 0.5),
            quadratic: weights(6, 0.25),
            watch: None,
        }),
        ..spec
    }
}

/// `spec` behind a soft sensor of five channels that are watched; the others say a part of each.
pub fn watched(name: &str, spec: ModelSpec) -> ModelSpec {
    let n_y = spec.outputs.len();
    let mut sensed = sensed(name, spec);
    let channel = |i: u32| signal(&format!("light_{i}"), "1", 0.25 * f64::from(i), 0.5);
    sensed.channels = (1..=5).map(channel).collect();
    let weights = |n: usize, size: f32| -> Vec<f32> {
        (0..n)
            .map(|i| size * f64::from(3 * i as u32 + 1).sin() as f32)
            .collect()
    };
    let sensor = sensed.soft_sensor.as_mut().unwrap();
    sensor.linear = weights(5 * n_y, 0.5);
    sensor.quadratic = weights(15 * n_y, 0.25);
    sensor.watch = Some(WatchSpec {
        bias: weights(5, 0.01),
        weights: (0..25)
            .map(|i| if i % 6 == 0 { 0.0 } else { 0.25 })
            .collect(),
        spread: vec![0.02; 5],
    });
    sensed
}

/// Network S at a horizon of two, with a cost-to-go.
pub fn with_value() -> ModelSpec {
    let mut spec = reference("S");
    spec.name = "with-value".into();
    spec.control.horizon = 2;
    spec.control.control_horizon = 2;
    spec.control.move_blocks = vec![2];
    spec.control.value = Some(ValueSpec {
        rows: 2,
        ahead: 3,
        points: vec![vec![-0.2, -0.1, -0.1], vec![0.3, 0.2, 0.2]],
    });
    spec
}

/// A model with two states and a parameter; its output and its channel are measured.
pub fn with_state() -> ModelSpec {
    let state = |name: &str| State {
        signal: signal(name, "SI", 2.0, 0.5),
        rest: -0.25,
        rest_deviation: 0.01,
        deviation: 1.0,
        noise: 1e-3,
    };
    ModelSpec {
        name: "state".into(),
        form: OutputForm::State,
        skip: Some((1..=8).map(|i| 0.0625 * i as f32).collect()),
        layers: vec![
            dense(4, 3, Activation::Tanh, 0.4),
            dense(3, 2, Activation::Linear, 0.25),
        ],
        state: Some(StateSpec {
            states: vec![state("mass.position"), state("mass.velocity")],
            parameters: vec![Parameter {
                name: "mass.inertia".into(),
                value: 1.5,
                spread: 0.15,
                noise: 0.02,
                lower: -2.5,
                upper: 2.5,
            }],
            measurement: Dense::from_rows(
                &[vec![0.5, 0.25], vec![-0.5, 0.125]],
                vec![0.5, -1.0],
                Activation::Linear,
            )
            .unwrap(),
            measurement_noise: vec![1e-3, 2e-3],
            disturbance_deviation: 0.01,
            gate: 6.0,
        }),
        ..tiny()
    }
}

/// A model of the given layers with 2 inputs, 2 outputs and the given number of channels; two
/// values of each input, one of each output.
pub fn network(
    name: &str,
    form: OutputForm,
    channels: usize,
    widths: &[(usize, Activation)],
) -> ModelSpec {
    let mut inputs = 6 + channels;
    let mut layers = Vec::new();
    for (place, &(outputs, activation)) in widths.iter().enumerate() {
        layers.push(dense(inputs, outputs, activation, 0.6 + 0.1 * place as f32));
        inputs = outputs;
    }
    ModelSpec {
        name: name.into(),
        period_s: 0.002,
        inputs: (1..=2)
            .map(|i| signal(&format!("u{i}"), "1", 1.0, 0.0))
            .collect(),
        outputs: (1..=2)
            .map(|i| signal(&format!("y{i}"), "1", 1.0, 0.0))
            .collect(),
        channels: (1..=channels)
            .map(|i| signal(&format!("s{i}"), "1", 1.0, 0.0))
            .collect(),
        past_inputs: 2,
        past_outputs: 1,
        form,
        skip: None,
        layers,
        control: control(2, 2),
        state: None,
        soft_sensor: None,
        golden: vec![],
    }
}

pub fn signal(name: &str, unit: &str, span: f64, offset: f64) -> Signal {
    Signal {
        name: name.into(),
        unit: unit.into(),
        span,
        offset,
    }
}

/// A layer whose weights are spread over +-`size` without a pattern that could hide a swapped
/// index.
pub fn dense(inputs: usize, outputs: usize, activation: Activation, size: f32) -> Layer {
    let mut state = (inputs * 31 + outputs) as u32;
    let mut next = || {
        state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        // Three decimals, so that snapshots can be read.
        ((state >> 8) as f32 / 16_777_216.0 * 2000.0 - 1000.0).round() / 1000.0 * size
    };
    Layer::Dense(Dense {
        inputs,
        outputs,
        weights: (0..inputs * outputs).map(|_| next()).collect(),
        bias: (0..outputs).map(|_| next()).collect(),
        activation,
    })
}

/// A model as [`network`], with a recurrent layer of `units` before the dense ones.
pub fn recurrent(
    name: &str,
    cell: Cell,
    units: usize,
    channels: usize,
    widths: &[(usize, Activation)],
) -> ModelSpec {
    let mut spec = network(
        name,
        OutputForm::Increment,
        channels,
        &[(units, Activation::Tanh)],
    );
    let inputs = spec.regressor_len();
    let gates = cell.gates();
    // The weights of wide dense layers, without their pattern.
    let values =
        |rows: usize, columns: usize, size: f32| match dense(columns, rows, Activation::Tanh, size)
        {
            Layer::Dense(dense) => dense.weights,
            Layer::Recurrent(_) => unreachable!("it is dense"),
        };
    spec.layers = vec![Layer::Recurrent(Recurrent {
        kernel: values(gates * units, inputs, 0.9),
        recurrent: values(gates * units, units, 0.7),
        bias: values(gates * units, 1, 0.3),
        inner_bias: match cell {
            Cell::Gru { .. } => values(units, 1, 0.2),
            _ => vec![],
        },
        ..unfilled(cell, units)
    })];
    let mut inputs = units;
    for &(outputs, activation) in widths {
        spec.layers.push(dense(inputs, outputs, activation, 0.8));
        inputs = outputs;
    }
    spec.skip = Some(values(2, spec.regressor_len(), 0.3));
    spec
}

pub fn control(inputs: usize, outputs: usize) -> ControlSpec {
    ControlSpec {
        horizon: 10,
        control_horizon: 3,
        move_blocks: vec![],
        first_step: 1,
        tracking_weight: vec![1.0; outputs],
        move_suppression: vec![0.1; inputs],
        command_weight: 0.0,
        budget: None,
        observer_gain: 1.0,
        lower: vec![-10.0; inputs],
        upper: vec![10.0; inputs],
        rate_limit: vec![f64::INFINITY; inputs],
        safe: vec![0.0; inputs],
        disturbance_gain: 0.2,
        iterations: 2,
        max_missing_samples: 12,
        value: None,
    }
}

pub fn golden(x: &[f32], y: &[f64]) -> Golden {
    Golden {
        x: x.to_vec(),
        y: y.to_vec(),
    }
}

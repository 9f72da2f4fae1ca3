//! The controller's model as a network: regressor in, next output out, both in physical units.

use sinew_nn::{Activation, Dense, Golden, Network, NetworkError, Op};

use crate::spec::{self, Layer, ModelSpec, OutputForm};

/// The network of a model, in physical units.
///
/// ```no_run
/// use sinew_model::{store, to_network};
///
/// let model = store::load("models/reference-s".as_ref())?;
/// let network = to_network::network(&model)?;
/// assert_eq!(network.inputs(), model.regressor_len());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// Its scaling is inside: `x` is the regressor of docs/reference/model-files.md, eq. 1, in physical
/// units, and `y` the next output in its own.
///
/// # Errors
/// [`NetworkError`] if the model is not valid.
pub fn network(spec: &ModelSpec) -> Result<Network, NetworkError> {
    spec.validate()
        .map_err(|error| NetworkError::caused("model.toml", error))?;
    let mut network = Network::new(&spec.name, "regressor", vec![spec.regressor_len()]);
    // Every signal as often as the regressor has it: (gain, offset) from physical to model units.
    let scaled = |signals: &[spec::Signal]| -> Vec<(f64, f64)> {
        let scale = |s: &spec::Signal| (1.0 / s.span, -s.offset / s.span);
        signals.iter().map(scale).collect()
    };
    let inputs = [
        scaled(&spec.inputs).repeat(spec.past_inputs),
        scaled(&spec.outputs).repeat(spec.past_outputs),
        scaled(spec.seen_channels()),
    ]
    .concat();
    let scale = Op::Scale {
        gain: inputs.iter().map(|(gain, _)| *gain as f32).collect(),
        offset: inputs.iter().map(|(_, offset)| *offset as f32).collect(),
    };
    let scaling = network.push("scaling", scale, vec![0])?;
    let last = layers(spec, &mut network, scaling)?;
    let physical = Op::Scale {
        gain: spec.outputs.iter().map(|s| s.span as f32).collect(),
        offset: spec.outputs.iter().map(|s| s.offset as f32).collect(),
    };
    network.push("physical units", physical, vec![last])?;
    if spec.hidden_state_len() == 0 {
        // Vectors of a recurrent network begin at rest; those of a model begin anywhere.
        network.golden = golden(spec, &inputs);
    }
    Ok(network)
}

/// As [`network`], in model units.
///
/// # Errors
/// [`NetworkError`] if a layer does not fit.
pub fn unscaled(spec: &ModelSpec) -> Result<Network, NetworkError> {
    let mut network = Network::new(&spec.name, "regressor", vec![spec.regressor_len()]);
    layers(spec, &mut network, 0)?;
    Ok(network)
}

/// The layers of a model behind `scaled`, its regressor in model units; the node of the result.
fn layers(spec: &ModelSpec, network: &mut Network, scaled: usize) -> Result<usize, NetworkError> {
    let mut last = scaled;
    for (index, layer) in spec.layers.iter().enumerate() {
        let dense = match layer {
            Layer::Dense(dense) => dense,
            Layer::Recurrent(layer) => {
                let step = Op::Reshape(vec![1, layer.inputs()]);
                let sequence = network.push("step", step, vec![last])?;
                let op = Op::Recurrent(layer.clone());
                last = network.push("recurrent", op, vec![sequence])?;
                continue;
            }
        };
        let op = Op::Dense(Dense {
            weights: dense.weights.clone(),
            bias: dense.bias.clone(),
        });
        last = network.push(&format!("dense {}", index + 1), op, vec![last])?;
        let g = match dense.activation {
            spec::Activation::Linear => continue,
            spec::Activation::Tanh => Activation::Tanh,
            spec::Activation::Relu => Activation::Relu,
        };
        last = network.push(
            &format!("activation {}", index + 1),
            Op::Activation(g),
            vec![last],
        )?;
    }
    if let Some(weights) = skip(spec) {
        let bias = vec![0.0; spec.outputs.len()];
        let skip = network.push("skip", Op::Dense(Dense { weights, bias }), vec![scaled])?;
        last = network.push("sum", Op::Add, vec![last, skip])?;
    }
    Ok(last)
}

/// The skip connection of eq. 4 with, for an increment, the present output in it.
fn skip(spec: &ModelSpec) -> Option<Vec<f32>> {
    let length = spec.regressor_len();
    let mut weights = spec.skip.clone();
    if spec.form == OutputForm::Increment {
        let weights = weights.get_or_insert_with(|| vec![0.0; spec.outputs.len() * length]);
        let present = spec.past_inputs * spec.inputs.len();
        for output in 0..spec.outputs.len() {
            weights[output * length + present + output] += 1.0;
        }
    }
    weights
}

/// The model's vectors in physical units.
fn golden(spec: &ModelSpec, inputs: &[(f64, f64)]) -> Vec<Golden> {
    let vector = |golden: &spec::Golden| {
        let x = golden.x.iter().zip(inputs);
        let y = golden.y.iter().zip(&spec.outputs);
        Golden {
            x: x.map(|(&x, (gain, offset))| ((f64::from(x) - offset) / gain) as f32)
                .collect(),
            y: y.map(|(y, s)| y * s.span + s.offset).collect(),
        }
    };
    spec.golden.iter().map(vector).collect()
}

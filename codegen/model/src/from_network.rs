//! A network of another tool as the controller's predictor: the inverse of
//! [`to_network`](mod@crate::to_network).

use sinew_nn::{Activation, Dense, Network, NetworkError, Op};

use crate::spec::{self, Layer};

/// Supported networks, for the message of a refused layer.
const NEAREST: &str =
    "the controller takes a chain of dense layers with tanh, relu or no activation";

/// The layers of a model whose signals are scaled, from a network in physical units. `inputs` and
/// `outputs` are (span, offset) of every value of the regressor and of every output; an increment's
/// offset is nought. Scaling inside the network, such as a normalisation, and that of the signals
/// go into the weights, combined in double precision.
///
/// # Errors
/// Another number of inputs or outputs, or a layer that is not in [`spec::Layer`].
pub fn layers(
    network: &Network,
    inputs: &[(f64, f64)],
    outputs: &[(f64, f64)],
) -> Result<Vec<Layer>, NetworkError> {
    for (what, has, wants) in [
        ("input", network.inputs(), inputs.len()),
        ("output", network.outputs(), outputs.len()),
    ] {
        if has != wants {
            return Err(NetworkError::malformed(
                network.name.as_str(),
                format!(
                    "the network has {has} {what}s, the rig's regressor and outputs want {wants}"
                ),
            ));
        }
    }
    chain(&scaled(network, inputs, outputs)?.folded())
}

/// The network between scales from and to model units.
fn scaled(
    network: &Network,
    inputs: &[(f64, f64)],
    outputs: &[(f64, f64)],
) -> Result<Network, NetworkError> {
    let narrow = |values: &mut dyn Iterator<Item = f64>| values.map(|v| v as f32).collect();
    let mut whole = Network::new(&network.name, "regressor", vec![inputs.len()]);
    let to_physical = Op::Scale {
        gain: narrow(&mut inputs.iter().map(|(span, _)| *span)),
        offset: narrow(&mut inputs.iter().map(|(_, offset)| *offset)),
    };
    let mut input = whole.push("signals", to_physical, vec![0])?;
    if let Some(first) = network.nodes.first()
        && first.shape != [inputs.len()]
    {
        input = whole.push(&first.name, Op::Reshape(first.shape.clone()), vec![input])?;
    }
    let mut places = vec![input];
    for node in network.nodes.iter().skip(1) {
        let from = node.from.iter().map(|from| places[*from]).collect();
        places.push(whole.push(&node.name, node.op.clone(), from)?);
    }
    let mut last = places.last().copied().unwrap_or(input);
    if whole.nodes[last].shape != [outputs.len()] {
        last = whole.push("outputs", Op::Reshape(vec![outputs.len()]), vec![last])?;
    }
    let to_model = Op::Scale {
        gain: narrow(&mut outputs.iter().map(|(span, _)| 1.0 / span)),
        offset: narrow(&mut outputs.iter().map(|(span, offset)| -offset / span)),
    };
    whole.push("model units", to_model, vec![last])?;
    Ok(whole)
}

/// Layer by layer, each with the activation that follows it.
fn chain(network: &Network) -> Result<Vec<Layer>, NetworkError> {
    let mut layers: Vec<spec::Dense> = Vec::new();
    let mut closed = true;
    // Each reads the one before it: what nobody reads is gone, and what reads two, a sum or values
    // side by side, is refused.
    for node in network.nodes.iter().skip(1) {
        let refused = |what: &str| Err(NetworkError::unsupported(&node.name, what, NEAREST));
        match &node.op {
            Op::Dense(Dense { weights, bias }) => {
                layers.push(spec::Dense {
                    inputs: weights.len() / bias.len().max(1),
                    outputs: bias.len(),
                    weights: weights.clone(),
                    bias: bias.clone(),
                    activation: spec::Activation::Linear,
                });
                closed = false;
            }
            Op::Activation(g) => {
                let known = match g {
                    Activation::Linear => continue,
                    Activation::Tanh => spec::Activation::Tanh,
                    Activation::Relu => spec::Activation::Relu,
                    _ => return refused("this activation"),
                };
                match layers.last_mut() {
                    Some(layer) if !closed => layer.activation = known,
                    _ => return refused("an activation that follows no dense layer"),
                }
                closed = true;
            }
            // Behind an activation it cannot go into the weights before it.
            Op::Scale { gain, offset } => {
                let mut weights = vec![0.0; gain.len() * gain.len()];
                for (i, gain) in gain.iter().enumerate() {
                    weights[i * offset.len() + i] = *gain;
                }
                layers.push(spec::Dense {
                    inputs: gain.len(),
                    outputs: gain.len(),
                    weights,
                    bias: offset.clone(),
                    activation: spec::Activation::Linear,
                });
                closed = false;
            }
            Op::Reshape(_) => {}
            other => return refused(other.kind()),
        }
    }
    Ok(layers.into_iter().map(Layer::Dense).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use sinew_nn::evaluate;

    fn dense(rows: &[&[f32]], bias: &[f32]) -> Op {
        Op::Dense(Dense {
            weights: rows.concat(),
            bias: bias.to_vec(),
        })
    }

    /// Output of the layers in physical units.
    fn predicted(layers: &[Layer], scales: [&[(f64, f64)]; 2], x: &[f64]) -> Vec<f64> {
        let each = x.iter().zip(scales[0]);
        let mut a: Vec<f64> = each
            .map(|(x, (span, offset))| (x - offset) / span)
            .collect();
        for layer in layers {
            let Layer::Dense(layer) = layer else { continue };
            let rows = layer.rows().zip(&layer.bias);
            let sums = rows.map(|(row, b)| {
                let products = row.iter().zip(&a).map(|(w, a)| f64::from(*w) * a);
                f64::from(*b) + products.sum::<f64>()
            });
            a = sums
                .map(|z| match layer.activation {
                    spec::Activation::Linear => z,
                    spec::Activation::Tanh => z.tanh(),
                    spec::Activation::Relu => z.max(0.0),
                })
                .collect();
        }
        let each = a.iter().zip(scales[1]);
        each.map(|(a, (span, offset))| a * span + offset).collect()
    }

    /// Normalised inside, two hidden layers; its last activation is `last`.
    fn foreign(last: Activation) -> Network {
        let mut network = Network::new("theirs", "x", vec![1, 3]);
        let flat = network.push("flat", Op::Reshape(vec![3]), vec![0]).unwrap();
        let normal = Op::Scale {
            gain: vec![2.0, 0.5, 10.0],
            offset: vec![0.1, -0.2, 0.0],
        };
        let normal = network.push("normal", normal, vec![flat]).unwrap();
        let first = dense(&[&[0.3, -0.7, 0.2], &[0.5, 0.1, -0.4]], &[0.1, -0.3]);
        let first = network.push("first", first, vec![normal]).unwrap();
        let tanh = Op::Activation(Activation::Tanh);
        let tanh = network.push("tanh", tanh, vec![first]).unwrap();
        let second = dense(&[&[1.5, -0.8], &[0.2, 0.9]], &[0.05, 0.0]);
        let second = network.push("second", second, vec![tanh]).unwrap();
        network
            .push("last", Op::Activation(last), vec![second])
            .unwrap();
        network
    }

    #[test]
    fn a_model_gives_what_the_network_gives_in_physical_units() {
        let inputs = [(20.0, 0.0), (0.05, 0.15), (0.3, -0.1)];
        let outputs = [(0.05, 0.2), (4.0, -1.0)];
        for last in [Activation::Linear, Activation::Relu, Activation::Tanh] {
            let network = foreign(last);
            let layers = layers(&network, &inputs, &outputs).unwrap();
            for x in [[3.0, 0.17, -0.2], [-14.0, 0.1, 0.1], [0.0, 0.0, 0.0]] {
                let theirs = evaluate::run(&network, &x);
                let ours = predicted(&layers, [&inputs, &outputs], &x);
                for (ours, theirs) in ours.iter().zip(&theirs) {
                    assert!(
                        (ours - theirs).abs() < 1e-6 * (1.0 + theirs.abs()),
                        "{last:?} {ours} {theirs}"
                    );
                }
            }
        }
    }

    #[test]
    fn what_is_no_chain_of_dense_layers_is_refused_by_name() {
        let (inputs, outputs) = ([(1.0, 0.0); 3], [(1.0, 0.0); 2]);
        let said = |network: &Network| match layers(network, &inputs, &outputs) {
            Ok(layers) => panic!("{layers:?}"),
            Err(error) => error.to_string(),
        };
        assert!(said(&foreign(Activation::Gelu)).contains("\"last\": this activation"));
        let mut skips = foreign(Activation::Linear);
        let last = skips.nodes.len() - 1;
        skips.push("skip", Op::Add, vec![last, last - 2]).unwrap();
        assert!(said(&skips).contains("\"skip\": add"), "{}", said(&skips));
        let short = layers(&foreign(Activation::Linear), &inputs[..2], &outputs);
        let short = short.unwrap_err().to_string();
        assert!(
            short.contains("3 inputs") && short.contains("want 2"),
            "{short}"
        );
    }
}

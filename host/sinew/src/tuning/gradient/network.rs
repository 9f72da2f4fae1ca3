//! The predictor in any scalar: the network's output, and its Jacobian from what it left behind.

use sinew_model::spec::{Activation, Dense, Layer, ModelSpec, OutputForm};
use sinew_sim::Scalar;

/// A dense predictor of a model, in model units. The regressor is u(k), u(k-1) .., y(k), y(k-1) ..,
/// s(k), each vector whole.
pub struct Predictor<'a> {
    layers: Vec<&'a Dense>,
    skip: Option<&'a [f32]>,
    increment: bool,
    /// Commands.
    pub inputs: usize,
    /// Outputs.
    pub outputs: usize,
    /// Values of each command in the regressor.
    pub past_inputs: usize,
    /// Values of each output in the regressor.
    pub past_outputs: usize,
    channels: usize,
}

/// Slopes of the activations of each layer; empty where they are all 1.
pub type Trace<S> = Vec<Vec<S>>;

impl<'a> Predictor<'a> {
    /// The predictor of a model; `None` for one with a state or a memory.
    pub fn new(spec: &'a ModelSpec) -> Option<Self> {
        let layers = spec.layers.iter().map(|layer| match layer {
            Layer::Dense(dense) => Some(dense),
            Layer::Recurrent(_) => None,
        });
        let layers = layers.collect::<Option<Vec<_>>>()?;
        (spec.form != OutputForm::State).then(|| Self {
            layers,
            skip: spec.skip.as_deref(),
            increment: spec.form == OutputForm::Increment,
            inputs: spec.inputs.len(),
            outputs: spec.outputs.len(),
            past_inputs: spec.past_inputs,
            past_outputs: spec.past_outputs,
            channels: spec.channels.len(),
        })
    }

    /// Place of y(k) in the regressor.
    pub const fn first_output(&self) -> usize {
        self.inputs * self.past_inputs
    }

    /// Place of s(k) in the regressor: as many values of commands and outputs are before it.
    pub const fn first_channel(&self) -> usize {
        self.first_output() + self.outputs * self.past_outputs
    }

    /// Length of the regressor.
    pub const fn regressor(&self) -> usize {
        self.first_channel() + self.channels
    }

    /// y(k+1) of the regressor `x`; `trace` is overwritten.
    pub fn predict<S: Scalar>(&self, x: &[S], trace: &mut Trace<S>) -> Vec<S> {
        trace.resize(self.layers.len(), Vec::new());
        let mut a: Vec<S> = x.to_vec();
        for (dense, slopes) in self.layers.iter().zip(trace.iter_mut()) {
            slopes.clear();
            let z = dense.rows().zip(&dense.bias).map(|(row, bias)| {
                let start = S::constant(f64::from(*bias));
                (row.iter().zip(&a)).fold(start, |sum, (w, x)| sum + *x * f64::from(*w))
            });
            a = match dense.activation {
                Activation::Linear => z.collect(),
                Activation::Tanh => {
                    let a: Vec<S> = z.map(Scalar::tanh).collect();
                    slopes.extend(a.iter().map(|a| -(*a * *a) + 1.0));
                    a
                }
                Activation::Relu => {
                    let z: Vec<S> = z.collect();
                    let step = |z: &S| f64::from(u8::from(z.value() > 0.0));
                    slopes.extend(z.iter().map(|z| S::constant(step(z))));
                    z.iter().map(|z| *z * step(z)).collect()
                }
            };
        }
        if let Some(skip) = self.skip {
            for (y, row) in a.iter_mut().zip(skip.chunks(x.len().max(1))) {
                *y = row
                    .iter()
                    .zip(x)
                    .fold(*y, |sum, (w, x)| sum + *x * f64::from(*w));
            }
        }
        if self.increment {
            for (y, now) in a.iter_mut().zip(&x[self.first_output()..]) {
                *y += *now;
            }
        }
        a
    }

    /// dy(k+1)/dx of the prediction that left `trace`: a row an output, a column a past command or
    /// output.
    pub fn jacobian<S: Scalar>(&self, trace: &Trace<S>) -> Vec<Vec<S>> {
        let columns = self.first_channel();
        let mut rows: Vec<Vec<S>> = (0..self.outputs)
            .map(|output| {
                let mut row = vec![S::ZERO; self.outputs];
                row[output] = S::constant(1.0);
                row
            })
            .collect();
        for (dense, slopes) in self.layers.iter().zip(trace).rev() {
            for row in &mut rows {
                for (value, slope) in row.iter_mut().zip(slopes) {
                    *value = *value * *slope;
                }
                let mut next = vec![S::ZERO; dense.inputs];
                for (value, weights) in row.iter().zip(dense.rows()) {
                    for (sum, weight) in next.iter_mut().zip(weights) {
                        *sum += *value * f64::from(*weight);
                    }
                }
                *row = next;
            }
        }
        for (output, row) in rows.iter_mut().enumerate() {
            if let Some(skip) = self.skip {
                let weights = skip.chunks(self.regressor().max(1)).nth(output);
                for (value, weight) in row.iter_mut().zip(weights.unwrap_or_default()) {
                    *value = *value + f64::from(*weight);
                }
            }
            if self.increment {
                let place = self.first_output() + output;
                row[place] = row[place] + 1.0;
            }
            row.truncate(columns);
        }
        rows
    }
}

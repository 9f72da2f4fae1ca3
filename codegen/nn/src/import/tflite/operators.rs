//! Operator of the file: the method that reads it, its options, or the nearest operator that works.

use super::file::Operator;
use super::names::operator_name;
use super::{Import, held, tensor};
use crate::{Activation, NetworkError, Op, Pool, PoolKind};

/// Operators that are known not to work: code and what is nearest.
const NEAREST: &[(i32, &str)] = &[
    (34, "use padding='same' in the convolution"),
    (67, "use Conv2D"),
    (117, "use swish"),
    (7, "use Dense on one-hot inputs"),
    (53, "convert a model of float32"),
    (32, "use TensorFlow Lite's own operators"),
    (
        142,
        "convert with TFLiteConverter.from_keras_model, which freezes the weights",
    ),
    (42, "division by a constant works"),
    (54, "use LeakyReLU"),
    (75, "use Normalization"),
    (76, "use BatchNormalization, which is folded into weights"),
    (92, "use a Dense layer of more units"),
    (99, "use BatchNormalization, which is folded into weights"),
    (126, "use Dense"),
];

/// Operators: code, and the fields of their options that are looked at or change nothing.
const OPTIONS: &[(i32, &[usize])] = &[
    (0, &[0, 1]),
    (1, &[0, 1, 2, 3, 4, 5]),
    (2, &[0, 1]),
    (3, &[0, 1, 2, 3, 4, 5, 6]),
    (4, &[0, 1, 2, 3, 4, 5, 6]),
    (9, &[0, 1, 2, 3, 4]),
    (17, &[0, 1, 2, 3, 4, 5]),
    (18, &[0]),
    (22, &[0]),
    (25, &[0]),
    (36, &[0, 1]),
    (40, &[0]),
    (41, &[0, 1]),
    (42, &[0]),
    (43, &[0]),
    (45, &[0, 1, 2, 3, 4]),
    (49, &[0]),
    (74, &[0]),
    (77, &[0]),
    (82, &[0]),
    (83, &[0, 1]),
    (88, &[0, 1]),
    (98, &[0]),
    (102, &[0]),
    (150, &[0]),
];

impl Import<'_> {
    pub(super) fn operator(&mut self, operator: &Operator<'_>) -> Result<(), NetworkError> {
        let Some(&output) = operator.outputs.first() else {
            return Err(NetworkError::malformed(
                "model",
                "an operator without output",
            ));
        };
        let info = tensor(self.model, output)?;
        let name = self.free_name(&info.name);
        let option = |id: usize| operator.options.map_or(Ok(0), |options| options.byte(id));
        expect_known(operator, &name)?;
        if self.place(operator, &name)? {
            return Ok(());
        }
        let place = match operator.code {
            0 => {
                let sum = self.sum(operator, &name, [1.0, 1.0])?;
                self.fused(&name, sum, option(0)?)?
            }
            41 => {
                let sum = self.sum(operator, &name, [1.0, -1.0])?;
                self.fused(&name, sum, option(0)?)?
            }
            18 => {
                let product = self.product(operator, &name)?;
                self.fused(&name, product, option(0)?)?
            }
            1 | 17 => {
                let kind = if operator.code == 17 {
                    PoolKind::Max
                } else {
                    PoolKind::Average
                };
                let (x, window) = self.pool(operator, &name)?;
                let place = self
                    .network
                    .push(&name, Op::Pool(Pool { window, kind }), vec![x])?;
                self.fused(&name, place, option(5)?)?
            }
            2 => {
                let axis = operator
                    .options
                    .map_or(Ok(0), |options| options.int(0, 0))?;
                let place = self.concatenate(operator, &name, axis)?;
                self.fused(&name, place, option(1)?)?
            }
            3 => {
                let place = self.convolution(operator, &name)?;
                self.fused(&name, place, option(3)?)?
            }
            9 => {
                let place = self.dense(operator, &name)?;
                self.fused(&name, place, option(0)?)?
            }
            4 => {
                let place = self.depthwise(operator, &name)?;
                self.fused(&name, place, option(4)?)?
            }
            20 | 21 => {
                let x = self.value(operator, 0, &name)?;
                self.clipped(&name, x, operator.code == 21)?
            }
            42 => {
                let quotient = self.quotient(operator, &name)?;
                self.fused(&name, quotient, option(0)?)?
            }
            59 => {
                let x = self.value(operator, 0, &name)?;
                self.network.push(&name, self.scale(x, -1.0), vec![x])?
            }
            40 | 74 | 82 => self.reduce(operator, &name)?,
            // A weight that is only widened, or a value that is only requantised, stays itself.
            6 | 114 => {
                let input = operator.inputs.first().copied().unwrap_or(-1);
                match self.places.get(&input) {
                    Some(&place) => place,
                    None => return Ok(()),
                }
            }
            22 | 43 | 70 => {
                let x = self.value(operator, 0, &name)?;
                let length = self.network.nodes[x].len();
                self.network
                    .push(&name, Op::Reshape(held(&info.shape, length)), vec![x])?
            }
            25 => {
                let beta = operator
                    .options
                    .map_or(Ok(1.0), |options| options.float(0, 1.0))?;
                if beta != 1.0 {
                    return Err(NetworkError::unsupported(
                        name,
                        format!("a softmax of beta {beta}"),
                        "use beta = 1",
                    ));
                }
                let x = self.value(operator, 0, &name)?;
                let rows = info.shape.last().copied().unwrap_or(1);
                if self.network.nodes[x].shape.last() != Some(&rows) {
                    return Err(NetworkError::unsupported(
                        name,
                        format!("a softmax of shape {:?}", info.shape),
                        "use the last axis",
                    ));
                }
                self.network.push(&name, Op::Softmax, vec![x])?
            }
            code => {
                let g = activation(code, operator, &name)?;
                let x = self.value(operator, 0, &name)?;
                self.network.push(&name, Op::Activation(g), vec![x])?
            }
        };
        self.places.insert(output, place);
        Ok(())
    }
}

/// That an operator has no option that nothing here looks at.
fn expect_known(operator: &Operator<'_>, name: &str) -> Result<(), NetworkError> {
    let Some(options) = operator.options else {
        return Ok(());
    };
    let known = OPTIONS.iter().find(|(code, _)| *code == operator.code);
    let known = known.map_or(&[][..], |(_, fields)| fields);
    match options
        .fields()?
        .into_iter()
        .find(|field| !known.contains(field))
    {
        None => Ok(()),
        // Of an operator that is refused anyway the operator is named.
        Some(_) if NEAREST.iter().any(|(code, ..)| *code == operator.code) => Ok(()),
        Some(field) => Err(NetworkError::unsupported(
            name,
            format!("option {field} of operator {}", operator.code),
            "convert without it",
        )),
    }
}

fn activation(code: i32, operator: &Operator<'_>, name: &str) -> Result<Activation, NetworkError> {
    let options = operator.options;
    Ok(match code {
        14 => Activation::Sigmoid,
        19 => Activation::Relu,
        28 => Activation::Tanh,
        47 => Activation::Exponential,
        98 => Activation::LeakyRelu {
            alpha: options.map_or(Ok(0.0), |options| options.float(0, 0.0))?,
        },
        111 => Activation::Elu {
            alpha: 1.0,
            scale: 1.0,
        },
        150 if options.map_or(Ok(0), |options| options.byte(0))? != 0 => Activation::GeluTanh,
        150 => Activation::Gelu,
        other => {
            let known = NEAREST.iter().find(|(code, _)| *code == other);
            let nearest = known.map_or(
                "see docs/reference/networks.md for the operators that are",
                |(_, nearest)| *nearest,
            );
            let what = format!("the operator {}", operator_name(other));
            return Err(NetworkError::unsupported(name, what, nearest));
        }
    })
}

//! Operator of the file: the method that reads it, its options, or the nearest operator that works.

use super::file::Operator;
use super::names::operator_name;
use super::{Import, held, tensor};
use crate::{Activation, NetworkError, Op, Pool, PoolKind};

/// Operators that are known not to work: code and what is nearest.
const NEAREST: &[(i32, &str)] = &[
    (67, "use UpSampling2D and Conv2D"),
    (7, "use Dense on one-hot inputs"),
    (53, "convert a model of float32"),
    (32, "use TensorFlow Lite's own operators"),
    (
        142,
        "convert with TFLiteConverter.from_keras_model, which freezes the weights",
    ),
    (
        38,
        "convert with a fixed batch, Input(shape, batch_size=1), which keeps the dilation",
    ),
    (126, "use Dense"),
    (
        94,
        "convert with a fixed batch, Input(shape, batch_size=1), which fills no tensor",
    ),
];

/// Operators: code, the newest version whose meaning is known here, and the fields of their
/// options that are looked at or change nothing. Versions up to it differ by the types of numbers.
const KNOWN: &[(i32, i32, &[usize])] = &[
    (0, 5, &[0, 1]),
    (1, 3, &[0, 1, 2, 3, 4, 5]),
    (2, 4, &[0, 1]),
    (3, 8, &[0, 1, 2, 3, 4, 5, 6]),
    (4, 7, &[0, 1, 2, 3, 4, 5, 6]),
    (6, 6, &[]),
    (9, 13, &[0, 1, 2, 3, 4]),
    (14, 3, &[]),
    (17, 3, &[0, 1, 2, 3, 4, 5]),
    (18, 7, &[0]),
    (19, 3, &[]),
    (20, 1, &[]),
    (21, 3, &[]),
    (22, 1, &[0]),
    (25, 3, &[0]),
    (28, 3, &[]),
    (34, 4, &[]),
    (36, 6, &[0, 1]),
    (39, 6, &[]),
    (40, 3, &[0]),
    (41, 5, &[0, 1]),
    (42, 2, &[0]),
    (43, 2, &[0]),
    (45, 8, &[0, 1, 2, 3, 4]),
    (47, 2, &[]),
    (49, 4, &[0]),
    (50, 2, &[]),
    (54, 1, &[]),
    (55, 4, &[]),
    (57, 4, &[]),
    (59, 1, &[]),
    (60, 4, &[]),
    (61, 2, &[]),
    (64, 4, &[]),
    (65, 6, &[]),
    (69, 3, &[]),
    (70, 1, &[]),
    (73, 2, &[]),
    (74, 2, &[0]),
    (75, 1, &[]),
    (76, 2, &[]),
    (77, 1, &[0]),
    (78, 1, &[]),
    (81, 2, &[0]),
    (82, 3, &[0]),
    (83, 4, &[0, 1]),
    (88, 4, &[0, 1]),
    (92, 1, &[]),
    (98, 2, &[0]),
    (99, 2, &[]),
    (101, 5, &[]),
    (102, 2, &[0]),
    (105, 3, &[]),
    (111, 1, &[]),
    (114, 3, &[]),
    (117, 1, &[]),
    (123, 2, &[]),
    (130, 3, &[]),
    (150, 2, &[0]),
    (152, 1, &[]),
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
                let (low, high) = if operator.code == 21 {
                    (0.0, 6.0)
                } else {
                    (-1.0, 1.0)
                };
                self.network.clipped(&name, x, low, high)?
            }
            42 => {
                let quotient = self.quotient(operator, &name)?;
                self.fused(&name, quotient, option(0)?)?
            }
            59 => {
                let x = self.value(operator, 0, &name)?;
                self.network.scaled(&name, x, -1.0, 0.0)?
            }
            40 | 74 | 82 => self.reduce(operator, &name)?,
            55 | 57 => self.bounded(operator, &name)?,
            61 => return self.sign(operator, &name),
            64 | 123 => self.choice(operator, &name)?,
            34 | 60 => self.padded(operator, &name)?,
            54 => self.prelu(operator, &name)?,
            78 => self.power(operator, &name)?,
            99 => {
                let difference = self.sum(operator, &name, [1.0, -1.0])?;
                self.network.power(&name, difference, 2.0)?
            }
            75 | 76 | 92 | 101 | 117 | 152 => {
                let x = self.value(operator, 0, &name)?;
                let network = &mut self.network;
                match operator.code {
                    75 => network.power(&name, x, 0.5)?,
                    76 => network.power(&name, x, -0.5)?,
                    92 => network.power(&name, x, 2.0)?,
                    101 => network.absolute(&name, x)?,
                    117 => network.hard_swish(&name, x)?,
                    _ => network.clipped(&name, x, 0.0, 1.0)?,
                }
            }
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
            25 | 50 => self.softmax(operator, &name)?,
            code => {
                let g = activation(code, operator, &name)?;
                let x = self.value(operator, 0, &name)?;
                self.network.push(&name, Op::Activation(g), vec![x])?
            }
        };
        self.places.insert(output, place);
        Ok(())
    }
    /// A softmax of beta 1 over the last axis, or its logarithm.
    fn softmax(&mut self, operator: &Operator<'_>, name: &str) -> Result<usize, NetworkError> {
        const SOFTMAX: i32 = 25;
        let op = match operator.code {
            SOFTMAX => Op::Softmax,
            _ => Op::LogSoftmax,
        };
        let beta = match operator.options {
            Some(options) if op == Op::Softmax => options.float(0, 1.0)?,
            _ => 1.0,
        };
        if beta != 1.0 {
            let what = format!("a softmax of beta {beta}");
            return Err(NetworkError::unsupported(name, what, "use beta = 1"));
        }
        let x = self.value(operator, 0, name)?;
        let output = operator.outputs.first().copied().unwrap_or(-1);
        let shape = &tensor(self.model, output)?.shape;
        let rows = shape.last().copied().unwrap_or(1);
        if self.network.nodes[x].shape.last() != Some(&rows) {
            let what = format!("a softmax of shape {shape:?}");
            return Err(NetworkError::unsupported(name, what, "use the last axis"));
        }
        self.network.push(name, op, vec![x])
    }
}

/// That an operator is in the table, of a version that is known here, and has no option that
/// nothing looks at.
fn expect_known(operator: &Operator<'_>, name: &str) -> Result<(), NetworkError> {
    let known = KNOWN.iter().find(|(code, ..)| *code == operator.code);
    let Some((_, newest, known)) = known else {
        return Err(unread(operator.code, name));
    };
    let version = operator.version;
    if !(1..=*newest).contains(&version) {
        return Err(NetworkError::unsupported(
            name,
            format!("version {version} of {}", operator_name(operator.code)),
            format!("versions 1 to {newest} work"),
        ));
    }
    let fields = operator
        .options
        .map_or(Ok(Vec::new()), |options| options.fields())?;
    match fields.into_iter().find(|field| !known.contains(field)) {
        None => Ok(()),
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
        73 => Activation::Logarithm,
        98 => Activation::LeakyRelu {
            alpha: options.map_or(Ok(0.0), |options| options.float(0, 0.0))?,
        },
        111 => Activation::Elu {
            alpha: 1.0,
            scale: 1.0,
        },
        150 if options.map_or(Ok(0), |options| options.byte(0))? != 0 => Activation::GeluTanh,
        150 => Activation::Gelu,
        other => return Err(unread(other, name)),
    })
}

/// Refusal of an operator that nothing here reads, by its name.
fn unread(code: i32, name: &str) -> NetworkError {
    let known = NEAREST.iter().find(|(other, _)| *other == code);
    let nearest = known.map_or(
        "see docs/reference/networks.md for the operators that are",
        |(_, nearest)| *nearest,
    );
    let what = format!("the operator {}", operator_name(code));
    NetworkError::unsupported(name, what, nearest)
}

//! TensorFlow Lite: float32 and float16, and int8 with its weights dequantised. Values between
//! layers are floating point here, so a quantised file gives what its weights say, without the
//! rounding of its values.

mod file;
mod flatbuffer;
mod places;
mod recurrent;

use std::collections::HashMap;

use super::tensor::Tensor;
use super::{pads, shapes};
use crate::{Activation, Convolution, Dense, Network, NetworkError, Op, Pool, PoolKind, Window};
use file::{Model, Operator};

/// Operators that are known not to work: code, name and what is nearest.
const NEAREST: &[(i32, &str, &str)] = &[
    (34, "PAD", "use padding='same' in the convolution"),
    (67, "TRANSPOSE_CONV", "use Conv2D"),
    (117, "HARD_SWISH", "use swish"),
    (7, "EMBEDDING_LOOKUP", "use Dense on one-hot inputs"),
    (53, "CAST", "convert a model of float32"),
    (32, "CUSTOM", "use TensorFlow Lite's own operators"),
    (
        142,
        "VAR_HANDLE",
        "convert with TFLiteConverter.from_keras_model, which freezes the weights",
    ),
    (42, "DIV", "division by a constant works"),
    (54, "PRELU", "use LeakyReLU"),
    (75, "SQRT", "use Normalization"),
    (
        76,
        "RSQRT",
        "use BatchNormalization, which is folded into weights",
    ),
    (92, "SQUARE", "use a Dense layer of more units"),
    (
        99,
        "SQUARED_DIFFERENCE",
        "use BatchNormalization, which is folded into weights",
    ),
    (126, "BATCH_MATMUL", "use Dense"),
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

/// Weights of a depthwise convolution with its zeros between channels.
const MAX_UNGROUPED: usize = 65_536;

struct Import<'a> {
    network: Network,
    model: &'a Model<'a>,
    /// The node that holds each tensor.
    places: HashMap<i32, usize>,
}

/// # Errors
/// [`NetworkError`].
pub(super) fn import(name: &str, bytes: &[u8]) -> Result<Network, NetworkError> {
    let model = Model::new(bytes)?;
    recurrent::refuse(&model)?;
    if model.graphs > 1 {
        return Err(NetworkError::unsupported(
            "model",
            format!("{} graphs", model.graphs),
            "convert a model without loops or branches that depend on values",
        ));
    }
    let one = |list: &[i32], what: &str| match *list {
        [one] => Ok(one),
        _ => Err(NetworkError::unsupported(
            "model",
            format!("{} {what}s", list.len()),
            format!("concatenate the {what}s into one"),
        )),
    };
    let (input, output) = (one(&model.inputs, "input")?, one(&model.outputs, "output")?);
    let info = tensor(&model, input)?;
    if !info.is_number {
        return Err(NetworkError::unsupported(
            last(&info.name),
            "an input of integers",
            "convert a model that reads float32",
        ));
    }
    if info.open || info.shape.first().is_some_and(|&batch| batch > 1) && info.shape.len() > 1 {
        return Err(NetworkError::unsupported(
            last(&info.name),
            format!(
                "an input of shape {:?}{}",
                info.shape,
                if info.open {
                    ", open beside the batch"
                } else {
                    ""
                }
            ),
            "a batch of 1 and fixed axes after it work",
        ));
    }
    let shape = info.shape.get(1..).unwrap_or(&[]).to_vec();
    let input_name = if info.name.is_empty() {
        "input"
    } else {
        &info.name
    };
    let mut import = Import {
        network: Network::new(name, input_name, shape),
        model: &model,
        places: HashMap::from([(input, 0)]),
    };
    for operator in &model.operators {
        import.operator(operator)?;
    }
    let place = import.places.get(&output).copied();
    let place =
        place.ok_or_else(|| NetworkError::malformed("model", "no operator gives the output"))?;
    let mut network = import.network;
    network.nodes.truncate(place + 1);
    network.drop_unread();
    Ok(network)
}

fn tensor<'a>(model: &'a Model<'_>, index: i32) -> Result<&'a file::TensorInfo, NetworkError> {
    let found = usize::try_from(index)
        .ok()
        .and_then(|index| model.tensors.get(index));
    found.ok_or_else(|| NetworkError::malformed("model", format!("there is no tensor {index}")))
}

/// Names of fused layers are joined by `;`, the last being that of the layer.
fn last(name: &str) -> &str {
    name.rsplit(';').next().unwrap_or(name)
}

impl Import<'_> {
    fn operator(&mut self, operator: &Operator<'_>) -> Result<(), NetworkError> {
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

    fn free_name(&self, name: &str) -> String {
        let name = if name.is_empty() { "layer" } else { last(name) };
        let taken = |name: &str| self.network.nodes.iter().any(|node| node.name == name);
        let mut free: String = name.chars().filter(|c| !c.is_control()).take(200).collect();
        let mut number = 2;
        while taken(&free) {
            free = format!("{name} {number}");
            number += 1;
        }
        free
    }

    /// The node at an input.
    fn value(
        &self,
        operator: &Operator<'_>,
        input: usize,
        name: &str,
    ) -> Result<usize, NetworkError> {
        let index = operator.inputs.get(input).copied().unwrap_or(-1);
        self.places.get(&index).copied().ok_or_else(|| {
            NetworkError::malformed(
                name,
                format!("it reads tensor {index}, which no operator before it gives"),
            )
        })
    }

    /// The weights at an input, also where they are widened first.
    fn constant(
        &self,
        operator: &Operator<'_>,
        input: usize,
    ) -> Result<Option<&Tensor>, NetworkError> {
        let Some(&index) = operator.inputs.get(input).filter(|&&index| index >= 0) else {
            return Ok(None);
        };
        let info = tensor(self.model, index)?;
        if info.constant.is_some() {
            return Ok(info.constant.as_ref());
        }
        let widened = self
            .model
            .operators
            .iter()
            .find(|o| o.code == 6 && o.outputs.first() == Some(&index));
        match widened.and_then(|operator| operator.inputs.first()) {
            Some(&source) => Ok(tensor(self.model, source)?.constant.as_ref()),
            None => Ok(None),
        }
    }

    fn weights(
        &self,
        operator: &Operator<'_>,
        input: usize,
        name: &str,
    ) -> Result<&Tensor, NetworkError> {
        self.constant(operator, input)?.ok_or_else(|| {
            NetworkError::unsupported(name, "weights that are computed", "convert a trained model")
        })
    }

    fn bias(
        &self,
        operator: &Operator<'_>,
        count: usize,
        name: &str,
    ) -> Result<Vec<f32>, NetworkError> {
        match self.constant(operator, 2)? {
            Some(bias) => {
                bias.expect_shape(name, &[count])?;
                Ok(bias.values.clone())
            }
            None if operator.inputs.get(2).is_none_or(|&index| index < 0) => Ok(vec![0.0; count]),
            None => Err(NetworkError::unsupported(
                name,
                "a bias that is computed, or of integers without a scale",
                "convert a trained model",
            )),
        }
    }

    /// The activation that an operator has within it.
    fn fused(&mut self, name: &str, place: usize, code: u8) -> Result<usize, NetworkError> {
        let g = match code {
            0 => return Ok(place),
            1 => Activation::Relu,
            2 | 3 => {
                let name = self.free_name(&format!("{name} activation"));
                return self.clipped(&name, place, code == 3);
            }
            4 => Activation::Tanh,
            other => {
                let what = format!("the fused activation {other}");
                return Err(NetworkError::unsupported(name, what, "the nearest is ReLU"));
            }
        };
        let name = self.free_name(&format!("{name} activation"));
        self.network.push(&name, Op::Activation(g), vec![place])
    }

    fn dense(&mut self, operator: &Operator<'_>, name: &str) -> Result<usize, NetworkError> {
        let x = self.value(operator, 0, name)?;
        let weights = self.weights(operator, 1, name)?;
        weights.expect_axes(name, 2)?;
        if operator.options.map_or(Ok(0), |options| options.byte(1))? != 0 {
            return Err(NetworkError::unsupported(
                name,
                "shuffled weights",
                "convert without shuffling",
            ));
        }
        let inputs = weights.shape[1].max(1);
        let outputs = weights.shape[0];
        let bias = self.bias(operator, outputs, name)?;
        let weights = weights.values.clone();
        let length = self.network.nodes[x].len();
        if length == inputs || !length.is_multiple_of(inputs) {
            return self
                .network
                .push(name, Op::Dense(Dense { weights, bias }), vec![x]);
        }
        // The same weights at every row.
        let mut from = x;
        let shape = &self.network.nodes[x].shape;
        if shape.last() != Some(&inputs) || !(2..=3).contains(&shape.len()) {
            let rows = Op::Reshape(vec![length / inputs, inputs]);
            from = self
                .network
                .push(&self.free_name(&format!("{name} rows")), rows, vec![x])?;
        }
        let window = Window {
            size: [1; 2],
            stride: [1; 2],
            dilation: [1; 2],
            before: [0; 2],
            after: [0; 2],
        };
        let op = Op::Convolution(Convolution {
            window,
            weights,
            bias,
        });
        self.network.push(name, op, vec![from])
    }

    fn image(&self, x: usize, name: &str) -> Result<[usize; 2], NetworkError> {
        match *self.network.nodes[x].shape.as_slice() {
            [rows, columns, _] => Ok([rows, columns]),
            [columns, _] => Ok([1, columns]),
            ref other => Err(NetworkError::malformed(
                name,
                format!("{other:?} is no image"),
            )),
        }
    }

    fn window(
        &self,
        operator: &Operator<'_>,
        image: [usize; 2],
        size: [usize; 2],
        dilated: Option<[usize; 2]>,
    ) -> Result<Window, NetworkError> {
        let Some(options) = operator.options else {
            return Err(NetworkError::malformed("model", "a window without options"));
        };
        let number = |id: usize, otherwise: i32| -> Result<usize, NetworkError> {
            Ok(usize::try_from(options.int(id, otherwise)?).unwrap_or(0))
        };
        let stride = [number(2, 0)?, number(1, 0)?];
        let dilation = match dilated {
            Some([rows, columns]) => [number(rows, 1)?, number(columns, 1)?],
            None => [1, 1],
        };
        let mut window = Window {
            size,
            stride,
            dilation,
            before: [0; 2],
            after: [0; 2],
        };
        if options.byte(0)? == 0 {
            for axis in 0..2 {
                let (before, after) =
                    pads::same(image[axis], size[axis], stride[axis], dilation[axis]);
                (window.before[axis], window.after[axis]) = (before, after);
            }
        }
        Ok(window)
    }

    fn convolution(&mut self, operator: &Operator<'_>, name: &str) -> Result<usize, NetworkError> {
        let x = self.value(operator, 0, name)?;
        let image = self.image(x, name)?;
        let weights = self.weights(operator, 1, name)?;
        weights.expect_axes(name, 4)?;
        let channels = self.network.nodes[x].shape.last().copied().unwrap_or(1);
        if weights.shape[3] != channels && channels.is_multiple_of(weights.shape[3].max(1)) {
            return Err(NetworkError::unsupported(
                name,
                format!(
                    "a convolution in {} groups",
                    channels / weights.shape[3].max(1)
                ),
                "use groups=1",
            ));
        }
        let size = [weights.shape[1], weights.shape[2]];
        let window = self.window(operator, image, size, Some([5, 4]))?;
        let bias = self.bias(operator, weights.shape[0], name)?;
        let weights = weights.values.clone();
        self.network.push(
            name,
            Op::Convolution(Convolution {
                window,
                weights,
                bias,
            }),
            vec![x],
        )
    }

    fn pool(
        &mut self,
        operator: &Operator<'_>,
        name: &str,
    ) -> Result<(usize, Window), NetworkError> {
        let x = self.value(operator, 0, name)?;
        let image = self.image(x, name)?;
        let number = |id: usize| operator.options.map_or(Ok(0), |options| options.int(id, 0));
        let size = [number(4)?, number(3)?].map(|n| usize::try_from(n).unwrap_or(0));
        Ok((x, self.window(operator, image, size, None)?))
    }

    /// A convolution of each channel by itself, as one over all channels with zeros between them.
    fn depthwise(&mut self, operator: &Operator<'_>, name: &str) -> Result<usize, NetworkError> {
        let x = self.value(operator, 0, name)?;
        let image = self.image(x, name)?;
        let weights = self.weights(operator, 1, name)?;
        weights.expect_axes(name, 4)?;
        let (size, filters) = ([weights.shape[1], weights.shape[2]], weights.shape[3]);
        let channels = self.network.nodes[x].shape.last().copied().unwrap_or(1);
        let places = size[0].saturating_mul(size[1]);
        if weights.shape[0] != 1 || !filters.is_multiple_of(channels) {
            return Err(NetworkError::malformed(
                name,
                format!(
                    "weights of shape {:?} for {channels} channels",
                    weights.shape
                ),
            ));
        }
        if places.saturating_mul(filters).saturating_mul(channels) > MAX_UNGROUPED {
            return Err(NetworkError::unsupported(
                name,
                format!("DEPTHWISE_CONV_2D of {filters} filters"),
                "use Conv2D",
            ));
        }
        let mut full = vec![0.0; filters * places * channels];
        for (i, &w) in weights.values.iter().enumerate() {
            let (place, filter) = (i / filters, i % filters);
            let channel = filter / (filters / channels);
            full[(filter * places + place) * channels + channel] = w;
        }
        let window = self.window(operator, image, size, Some([6, 5]))?;
        let bias = self.bias(operator, filters, name)?;
        let op = Op::Convolution(Convolution {
            window,
            weights: full,
            bias,
        });
        self.network.push(name, op, vec![x])
    }

    /// The mean, sum or largest over all axes between the batch and the last.
    fn reduce(&mut self, operator: &Operator<'_>, name: &str) -> Result<usize, NetworkError> {
        let x = self.value(operator, 0, name)?;
        let input = tensor(self.model, operator.inputs.first().copied().unwrap_or(-1))?;
        let axes = &tensor(self.model, operator.inputs.get(1).copied().unwrap_or(-1))?.integers;
        let count = input.shape.len() as i64;
        let mut axes: Vec<i64> = axes
            .iter()
            .map(|&axis| if axis < 0 { axis + count } else { axis })
            .collect();
        axes.sort_unstable();
        // What is reduced is one run of axes, and what stands before it is 1.
        let run = axes.windows(2).all(|pair| pair[1] == pair[0] + 1);
        let (first, after) = (
            axes.first().copied().unwrap_or(-1),
            axes.last().map_or(0, |axis| axis + 1),
        );
        let inside = run && first >= 0 && after <= count;
        let outer: usize = if inside {
            product(&input.shape[..first as usize])
        } else {
            0
        };
        if outer != 1 {
            return Err(NetworkError::unsupported(
                name,
                format!("a reduction of {:?} over the axes {axes:?}", input.shape),
                "all axes between the batch and the channels work, as in GlobalAveragePooling2D",
            ));
        }
        let reduced = product(&input.shape[first as usize..after as usize]);
        let channels = product(&input.shape[after as usize..]);
        let window = Window {
            size: [1, reduced],
            stride: [1; 2],
            dilation: [1; 2],
            before: [0; 2],
            after: [0; 2],
        };
        let kind = if operator.code == 82 {
            PoolKind::Max
        } else {
            PoolKind::Average
        };
        let mut from = x;
        if self.network.nodes[x].shape != [reduced, channels] {
            let rows = Op::Reshape(vec![reduced, channels]);
            from = self
                .network
                .push(&self.free_name(&format!("{name} rows")), rows, vec![x])?;
        }
        let pool = Op::Pool(Pool { window, kind });
        let mut pool =
            self.network
                .push(&self.free_name(&format!("{name} pool")), pool, vec![from])?;
        if operator.code == 74 {
            let op = self.scale(pool, reduced as f32);
            pool = self
                .network
                .push(&self.free_name(&format!("{name} sum")), op, vec![pool])?;
        }
        self.network
            .push(name, Op::Reshape(vec![channels]), vec![pool])
    }

    /// The same gain for all channels of a node.
    fn scale(&self, x: usize, gain: f32) -> Op {
        let channels = self.network.nodes[x].shape.last().copied().unwrap_or(1);
        Op::Scale {
            gain: vec![gain; channels],
            offset: vec![0.0; channels],
        }
    }

    /// Bounds of 0 and 6, or of -1 and 1, as a hard sigmoid between them.
    fn clipped(&mut self, name: &str, x: usize, six: bool) -> Result<usize, NetworkError> {
        let (low, width) = if six { (0.0, 6.0) } else { (-1.0, 2.0) };
        let g = Activation::HardSigmoid {
            alpha: 1.0 / width,
            beta: -low / width,
        };
        let inner = self.free_name(&format!("{name} bounds"));
        let bounded = self.network.push(&inner, Op::Activation(g), vec![x])?;
        let channels = self.network.nodes[x].shape.last().copied().unwrap_or(1);
        let op = Op::Scale {
            gain: vec![width; channels],
            offset: vec![low; channels],
        };
        self.network.push(name, op, vec![bounded])
    }

    /// A value divided by weights.
    fn quotient(&mut self, operator: &Operator<'_>, name: &str) -> Result<usize, NetworkError> {
        let Some(constant) = self.constant(operator, 1)?.cloned() else {
            return Err(NetworkError::unsupported(
                name,
                "DIV by a value",
                "division by a constant works",
            ));
        };
        let x = self.value(operator, 0, name)?;
        let gain: Vec<f32> = self
            .spread(&constant, x, name)?
            .iter()
            .map(|c| 1.0 / c)
            .collect();
        let offset = vec![0.0; gain.len()];
        self.scaled(name, x, gain, offset)
    }

    /// A gain and an offset for each channel, or for each value.
    fn scaled(
        &mut self,
        name: &str,
        x: usize,
        gain: Vec<f32>,
        offset: Vec<f32>,
    ) -> Result<usize, NetworkError> {
        let shape = self.network.nodes[x].shape.clone();
        if shape.last() == Some(&gain.len()) {
            return self.network.push(name, Op::Scale { gain, offset }, vec![x]);
        }
        let flat = self.free_name(&format!("{name} flat"));
        let flat = self
            .network
            .push(&flat, Op::Reshape(vec![gain.len()]), vec![x])?;
        let scale = self.free_name(&format!("{name} scale"));
        let scaled = self
            .network
            .push(&scale, Op::Scale { gain, offset }, vec![flat])?;
        self.network.push(name, Op::Reshape(shape), vec![scaled])
    }

    /// Values added, or a value and weights; with the signs of both.
    fn sum(
        &mut self,
        operator: &Operator<'_>,
        name: &str,
        signs: [f32; 2],
    ) -> Result<usize, NetworkError> {
        for (value, weights) in [(0, 1), (1, 0)] {
            let Some(constant) = self.constant(operator, weights)?.cloned() else {
                continue;
            };
            let x = self.value(operator, value, name)?;
            let offset = self.spread(&constant, x, name)?;
            let gain = vec![signs[value]; offset.len()];
            let offset = offset.iter().map(|o| signs[weights] * o).collect();
            return self.scaled(name, x, gain, offset);
        }
        if signs != [1.0; 2] {
            let (a, b) = (
                self.value(operator, 0, name)?,
                self.value(operator, 1, name)?,
            );
            let op = self.scale(b, -1.0);
            let b = self
                .network
                .push(&self.free_name(&format!("{name} negative")), op, vec![b])?;
            return self.network.push(name, Op::Add, vec![a, b]);
        }
        let from = (0..operator.inputs.len()).map(|input| self.value(operator, input, name));
        let from = from.collect::<Result<_, _>>()?;
        self.network.push(name, Op::Add, from)
    }

    /// A value and weights, or a value and its own sigmoid.
    fn product(&mut self, operator: &Operator<'_>, name: &str) -> Result<usize, NetworkError> {
        for (value, weights) in [(0, 1), (1, 0)] {
            if let Some(constant) = self.constant(operator, weights)?.cloned() {
                let x = self.value(operator, value, name)?;
                let gain = self.spread(&constant, x, name)?;
                let offset = vec![0.0; gain.len()];
                return self.scaled(name, x, gain, offset);
            }
            let (x, gate) = (
                self.value(operator, value, name)?,
                self.value(operator, weights, name)?,
            );
            let node = &self.network.nodes[gate];
            if node.op == Op::Activation(Activation::Sigmoid) && node.from == [x] {
                return self
                    .network
                    .push(name, Op::Activation(Activation::Swish), vec![x]);
            }
        }
        Err(NetworkError::unsupported(
            name,
            "MUL of two values",
            "x * sigmoid(x) works, and ADD",
        ))
    }

    /// One number for each channel of a node, or for each value.
    fn spread(&self, constant: &Tensor, x: usize, name: &str) -> Result<Vec<f32>, NetworkError> {
        shapes::spread(
            name,
            &constant.shape,
            &constant.values,
            &self.network.nodes[x].shape,
        )
    }

    fn concatenate(
        &mut self,
        operator: &Operator<'_>,
        name: &str,
        axis: i32,
    ) -> Result<usize, NetworkError> {
        let from = (0..operator.inputs.len()).map(|input| self.value(operator, input, name));
        let from = from.collect::<Result<Vec<_>, _>>()?;
        let info = tensor(self.model, operator.inputs.first().copied().unwrap_or(-1))?;
        let axes = info.shape.len() as i32;
        let axis = if axis < 0 { axis + axes } else { axis };
        // The shape here is that of the file, mostly without the batch.
        let held = from
            .first()
            .map_or(0, |&x| self.network.nodes[x].shape.len() as i32);
        let place = axis - (axes - held);
        let known = (axes - held == 1 && info.shape.first() == Some(&1)) || axes == held;
        if !known || !(0..held).contains(&place) {
            return Err(NetworkError::unsupported(
                name,
                format!("a concatenation of {:?} along axis {axis}", info.shape),
                "concatenate along an axis after the batch",
            ));
        }
        self.network
            .push(name, Op::Concatenate(place as usize), from)
    }
}

/// Number of values of a shape.
fn product(shape: &[usize]) -> usize {
    shape.iter().fold(1, |n, &axis| n.saturating_mul(axis))
}

/// A tensor's shape as a node holds it: without the batch of 1, and flat where no node has so many
/// axes.
fn held(shape: &[usize], length: usize) -> Vec<usize> {
    let inner = match shape {
        [1, inner @ ..] if !inner.is_empty() => inner,
        other => other,
    };
    let fits = (1..=3).contains(&inner.len()) && product(inner) == length;
    if fits { inner.to_vec() } else { vec![length] }
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
            let known = NEAREST.iter().find(|(code, ..)| *code == other);
            let (what, nearest) = known.map_or(
                (
                    format!("the operator {other}"),
                    "see docs/reference/networks.md for the operators that are",
                ),
                |(_, name, nearest)| (format!("the operator {name}"), *nearest),
            );
            return Err(NetworkError::unsupported(name, what, nearest));
        }
    })
}

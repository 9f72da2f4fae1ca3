//! Networks of random weights that have every layer, every way of reading one another, and every
//! kind of derivative between them.

use sinew_nn::emit::{Accuracy, Options, Weights};
use sinew_nn::{
    Activation, Cell, Convolution, Dense, Network, Op, Pool, PoolKind, Recurrent, Selection, Window,
};

use super::bench::Case;

/// SplitMix64, as f32 between -1 and 1.
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^= z >> 31;
        (z >> 40) as f32 * (2.0 / 16_777_216.0) - 1.0
    }

    pub fn list(&mut self, count: usize) -> Vec<f32> {
        (0..count).map(|_| self.next()).collect()
    }
}

/// A network under construction: names and sizes take care of themselves.
struct Builder {
    network: Network,
    random: Random,
}

impl Builder {
    fn new(name: &str, shape: &[usize]) -> Self {
        let seed = name.bytes().fold(7_u64, |seed, byte| {
            seed.wrapping_mul(31).wrapping_add(byte.into())
        });
        Self {
            network: Network::new(name, "input", shape.to_vec()),
            random: Random(seed),
        }
    }

    fn last(&self) -> usize {
        self.network.nodes.len() - 1
    }

    fn add(&mut self, op: Op, from: &[usize]) -> usize {
        let name = format!("{} {}", op.kind(), self.network.nodes.len());
        self.network
            .push(&name, op, from.to_vec())
            .unwrap_or_else(|error| panic!("{error}"))
    }

    fn then(&mut self, op: Op) -> &mut Self {
        let last = self.last();
        self.add(op, &[last]);
        self
    }

    fn weights(&mut self, count: usize, fan: usize) -> Vec<f32> {
        let size = (fan as f32).recip();
        (0..count)
            .map(|_| 2.0 * size * self.random.next())
            .collect()
    }

    fn dense_of(&mut self, from: usize, outputs: usize) -> usize {
        let inputs = self.network.nodes[from].len();
        let weights = self.weights(inputs * outputs, 1 + inputs / 2);
        let bias = self.random.list(outputs);
        self.add(Op::Dense(Dense { weights, bias }), &[from])
    }

    fn dense(&mut self, outputs: usize) -> &mut Self {
        let last = self.last();
        self.dense_of(last, outputs);
        self
    }

    fn activation(&mut self, g: Activation) -> &mut Self {
        self.then(Op::Activation(g))
    }

    fn convolution(&mut self, filters: usize, window: Window) -> &mut Self {
        let channels = *self.network.nodes[self.last()].shape.last().unwrap();
        let per_filter = window.size[0] * window.size[1] * channels;
        let weights = self.weights(filters * per_filter, per_filter);
        let bias = self.random.list(filters);
        self.then(Op::Convolution(Convolution {
            window,
            weights,
            bias,
        }))
    }

    fn recurrent(
        &mut self,
        cell: Cell,
        units: usize,
        sequences: bool,
        streaming: bool,
    ) -> &mut Self {
        let inputs = *self.network.nodes[self.last()].shape.last().unwrap();
        let gates = cell.gates();
        let kernel = self.weights(gates * units * inputs, inputs);
        let recurrent = self.weights(gates * units * units, units);
        let bias = self.random.list(gates * units);
        let inner = matches!(
            cell,
            Cell::Gru {
                reset_after: true,
                ..
            }
        );
        let inner_bias = if inner {
            self.random.list(units)
        } else {
            Vec::new()
        };
        self.then(Op::Recurrent(Recurrent {
            cell,
            units,
            kernel,
            recurrent,
            bias,
            inner_bias,
            sequences,
            streaming,
        }))
    }

    fn scale(&mut self) -> &mut Self {
        let channels = *self.network.nodes[self.last()].shape.last().unwrap();
        let gain = (0..channels)
            .map(|_| 1.0 + 0.5 * self.random.next())
            .collect();
        let offset = self.random.list(channels);
        self.then(Op::Scale { gain, offset })
    }

    fn done(&mut self) -> Network {
        self.network.clone()
    }
}

fn window(size: [usize; 2]) -> Window {
    Window {
        size,
        stride: [1; 2],
        dilation: [1; 2],
        before: [0; 2],
        after: [0; 2],
    }
}

fn gru(reset_after: bool) -> Cell {
    Cell::Gru {
        activation: Activation::Tanh,
        gates: Activation::Sigmoid,
        reset_after,
    }
}

const LSTM: Cell = Cell::Lstm {
    activation: Activation::Tanh,
    gates: Activation::Sigmoid,
};
const RNN: Cell = Cell::Simple {
    activation: Activation::Tanh,
};

/// The networks.
pub fn cases() -> Vec<Case> {
    let mut networks = chains();
    networks.extend(convolutions());
    networks.push(branches());
    networks.push(residual());
    networks.extend(products_and_choices());
    networks.extend(bounds_and_logarithms());

    let mut cases: Vec<Case> = networks
        .into_iter()
        .map(|network| case(network, Options::default()))
        .collect();
    cases.extend(accuracies());
    cases.extend(int8());
    cases
}

/// Layers one after another, some with a state.
fn chains() -> Vec<Network> {
    use Activation::{Relu, Sigmoid, Tanh};
    vec![
        Builder::new("linear", &[3]).dense(2).done(),
        Builder::new("one-tanh", &[3])
            .dense(2)
            .activation(Tanh)
            .done(),
        Builder::new("only-softmax", &[4]).then(Op::Softmax).done(),
        Builder::new("only-gelu", &[4])
            .activation(Activation::Gelu)
            .done(),
        Builder::new("mlp", &[12])
            .dense(10)
            .activation(Tanh)
            .dense(3)
            .done(),
        Builder::new("wide", &[5])
            .dense(7)
            .activation(Relu)
            .dense(11)
            .activation(Sigmoid)
            .done(),
        Builder::new("gru-stream", &[15])
            .recurrent(gru(true), 5, false, true)
            .dense(3)
            .done(),
        Builder::new("gru-before-stream", &[15])
            .recurrent(gru(false), 5, false, true)
            .dense(3)
            .done(),
        Builder::new("lstm-stream", &[15])
            .recurrent(LSTM, 5, false, true)
            .dense(3)
            .done(),
        Builder::new("rnn-stream", &[4])
            .recurrent(RNN, 5, false, true)
            .activation(Relu)
            .dense(3)
            .done(),
        Builder::new("two-stream", &[1, 4])
            .recurrent(LSTM, 3, true, true)
            .recurrent(gru(true), 4, false, true)
            .done(),
        Builder::new("gru-sequence", &[6, 3])
            .recurrent(gru(true), 4, true, false)
            .recurrent(gru(false), 3, false, false)
            .dense(2)
            .done(),
        Builder::new("lstm-sequence", &[5, 2])
            .recurrent(LSTM, 3, true, false)
            .recurrent(RNN, 3, true, false)
            .recurrent(LSTM, 4, false, false)
            .done(),
    ]
}

fn convolutions() -> Vec<Network> {
    use Activation::{Relu, Tanh};
    let mut networks = Vec::new();
    let conv = Window {
        stride: [2, 1],
        dilation: [1, 2],
        before: [1, 1],
        after: [0, 1],
        ..window([3, 2])
    };
    let pool = Window {
        stride: [2, 2],
        before: [1, 0],
        after: [0, 1],
        ..window([2, 3])
    };
    for (name, kind) in [
        ("max", PoolKind::Max),
        ("mean", PoolKind::Average),
        ("mean-padded", PoolKind::AverageWithPadding),
    ] {
        let mut builder = Builder::new(&format!("conv2d-{name}"), &[7, 8, 2]);
        builder
            .convolution(3, conv)
            .activation(Tanh)
            .then(Op::Pool(Pool { window: pool, kind }));
        builder.activation(Activation::Swish).dense(3);
        networks.push(builder.done());
    }
    let mut builder = Builder::new("conv1d", &[9, 2]);
    builder
        .convolution(
            4,
            Window {
                before: [0, 1],
                after: [0, 1],
                ..window([1, 3])
            },
        )
        .activation(Relu);
    builder.then(Op::Pool(Pool {
        window: Window {
            stride: [1, 2],
            ..window([1, 2])
        },
        kind: PoolKind::Max,
    }));
    builder
        .scale()
        .then(Op::Permute(vec![1, 0]))
        .activation(Tanh)
        .then(Op::Reshape(vec![16]))
        .dense(2);
    networks.push(builder.done());
    networks
}

/// Every activation of the input and of a dense layer, side by side.
fn branches() -> Network {
    use Activation::{Relu, Sigmoid, Tanh};
    let mut builder = Builder::new("branches", &[6]);
    let parts: Vec<usize> = [
        Relu,
        Activation::LeakyRelu { alpha: 0.2 },
        Activation::Elu {
            alpha: 0.9,
            scale: 1.0,
        },
        Activation::SELU,
        Activation::Gelu,
        Activation::GeluTanh,
        Activation::Softplus,
        Activation::Softsign,
        Activation::Swish,
        Activation::HardSigmoid {
            alpha: 0.4,
            beta: 0.5,
        },
        Sigmoid,
        Tanh,
        Activation::Exponential,
    ]
    .into_iter()
    .map(|g| {
        let dense = builder.dense_of(0, 3);
        let a = builder.add(Op::Activation(g), &[dense]);
        let b = builder.add(Op::Activation(g), &[0]);
        builder.add(Op::Concatenate(0), &[a, b])
    })
    .collect();
    let all = builder.add(Op::Concatenate(0), &parts);
    builder.dense_of(all, 3);
    builder.then(Op::Softmax);
    builder.done()
}

/// Skip connections of images.
fn residual() -> Network {
    use Activation::Tanh;
    let mut builder = Builder::new("residual", &[4, 5, 2]);
    builder.convolution(
        2,
        Window {
            before: [1; 2],
            after: [1; 2],
            ..window([3; 2])
        },
    );
    let a = builder.last();
    builder.activation(Tanh);
    let b = builder.last();
    let sum = builder.add(Op::Add, &[b, 0, a]);
    let beside = builder.add(Op::Concatenate(1), &[sum, b]);
    let over = builder.add(Op::Concatenate(2), &[beside, beside]);
    let pool = builder.add(
        Op::Pool(Pool {
            window: window([4, 10]),
            kind: PoolKind::Average,
        }),
        &[over],
    );
    let flat = builder.add(Op::Reshape(vec![4]), &[pool]);
    builder.add(Op::Softmax, &[flat]);
    builder.dense(2).scale();
    builder.done()
}

/// The same network at other accuracies of tanh.
fn accuracies() -> [Case; 2] {
    let mut precise = Builder::new("precise", &[15])
        .recurrent(gru(true), 5, false, true)
        .dense(3)
        .done();
    precise.name = "gru-precise".into();
    let precise = case(
        precise,
        Options {
            accuracy: Accuracy::Precise,
            ..Options::default()
        },
    );
    let mut rough = Builder::new("rough", &[15])
        .recurrent(gru(true), 5, false, true)
        .dense(3)
        .done();
    rough.name = "gru-rough".into();
    let rough = case(
        rough,
        Options {
            accuracy: Accuracy::Rough,
            ..Options::default()
        },
    );
    [precise, rough]
}

/// Networks with products, choices of values and normalisation.
fn products_and_choices() -> Vec<Network> {
    let select = |shape: &[usize], places: &[Option<usize>]| {
        Op::Select(Selection {
            places: places.to_vec(),
            shape: shape.to_vec(),
        })
    };
    let reversed: Vec<Option<usize>> = (0..12).rev().map(Some).collect();
    let mut networks = Vec::new();

    // A gate, and a square of the input itself.
    let mut builder = Builder::new("products", &[5]);
    let gate = builder.dense_of(0, 4);
    let gate = builder.add(Op::Activation(Activation::Sigmoid), &[gate]);
    let value = builder.dense_of(0, 4);
    let value = builder.add(Op::Activation(Activation::Tanh), &[value]);
    let product = builder.add(Op::Multiply, &[gate, value]);
    let square = builder.add(Op::Multiply, &[0, 0]);
    let both = builder.add(Op::Concatenate(0), &[product, square, product]);
    builder.dense_of(both, 3);
    networks.push(builder.done());

    let mut builder = Builder::new("normalised", &[3, 6]);
    builder
        .then(Op::Normalise { epsilon: 1e-3 })
        .scale()
        .activation(Activation::Tanh)
        .then(Op::Normalise { epsilon: 1e-5 })
        .dense(2);
    networks.push(builder.done());
    let mut builder = Builder::new("only-normalised", &[4]);
    builder.then(Op::Normalise { epsilon: 1e-3 });
    networks.push(builder.done());

    // A slice of the input alone, repeated and padded.
    let mut builder = Builder::new("only-choice", &[6]);
    builder.then(select(&[5], &[Some(5), None, Some(2), Some(2), Some(0)]));
    networks.push(builder.done());

    let mut builder = Builder::new("both-ways", &[4, 3]);
    builder.then(select(&[4, 3], &reversed));
    builder.recurrent(gru(true), 3, false, false);
    let backward = builder.last();
    builder.add(select(&[4, 3], &reversed), &[0]);
    builder.recurrent(LSTM, 3, true, false);
    let last: Vec<Option<usize>> = (9..12).map(Some).collect();
    builder.then(select(&[3], &last));
    let other = builder.last();
    let both = builder.add(Op::Concatenate(0), &[backward, other]);
    builder.dense_of(both, 2);
    networks.push(builder.done());

    // Zeros around an image go into the window, those around it in the middle do not.
    let mut builder = Builder::new("padded", &[3, 2, 2]);
    let zeros = |place: usize| {
        let (row, column, channel) = (place / 10, place / 2 % 5, place % 2);
        let inside = (1..4).contains(&row) && (2..4).contains(&column);
        inside.then(|| ((row - 1) * 2 + column - 2) * 2 + channel)
    };
    let places: Vec<Option<usize>> = (0..50).map(zeros).collect();
    builder
        .then(select(&[5, 5, 2], &places))
        .convolution(2, window([3, 2]))
        .activation(Activation::Tanh)
        .dense(3);
    networks.push(builder.done());

    networks.push(signs());
    networks
}

/// Slopes of negative parameters, and functions of positive numbers.
fn signs() -> Network {
    let mut builder = Builder::new("signs", &[4]);
    let mut parts = Vec::new();
    for g in [
        Activation::LeakyRelu { alpha: -0.6 },
        Activation::LeakyRelu { alpha: -1.0 },
        Activation::LeakyRelu { alpha: 0.0 },
        Activation::Elu {
            alpha: -0.7,
            scale: 1.2,
        },
    ] {
        let dense = builder.dense_of(0, 3);
        parts.push(builder.add(Op::Activation(g), &[dense]));
    }
    for g in [
        Activation::Root,
        Activation::Reciprocal,
        Activation::Logarithm,
    ] {
        let dense = builder.dense_of(0, 3);
        let positive = builder.add(Op::Activation(Activation::Softplus), &[dense]);
        parts.push(builder.add(Op::Activation(g), &[positive]));
        let exponential = builder.add(Op::Activation(Activation::Exponential), &[dense]);
        let scaled = builder.dense_of(exponential, 2);
        let positive = builder.add(Op::Activation(Activation::Exponential), &[scaled]);
        parts.push(builder.add(Op::Activation(g), &[positive]));
    }
    let all = builder.add(Op::Concatenate(0), &parts);
    builder.dense_of(all, 3);
    builder.done()
}

/// Networks with bounds near and far, the larger and smaller of values, and logarithms of softmax
/// close to the largest value and far below it.
fn bounds_and_logarithms() -> Vec<Network> {
    let mut networks = Vec::new();
    let mut builder = Builder::new("clips", &[5]);
    let mut parts = Vec::new();
    for (low, high) in [
        (-0.2, 0.3),
        (f32::NEG_INFINITY, 0.1),
        (-0.1, f32::INFINITY),
        (-1e6, 1e7),
    ] {
        let dense = builder.dense_of(0, 4);
        let clip = Op::Activation(Activation::Clip { low, high });
        parts.push(builder.add(clip.clone(), &[dense]));
        parts.push(builder.add(clip, &[0]));
    }
    let (a, b) = (builder.dense_of(0, 5), builder.dense_of(0, 5));
    parts.push(builder.add(Op::Maximum, &[a, b]));
    parts.push(builder.add(Op::Minimum, &[0, a]));
    parts.push(builder.add(Op::Maximum, &[b, 0]));
    let all = builder.add(Op::Concatenate(0), &parts);
    let (c, d) = (builder.dense_of(all, 3), builder.dense_of(all, 3));
    builder.add(Op::Minimum, &[c, d]);
    networks.push(builder.done());

    let mut builder = Builder::new("only-maximum", &[4]);
    let tanh = builder.add(Op::Activation(Activation::Tanh), &[0]);
    builder.add(Op::Maximum, &[0, tanh]);
    networks.push(builder.done());

    let mut builder = Builder::new("only-log-softmax", &[2, 4]);
    builder.then(Op::LogSoftmax);
    networks.push(builder.done());
    let mut builder = Builder::new("log-softmax-far", &[5]);
    builder.dense(4);
    let far = vec![300.0; 4];
    builder.then(Op::Scale {
        gain: far.clone(),
        offset: far,
    });
    builder.then(Op::LogSoftmax);
    networks.push(builder.done());

    // The slope of a normalisation is that of its own values, which the activation may not take.
    let mut builder = Builder::new("normalised-activated", &[6]);
    builder
        .dense(5)
        .then(Op::Normalise { epsilon: 1e-3 })
        .activation(Activation::Relu)
        .dense(3);
    networks.push(builder.done());
    let mut builder = Builder::new("log-softmax-activated", &[6]);
    builder
        .dense(5)
        .then(Op::LogSoftmax)
        .activation(Activation::Softsign)
        .dense(3);
    networks.push(builder.done());
    networks
}

/// One network of each kind of matrix, with its weights as integers: it is held against the network
/// that these integers make.
fn int8() -> Vec<Case> {
    let networks = [
        Builder::new("int8-mlp", &[12])
            .dense(10)
            .activation(Activation::Tanh)
            .dense(3)
            .done(),
        Builder::new("int8-gru", &[15])
            .recurrent(gru(true), 5, false, true)
            .dense(3)
            .done(),
        Builder::new("int8-gru-before", &[4, 3])
            .recurrent(gru(false), 5, false, false)
            .dense(6)
            .done(),
        Builder::new("int8-lstm", &[4, 3])
            .recurrent(LSTM, 5, true, false)
            .recurrent(RNN, 3, false, false)
            .dense(2)
            .done(),
        Builder::new("int8-conv", &[6, 5, 2])
            .convolution(4, window([3, 2]))
            .activation(Activation::Relu)
            .dense(3)
            .done(),
    ];
    let options = Options {
        weights: Weights::Int8,
        ..Options::default()
    };
    networks
        .map(|network| case(network.quantised(), options))
        .into()
}

/// Three inputs of a few calls.
pub fn case(network: Network, options: Options) -> Case {
    let mut random = Random(network.parameters() as u64);
    let calls = if network.state() > 0 { 6 } else { 1 };
    let inputs = (0..3)
        .map(|_| random.list(calls * network.inputs()))
        .collect();
    // A squared gain of hundreds turns the last digit of a slope of 1 into second derivatives.
    let far = network.name.ends_with("-far");
    let curvature = network.inputs() + network.state() <= 40 && !far;
    Case {
        network,
        options,
        inputs,
        curvature,
        in_qemu: true,
    }
}

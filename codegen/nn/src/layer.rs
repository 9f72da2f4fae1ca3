//! Operations of a node.

use super::Activation;

/// A layer.
#[derive(Clone, Debug, PartialEq)]
pub enum Op {
    /// The input of the network.
    Input,
    /// `W x + b` of everything that it reads.
    Dense(Dense),
    /// Convolution over one or two dimensions, channels last.
    Convolution(Convolution),
    /// The largest or the mean of a window.
    Pool(Pool),
    /// The same values in another shape.
    Reshape(Vec<usize>),
    /// Another order of axes: axis `i` of the result is axis `axes[i]` of what it reads.
    Permute(Vec<usize>),
    /// `gain x + offset`, channel by channel of the last axis.
    Scale {
        /// One for each channel.
        gain: Vec<f32>,
        /// One for each channel.
        offset: Vec<f32>,
    },
    /// A function of each value.
    Activation(Activation),
    /// Softmax over the last axis.
    Softmax,
    /// Logarithm of softmax over the last axis.
    LogSoftmax,
    /// A recurrent layer.
    Recurrent(Recurrent),
    /// The sum of values of equal shape.
    Add,
    /// The product, value by value, of two values of equal shape.
    Multiply,
    /// The larger, value by value, of two values of equal shape.
    Maximum,
    /// The smaller, value by value, of two values of equal shape.
    Minimum,
    /// Values at places of what it reads: slices, reversals, repetitions, padding.
    Select(Selection),
    /// `(x - mean) / sqrt(variance + epsilon)`, with mean and variance of each run of the last
    /// axis.
    Normalise {
        /// Added to the variance.
        epsilon: f32,
    },
    /// Values side by side along this axis.
    Concatenate(usize),
}

/// Values at places of what a layer reads.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Selection {
    /// For each value of the result its place in what is read; none gives zero.
    pub places: Vec<Option<usize>>,
    /// Shape of the result.
    pub shape: Vec<usize>,
}

/// Weights of a dense layer.
#[derive(Clone, Debug, PartialEq)]
pub struct Dense {
    /// `[outputs][inputs]`.
    pub weights: Vec<f32>,
    /// `[outputs]`.
    pub bias: Vec<f32>,
}

/// The window of a convolution or pool; rows, then columns, with one row for one dimension.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// Size.
    pub size: [usize; 2],
    /// Steps between outputs.
    pub stride: [usize; 2],
    /// Steps between elements.
    pub dilation: [usize; 2],
    /// Padding before the first.
    pub before: [usize; 2],
    /// Padding after the last.
    pub after: [usize; 2],
}

/// Weights of a convolution.
///
/// ```
/// use sinew_nn::{Convolution, Network, Op, Window, evaluate};
///
/// // Differences of neighbours: four values in a row, one channel, a window of two.
/// let window = Window { size: [1, 2], stride: [1, 1], dilation: [1, 1], before: [0, 0], after: [0, 0] };
/// let difference = Convolution { window, weights: vec![-1.0, 1.0], bias: vec![0.0] };
/// let mut network = Network::new("difference", "x", vec![1, 4, 1]);
/// network.push("convolution", Op::Convolution(difference), vec![0])?;
/// assert_eq!(network.nodes[1].shape, [1, 3, 1]);
/// assert_eq!(evaluate::call(&network, &[1.0, 4.0, 9.0, 16.0], &[]).y, [3.0, 5.0, 7.0]);
/// # Ok::<(), sinew_nn::NetworkError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Convolution {
    /// Window of each output.
    pub window: Window,
    /// `[filters][rows][columns][channels]`.
    pub weights: Vec<f32>,
    /// `[filters]`.
    pub bias: Vec<f32>,
}

/// A pool.
#[derive(Clone, Debug, PartialEq)]
pub struct Pool {
    /// Window of each output.
    pub window: Window,
    /// Reduction of a window.
    pub kind: PoolKind,
}

/// Reduction of a window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PoolKind {
    /// The largest.
    Max,
    /// The mean of what lies within the image.
    Average,
    /// The mean, padding counted as zeros.
    AverageWithPadding,
}

/// A recurrent layer.
///
/// ```
/// use sinew_nn::{Activation, Cell, Network, Op, Recurrent, evaluate};
///
/// // h' = x + 0.5 h, one step a call.
/// let cell = Cell::Simple { activation: Activation::Linear };
/// let layer = Recurrent {
///     cell,
///     units: 1,
///     kernel: vec![1.0],
///     recurrent: vec![0.5],
///     bias: vec![0.0],
///     inner_bias: vec![],
///     sequences: false,
///     streaming: true,
/// };
/// let mut network = Network::new("leak", "x", vec![1, 1]);
/// network.push("leak", Op::Recurrent(layer), vec![0])?;
/// let call = evaluate::call(&network, &[1.0], &[4.0]);
/// assert_eq!((call.y, call.state), (vec![3.0], vec![3.0]));
/// # Ok::<(), sinew_nn::NetworkError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Recurrent {
    /// Its kind, with its activations.
    pub cell: Cell,
    /// Size of the state.
    pub units: usize,
    /// `[gates][units][inputs]`, the gates in the order of [`Cell`].
    pub kernel: Vec<f32>,
    /// `[gates][units][units]`.
    pub recurrent: Vec<f32>,
    /// `[gates][units]`.
    pub bias: Vec<f32>,
    /// `[units]`: the bias inside the reset of a GRU with `reset_after`; empty otherwise.
    pub inner_bias: Vec<f32>,
    /// True if the output has the hidden state after every step; false if only after the last.
    pub sequences: bool,
    /// True if the hidden state lasts from one call to the next, one step a call; otherwise a call
    /// is a whole sequence, from rest.
    pub streaming: bool,
}

/// The kind of a recurrent layer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cell {
    /// `h' = g(W x + U h + b)`.
    Simple {
        /// `g`.
        activation: Activation,
    },
    /// Gates update, reset, candidate.
    Gru {
        /// Of the candidate.
        activation: Activation,
        /// Of the gates.
        gates: Activation,
        /// True if the reset comes after the recurrent product.
        reset_after: bool,
    },
    /// Gates input, forget, candidate, output.
    Lstm {
        /// Of the candidate and of the cell.
        activation: Activation,
        /// Of the gates.
        gates: Activation,
    },
}

impl Cell {
    /// Number of weight matrices.
    #[must_use]
    pub fn gates(self) -> usize {
        match self {
            Self::Simple { .. } => 1,
            Self::Gru { .. } => 3,
            Self::Lstm { .. } => 4,
        }
    }

    /// Vectors of the layer's size that make up its state.
    #[must_use]
    pub fn vectors(self) -> usize {
        match self {
            Self::Simple { .. } | Self::Gru { .. } => 1,
            Self::Lstm { .. } => 2,
        }
    }

    /// The activations that it uses.
    #[must_use]
    pub fn activations(self) -> Vec<Activation> {
        match self {
            Self::Simple { activation } => vec![activation],
            Self::Gru {
                activation, gates, ..
            }
            | Self::Lstm { activation, gates } => vec![gates, activation],
        }
    }
}

impl Recurrent {
    /// Number of values of one step's input.
    #[must_use]
    pub fn inputs(&self) -> usize {
        self.kernel
            .len()
            .checked_div(self.cell.gates() * self.units)
            .unwrap_or(0)
    }
}

impl Op {
    /// The tensors of the layer: their names in files, and their values.
    #[must_use]
    pub fn tensors(&self) -> Vec<(&'static str, &Vec<f32>)> {
        match self {
            Self::Dense(Dense { weights, bias })
            | Self::Convolution(Convolution { weights, bias, .. }) => {
                vec![("weights", weights), ("bias", bias)]
            }
            Self::Scale { gain, offset } => vec![("gain", gain), ("offset", offset)],
            Self::Recurrent(layer) => {
                let mut tensors = vec![
                    ("kernel", &layer.kernel),
                    ("recurrent", &layer.recurrent),
                    ("bias", &layer.bias),
                ];
                if !layer.inner_bias.is_empty() {
                    tensors.push(("inner_bias", &layer.inner_bias));
                }
                tensors
            }
            _ => Vec::new(),
        }
    }

    /// Number of weights and biases.
    #[must_use]
    pub fn parameters(&self) -> usize {
        self.tensors().iter().map(|(_, values)| values.len()).sum()
    }

    /// Number of values kept from one call to the next.
    #[must_use]
    pub fn state(&self) -> usize {
        match self {
            Self::Recurrent(layer) if layer.streaming => layer.units * layer.cell.vectors(),
            _ => 0,
        }
    }

    /// Name in tables and messages.
    #[must_use]
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Input => "input",
            Self::Dense(_) => "dense",
            Self::Convolution(c) if c.window.size[0] == 1 => "conv1d",
            Self::Convolution(_) => "conv2d",
            Self::Pool(Pool {
                kind: PoolKind::Max,
                ..
            }) => "max_pool",
            Self::Pool(_) => "average_pool",
            Self::Reshape(_) => "reshape",
            Self::Permute(_) => "permute",
            Self::Scale { .. } => "scale",
            Self::Activation(_) => "activation",
            Self::Softmax => "softmax",
            Self::LogSoftmax => "log_softmax",
            Self::Recurrent(layer) => match layer.cell {
                Cell::Simple { .. } => "simple_rnn",
                Cell::Gru { .. } => "gru",
                Cell::Lstm { .. } => "lstm",
            },
            Self::Add => "add",
            Self::Multiply => "multiply",
            Self::Maximum => "maximum",
            Self::Minimum => "minimum",
            Self::Select(_) => "select",
            Self::Normalise { .. } => "normalise",
            Self::Concatenate(_) => "concatenate",
        }
    }
}

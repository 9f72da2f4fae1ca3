//! A GRU or an LSTM as the predictor's first layer (docs/reference/networks.md, eq. 5 and 6).

use crate::network_table::FirstLayer;
use burn::module::{Module, Param};
use burn::tensor::activation::sigmoid;
use burn::tensor::{Device, Tensor, TensorData};
use nalgebra::{DMatrix, DVector};

use super::gates;
use super::linear::{Draws, Linear};
use super::matrix::to_matrix;

/// The layer's weights, the gates side by side: z r n of a GRU, i f g o of an LSTM.
#[derive(Module, Debug)]
pub struct Cell {
    /// For the input, with the biases: `[n][gates units]`.
    kernel: Linear,
    /// For the state: `[units][gates units]`.
    recurrent: Linear,
    /// The bias inside the reset of a GRU, `[1][units]`.
    inner: Option<Param<Tensor<2>>>,
}

/// The same as tensors, with a graph behind them or without.
pub struct Weights {
    kernel: Tensor<2>,
    bias: Tensor<1>,
    recurrent: Tensor<2>,
    inner: Option<Tensor<2>>,
}

/// h of a GRU, h and c of an LSTM, each `[rows][units]`.
pub type State = Vec<Tensor<2>>;

impl Cell {
    /// A layer with drawn weights; one that is no cell gives none.
    pub fn new(
        first: FirstLayer,
        (inputs, units): (usize, usize),
        draws: &mut Draws,
        device: &Device,
    ) -> Option<Self> {
        let gates = gates(first)?;
        let kernel = Linear::without_bias(inputs, gates * units, draws);
        let recurrent = Linear::without_bias(units, gates * units, draws);
        let zeros =
            |n: usize| Tensor::<2>::from_data(TensorData::new(vec![0.0_f32; n], [1, n]), device);
        let inner = (first == FirstLayer::Gru).then(|| Param::from_tensor(zeros(units)));
        // What is to be remembered stays: one on the bias of z, of f.
        let kept = match first {
            FirstLayer::Gru => 0,
            _ => units,
        };
        let bias =
            (0..gates * units).map(|i| f32::from(u8::from((kept..kept + units).contains(&i))));
        let bias = TensorData::new(bias.collect::<Vec<_>>(), [gates * units]);
        let kernel = Linear {
            bias: Some(Param::from_tensor(Tensor::from_data(bias, device))),
            ..kernel
        };
        Some(Self {
            kernel,
            recurrent,
            inner,
        })
    }

    /// The weights, to be learned.
    pub fn learned(&self) -> Weights {
        let kernel = self.kernel.weight.val();
        let [_, width] = kernel.dims();
        let bias = self.kernel.bias.as_ref();
        Weights {
            bias: bias.map_or_else(|| Tensor::zeros([width], &kernel.device()), Param::val),
            kernel,
            recurrent: self.recurrent.weight.val(),
            inner: self.inner.as_ref().map(Param::val),
        }
    }

    /// Input (W, w), recurrent matrix, inner bias of a GRU: rows are gates, one after another.
    pub fn matrices(&self) -> (DMatrix<f64>, DVector<f64>, DMatrix<f64>, Vec<f64>) {
        let weights = self.learned();
        let vector = |values: TensorData| values.iter::<f64>().collect::<Vec<_>>();
        (
            to_matrix(weights.kernel).transpose(),
            DVector::from_vec(vector(weights.bias.into_data())),
            to_matrix(weights.recurrent).transpose(),
            weights
                .inner
                .map_or_else(Vec::new, |inner| vector(inner.into_data())),
        )
    }
}

impl Weights {
    /// The same without a graph: what is computed with them teaches nothing.
    pub fn still(&self) -> Self {
        Self {
            kernel: self.kernel.clone().inner(),
            bias: self.bias.clone().inner(),
            recurrent: self.recurrent.clone().inner(),
            inner: self.inner.clone().map(Tensor::inner),
        }
    }

    /// The state of a network that has seen nothing, for `rows` of them.
    pub fn rest(&self, rows: usize) -> State {
        let [units, _] = self.recurrent.dims();
        let zero = Tensor::zeros([rows, units], &self.recurrent.device());
        match self.inner {
            Some(_) => vec![zero],
            None => vec![zero.clone(), zero],
        }
    }

    /// `W z + b` of all gates.
    pub fn by_input(&self, z: Tensor<2>) -> Tensor<2> {
        z.matmul(self.kernel.clone()) + self.bias.clone().unsqueeze::<2>()
    }

    /// One step, from [`Weights::by_input`].
    pub fn step(&self, by_input: Tensor<2>, state: &State) -> State {
        let [units, _] = self.recurrent.dims();
        let h = state[0].clone();
        let by_state = h.clone().matmul(self.recurrent.clone());
        let part = |t: &Tensor<2>, first: usize, count: usize| {
            t.clone().narrow(1, first * units, count * units)
        };
        if let Some(inner) = &self.inner {
            let gates = sigmoid(part(&by_input, 0, 2) + part(&by_state, 0, 2));
            let (z, r) = (part(&gates, 0, 1), part(&gates, 1, 1));
            let n = (part(&by_input, 2, 1) + r * (part(&by_state, 2, 1) + inner.clone())).tanh();
            return vec![n.clone() + z * (h - n)];
        }
        let sum = by_input + by_state;
        let gates = sigmoid(part(&sum, 0, 2));
        let (i, f) = (part(&gates, 0, 1), part(&gates, 1, 1));
        let (g, o) = (part(&sum, 2, 1).tanh(), sigmoid(part(&sum, 3, 1)));
        let c = f * state[1].clone() + i * g;
        vec![o * c.clone().tanh(), c]
    }
}

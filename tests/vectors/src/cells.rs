//! GRU and LSTM with a linear layer behind, as predictors: the kernels of a printed network, and
//! what it remembers as channels that it predicts.

use sinew_mpc::model::{ChannelJacobian, Jacobian, Model, Regressor};
use sinew_mpc::network::recurrent;
use sinew_mpc::sensitivity::{self, Propagate, Sensitivities, Stage};
use sinew_mpc::tuning::Tuning;

use crate::layers::gru::{self, Gru};
use crate::layers::lstm::{self, Lstm};
use crate::layers::sigmoid::Sigmoid;
use crate::layers::tanh::Tanh;

use super::random::Random;

/// x = (u(k), y(k)), the cell, y(k+1) = W h' + b.
pub struct Readout<C, const H: usize, const NY: usize> {
    /// The recurrent layer.
    pub cell: C,
    /// Weights of the outputs.
    pub w: [[f32; H]; NY],
    /// Their biases.
    pub b: [f32; NY],
}

/// A predictor with weights from a seed.
pub trait Drawn {
    /// The next one.
    fn random(random: &mut Random) -> Self;
}

/// A GRU of H units, its reset gate behind the product.
pub type GruNet<const NX: usize, const H: usize, const NY: usize> =
    Readout<Gru<[[f32; NX]; H], [[f32; H]; H], H>, H, NY>;
/// An LSTM of H units; NS = 2 H channels.
pub type LstmNet<const NX: usize, const H: usize, const NY: usize> =
    Readout<Lstm<[[f32; NX]; H], [[f32; H]; H], H>, H, NY>;

impl<C, const H: usize, const NY: usize> Readout<C, H, NY> {
    fn around(cell: C, random: &mut Random) -> Self {
        Self {
            cell,
            w: random.matrix(0.5),
            b: random.array(0.1),
        }
    }

    fn output(&self, h: &[f32; H]) -> [f32; NY] {
        core::array::from_fn(|r| (0..H).map(|k| self.w[r][k] * h[k]).sum::<f32>() + self.b[r])
    }

    /// Adjoints of the outputs with respect to the state: the transposed weights.
    fn seed(&self) -> [[f32; NY]; H] {
        core::array::from_fn(|k| core::array::from_fn(|r| self.w[r][k]))
    }
}

impl<C, const H: usize, const NY: usize> Tuning for Readout<C, H, NY> {}

fn input<const NX: usize, const NU: usize, const NY: usize, const NS: usize>(
    x: &Regressor<NU, NY, NS, 1, 1>,
) -> [f32; NX] {
    core::array::from_fn(|i| if i < NU { x.u[0][i] } else { x.y[0][i - NU] })
}

/// Transposed: adjoints `[place][result]` to a Jacobian's `[result][place]`, from `start` on.
fn turn<const R: usize, const C: usize>(t: &[[f32; R]], start: usize) -> [[f32; C]; R] {
    core::array::from_fn(|r| core::array::from_fn(|c| t[start + c][r]))
}

fn identity<const H: usize, const R: usize>(start: usize) -> [[f32; R]; H] {
    core::array::from_fn(|k| core::array::from_fn(|r| f32::from(u8::from(r == start + k))))
}

impl<const NX: usize, const H: usize, const NY: usize> Drawn for GruNet<NX, H, NY> {
    fn random(random: &mut Random) -> Self {
        let cell = Gru {
            kernel: core::array::from_fn(|_| random.matrix(0.9)),
            recurrent: core::array::from_fn(|_| random.matrix(0.5)),
            bias: random.matrix(0.2),
            inner_bias: random.array(0.2),
            reset_after: true,
        };
        Self::around(cell, random)
    }
}

impl<const NX: usize, const H: usize, const NU: usize, const NY: usize> Model<NU, NY, H, 1, 1>
    for GruNet<NX, H, NY>
{
    type Trace = gru::Step<f32, H>;
    const TRACE: Self::Trace = gru::Step::ZERO;
    const PREDICTS_CHANNELS: bool = true;

    fn predict(&self, x: &Regressor<NU, NY, H, 1, 1>, step: &mut Self::Trace) -> [f32; NY] {
        gru::step(
            &self.cell,
            Sigmoid,
            Tanh,
            &input::<NX, NU, NY, H>(x),
            &x.s,
            step,
        );
        self.output(&step.state)
    }

    fn channels(&self, _: &Regressor<NU, NY, H, 1, 1>, step: &Self::Trace) -> [f32; H] {
        step.state
    }

    fn jacobian(&self, step: &Self::Trace, jacobian: &mut Jacobian<NU, NY, 1, 1>) {
        let (mut t_h, mut t_x) = (self.seed(), [[0.0; NY]; NX]);
        gru::step_back(&self.cell, Sigmoid, Tanh, step, &mut t_h, &mut t_x);
        jacobian.u = [turn(&t_x, 0)];
        jacobian.y = [turn(&t_x, NU)];
    }

    fn channel_jacobian(
        &self,
        step: &Self::Trace,
        jacobian: &mut ChannelJacobian<NU, NY, H, 1, 1>,
    ) {
        let (mut t_h, mut t_x) = (self.seed(), [[0.0; NY]; NX]);
        gru::step_back(&self.cell, Sigmoid, Tanh, step, &mut t_h, &mut t_x);
        jacobian.y_by_s = turn(&t_h, 0);
        let (mut t_h, mut t_x) = (identity::<H, H>(0), [[0.0; H]; NX]);
        gru::step_back(&self.cell, Sigmoid, Tanh, step, &mut t_h, &mut t_x);
        jacobian.u = [turn(&t_x, 0)];
        jacobian.y = [turn(&t_x, NU)];
        jacobian.s = turn(&t_h, 0);
    }
}

impl<const NX: usize, const H: usize, const NU: usize, const NY: usize> Propagate<NU, NY, H, 1, 1>
    for GruNet<NX, H, NY>
{
    /// Along the commands' directions, as printed predictors do; the LSTM below goes by all of the
    /// Jacobian.
    fn propagate_channels(
        &self,
        step: &Self::Trace,
        stage: &Stage<'_, NY>,
        sensitivities: &mut Sensitivities<'_, NU, NY, 1>,
        channels: &mut [[[f32; NU]; H]],
    ) {
        sensitivity::propagate_along(
            stage,
            sensitivities,
            channels,
            |direction: &sensitivity::Direction<'_, NU, NY, H, 1, 1>| {
                let x: [[f32; NU]; NX] = recurrent::input_along(direction);
                let h = gru::step_along(&self.cell, Sigmoid, Tanh, step, &x, direction.s);
                (recurrent::dense_along(&self.w, &[1.0; NY], &h), h)
            },
        );
    }
}

/// Its channels are the state, then the cell: `NS = 2 H`.
fn halves<const H: usize, T: Copy>(s: &[T]) -> (&[T; H], &[T; H]) {
    let (h, c) = s.split_at(H);
    (
        h.try_into().expect("H of 2 H"),
        c.try_into().expect("H of 2 H"),
    )
}

impl<const NX: usize, const H: usize, const NY: usize> Drawn for LstmNet<NX, H, NY> {
    fn random(random: &mut Random) -> Self {
        let cell = Lstm {
            kernel: core::array::from_fn(|_| random.matrix(0.9)),
            recurrent: core::array::from_fn(|_| random.matrix(0.5)),
            bias: random.matrix(0.2),
        };
        Self::around(cell, random)
    }
}

impl<const NX: usize, const H: usize, const NU: usize, const NY: usize, const NS: usize>
    Model<NU, NY, NS, 1, 1> for LstmNet<NX, H, NY>
{
    type Trace = lstm::Step<f32, H>;
    const TRACE: Self::Trace = lstm::Step::ZERO;
    const PREDICTS_CHANNELS: bool = true;

    fn predict(&self, x: &Regressor<NU, NY, NS, 1, 1>, step: &mut Self::Trace) -> [f32; NY] {
        let flat: [f32; NX] = input(x);
        lstm::step(&self.cell, Sigmoid, Tanh, &flat, halves(&x.s), step);
        self.output(&step.state)
    }

    fn channels(&self, _: &Regressor<NU, NY, NS, 1, 1>, step: &Self::Trace) -> [f32; NS] {
        core::array::from_fn(|i| {
            if i < H {
                step.state[i]
            } else {
                step.cell[i - H]
            }
        })
    }

    fn jacobian(&self, step: &Self::Trace, jacobian: &mut Jacobian<NU, NY, 1, 1>) {
        let (mut t_h, mut t_c, mut t_x) = (self.seed(), [[0.0; NY]; H], [[0.0; NY]; NX]);
        lstm::step_back(
            &self.cell,
            Sigmoid,
            Tanh,
            step,
            (&mut t_h, &mut t_c),
            &mut t_x,
        );
        jacobian.u = [turn(&t_x, 0)];
        jacobian.y = [turn(&t_x, NU)];
    }

    fn channel_jacobian(
        &self,
        step: &Self::Trace,
        jacobian: &mut ChannelJacobian<NU, NY, NS, 1, 1>,
    ) {
        let (mut t_h, mut t_c, mut t_x) = (self.seed(), [[0.0; NY]; H], [[0.0; NY]; NX]);
        lstm::step_back(
            &self.cell,
            Sigmoid,
            Tanh,
            step,
            (&mut t_h, &mut t_c),
            &mut t_x,
        );
        let t: [[f32; NY]; NS] = core::array::from_fn(|i| if i < H { t_h[i] } else { t_c[i - H] });
        jacobian.y_by_s = turn(&t, 0);
        let (mut t_h, mut t_c) = (identity::<H, NS>(0), identity::<H, NS>(H));
        let mut t_x = [[0.0; NS]; NX];
        lstm::step_back(
            &self.cell,
            Sigmoid,
            Tanh,
            step,
            (&mut t_h, &mut t_c),
            &mut t_x,
        );
        jacobian.u = [turn(&t_x, 0)];
        jacobian.y = [turn(&t_x, NU)];
        let t: [[f32; NS]; NS] = core::array::from_fn(|i| if i < H { t_h[i] } else { t_c[i - H] });
        jacobian.s = turn(&t, 0);
    }
}

impl<const NX: usize, const H: usize, const NU: usize, const NY: usize, const NS: usize>
    Propagate<NU, NY, NS, 1, 1> for LstmNet<NX, H, NY>
{
}

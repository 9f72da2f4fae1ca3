//! Predictor that runs on an estimated state (docs/explanation/controller.md, eq. 19).

use crate::filter::{Filter, MeasurementJacobian, StateSpace, TransitionJacobian};
use crate::model::{ChannelJacobian, Jacobian, Model, Regressor};
use crate::sensitivity::{self, Propagate, Sensitivities, Stage};
use crate::tuning::Tuning;

/// State-space model with its parameters and disturbance as they are estimated now: a [`Model`]
/// whose channels are the state.
///
/// There are no past inputs or outputs. `Regressor::s` is x(k+j), `Regressor::u` the command, and
/// `Regressor::y` is not read. Outputs are the first `NY` measurements. Sensitivities are `NX` by
/// blocks, instead of a register of past outputs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StatePredictor<S, const NU: usize, const NP: usize> {
    /// Transition and measurements.
    pub model: S,
    /// Parameters, held over the horizon.
    pub theta: [f32; NP],
    /// Disturbance of the inputs, held over the horizon.
    pub disturbance: [f32; NU],
}

/// Intermediate values of a prediction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StateTrace<T, const NX: usize> {
    /// Those of the transition.
    transition: T,
    /// The state that was reached.
    x: [f32; NX],
}

impl<S, const NU: usize, const NP: usize> StatePredictor<S, NU, NP> {
    /// Takes over what a filter has estimated.
    pub fn follow<const NX: usize, const NM: usize, const NZ: usize>(
        &mut self,
        filter: &Filter<NX, NU, NM, NP, NZ>,
    ) {
        self.theta = *filter.theta();
        self.disturbance = *filter.disturbance();
    }
}

/// The model as a predictor of `NY` outputs, the first of its `NM` measurements.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outputs<S, const NU: usize, const NM: usize, const NP: usize>(
    pub StatePredictor<S, NU, NP>,
);

impl<
    S: StateSpace<NX, NU, NM, NP>,
    const NX: usize,
    const NU: usize,
    const NY: usize,
    const NM: usize,
    const NP: usize,
> Model<NU, NY, NX, 1, 1> for Outputs<S, NU, NM, NP>
{
    type Trace = StateTrace<S::Trace, NX>;

    const TRACE: Self::Trace = StateTrace {
        transition: S::TRACE,
        x: [0.0; NX],
    };

    const PREDICTS_CHANNELS: bool = true;

    #[inline(always)]
    fn predict(&self, x: &Regressor<NU, NY, NX, 1, 1>, trace: &mut Self::Trace) -> [f32; NY] {
        const { assert!(NY <= NM, "outputs are the first measurements") };
        let [mut u] = x.u;
        for (u, d) in u.iter_mut().zip(&self.0.disturbance) {
            *u += d;
        }
        let theta = &self.0.theta;
        trace.x = self
            .0
            .model
            .transition(&x.s, &u, theta, &mut trace.transition);
        let mut y = [0.0; NY];
        for (y, m) in y.iter_mut().zip(self.0.model.measure(&trace.x, theta)) {
            *y = m;
        }
        y
    }

    #[inline(always)]
    fn channels(&self, _: &Regressor<NU, NY, NX, 1, 1>, trace: &Self::Trace) -> [f32; NX] {
        trace.x
    }

    fn jacobian(&self, trace: &Self::Trace, jacobian: &mut Jacobian<NU, NY, 1, 1>) {
        let (f, h) = self.derivatives(trace);
        *jacobian = Jacobian::ZERO;
        sensitivity::add_product(&mut jacobian.u[0], &h, &f.u);
    }

    fn channel_jacobian(
        &self,
        trace: &Self::Trace,
        jacobian: &mut ChannelJacobian<NU, NY, NX, 1, 1>,
    ) {
        let (f, h) = self.derivatives(trace);
        sensitivity::add_product(&mut jacobian.y_by_s, &h, &f.x);
        jacobian.u[0] = f.u;
        jacobian.s = f.x;
    }
}

impl<S, const NU: usize, const NM: usize, const NP: usize> Outputs<S, NU, NM, NP> {
    /// Derivatives of the next state, and of the outputs in it.
    #[inline(always)]
    fn derivatives<const NX: usize, const NY: usize>(
        &self,
        trace: &StateTrace<S::Trace, NX>,
    ) -> (TransitionJacobian<NX, NU, NP>, [[f32; NX]; NY])
    where
        S: StateSpace<NX, NU, NM, NP>,
    {
        let (mut f, mut h) = (TransitionJacobian::ZERO, MeasurementJacobian::ZERO);
        self.0.model.transition_jacobian(&trace.transition, &mut f);
        self.0
            .model
            .measurement_jacobian(&trace.x, &self.0.theta, &mut h);
        let mut outputs = [[0.0; NX]; NY];
        for (row, of_measurement) in outputs.iter_mut().zip(&h.x) {
            *row = *of_measurement;
        }
        (f, outputs)
    }
}

impl<S, const NU: usize, const NM: usize, const NP: usize> Tuning for Outputs<S, NU, NM, NP> {}

impl<
    S: StateSpace<NX, NU, NM, NP>,
    const NX: usize,
    const NU: usize,
    const NY: usize,
    const NM: usize,
    const NP: usize,
> Propagate<NU, NY, NX, 1, 1> for Outputs<S, NU, NM, NP>
{
    /// dx(k+j+1)/dv = F dx(k+j)/dv + B du(k+j)/dv and dy/dv = H dx/dv (eq. 19): per block with an
    /// effect `NU NX (NX + NY)` multiply-adds.
    fn propagate_channels(
        &self,
        trace: &Self::Trace,
        stage: &Stage<'_, NY>,
        sensitivities: &mut Sensitivities<'_, NU, NY, 1>,
        channels: &mut [[[f32; NU]; NX]],
    ) {
        let (f, h) = self.derivatives::<NX, NY>(trace);
        sensitivity::propagate_along(stage, sensitivities, channels, |direction| {
            let mut x = [[0.0; NU]; NX];
            sensitivity::add_product(&mut x, &f.x, direction.s);
            let [weight] = direction.u;
            if weight > 0.0 {
                sensitivity::add_scaled(&mut x, weight, &f.u);
            }
            let mut y = [[0.0; NU]; NY];
            sensitivity::add_product(&mut y, &h, &x);
            (y, x)
        });
    }
}

//! A predictor whose derivatives are differences of its predictions: what exact ones are held
//! against, in instructions (`cargo xtask bench differences`) and in accuracy.

use sinew_mpc::model::{Jacobian, Model, Regressor};
use sinew_mpc::sensitivity::{self, Propagate, Sensitivities, Stage};
use sinew_mpc::tuning::Tuning;

/// Step of a difference, model units: about the root of f32's resolution, where rounding and
/// curvature are level, and a power of two.
pub const STEP: f32 = 1.0 / 2048.0;

/// A predictor without its own derivatives.
pub struct Differenced<M>(pub M);

impl<M, const NU: usize, const NY: usize, const NS: usize, const ND: usize, const DD: usize>
    Model<NU, NY, NS, ND, DD> for Differenced<M>
where
    M: Model<NU, NY, NS, ND, DD>,
{
    /// Regressor of the prediction, and the outputs there.
    type Trace = (Regressor<NU, NY, NS, ND, DD>, [f32; NY]);

    const TRACE: Self::Trace = (
        Regressor {
            u: [[0.0; NU]; ND],
            y: [[0.0; NY]; DD],
            s: [0.0; NS],
        },
        [0.0; NY],
    );

    fn predict(&self, x: &Regressor<NU, NY, NS, ND, DD>, trace: &mut Self::Trace) -> [f32; NY] {
        let y = self.0.predict(x, &mut { M::TRACE });
        *trace = (*x, y);
        y
    }

    fn jacobian(&self, trace: &Self::Trace, jacobian: &mut Jacobian<NU, NY, ND, DD>) {
        self.inputs(trace, ND, jacobian);
        let (mut x, y) = *trace;
        for i in 0..DD {
            for c in 0..NY {
                let was = x.y[i][c];
                x.y[i][c] = was + STEP;
                let moved = self.0.predict(&x, &mut { M::TRACE });
                x.y[i][c] = was;
                for r in 0..NY {
                    jacobian.y[i][r][c] = (moved[r] - y[r]) / STEP;
                }
            }
        }
    }
}

impl<M: Tuning> Tuning for Differenced<M> {
    const COMMAND_WEIGHT: f32 = M::COMMAND_WEIGHT;
    const OBSERVER_GAIN: f32 = M::OBSERVER_GAIN;
}

impl<M, const NU: usize, const NY: usize, const NS: usize, const ND: usize, const DD: usize>
    Propagate<NU, NY, NS, ND, DD> for Differenced<M>
where
    M: Model<NU, NY, NS, ND, DD> + Tuning,
{
    /// As generated models do, the first prediction of a horizon is derived by u(k) alone.
    fn propagate(
        &self,
        trace: &Self::Trace,
        stage: &Stage<'_, NY>,
        sensitivities: &mut Sensitivities<'_, NU, NY, DD>,
    ) {
        let mut jacobian = Jacobian::<NU, NY, ND, DD>::ZERO;
        if stage.active_before == 0 {
            self.inputs(trace, 1, &mut jacobian);
        } else {
            self.jacobian(trace, &mut jacobian);
        }
        sensitivity::propagate(&jacobian, stage, sensitivities);
    }
}

impl<M> Differenced<M> {
    /// By the newest `lags` inputs.
    fn inputs<const NU: usize, const NY: usize, const NS: usize, const ND: usize, const DD: usize>(
        &self,
        (x, y): &(Regressor<NU, NY, NS, ND, DD>, [f32; NY]),
        lags: usize,
        jacobian: &mut Jacobian<NU, NY, ND, DD>,
    ) where
        M: Model<NU, NY, NS, ND, DD>,
    {
        let mut x = *x;
        for i in 0..lags.min(ND) {
            for c in 0..NU {
                let was = x.u[i][c];
                x.u[i][c] = was + STEP;
                let moved = self.0.predict(&x, &mut { M::TRACE });
                x.u[i][c] = was;
                for r in 0..NY {
                    jacobian.u[i][r][c] = (moved[r] - y[r]) / STEP;
                }
            }
        }
    }
}

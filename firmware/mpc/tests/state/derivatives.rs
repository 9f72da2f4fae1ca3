//! Gradient through the state against differences of J, and the two ways to the Hessian.

use proptest::prelude::*;
use sinew_mpc::rollout::Trajectory;
use sinew_mpc::sensitivity::{Propagate, Sensitivities, Stage, propagate_channels};
use sinew_mpc::state_predictor::{Outputs, StatePredictor};
use sinew_mpc::{Bounds, Horizons, Model, Problem, Quadratic, Regressor, Tuning, Weights};

use crate::common::cases;
use crate::mass::{INPUTS, MEASUREMENTS, Mass, OUTPUTS, PARAMETERS, STATES};

/// The predictor with the generic propagation, by the full Jacobian.
struct Generic(Outputs<Mass, INPUTS, MEASUREMENTS, PARAMETERS>);

type Shape = Regressor<INPUTS, OUTPUTS, STATES, 1, 1>;

impl Model<INPUTS, OUTPUTS, STATES, 1, 1> for Generic {
    type Trace =
        <Outputs<Mass, INPUTS, MEASUREMENTS, PARAMETERS> as Model<1, 1, STATES, 1, 1>>::Trace;
    const TRACE: Self::Trace =
        <Outputs<Mass, INPUTS, MEASUREMENTS, PARAMETERS> as Model<1, 1, STATES, 1, 1>>::TRACE;
    const PREDICTS_CHANNELS: bool = true;

    fn predict(&self, x: &Shape, trace: &mut Self::Trace) -> [f32; 1] {
        self.0.predict(x, trace)
    }

    fn channels(&self, x: &Shape, trace: &Self::Trace) -> [f32; STATES] {
        Model::<1, 1, STATES, 1, 1>::channels(&self.0, x, trace)
    }

    fn jacobian(&self, trace: &Self::Trace, jacobian: &mut sinew_mpc::Jacobian<1, 1, 1, 1>) {
        Model::<1, 1, STATES, 1, 1>::jacobian(&self.0, trace, jacobian);
    }

    fn channel_jacobian(
        &self,
        trace: &Self::Trace,
        jacobian: &mut sinew_mpc::model::ChannelJacobian<1, 1, STATES, 1, 1>,
    ) {
        self.0.channel_jacobian(trace, jacobian);
    }
}

impl Tuning for Generic {}

impl Propagate<INPUTS, OUTPUTS, STATES, 1, 1> for Generic {
    fn propagate_channels(
        &self,
        trace: &Self::Trace,
        stage: &Stage<'_, OUTPUTS>,
        sensitivities: &mut Sensitivities<'_, INPUTS, OUTPUTS, 1>,
        channels: &mut [[[f32; INPUTS]; STATES]],
    ) {
        let mut jacobian = sinew_mpc::Jacobian::ZERO;
        let mut of_channels = sinew_mpc::model::ChannelJacobian::ZERO;
        self.jacobian(trace, &mut jacobian);
        self.channel_jacobian(trace, &mut of_channels);
        propagate_channels(&jacobian, &of_channels, stage, sensitivities, channels);
    }
}

/// J and its derivatives at a plan.
fn quadratic<M: Propagate<1, 1, STATES, 1, 1>>(
    model: &M,
    start: [f32; STATES],
    plan: &[f32; 3],
) -> (f32, Quadratic<3>) {
    let problem = Problem {
        model,
        start: &Regressor {
            u: [[0.0]],
            y: [[0.0]],
            s: start,
        },
        disturbance: &[0.0],
        reference: &[[0.3]; 9],
        weights: Weights {
            tracking: [100.0],
            moves: [1e-4],
        },
        bounds: &Bounds {
            lower: [-20.0],
            upper: [20.0],
            rate: [10.0; 3],
            previous: [0.5],
        },
        horizons: &Horizons::<9, 3>::new(2, [1, 3, 2]),
    };
    let mut trajectory = Trajectory::new(M::TRACE, ());
    let mut quadratic = Quadratic::new();
    let cost = problem.rollout(plan, &mut trajectory);
    problem.linearise(plan, &trajectory, &mut quadratic);
    (cost, quadratic)
}

proptest! {
    #![proptest_config(cases(200))]
    #[test]
    fn the_gradient_is_the_slope_of_the_cost_and_both_ways_agree(
        q in -0.4_f32..0.4,
        v in -0.5_f32..0.5,
        plan in prop::array::uniform3(-15.0_f32..15.0),
        theta in prop::array::uniform4(0.7_f32..1.3),
        disturbance in -1.0_f32..1.0,
    ) {
        let predictor = Outputs(StatePredictor { model: Mass, theta, disturbance: [disturbance] });
        let (_, exact) = quadratic(&predictor, [q, v], &plan);
        let scale = exact.gradient.iter().fold(0.0_f32, |m, g| m.max(g.abs()));
        for i in 0..3 {
            let at = |change: f32| {
                let mut moved = plan;
                moved[i] += change;
                f64::from(quadratic(&predictor, [q, v], &moved).0)
            };
            let step = 0.05;
            // Half of the gradient, by differences of fourth order.
            let near = (at(step) - at(-step)) / (2.0 * f64::from(step));
            let far = (at(2.0 * step) - at(-2.0 * step)) / (4.0 * f64::from(step));
            let slope = 0.5 * (4.0 * near - far) / 3.0;
            let error = (f64::from(exact.gradient[i]) - slope).abs();
            prop_assert!(error < 0.02 * f64::from(scale) + 1e-3, "{i}: {:?} {slope}", exact);
        }
        let (_, generic) = quadratic(&Generic(predictor), [q, v], &plan);
        for (a, b) in exact.gradient.iter().zip(&generic.gradient) {
            prop_assert!((a - b).abs() <= 1e-5 * scale, "{exact:?} {generic:?}");
        }
        let pairs = exact.hessian.as_flattened().iter().zip(generic.hessian.as_flattened());
        for (a, b) in pairs {
            prop_assert!((a - b).abs() <= 1e-5 * (a.abs() + b.abs()) + 1e-9, "{a} {b}");
        }
    }
}

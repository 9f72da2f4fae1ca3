//! The emitted transition and controller of a model with a state: weights in flash, and the noise
//! and prior of its filter.

use super::HEADER;
use super::parts::{Parts, budget, narrow};
use crate::spec::{Layer, ModelSpec, StateSpec};
use sinew_nn::literal;

/// The emitted `src/network.rs`.
pub(super) fn network(spec: &ModelSpec, state: &StateSpec) -> String {
    let [Layer::Dense(hidden), Layer::Dense(output)] = &spec.layers[..] else {
        unreachable!("a validated model with a state has two dense layers");
    };
    let n_u = spec.inputs.len();
    let n_x = state.states.len();
    let units = hidden.outputs;
    // The layers take (u, x, theta), the kernel (x, u, theta).
    let ordered = |row: &[f32]| -> Vec<String> {
        let (u, rest) = row.split_at(n_u);
        let (x, theta) = rest.split_at(n_x);
        let ordered = x.iter().chain(u).chain(theta);
        ordered.map(|v| literal::float(*v)).collect()
    };
    let rows = |rows: &mut dyn Iterator<Item = Vec<String>>| literal::matrix(rows, 4);
    let plain = |row: &[f32]| row.iter().map(|v| literal::float(*v)).collect::<Vec<_>>();
    let list = |values: &[f32], beside: usize| literal::block(plain(values), 4, beside);
    let skip = spec.skip.as_deref().unwrap_or_default();
    let linear = rows(&mut skip.chunks(spec.regressor_len()).map(ordered));
    let hidden_rows = rows(&mut hidden.rows().map(ordered));
    let output_rows = rows(&mut output.rows().map(plain));
    let measurement = rows(&mut state.measurement.rows().map(plain));
    let bias = list(&output.bias, 6);
    let hidden_bias = list(&hidden.bias, 13);
    let measurement_bias = list(&state.measurement.bias, 18);
    let budget = budget(spec).unwrap_or_default();
    format!(
        "//! The transition and the measurement: weights in flash.
//!
//! {HEADER}

use sinew_mpc::filter::{{self, StateSpace}};
use sinew_mpc::network::state::StateNetwork;

use crate::control::{{ESTIMATED, MEASUREMENTS, NU, PARAMETERS, STATES}};

type TransitionJacobian = filter::TransitionJacobian<STATES, NU, PARAMETERS>;
type MeasurementJacobian = filter::MeasurementJacobian<STATES, MEASUREMENTS, PARAMETERS>;

/// Hidden units.
pub const UNITS: usize = {units};

/// The network of this model.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Network;

impl StateSpace<STATES, NU, MEASUREMENTS, PARAMETERS> for Network {{
    type Trace = [f32; UNITS];
    const TRACE: Self::Trace = [0.0; UNITS];
{budget}
    #[inline(always)]
    fn transition(
        &self,
        x: &[f32; STATES],
        u: &[f32; NU],
        theta: &[f32; PARAMETERS],
        trace: &mut Self::Trace,
    ) -> [f32; STATES] {{
        WEIGHTS.transition(x, u, theta, trace)
    }}

    #[inline(always)]
    fn transition_jacobian(&self, trace: &Self::Trace, jacobian: &mut TransitionJacobian) {{
        WEIGHTS.transition_jacobian(trace, jacobian);
    }}

    #[inline(always)]
    fn measure(&self, x: &[f32; STATES], theta: &[f32; PARAMETERS]) -> [f32; MEASUREMENTS] {{
        WEIGHTS.measure(x, theta)
    }}

    #[inline(always)]
    fn measurement_jacobian(
        &self,
        x: &[f32; STATES],
        theta: &[f32; PARAMETERS],
        jacobian: &mut MeasurementJacobian,
    ) {{
        WEIGHTS.measurement_jacobian(x, theta, jacobian);
    }}
}}

/// Columns of `linear` and `hidden`: states, inputs, parameters.
#[rustfmt::skip]
static WEIGHTS: StateNetwork<STATES, NU, MEASUREMENTS, PARAMETERS, ESTIMATED, UNITS> = StateNetwork {{
    linear: {linear},
    bias: {bias},
    hidden: {hidden_rows},
    hidden_bias: {hidden_bias},
    output: {output_rows},
    measurement: {measurement},
    measurement_bias: {measurement_bias},
}};
"
    )
}

/// Parts of the emitted `src/control.rs`.
pub(super) fn parts(spec: &ModelSpec, state: &StateSpec) -> Parts {
    let control = &spec.control;
    let states = state.states.len();
    let parameters = state.parameters.len();
    let tracking_weight = narrow(&control.tracking_weight);
    let move_suppression = narrow(&control.move_suppression);
    let (iterations, max_missing_samples) = (control.iterations, control.max_missing_samples);
    let of_states = |value: fn(&crate::spec::State) -> f64| {
        narrow(&state.states.iter().map(value).collect::<Vec<_>>())
    };
    let of_parameters = |value: fn(&crate::spec::Parameter) -> f64| {
        narrow(&state.parameters.iter().map(value).collect::<Vec<_>>())
    };
    let rest = of_states(|s| s.rest);
    let rest_deviation = of_states(|s| s.rest_deviation);
    let state_deviation = of_states(|s| s.deviation);
    let state_noise = of_states(|s| s.noise);
    let parameter_noise = of_parameters(|p| p.noise);
    let lower = of_parameters(|p| p.lower);
    let upper = of_parameters(|p| p.upper);
    let measurement_noise = narrow(&state.measurement_noise);
    let deviation = literal::float(state.disturbance_deviation as f32);
    let gain = literal::float(control.disturbance_gain as f32);
    let gate = literal::float(state.gate as f32);
    let signals = spec.outputs.iter().chain(spec.seen_channels());
    let span = narrow(&signals.clone().map(|s| s.span).collect::<Vec<_>>());
    let offset = narrow(&signals.map(|s| s.offset).collect::<Vec<_>>());
    Parts {
        uses: "use sinew_mpc::filter::{Filter, FilterSettings, Prior};
use sinew_mpc::limits::Limits;
use sinew_mpc::move_blocking::Horizons;
use sinew_mpc::predictive_loop::DISTURBANCE_NOISE;
use sinew_mpc::problem::Weights;
use sinew_mpc::scaling::{ModelScaling, Scaling};
use sinew_mpc::state_loop::{StateLoop, StateSettings};
"
        .into(),
        settings: format!(
            "/// States.
pub const STATES: usize = {states};
/// Parameters that the filter estimates.
pub const PARAMETERS: usize = {parameters};
/// Measurements: outputs and channels.
pub const MEASUREMENTS: usize = NY + NS;
/// All that the filter estimates: states, a disturbance of each input, parameters.
pub const ESTIMATED: usize = STATES + NU + PARAMETERS;

/// Scaling of inputs and measurements.
#[rustfmt::skip]
pub const MEASUREMENT_SCALING: ModelScaling<NU, MEASUREMENTS, 0> = ModelScaling {{
    u: SCALING.u,
    y: Scaling {{ span: {span}, offset: {offset} }},
    s: Scaling {{ span: [], offset: [] }},
}};

/// Initial settings of the controller; a session may change them.
#[rustfmt::skip]
pub const SETTINGS: StateSettings<NU, NY> = StateSettings {{
    weights: Weights {{ tracking: {tracking_weight}, moves: {move_suppression} }},
    iterations: {iterations},
}};

/// Assumptions of the filter before any reading, model units.
#[rustfmt::skip]
pub const PRIOR: Prior<STATES, NU, PARAMETERS> = Prior {{
    x: {rest},
    rest_deviation: {rest_deviation},
    state_deviation: {state_deviation},
    disturbance_deviation: [{deviation}; NU],
    theta: [0.0; PARAMETERS],
    parameter_deviation: [1.0; PARAMETERS],
    lower: {lower},
    upper: {upper},
}};

/// Noise and rules of the filter, model units; a session may change the disturbance's.
#[rustfmt::skip]
pub const FILTER: FilterSettings<STATES, NU, MEASUREMENTS, PARAMETERS> = FilterSettings {{
    state_noise: {state_noise},
    disturbance_noise: [DISTURBANCE_NOISE * {gain}; NU],
    parameter_noise: {parameter_noise},
    measurement_noise: {measurement_noise},
    gate: {gate},
    adapt: true,
    max_missing_samples: {max_missing_samples},
}};

"
        ),
        types: TYPES.into(),
    }
}

const TYPES: &str = "\
/// The controller of this model.
pub type Controller = StateLoop<
    Network,
    STATES,
    NU,
    NY,
    MEASUREMENTS,
    PARAMETERS,
    ESTIMATED,
    1,
    HORIZON,
    MOVE_BLOCKS,
    DECISIONS,
>;

/// The controller with frames around it.
pub type Session = session::LoopSession<Controller, NU, NY, NS, HORIZON>;

/// A controller at rest.
pub const fn controller() -> Controller {
    let filter = Filter::new(PRIOR, FILTER);
    StateLoop::new(
        Network,
        MEASUREMENT_SCALING,
        LIMITS,
        SETTINGS,
        filter,
        HORIZONS,
    )
}

/// A session at rest: what a board feeds with bytes.
pub const fn session() -> Session {
    Session::within(controller(), LIMITS, IDENTITY)
}
";

//! The emitted `src/value.rs`, and what a cost-to-go changes in `src/control.rs`.

use super::{HEADER, soft_sensor};
use crate::spec::{ControlSpec, ModelSpec};
use crate::value::{PointRows, ValueRows};
use sinew_nn::literal;

/// Constants of the horizon.
pub(super) fn horizon(control: &ControlSpec) -> String {
    let predicted = control.horizon;
    match control.value {
        None => format!(
            "/// Steps that are predicted.
pub const HORIZON: usize = {predicted};
"
        ),
        Some(_) => format!(
            "/// Rows of the reference that a step sees: those of the predicted steps, and those ahead.
pub const HORIZON: usize = {};
/// Steps that are predicted.
pub const PREDICTED: usize = {predicted};
",
            control.preview()
        ),
    }
}

/// Name of the number of predicted steps.
pub(super) fn predicted(control: &ControlSpec) -> &'static str {
    match control.value {
        None => "HORIZON",
        Some(_) => "PREDICTED",
    }
}

/// Types of controller and session.
pub(super) fn types(spec: &ModelSpec) -> String {
    let inner = INNER.replace("    NS,", &format!("    {},", soft_sensor::seen_name(spec)));
    match &spec.soft_sensor {
        None => format!(
            "/// The controller of this model.
pub type Controller = {inner};
{TYPES}"
        ),
        Some(sensor) => soft_sensor::types(sensor, &inner, "Predictor::new()"),
    }
}

const INNER: &str = "\
ControlLoop<
    Predictor,
    NU,
    NY,
    NS,
    PAST_INPUTS,
    PAST_OUTPUTS,
    PREDICTED,
    MOVE_BLOCKS,
    DECISIONS,
    HORIZON,
>";

const TYPES: &str = "
/// The controller with frames around it.
pub type Session = session::LoopSession<Controller, NU, NY, NS, HORIZON>;

/// A controller at rest.
pub const fn controller() -> Controller {
    ControlLoop::new(Predictor::new(), SCALING, LIMITS, SETTINGS, HORIZONS)
}

/// A session at rest: what a board feeds with bytes.
pub const fn session() -> Session {
    Session::within(controller(), LIMITS, IDENTITY)
}
";

/// The emitted `src/value.rs`.
pub(super) fn print(spec: &ModelSpec, value: &ValueRows) -> String {
    let rows = value.points.first().map_or(0, |point| point.offset.len());
    let n_points = value.points.len();
    let direction = list(&value.direction);
    let channels = soft_sensor::seen(spec);
    let points: String = value.points.iter().map(|p| point(spec, p)).collect();
    format!(
        "//! The cost-to-go at the end of the horizon: rows in flash.
//!
//! {HEADER}

use sinew_mpc::cost::{{self, CostTerm}};
use sinew_mpc::model;
use sinew_mpc::terminal::{{ValuePoint, Valued}};

use crate::control::{{MOVE_BLOCKS, {channels}, NU, NY, PAST_INPUTS, PAST_OUTPUTS}};
use crate::network::Network;

type Regressor = model::Regressor<NU, NY, NS, PAST_INPUTS, PAST_OUTPUTS>;
type End<'a, const NB: usize> = cost::End<'a, NU, NY, NS, PAST_OUTPUTS, NB>;

/// Rows.
pub const ROWS: usize = {rows};

/// The network with its cost-to-go.
#[derive(Clone, Debug)]
pub struct Predictor(Valued<Network, NU, NY, NS, PAST_INPUTS, PAST_OUTPUTS, ROWS>);

impl Predictor {{
    /// Before any step.
    #[must_use]
    pub const fn new() -> Self {{
        Self(Valued::new(Network, DIRECTION, &POINTS))
    }}
}}

impl Default for Predictor {{
    fn default() -> Self {{
        Self::new()
    }}
}}

// Code of this crate, which is compiled for speed.
impl CostTerm<NU, NY, NS, PAST_INPUTS, PAST_OUTPUTS> for Predictor {{
    type Model = Network;
    type Residuals = [f32; ROWS];
    const RESIDUALS: [f32; ROWS] = [0.0; ROWS];

    #[inline(always)]
    fn model(&self) -> &Network {{
        self.0.model()
    }}

    #[inline(never)]
    fn prepare(&mut self, reference: &[[f32; NY]], disturbance: &[f32]) {{
        self.0.prepare(reference, disturbance);
    }}

    #[inline(never)]
    fn cost_to_go(&self, end: &Regressor, residuals: &mut [f32; ROWS]) -> f32 {{
        self.0.cost_to_go(end, residuals)
    }}

    #[inline(always)]
    fn linearise_cost_to_go<const NB: usize>(
        &self,
        residuals: &[f32; ROWS],
        end: &End<NB>,
        gradient: &mut [[f32; NU]],
        pairs: &mut [[[f32; NU]; NU]],
    ) {{
        if let Some(end) = end.with_blocks() {{
            self.linearise(residuals, &end, gradient, pairs);
        }}
    }}
}}

impl Predictor {{
    #[inline(never)]
    fn linearise(
        &self,
        residuals: &[f32; ROWS],
        end: &End<MOVE_BLOCKS>,
        gradient: &mut [[f32; NU]],
        pairs: &mut [[[f32; NU]; NU]],
    ) {{
        self.0.linearise_cost_to_go(residuals, end, gradient, pairs);
    }}
}}

/// Direction of the outputs along which the operating points lie.
#[rustfmt::skip]
pub const DIRECTION: [f32; NY] = {direction};

/// Rows at the operating points.
#[rustfmt::skip]
pub static POINTS: [ValuePoint<NU, NY, NS, PAST_INPUTS, PAST_OUTPUTS, ROWS>; {n_points}] = [
{points}];
"
    )
}

fn point(spec: &ModelSpec, point: &PointRows) -> String {
    let disturbance = point.disturbance.iter().map(|column| numbers(column));
    let channels = spec.seen_channels().len();
    debug_assert_eq!(channels, 0, "a cost-to-go is for models without channels");
    format!(
        "    ValuePoint {{
        at: {at},
        u: {u},
        y: {y},
        s: [[0.0; NS]; ROWS],
        offset: {offset},
        disturbance: &{disturbance},
        reference: &{reference},
    }},
",
        at = literal::float(point.at as f32),
        u = matrices(&point.u),
        y = matrices(&point.y),
        offset = list(&point.offset),
        disturbance = literal::matrix(disturbance, 8),
        reference = matrices(&point.reference),
    )
}

/// Matrices, one under another.
fn matrices(lags: &[Vec<Vec<f64>>]) -> String {
    let mut text = String::from("[\n");
    for rows in lags {
        let rows = literal::matrix(rows.iter().map(|row| numbers(row)), 12);
        text.push_str(&format!("            {rows},\n"));
    }
    text + "        ]"
}

fn list(values: &[f64]) -> String {
    literal::list(numbers(values))
}

fn numbers(values: &[f64]) -> Vec<String> {
    let number = |value: &f64| literal::float(*value as f32);
    values.iter().map(number).collect()
}

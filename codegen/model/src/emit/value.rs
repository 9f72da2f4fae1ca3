//! The emitted `src/value.rs`, and what a cost-to-go changes in `src/control.rs`.

use super::HEADER;
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

pub(super) const TYPES: &str = "\
/// The network with its cost-to-go.
pub type Predictor = Valued<Network, NU, NY, NS, PAST_INPUTS, PAST_OUTPUTS, ROWS>;

/// The controller of this model.
pub type Controller = ControlLoop<
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
>;

/// The controller with frames around it.
pub type Session = session::LoopSession<Controller, NU, NY, NS, HORIZON>;

/// A controller at rest.
pub const fn controller() -> Controller {
    let predictor = Valued::new(Network, DIRECTION, &POINTS);
    ControlLoop::new(predictor, SCALING, LIMITS, SETTINGS, HORIZONS)
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
    let points: String = value.points.iter().map(|p| point(spec, p)).collect();
    format!(
        "//! The cost-to-go at the end of the horizon: rows in flash.
//!
//! {HEADER}

use sinew_mpc::terminal::ValuePoint;

use crate::control::{{NS, NU, NY, PAST_INPUTS, PAST_OUTPUTS}};

/// Rows.
pub const ROWS: usize = {rows};

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
    let channels = spec.channels.len();
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

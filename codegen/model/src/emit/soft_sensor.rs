//! The emitted `src/soft_sensor.rs`, and what a soft sensor changes in the other files.

use super::scaling::scaling;
use super::{EmitOptions, HEADER, golden};
use crate::spec::{ModelSpec, Role, SoftSensorSpec, WatchSpec};
use sinew_nn::literal;

/// Import of the number of channels that the network sees.
pub(super) fn seen(spec: &ModelSpec) -> &'static str {
    match spec.soft_sensor {
        None => "NS",
        Some(_) => "SEEN as NS",
    }
}

/// Its name in `src/control.rs`.
pub(super) fn seen_name(spec: &ModelSpec) -> &'static str {
    match spec.soft_sensor {
        None => "NS",
        Some(_) => "SEEN",
    }
}

/// Its constant.
pub(super) fn seen_constant(spec: &ModelSpec) -> &'static str {
    match spec.soft_sensor {
        None => "",
        Some(_) => {
            "/// Channels that the network sees: the soft sensor takes them all.
pub const SEEN: usize = 0;
"
        }
    }
}

/// Import of the statics of the emitted `src/soft_sensor.rs`.
pub(super) fn names(spec: &ModelSpec) -> &'static str {
    if watch(spec).is_some() {
        "use crate::soft_sensor::{PRODUCTS, RELATION, SENSOR};\n"
    } else {
        "use crate::soft_sensor::{PRODUCTS, SENSOR};\n"
    }
}

/// Import of the judge of the channels.
pub(super) fn watch_type(spec: &ModelSpec) -> &'static str {
    match watch(spec) {
        None => "",
        Some(_) => "use sinew_mpc::channel_watch::ChannelWatch;\n",
    }
}

fn watch(spec: &ModelSpec) -> Option<&WatchSpec> {
    spec.soft_sensor.as_ref()?.watch.as_ref()
}

/// The types of a controller whose own type is `inner`, made by `ControlLoop::new(predictor, ..)`.
pub(super) fn types(sensor: &SoftSensorSpec, inner: &str, predictor: &str) -> String {
    let (judge, made) = match sensor.watch {
        None => ("", "SensedLoop::new(regulator, &SENSOR)"),
        Some(_) => (
            ", ChannelWatch<NS>",
            "SensedLoop::watched(regulator, &SENSOR, ChannelWatch::new(&RELATION))",
        ),
    };
    format!(
        "/// The controller behind the soft sensor.
pub type Regulator = {inner};

/// The controller of this model.
pub type Controller = SensedLoop<Regulator, NS, NY, PRODUCTS, SEEN, HORIZON{judge}>;

/// The controller with frames around it.
pub type Session = session::LoopSession<Controller, NU, NY, NS, HORIZON>;

/// A controller at rest.
pub const fn controller() -> Controller {{
    // The network sees no channel.
    let scaling = ModelScaling {{
        u: SCALING.u,
        y: SCALING.y,
        s: Scaling::IDENTITY,
    }};
    let regulator = ControlLoop::new({predictor}, scaling, LIMITS, SETTINGS, HORIZONS);
    {made}
}}

/// A session at rest: what a board feeds with bytes.
pub const fn session() -> Session {{
    Session::within(controller(), LIMITS, IDENTITY)
}}
"
    )
}

/// The emitted `src/soft_sensor.rs`.
pub(super) fn print(spec: &ModelSpec, sensor: &SoftSensorSpec, options: &EmitOptions) -> String {
    let (n_s, n_y) = (spec.channels.len(), spec.outputs.len());
    let products = SoftSensorSpec::products(n_s);
    let numbers = |row: &[f32]| row.iter().map(|v| literal::float(*v)).collect::<Vec<_>>();
    let rows = |values: &[f32], n: usize| literal::matrix(values.chunks(n).map(numbers), 4);
    let vectors = options.golden_vectors;
    format!(
        "//! The soft sensor: the outputs, from channels in flash-held weights.
//!
//! {HEADER}

{of_watch}use sinew_mpc::scaling::Scaling;
use sinew_mpc::soft_sensor::SoftSensor;

use crate::control::{{NS, NY}};

/// Products of two channels.
pub const PRODUCTS: usize = {products};

/// The map of this device.
#[rustfmt::skip]
pub static SENSOR: SoftSensor<NS, NY, PRODUCTS> = SoftSensor {{
    channels: {channels},
    outputs: {outputs},
    bias: {bias},
    linear: {linear},
    quadratic: {quadratic},
}};

{relation}/// Channels in physical units, and the outputs that double precision makes of them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Golden {{
    /// Channels.
    pub channels: [f32; {n_s}],
    /// Outputs.
    pub outputs: [f64; {n_y}],
}}

/// Vectors drawn from seed {seed}. Nothing in a controller refers to them, so they take no flash.
#[rustfmt::skip]
pub static GOLDEN: [Golden; {vectors}] = [
{golden}];
",
        of_watch = match sensor.watch {
            None => "",
            Some(_) => "use sinew_mpc::channel_watch::Consistency;\n",
        },
        relation = sensor.watch.as_ref().map(relation).unwrap_or_default(),
        channels = scaling(spec, Role::Channel),
        outputs = scaling(spec, Role::Output),
        bias = literal::block(numbers(&sensor.bias), 4, 6),
        linear = rows(&sensor.linear, n_s),
        quadratic = rows(&sensor.quadratic, products),
        seed = options.golden_seed,
        golden = drawn(spec, sensor, options),
    )
}

/// The static by which channels are judged.
fn relation(watch: &WatchSpec) -> String {
    let numbers = |row: &[f32]| row.iter().map(|v| literal::float(*v)).collect::<Vec<_>>();
    let n_s = watch.bias.len();
    format!(
        "/// Readings of each channel by the others, and its spread about them.
#[rustfmt::skip]
pub static RELATION: Consistency<NS> = Consistency {{
    bias: {bias},
    weights: {weights},
    spread: {spread},
}};

",
        bias = literal::block(numbers(&watch.bias), 4, 6),
        weights = literal::matrix(watch.weights.chunks(n_s).map(numbers), 4),
        spread = literal::block(numbers(&watch.spread), 4, 6),
    )
}

/// Vectors over the range of the calibration.
fn drawn(spec: &ModelSpec, sensor: &SoftSensorSpec, options: &EmitOptions) -> String {
    let mut state = options.golden_seed;
    let vector = |_| {
        let physical = |signal: &crate::spec::Signal, z: f64| signal.span * z + signal.offset;
        let channels: Vec<f32> = (spec.channels.iter())
            .map(|signal| physical(signal, f64::from(golden::uniform(&mut state))) as f32)
            .collect();
        let each = spec.channels.iter().zip(&channels);
        let z: Vec<f64> = each
            .map(|(s, v)| (f64::from(*v) - s.offset) / s.span)
            .collect();
        let y = sensor.outputs(&z);
        let outputs = spec
            .outputs
            .iter()
            .zip(y)
            .map(|(signal, y)| physical(signal, y));
        format!(
            "    Golden {{
        channels: {},
        outputs: {},
    }},
",
            literal::block(channels.iter().copied().map(literal::float), 8, 11),
            literal::block(outputs.map(literal::double), 8, 10),
        )
    };
    (0..options.golden_vectors).map(vector).collect()
}

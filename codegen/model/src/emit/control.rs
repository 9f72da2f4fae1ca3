//! The emitted `src/control.rs`: shapes, scaling, limits, settings, and the controller they make.

use super::HEADER;
use super::parts::{Parts, budget, narrow};
use super::scaling::scaling;
use super::{soft_sensor, value};
use crate::fingerprint::fingerprint;
use crate::spec::{ModelSpec, Role};
use sinew_nn::literal;

pub(super) fn print(spec: &ModelSpec) -> String {
    let control = &spec.control;
    let (n_u, n_y, measured) = (spec.inputs.len(), spec.outputs.len(), spec.channels.len());
    let n_s = measured + spec.hidden_state_len();
    let (past_inputs, past_outputs) = (spec.past_inputs, spec.past_outputs);
    let control_horizon = control.control_horizon;
    let blocks = control.blocks();
    let (n_blocks, decisions) = (blocks.len(), blocks.len() * n_u);
    let lengths = literal::list(blocks.iter().map(ToString::to_string));
    let first_step = control.first_step;
    let period_s = spec.period_s;
    let rate_mhz = rate_mhz(period_s);
    let model = fingerprint(spec);
    let [u, y, s] = Role::ALL.map(|role| scaling(spec, role));
    let limits = limits(spec);
    let parts = match &spec.state {
        None => regression(spec),
        Some(state) => super::state::parts(spec, state),
    };
    let Parts {
        uses,
        settings,
        types,
    } = parts;
    format!(
        "//! The control problem: shapes, scaling, limits, settings, and the controller they make.
//!
//! {HEADER}

use sinew_device::protocol::{{Identity, PROTOCOL}};
use sinew_device::session;
{uses}
{modules}
/// Commands.
pub const NU: usize = {n_u};
/// Outputs.
pub const NY: usize = {n_y};
/// Channels: sensors, then the hidden state of the network.
pub const NS: usize = {n_s};
/// Channels that are sensors.
pub const MEASURED: usize = {measured};
{seen_constant}/// Values of each command that the network sees, the one being decided included.
pub const PAST_INPUTS: usize = {past_inputs};
/// Values of each output that the network sees, the present one included.
pub const PAST_OUTPUTS: usize = {past_outputs};
{horizon}/// Steps that are decided; the last command is held after them.
pub const CONTROL_HORIZON: usize = {control_horizon};
/// Blocks of equal moves that these steps have.
pub const MOVE_BLOCKS: usize = {n_blocks};
/// Decision variables: `MOVE_BLOCKS * NU`.
pub const DECISIONS: usize = {decisions};
/// The period, seconds.
pub const PERIOD_S: f32 = {period};

/// Physical units to model units and back.
#[rustfmt::skip]
pub const SCALING: ModelScaling<NU, NY, NS> = ModelScaling {{
    u: {u},
    y: {y},
    s: {s},
}};

/// Bounds of the commands in physical units, and of their change in one step. Rounded inwards to
/// f32: what is within these is within the model's limits.
#[rustfmt::skip]
pub const LIMITS: Limits<NU> = {limits};

{settings}/// The first step that counts, and the lengths of the blocks of equal moves.
#[rustfmt::skip]
pub const HORIZONS: Horizons<{predicted}, MOVE_BLOCKS> = Horizons::new({first_step}, {lengths});

/// Identity that the device reports.
pub const IDENTITY: Identity = Identity {{
    protocol: PROTOCOL,
    model: 0x{model:08x},
    n_u: NU as u8,
    n_y: NY as u8,
    n_s: MEASURED as u8,
    past_inputs: PAST_INPUTS as u8,
    past_outputs: PAST_OUTPUTS as u8,
    horizon: HORIZON as u8,
    control_horizon: CONTROL_HORIZON as u8,
    rate_mhz: {rate_mhz},
}};

{types}",
        period = literal::float(period_s as f32),
        seen_constant = soft_sensor::seen_constant(spec),
        horizon = value::horizon(control),
        modules = modules(spec),
        predicted = value::predicted(control),
    )
}

/// Imports from the other files of the crate.
fn modules(spec: &ModelSpec) -> String {
    let sensor = soft_sensor::names(spec);
    let lines = [
        (true, "use crate::network::Network;\n"),
        (spec.soft_sensor.is_some(), sensor),
        (
            spec.control.value.is_some(),
            "use crate::value::Predictor;\n",
        ),
    ];
    let present = lines.into_iter().filter(|(present, _)| *present);
    present.map(|(_, line)| line).collect()
}

/// The parts of a model on past readings.
fn regression(spec: &ModelSpec) -> Parts {
    let control = &spec.control;
    let tracking_weight = narrow(&control.tracking_weight);
    let move_suppression = narrow(&control.move_suppression);
    let disturbance_gain = literal::float(control.disturbance_gain as f32);
    let tuning = tuning(spec);
    let sensed_loop = match spec.soft_sensor {
        None => "",
        Some(_) => "use sinew_mpc::soft_sensor::SensedLoop;\n",
    };
    let watch = soft_sensor::watch_type(spec);
    let (iterations, max_missing_samples) = (control.iterations, control.max_missing_samples);
    Parts {
        uses: format!(
            "{watch}use sinew_mpc::controller::{{ControlLoop, Settings}};
use sinew_mpc::limits::Limits;
use sinew_mpc::move_blocking::Horizons;
use sinew_mpc::scaling::{{ModelScaling, Scaling}};
{sensed_loop}use sinew_mpc::tuning::Tuning;
"
        ),
        settings: format!(
            "/// Initial settings of the controller; a session may change them.
#[rustfmt::skip]
pub const SETTINGS: Settings<NU, NY> = Settings {{
    tracking_weight: {tracking_weight},
    move_suppression: {move_suppression},
    disturbance_gain: {disturbance_gain},
    iterations: {iterations},
    max_missing_samples: {max_missing_samples},
}};

/// Weights that are fixed when the controller is compiled.
impl Tuning for Network {tuning}

"
        ),
        types: match (&control.value, &spec.soft_sensor) {
            (Some(_), _) => value::types(spec),
            (None, None) => REGRESSION_TYPES.into(),
            (None, Some(sensor)) => soft_sensor::types(sensor, BEHIND_SENSOR, "Network"),
        },
    }
}

/// Body of `Tuning`: the constants that differ from its defaults.
fn tuning(spec: &ModelSpec) -> String {
    let control = &spec.control;
    let constants = [
        ("COMMAND_WEIGHT", control.command_weight as f32, 0.0),
        ("OBSERVER_GAIN", control.observer_gain as f32, 1.0),
    ];
    let differ = constants.iter().filter(|(_, value, usual)| value != usual);
    let lines: String = differ
        .map(|(name, value, _)| format!("    const {name}: f32 = {};\n", literal::float(*value)))
        .chain(budget(spec))
        .collect();
    match &lines[..] {
        "" => "{}".into(),
        lines => format!("{{\n{lines}}}"),
    }
}

/// The controller behind a soft sensor.
const BEHIND_SENSOR: &str = "\
ControlLoop<Network, NU, NY, SEEN, PAST_INPUTS, PAST_OUTPUTS, HORIZON, MOVE_BLOCKS, DECISIONS>";

const REGRESSION_TYPES: &str = "\
/// The controller of this model.
pub type Controller =
    ControlLoop<Network, NU, NY, NS, PAST_INPUTS, PAST_OUTPUTS, HORIZON, MOVE_BLOCKS, DECISIONS>;

/// The controller with frames around it.
pub type Session = session::Session<
    Network,
    NU,
    NY,
    NS,
    PAST_INPUTS,
    PAST_OUTPUTS,
    HORIZON,
    MOVE_BLOCKS,
    DECISIONS,
>;

/// A controller at rest.
pub const fn controller() -> Controller {
    ControlLoop::new(Network, SCALING, LIMITS, SETTINGS, HORIZONS)
}

/// A session at rest: what a board feeds with bytes.
pub const fn session() -> Session {
    Session::new(controller(), IDENTITY)
}
";

/// The rate in millihertz, to the nearest; a rate beyond u32 cannot come out of a valid period.
fn rate_mhz(period_s: f64) -> u32 {
    (1e3 / period_s).round() as u32
}

fn limits(spec: &ModelSpec) -> String {
    let control = &spec.control;
    let row = |values: &[f64], narrow: fn(f64) -> f32| {
        literal::list(values.iter().map(|&x| literal::float(narrow(x))))
    };
    let rate: Vec<f64> = control
        .rate_limit
        .iter()
        .map(|rate| rate * spec.period_s)
        .collect();
    // At an end of its range, the safe command is rounded as that end is.
    let range = control.lower.iter().zip(&control.upper);
    let safe = range
        .zip(&control.safe)
        .map(|((&lower, &upper), &safe)| (safe as f32).clamp(up(lower), down(upper)));
    format!(
        "Limits {{\n    lower: {},\n    upper: {},\n    rate: {},\n    safe: {},\n}}",
        row(&control.lower, up),
        row(&control.upper, down),
        row(&rate, down),
        literal::list(safe.map(literal::float)),
    )
}

/// The largest f32 that is not above `x`.
fn down(x: f64) -> f32 {
    let nearest = x as f32;
    if f64::from(nearest) > x {
        nearest.next_down()
    } else {
        nearest
    }
}

/// The smallest f32 that is not below `x`.
fn up(x: f64) -> f32 {
    -down(-x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_are_rounded_inwards() {
        let mut moved = 0;
        for i in 1..1000 {
            let x = f64::from(i) * 0.1;
            assert!(f64::from(down(x)) <= x && f64::from(up(x)) >= x);
            assert!(up(x) == down(x) || up(x) == down(x).next_up());
            moved += i32::from(up(x) != x as f32 || down(x) != x as f32);
        }
        assert!(
            moved > 500,
            "nearest was inwards already: this tests nothing"
        );
        assert_eq!((down(0.5), up(-0.5)), (0.5, -0.5));
        assert_eq!(
            (down(f64::INFINITY), up(f64::NEG_INFINITY)),
            (f32::INFINITY, f32::NEG_INFINITY)
        );
    }

    #[test]
    fn the_rate_of_a_period() {
        assert_eq!(rate_mhz(1.0 / 120.0), 120_000);
        assert_eq!(rate_mhz(1000.0), 1);
    }
}

//! The tendon platform.

use super::PLAIN;
use super::paths::{circle, eight, tendon_path};
use crate::experiments::problem::{Knowledge, Problem, Variant};
use crate::experiments::targets::{Target, errors};

macro_rules! tendon_tables {
    ($network:literal) => {
        concat!(
            "[control]\nrate_hz = 120.0\noutputs = [\"tip_x\", \"tip_y\", \"tip_z\"]\nhorizon = 10\ncontrol_horizon = 3\n\n",
            "[network]\n",
            $network,
            "derivative_weight = 1.0\n"
        )
    };
}

/// Control and network of the tendon platform.
const TENDON_TABLES: &str = tendon_tables!("hidden = [8]\npast_inputs = 4\npast_outputs = 8\n");
const TENDON_CHANNELS: &str = tendon_tables!(
    "hidden = [8]\npast_inputs = 3\npast_outputs = 3\nchannels = [\"light_1\", \"light_2\", \"light_3\", \"light_4\", \"light_5\", \
     \"light_6\", \"light_7\", \"light_8\", \"light_9\", \"light_10\", \"light_11\"]\n"
);
const TENDON_RELU: &str = tendon_tables!(
    "hidden = [8]\nfirst_layer = \"relu\"\npast_inputs = 3\npast_outputs = 3\nchannels = [\"light_1\", \"light_2\", \"light_3\", \"light_4\", \"light_5\", \
     \"light_6\", \"light_7\", \"light_8\", \"light_9\", \"light_10\", \"light_11\"]\n"
);
/// No reading of the tip: the eleven fibres say it. Tuned from a calm start, as below: from a
/// hundredth of this move suppression the search ends where the tip swings.
const TENDON_FIBRES: &str = "[control]\nrate_hz = 120.0\noutputs = [\"tip_x\", \"tip_y\", \"tip_z\"]\nhorizon = 10\ncontrol_horizon = 3\n\
     move_suppression = [1.0, 1.0]\n\
     sensed_by = [\"light_1\", \"light_2\", \"light_3\", \"light_4\", \"light_5\", \"light_6\", \"light_7\", \"light_8\", \
     \"light_9\", \"light_10\", \"light_11\"]\n\n\
     [network]\nhidden = [8]\npast_inputs = 3\npast_outputs = 3\nderivative_weight = 1.0\n";
const TENDON_LAGS: &str = tendon_tables!("hidden = [8]\npast_inputs = 3\npast_outputs = 3\n");

/// The network of [`TENDON_LAGS`] with a cost-to-go at the end of a short horizon of one move.
macro_rules! tendon_value {
    ($horizon:literal) => {
        concat!(
            "[control]\nrate_hz = 120.0\noutputs = [\"tip_x\", \"tip_y\", \"tip_z\"]\nhorizon = ",
            $horizon,
            "\ncontrol_horizon = 1\nterminal = \"value\"\n\n",
            "[network]\nhidden = [8]\npast_inputs = 3\npast_outputs = 3\nderivative_weight = 1.0\n"
        )
    };
}

/// The 32 inputs without the derivatives, tuned from a calm start: from a hundredth of this move
/// suppression a search in loops that are late ends where the tip swings.
pub const TENDON_CALM: &str = "[control]\nrate_hz = 120.0\noutputs = [\"tip_x\", \"tip_y\", \"tip_z\"]\nhorizon = 10\ncontrol_horizon = 3\n\
     move_suppression = [1.0, 1.0]\n\n[network]\nhidden = [8]\npast_inputs = 4\npast_outputs = 8\n";

/// Reference of the tendon platform, and what tuning follows.
pub const EIGHT: [fn() -> String; 2] = [|| tendon_path(eight, 14.0), || tendon_path(circle, 10.0)];

/// The tendon platform on a figure of eight; the plants' tendons rub and have slack.
pub const TENDON: Problem = Problem {
    name: "tendon",
    nominal: "rigs/tendon.toml",
    known: "",
    amplitude: "1",
    kind: "mixed",
    left_out: "rigs/experiments/tendon.left-out.toml",
    paths: Some(EIGHT),
    judged: None,
    delay: "0.008",
    disturbance: "none",
    textbook: false,
    rate_hz: 500.0,
    evaluations: ("120", Some("240")),
    variants: &[
        Variant {
            name: "15-8-3",
            tables: Some(TENDON_LAGS),
            tune: &["--horizons", "10", "--control-horizons", "3"],
            ..PLAIN
        },
        Variant {
            name: "small",
            small: Some("15-8-3"),
            ..PLAIN
        },
        Variant {
            name: "one-iteration",
            tables: Some(TENDON_LAGS),
            network_of: Some("15-8-3"),
            tune: &[
                "--horizons",
                "10",
                "--control-horizons",
                "3",
                "--iterations",
                "1",
            ],
            ..PLAIN
        },
        Variant {
            name: "32-8-3",
            tables: Some(TENDON_TABLES),
            tune: &["--horizons", "10", "--control-horizons", "3"],
            ..PLAIN
        },
        Variant {
            name: "26-8-3-channels",
            tables: Some(TENDON_CHANNELS),
            tune: &["--horizons", "10", "--control-horizons", "3"],
            ..PLAIN
        },
        Variant {
            name: "fibres-alone",
            tables: Some(TENDON_FIBRES),
            tune: &["--horizons", "10", "--control-horizons", "3"],
            ..PLAIN
        },
        Variant {
            // As published, but for its tanh behind the outputs.
            name: "26-8-3-relu",
            tables: Some(TENDON_RELU),
            tune: &["--horizons", "10", "--control-horizons", "3"],
            ..PLAIN
        },
        Variant {
            name: "horizon-1",
            tables: Some(TENDON_LAGS),
            network_of: Some("15-8-3"),
            tune: &["--horizons", "1", "--control-horizons", "1"],
            ..PLAIN
        },
        Variant {
            name: "value-1",
            tables: Some(tendon_value!("1")),
            network_of: Some("15-8-3"),
            tune: &["--horizons", "1", "--control-horizons", "1"],
            ..PLAIN
        },
        Variant {
            name: "value-2",
            tables: Some(tendon_value!("2")),
            network_of: Some("15-8-3"),
            tune: &["--horizons", "2", "--control-horizons", "1"],
            ..PLAIN
        },
        Variant {
            name: "value-3",
            tables: Some(tendon_value!("3")),
            network_of: Some("15-8-3"),
            tune: &["--horizons", "3", "--control-horizons", "1"],
            ..PLAIN
        },
        Variant {
            name: "no-estimate",
            tables: Some(TENDON_LAGS),
            network_of: Some("15-8-3"),
            tune: &[
                "--horizons",
                "10",
                "--control-horizons",
                "3",
                "--disturbance-gain",
                "0",
            ],
            ..PLAIN
        },
        Variant {
            name: "corrected",
            knows: Knowledge::Corrected,
            tables: Some(TENDON_LAGS),
            tune: &["--horizons", "10", "--control-horizons", "3"],
            ..PLAIN
        },
    ],
    targets: |comparison| {
        let [(rms, _), (_, worst)] = errors(comparison, None);
        vec![
            Target::most("tip error, RMS, median of the loops", 1.0, rms, "mm"),
            Target::most("tip error, worst of all loops", 2.0, worst, "mm"),
        ]
    },
};

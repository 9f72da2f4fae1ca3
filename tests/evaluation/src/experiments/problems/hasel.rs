//! The HASEL platform.

use super::PLAIN;
use super::paths::{small_swirl, swirl, table};
use crate::experiments::problem::{Problem, Variant};
use crate::experiments::targets::{Target, errors};

macro_rules! supply_delay {
    ($k:literal) => {
        concat!(
            "[[effect]]\nkind = \"input_delay\"\ncomponent = \"supply_",
            $k,
            "\"\ndelay = { value = 0.008, min = 0.0, max = 0.02 }\n\n"
        )
    };
}

macro_rules! hasel_tables {
    ($hidden:literal, $inputs:literal, $outputs:literal) => {
        concat!(
            "[control]\nrate_hz = 125.0\noutputs = [\"tip_x\", \"tip_y\", \"tip_z\"]\nhorizon = 10\ncontrol_horizon = 2\ncommand_weight = 0.008\n\n",
            "[network]\nhidden = ",
            $hidden,
            "\npast_inputs = ",
            $inputs,
            "\npast_outputs = ",
            $outputs,
            "\nobserver_gain = 0.6\nderivative_weight = 1.0\n"
        )
    };
}

/// The network of [`HASEL_TABLES`] with a cost-to-go at the end of a short horizon of one move.
macro_rules! hasel_value {
    ($horizon:literal) => {
        concat!(
            "[control]\nrate_hz = 125.0\noutputs = [\"tip_x\", \"tip_y\", \"tip_z\"]\nhorizon = ",
            $horizon,
            "\ncontrol_horizon = 1\ncommand_weight = 0.008\nterminal = \"value\"\n\n",
            "[network]\nhidden = [8]\npast_inputs = 2\npast_outputs = 3\nobserver_gain = 0.6\n\
             derivative_weight = 1.0\n"
        )
    };
}

macro_rules! hasel_memory {
    ($first:literal) => {
        concat!(
            "[control]\nrate_hz = 125.0\noutputs = [\"tip_x\", \"tip_y\", \"tip_z\"]\nhorizon = 10\ncontrol_horizon = 2\ncommand_weight = 0.008\n\n",
            "[network]\nhidden = [5]\nfirst_layer = \"",
            $first,
            "\"\npast_inputs = 2\npast_outputs = 1\n"
        )
    };
}

const HASEL_TABLES: &str = hasel_tables!("[8]", "2", "3");
/// No reading of the tip: the magnets say it.
const HASEL_MAGNETS: &str = "[control]\nrate_hz = 125.0\noutputs = [\"tip_x\", \"tip_y\", \"tip_z\"]\nhorizon = 10\ncontrol_horizon = 2\n\
     command_weight = 0.008\nsensed_by = [\
     \"field_1x\", \"field_1y\", \"field_1z\", \"field_2x\", \"field_2y\", \"field_2z\", \
     \"field_3x\", \"field_3y\", \"field_3z\", \"field_4x\", \"field_4y\", \"field_4z\", \
     \"field_5x\", \"field_5y\", \"field_5z\", \"field_6x\", \"field_6y\", \
     \"field_6z\"]\n\n\
     [network]\nhidden = [8]\npast_inputs = 2\npast_outputs = 3\nobserver_gain = 0.6\nderivative_weight = 1.0\n";
/// Six inputs that are alike, and a worst moment that is asked for
/// (docs/lab/0067-input-redundancy.md).
const HASEL_TUNE: &[&str] = &[
    "--horizons",
    "10",
    "--control-horizons",
    "2",
    "--tied",
    "--objective",
    "peak",
];

/// The HASEL platform on the published swirl; the plants creep and remember.
pub const HASEL: Problem = Problem {
    name: "hasel",
    nominal: "rigs/hasel.toml",
    // One period between a command and its voltage, as the owner knows from the amplifiers' bus;
    // without it in the model the controller swings the plate up.
    known: concat!(
        supply_delay!("1"),
        supply_delay!("2"),
        supply_delay!("3"),
        supply_delay!("4"),
        supply_delay!("5"),
        supply_delay!("6")
    ),
    amplitude: "0.65",
    // Sines of six supplies range over +-11 mm, where the path goes to 7; levels at random throw
    // the tip to 24 mm and more, and noise is reckoned by the range.
    kind: "multisine",
    left_out: "rigs/experiments/hasel.left-out.toml",
    paths: Some([
        || table(swirl, 22.0, 125.0),
        || table(small_swirl, 11.5, 125.0),
    ]),
    // Until it goes home: foam that has crept then keeps the plate up to 0.8 mm below where the
    // path ends, and voltages only pull.
    judged: Some("0,19"),
    delay: "0",
    disturbance: "none",
    textbook: false,
    // Its own: a step of 8 ms.
    rate_hz: 125.0,
    evaluations: ("120", None),
    variants: &[
        Variant {
            name: "21-8-3",
            tables: Some(HASEL_TABLES),
            tune: HASEL_TUNE,
            ..PLAIN
        },
        Variant {
            name: "small",
            small: Some("21-8-3"),
            ..PLAIN
        },
        Variant {
            name: "one-iteration",
            tables: Some(HASEL_TABLES),
            network_of: Some("21-8-3"),
            tune: &[
                "--horizons",
                "10",
                "--control-horizons",
                "2",
                "--iterations",
                "1",
                "--tied",
                "--objective",
                "peak",
            ],
            ..PLAIN
        },
        Variant {
            name: "magnets-alone",
            tables: Some(HASEL_MAGNETS),
            tune: HASEL_TUNE,
            ..PLAIN
        },
        Variant {
            name: "horizon-1",
            tables: Some(HASEL_TABLES),
            network_of: Some("21-8-3"),
            tune: &[
                "--horizons",
                "1",
                "--control-horizons",
                "1",
                "--tied",
                "--objective",
                "peak",
            ],
            ..PLAIN
        },
        Variant {
            name: "value-1",
            tables: Some(hasel_value!("1")),
            network_of: Some("21-8-3"),
            tune: &[
                "--horizons",
                "1",
                "--control-horizons",
                "1",
                "--tied",
                "--objective",
                "peak",
            ],
            ..PLAIN
        },
        Variant {
            name: "value-2",
            tables: Some(hasel_value!("2")),
            network_of: Some("21-8-3"),
            tune: &[
                "--horizons",
                "2",
                "--control-horizons",
                "1",
                "--tied",
                "--objective",
                "peak",
            ],
            ..PLAIN
        },
        Variant {
            name: "value-3",
            tables: Some(hasel_value!("3")),
            network_of: Some("21-8-3"),
            tune: &[
                "--horizons",
                "3",
                "--control-horizons",
                "1",
                "--tied",
                "--objective",
                "peak",
            ],
            ..PLAIN
        },
        Variant {
            name: "no-estimate",
            tables: Some(HASEL_TABLES),
            network_of: Some("21-8-3"),
            tune: &[
                "--horizons",
                "10",
                "--control-horizons",
                "2",
                "--disturbance-gain",
                "0",
                "--tied",
                "--objective",
                "peak",
            ],
            ..PLAIN
        },
        Variant {
            name: "36-16-3",
            tables: Some(hasel_tables!("[16]", "3", "6")),
            tune: HASEL_TUNE,
            ..PLAIN
        },
        Variant {
            name: "36-10-5-3",
            tables: Some(hasel_tables!("[10, 5]", "3", "6")),
            tune: HASEL_TUNE,
            ..PLAIN
        },
        Variant {
            name: "gru-15-5-3",
            tables: Some(hasel_memory!("gru")),
            tune: HASEL_TUNE,
            ..PLAIN
        },
        Variant {
            name: "lstm-15-5-3",
            tables: Some(hasel_memory!("lstm")),
            tune: HASEL_TUNE,
            ..PLAIN
        },
    ],
    targets: |comparison| {
        let [(rms, _), (_, worst)] = errors(comparison, None);
        vec![
            Target::most("tip error, RMS, median of the loops", 0.5, rms, "mm"),
            Target::most("tip error, worst of all loops", 0.5, worst, "mm"),
        ]
    },
};

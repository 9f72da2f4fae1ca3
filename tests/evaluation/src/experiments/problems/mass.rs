//! A mass on a spring and damper.

use super::{FLOOR_HZ, PLAIN};
use crate::experiments::problem::{Knowledge, Problem, Variant};
use crate::experiments::targets::{Target, errors};

/// The rig's own tables, its network taught by the simulator's derivatives as well, as all networks
/// here are but HASEL's that remember and those of the corrected mass
/// (docs/lab/0069-sobolev-training.md).
const MASS_TABLES: &str = "[control]\nrate_hz = 120.0\noutputs = [\"encoder\"]\nhorizon = 12\ncontrol_horizon = 4\n\n\
     [network]\nhidden = [12]\npast_inputs = 4\npast_outputs = 8\nderivative_weight = 1.0\n";

/// As the rig's own tables, but that a network says itself what it gives.
const MASS_INCREMENT: &str = "[control]\nrate_hz = 120.0\noutputs = [\"encoder\"]\nhorizon = 12\ncontrol_horizon = 4\n\n\
     [network]\npast_inputs = 4\npast_outputs = 8\nform = \"increment\"\n";

macro_rules! mass_tables {
    ($first:literal, $past:literal) => {
        concat!(
            "[control]\nrate_hz = 120.0\noutputs = [\"encoder\"]\nhorizon = 12\ncontrol_horizon = 4\n\n",
            "[network]\nhidden = [15]\nfirst_layer = \"",
            $first,
            "\"\npast_inputs = ",
            $past,
            "\npast_outputs = ",
            $past,
            "\nderivative_weight = 1.0\n"
        )
    };
}

/// A mass on a spring and damper, smooth moves to the levels of the staircase, beside a PID; the
/// plants rub.
pub const MASS: Problem = Problem {
    name: "mass-spring-damper",
    nominal: "rigs/mass-spring-damper.toml",
    known: "",
    amplitude: "0.3",
    kind: "mixed",
    left_out: "rigs/experiments/mass-spring-damper.left-out.toml",
    paths: None,
    judged: None,
    delay: "0.004",
    disturbance: "step",
    textbook: false,
    rate_hz: FLOOR_HZ,
    evaluations: ("120", None),
    variants: &[
        Variant {
            name: "horizon-12",
            tables: Some(MASS_TABLES),
            tune: &["--horizons", "12", "--control-horizons", "4"],
            ..PLAIN
        },
        Variant {
            name: "small",
            small: Some("horizon-12"),
            ..PLAIN
        },
        Variant {
            name: "one-iteration",
            tables: Some(MASS_TABLES),
            network_of: Some("horizon-12"),
            tune: &[
                "--horizons",
                "12",
                "--control-horizons",
                "4",
                "--iterations",
                "1",
            ],
            ..PLAIN
        },
        Variant {
            name: "horizon-1",
            tables: Some(MASS_TABLES),
            network_of: Some("horizon-12"),
            tune: &["--horizons", "1", "--control-horizons", "1"],
            ..PLAIN
        },
        Variant {
            name: "no-estimate",
            tables: Some(MASS_TABLES),
            network_of: Some("horizon-12"),
            tune: &[
                "--horizons",
                "12",
                "--control-horizons",
                "4",
                "--disturbance-gain",
                "0",
            ],
            ..PLAIN
        },
        Variant {
            // tests/foreign/keras_predictor.py
            name: "keras",
            tables: Some(MASS_INCREMENT),
            imported: Some("rigs/experiments/mass-spring-damper.tflite"),
            tune: &["--horizons", "12", "--control-horizons", "4"],
            ..PLAIN
        },
        Variant {
            // The published size with our one output.
            name: "gru-20-15-1",
            tables: Some(mass_tables!("gru", "10")),
            tune: &["--horizons", "12", "--control-horizons", "4"],
            ..PLAIN
        },
        Variant {
            name: "lstm-20-15-1",
            tables: Some(mass_tables!("lstm", "10")),
            tune: &["--horizons", "12", "--control-horizons", "4"],
            ..PLAIN
        },
        Variant {
            // As many units that look at the same and remember nothing.
            name: "20-15-1",
            tables: Some(mass_tables!("tanh", "10")),
            tune: &["--horizons", "12", "--control-horizons", "4"],
            ..PLAIN
        },
        Variant {
            // Memory in the place of the past.
            name: "gru-2-15-1",
            tables: Some(mass_tables!("gru", "1")),
            tune: &["--horizons", "12", "--control-horizons", "4"],
            ..PLAIN
        },
        Variant {
            name: "corrected",
            // Without its tables, so without the derivatives, which do not help it.
            knows: Knowledge::Corrected,
            tune: &["--horizons", "12", "--control-horizons", "4"],
            ..PLAIN
        },
    ],
    targets: |comparison| {
        let pid = errors(comparison, Some("PID"))[0].0;
        let [(median, _), _] = errors(comparison, None);
        vec![Target::most(
            "RMS error, median, beside half the PID's",
            pid / 2.0,
            median,
            "mm",
        )]
    },
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_masss_tables_are_its_rigs_own_but_for_the_derivatives() {
        let rig = include_str!("../../../../../rigs/mass-spring-damper.toml");
        let own = &rig[rig.find("[control]").expect("the list has this entry")..];
        let lines = own.lines().map(|line| line.split('#').next().unwrap_or(""));
        let own: String = lines
            .map(|line| line.trim_end().to_owned() + "\n")
            .collect();
        assert_eq!(own + "derivative_weight = 1.0\n", MASS_TABLES);
    }
}

//! The mass on the published staircase.

use super::paths::jumps;
use super::{MASS, PLAIN, without_preview};
use crate::experiments::problem::{Knowledge, Problem, Variant};
use crate::experiments::targets::{Target, errors};

macro_rules! steps_tables {
    ($more:literal) => {
        concat!(
            "[control]\nrate_hz = 120.0\noutputs = [\"encoder\"]\nhorizon = 20\ncontrol_horizon = 5\n\n",
            "[network]\nhidden = [12]\npast_inputs = 4\npast_outputs = 8\n",
            $more
        )
    };
}

const STEPS_TABLES: &str = steps_tables!("derivative_weight = 1.0\n");
const STEPS_TUNE: &[&str] = &["--horizons", "20", "--control-horizons", "5"];

/// The same mass on the staircase as published: levels, and jumps between them. The horizon is as
/// long as half of what the largest jump takes.
pub const STEPS: Problem = Problem {
    name: "mass-on-steps",
    paths: Some([
        || jumps(&[(0.0, 60), (0.07, 333), (0.14, 333), (0.28, 333)]),
        || {
            jumps(&[
                (0.0, 60),
                (0.21, 225),
                (0.05, 225),
                (0.26, 225),
                (0.12, 225),
            ])
        },
    ]),
    textbook: true,
    variants: &[
        Variant {
            name: "horizon-20",
            tables: Some(STEPS_TABLES),
            tune: STEPS_TUNE,
            ..PLAIN
        },
        Variant {
            name: "small",
            tables: Some(STEPS_TABLES),
            small: Some("horizon-20"),
            ..PLAIN
        },
        Variant {
            name: "horizon-12",
            tables: Some(STEPS_TABLES),
            network_of: Some("horizon-20"),
            tune: &["--horizons", "12", "--control-horizons", "4"],
            ..PLAIN
        },
        Variant {
            name: "one-iteration",
            tables: Some(STEPS_TABLES),
            network_of: Some("horizon-20"),
            tune: &[
                "--horizons",
                "20",
                "--control-horizons",
                "5",
                "--iterations",
                "1",
            ],
            ..PLAIN
        },
        Variant {
            name: "corrected",
            // The derivatives do not help it.
            tables: Some(steps_tables!("")),
            knows: Knowledge::Corrected,
            tune: STEPS_TUNE,
            ..PLAIN
        },
    ],
    targets: |comparison| {
        let [(median, worst), _] = errors(comparison, None);
        let beside = |what: &str, found: f64, of: fn((f64, f64)) -> f64| {
            let pid = of(errors(comparison, Some(&without_preview("PID")))[0]);
            Target::most(what, pid / 2.0, found, "mm")
        };
        vec![
            beside("RMS error, median, beside half the PID's", median, |e| e.0),
            beside("RMS error, worst loop, beside half the PID's", worst, |e| {
                e.1
            }),
        ]
    },
    ..MASS
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_published_staircase_is_three_levels_of_333_steps() {
        let [asked, _] = STEPS.paths.expect("the problem has paths of its own");
        let text = asked();
        let rows: Vec<&str> = text.lines().skip(1).collect();
        let of = |level: &str| rows.iter().filter(|row| row.ends_with(level)).count();
        assert_eq!(
            [of(",0"), of(",0.07"), of(",0.14"), of(",0.28")],
            [60, 333, 333, 333]
        );
        assert!(rows[120].starts_with("1.000000,"), "{}", rows[120]);
    }
}

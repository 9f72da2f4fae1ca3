//! The published problems: rigs, paths, controllers and targets (docs/published.md).

use std::f64::consts::TAU;
use std::fmt::Write;

use super::published::{Knowledge, Problem, Variant};
use super::targets::{Target, errors};

/// The published rate, which any controller is to keep.
const FLOOR_HZ: f64 = 120.0;

/// Trained on the believed rig with the rig's own tables, and tuned as it is.
const PLAIN: Variant = Variant {
    name: "",
    tables: None,
    knows: Knowledge::Believed,
    imported: None,
    network_of: None,
    tune: &[],
    small: None,
};

/// The rig's own tables, its network taught by the simulator's derivatives as well, as all networks here are but HASEL's that
/// remember and those of the mended mass (docs/decisions/0069-taught-by-derivatives.md).
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

/// A mass on a spring and damper, smooth moves to the levels of the staircase, beside a PID; the plants rub.
pub const MASS: Problem = Problem {
    name: "mass-spring-damper",
    believed: "rigs/mass-spring-damper.toml",
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
            name: "mended",
            // Without its tables, so without the derivatives, which do not help it.
            knows: Knowledge::Mended,
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

/// The same mass on the staircase as published: levels, and jumps between them. The horizon is as long as half of what the largest
/// jump takes.
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
            name: "mended",
            // The derivatives do not help it.
            tables: Some(steps_tables!("")),
            knows: Knowledge::Mended,
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

/// What a controller is called that sees no more of the reference than where the output should be now.
pub fn without_preview(name: &str) -> String {
    format!("{name} without preview")
}

macro_rules! supply_delay {
    ($k:literal) => {
        concat!(
            "[[effect]]\nkind = \"input_delay\"\ncomponent = \"supply_",
            $k,
            "\"\ndelay = { value = 0.008, min = 0.0, max = 0.02 }\n\n"
        )
    };
}

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

/// The same, tuned from a calm start: from a hundredth of this move suppression a search in loops that are late ends where the tip
/// swings.
pub const TENDON_CALM: &str = "[control]\nrate_hz = 120.0\noutputs = [\"tip_x\", \"tip_y\", \"tip_z\"]\nhorizon = 10\ncontrol_horizon = 3\n\
     move_suppression = [1.0, 1.0]\n\n[network]\nhidden = [8]\npast_inputs = 4\npast_outputs = 8\n";

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
const TENDON_LAGS: &str = tendon_tables!("hidden = [8]\npast_inputs = 3\npast_outputs = 3\n");

/// What the tendon platform is asked, and what tuning follows.
pub const EIGHT: [fn() -> String; 2] = [|| tendon_path(eight, 14.0), || tendon_path(circle, 10.0)];

/// The tendon platform on a figure of eight; the plants' tendons rub and have slack.
pub const TENDON: Problem = Problem {
    name: "tendon",
    believed: "rigs/tendon.toml",
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
            name: "mended",
            knows: Knowledge::Mended,
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
/// Six inputs that are alike, and a worst moment that is asked for (docs/decisions/0067-commands-have-a-weight.md).
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
    believed: "rigs/hasel.toml",
    // One period between a command and its voltage, as the owner knows from the amplifiers' bus; without it in the model
    // the controller swings the plate up.
    known: concat!(
        supply_delay!("1"),
        supply_delay!("2"),
        supply_delay!("3"),
        supply_delay!("4"),
        supply_delay!("5"),
        supply_delay!("6")
    ),
    amplitude: "0.65",
    // Sines of six supplies range over +-11 mm, where the path goes to 7; levels at random throw the tip to 24 mm and more, and
    // noise is reckoned by the range.
    kind: "multisine",
    left_out: "rigs/experiments/hasel.left-out.toml",
    paths: Some([
        || table(swirl, 22.0, 125.0),
        || table(small_swirl, 11.5, 125.0),
    ]),
    // Until it goes home: foam that has crept then keeps the plate up to 0.8 mm below where the path ends, and voltages only
    // pull.
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

/// Steps a second of the tendon platform's paths.
const PATH_HZ: f64 = 120.0;
/// Length of the segment, m.
const SEGMENT: f64 = 0.100;

/// 0 to 1 as in a minimum-jerk move (Flash and Hogan 1985).
fn eased(s: f64) -> f64 {
    let s = s.clamp(0.0, 1.0);
    s * s * s * (10.0 - 15.0 * s + 6.0 * s * s)
}

/// From rest to a figure of eight of 60 mm by 42 mm, once around in 10 s, and back.
fn eight(t: f64) -> (f64, f64) {
    let size = 0.030 * (eased((t - 0.5) / 1.5) - eased((t - 12.0) / 1.5));
    let angle = TAU * (t - 2.0).max(0.0) / 10.0;
    (size * angle.cos(), 0.7 * size * (2.0 * angle).sin())
}

/// From rest to a circle of 50 mm, once around in 5 s, and back.
fn circle(t: f64) -> (f64, f64) {
    let size = 0.025 * (eased((t - 0.5) / 1.5) - eased((t - 8.0) / 1.5));
    let angle = TAU * (t - 1.0).max(0.0) / 5.0;
    (size * angle.cos(), size * angle.sin())
}

/// From rest down by 5 mm, twice and a half around a circle of 7 mm, 6 s a turn, while the height goes 2 mm up and down, and
/// back: +-7 mm in x and y and 4 mm in z, as published.
fn swirl(t: f64) -> [f64; 3] {
    let (around, back) = (eased((t - 2.5) / 2.0), 1.0 - eased((t - 17.0) / 2.0));
    let angle = TAU * (t - 2.5).max(0.0) / 6.0;
    let size = 0.007 * around * back;
    let down = 0.005 * eased((t - 0.5) / 2.0) * (1.0 - eased((t - 19.0) / 2.0));
    let z = 0.150 - down + 0.002 * around * back * (angle / 2.0).sin();
    [size * angle.cos(), size * angle.sin(), z]
}

/// Another path in the same place, for tuning: a circle of 5 mm, 4 s a turn, tilted.
fn small_swirl(t: f64) -> [f64; 3] {
    let size = eased((t - 2.0) / 1.5) * (1.0 - eased((t - 8.0) / 1.5));
    let angle = TAU * (t - 2.0).max(0.0) / 4.0;
    let down = 0.005 * eased((t - 0.5) / 1.5) * (1.0 - eased((t - 9.0) / 1.5));
    let z = 0.150 - down - 0.001 * size * angle.cos();
    [0.005 * size * angle.cos(), 0.005 * size * angle.sin(), z]
}

/// Levels, m, each held for so many control periods, with jumps between them.
fn jumps(levels: &[(f64, usize)]) -> String {
    let rows = levels
        .iter()
        .flat_map(|(level, steps)| std::iter::repeat_n(level, *steps));
    let mut text = String::from("t,q_m\n");
    for (k, level) in rows.enumerate() {
        // Writing to a String cannot fail.
        let _ = writeln!(text, "{:.6},{level}", k as f64 / FLOOR_HZ);
    }
    text
}

/// Where a tip is to be, `rate` times a second.
fn table(at: fn(f64) -> [f64; 3], seconds: f64, rate: f64) -> String {
    let mut text = String::from("t,x_m,y_m,z_m\n");
    for k in 0..=(seconds * rate) as usize {
        let t = k as f64 / rate;
        let [x, y, z] = at(t);
        // Writing to a String cannot fail.
        let _ = writeln!(text, "{t:.6},{x:.6},{y:.6},{z:.6}");
    }
    text
}

/// The path of a tip, with the height that a segment has there which bends everywhere alike: by the angle a its tip goes
/// sideways by L (1 - cos a) / a and stands at L sin a / a.
fn tendon_path(sideways: fn(f64) -> (f64, f64), seconds: f64) -> String {
    let mut text = String::from("t,x_m,y_m,z_m\n");
    for k in 0..=(seconds * PATH_HZ) as usize {
        let t = k as f64 / PATH_HZ;
        let (x, y) = sideways(t);
        let z = height(x.hypot(y));
        // Writing to a String cannot fail.
        let _ = writeln!(text, "{t:.6},{x:.6},{y:.6},{z:.6}");
    }
    text
}

fn height(away: f64) -> f64 {
    let (mut low, mut high) = (1e-9, 2.0);
    for _ in 0..60 {
        let a: f64 = (low + high) / 2.0;
        if SEGMENT * (1.0 - a.cos()) / a < away {
            low = a;
        } else {
            high = a;
        }
    }
    SEGMENT * low.sin() / low
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tip_far_aside_stands_lower() {
        assert!((height(0.0) - SEGMENT).abs() < 1e-6);
        // A quarter circle: L = r pi / 2, aside and up by r.
        let r = 2.0 * SEGMENT / std::f64::consts::PI;
        assert!((height(r) - r).abs() < 1e-6, "{}", height(r));
    }

    #[test]
    fn the_masss_tables_are_its_rigs_own_but_for_the_derivatives() {
        let rig = include_str!("../../../rigs/mass-spring-damper.toml");
        let own = &rig[rig.find("[control]").expect("it has one")..];
        let lines = own.lines().map(|line| line.split('#').next().unwrap_or(""));
        let own: String = lines
            .map(|line| line.trim_end().to_owned() + "\n")
            .collect();
        assert_eq!(own + "derivative_weight = 1.0\n", MASS_TABLES);
    }

    #[test]
    fn the_published_staircase_is_three_levels_of_333_steps() {
        let [asked, _] = STEPS.paths.expect("it has its own");
        let text = asked();
        let rows: Vec<&str> = text.lines().skip(1).collect();
        let of = |level: &str| rows.iter().filter(|row| row.ends_with(level)).count();
        assert_eq!(
            [of(",0"), of(",0.07"), of(",0.14"), of(",0.28")],
            [60, 333, 333, 333]
        );
        assert!(rows[120].starts_with("1.000000,"), "{}", rows[120]);
    }

    #[test]
    fn paths_begin_and_end_at_rest_at_home() {
        for (text, home) in [
            (tendon_path(eight, 14.0), SEGMENT),
            (tendon_path(circle, 10.0), SEGMENT),
            (table(swirl, 22.0, 125.0), 0.150),
            (table(small_swirl, 11.5, 125.0), 0.150),
        ] {
            let rows: Vec<&str> = text.lines().skip(1).collect();
            for row in [rows[0], rows[1], rows[rows.len() - 1]] {
                let numbers: Vec<f64> = row.split(',').skip(1).flat_map(str::parse).collect();
                assert!(numbers[0].abs() < 1e-6 && numbers[1].abs() < 1e-6, "{row}");
                assert!((numbers[2] - home).abs() < 1e-6, "{row}");
            }
        }
    }
}

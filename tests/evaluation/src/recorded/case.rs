//! The recordings, the nominal rigs of their devices, and what is known.
//!
//! Splits are those of the data's own descriptions: what is held out there is held out here.

use super::prepare::Part;

/// A recording, relative to the data folder, and what is taken of it.
pub struct Source {
    pub file: &'static str,
    pub part: Part,
}

impl Source {
    const fn new(file: &'static str, part: Part) -> Self {
        Self { file, part }
    }
}

/// One device.
pub struct Case {
    /// Names its files.
    pub name: &'static str,
    /// Its nominal rig.
    pub rig: &'static str,
    /// For people.
    pub device: &'static str,
    /// The signal that the table shows.
    pub signal: &'static str,
    pub fit: &'static [Source],
    /// Without any, part of `fit` is set aside.
    pub check: &'static [Source],
    pub test: &'static [Source],
    /// Kinds that the literature has for it, any of which is right; none: nothing is missing.
    pub known: &'static [&'static str],
    /// The literature's effect gains next to nothing, and to name nothing is right, too.
    pub slight: bool,
    /// Error on the held-out recordings, as published or as the data's description has it.
    pub published: &'static str,
}

/// The four motions of the servo at each of some gains of its own controller.
macro_rules! servo {
    ($($gain:literal),*) => {
        &[$(
            Source::new(concat!("bam_xl330/kp", $gain, "_lift_and_drop.csv"), Part::Powered),
            Source::new(concat!("bam_xl330/kp", $gain, "_sin_sin.csv"), Part::Powered),
            Source::new(concat!("bam_xl330/kp", $gain, "_sin_time_square.csv"), Part::Powered),
            Source::new(concat!("bam_xl330/kp", $gain, "_up_and_down.csv"), Part::Powered),
        )*]
    };
}

/// Checked by the highest of the three gains that its data's description trains on; the rows after
/// it, by the other two.
const SERVO: Case = Case {
    name: "servo",
    rig: "rigs/recorded/servo.toml",
    device: "XL330 servo on a pendulum, checked by the gain 800",
    signal: "q_rad",
    fit: servo!("100", "200"),
    check: servo!("800"),
    test: servo!("400"),
    known: &["load_dependent_friction"],
    slight: false,
    published: "0.0575 rad with friction by load, 0.0897 rad with Coulomb",
};

/// All of them, in the order of the table.
pub const CASES: &[Case] = &[
    Case {
        name: "emps",
        rig: "rigs/recorded/emps.toml",
        device: "EMPS positioning axis",
        signal: "q_m",
        fit: &[Source::new("emps/train.csv", Part::Whole)],
        check: &[],
        test: &[Source::new("emps/test_pulses.csv", Part::Whole)],
        known: &["coulomb_friction", "direction_dependent_friction"],
        slight: false,
        published: "4.6 mm with Coulomb friction; 2.64 mm, the best",
    },
    Case {
        name: "emps-checked",
        rig: "rigs/recorded/emps.toml",
        device: "EMPS, checked by its other recording",
        signal: "q_m",
        fit: &[Source::new("emps/train.csv", Part::Whole)],
        check: &[Source::new("emps/test_pulses.csv", Part::Whole)],
        test: &[],
        known: &["coulomb_friction", "direction_dependent_friction"],
        slight: false,
        published: "as above",
    },
    Case {
        name: "silverbox",
        rig: "rigs/recorded/silverbox.toml",
        device: "Silverbox, an electronic Duffing oscillator",
        signal: "y_V",
        fit: &[Source::new("silverbox/train_multisine.csv", Part::Whole)],
        check: &[Source::new("silverbox/val_multisine.csv", Part::Whole)],
        test: &[Source::new("silverbox/test_arrow.csv", Part::Whole)],
        known: &["cubic_stiffness"],
        slight: false,
        published: "0.26 mV, the best; 0.97 mV with a cubic spring",
    },
    SERVO,
    Case {
        name: "servo-checked-by-200",
        device: "the servo, checked by the gain 200",
        fit: servo!("100", "800"),
        check: servo!("200"),
        ..SERVO
    },
    Case {
        name: "servo-checked-by-100",
        device: "the servo, checked by the gain 100",
        fit: servo!("200", "800"),
        check: servo!("100"),
        ..SERVO
    },
    Case {
        name: "pendulum",
        rig: "rigs/recorded/pendulum.toml",
        device: "pendulum",
        signal: "theta_rad",
        fit: &[Source::new("schmidt_lipson/pendulum.csv", Part::Early)],
        check: &[],
        test: &[Source::new("schmidt_lipson/pendulum.csv", Part::Late)],
        known: &["gravity_load"],
        slight: false,
        published: "0.031 rad with sin, 0.022 rad with drag as well",
    },
    Case {
        name: "torque-limited-pendulum",
        rig: "rigs/recorded/torque-limited-pendulum.toml",
        device: "torque-limited pendulum, swing-up",
        signal: "q_rad",
        fit: &[Source::new(
            "dfki_pendulum/energy_shaping.csv",
            Part::SwingUp,
        )],
        check: &[],
        test: &[Source::new("dfki_pendulum/sac_swingup.csv", Part::SwingUp)],
        known: &[
            "coulomb_friction",
            "viscous_damping",
            "direction_dependent_friction",
        ],
        slight: false,
        published: "0.042 rad without friction, 0.029 rad with it",
    },
    Case {
        name: "air-track",
        rig: "rigs/recorded/air-track.toml",
        device: "cart on an air track: a control",
        signal: "x_px",
        fit: &[Source::new(
            "schmidt_lipson/air_track_trial0.csv",
            Part::Early,
        )],
        check: &[],
        test: &[Source::new(
            "schmidt_lipson/air_track_trial0.csv",
            Part::Late,
        )],
        known: &[],
        slight: false,
        published: "0.443 px, and worse with anything more",
    },
    Case {
        name: "air-track-double",
        rig: "rigs/recorded/air-track-double.toml",
        device: "two carts on an air track",
        signal: "x1_px",
        fit: &[Source::new(
            "schmidt_lipson/air_track_double_trial0.csv",
            Part::Early,
        )],
        check: &[],
        test: &[Source::new(
            "schmidt_lipson/air_track_double_trial0.csv",
            Part::Late,
        )],
        known: &[],
        slight: false,
        published: "",
    },
    Case {
        name: "ball-whiffle",
        rig: "rigs/recorded/ball.toml",
        device: "whiffle ball, falling 47 m",
        signal: "height_m",
        fit: &[Source::new(
            "ball_drops/whiffle_ball_1_drop1.csv",
            Part::Whole,
        )],
        check: &[Source::new(
            "ball_drops/whiffle_ball_1_drop2.csv",
            Part::Whole,
        )],
        test: &[],
        known: &["quadratic_drag", "viscous_damping"],
        slight: false,
        published: "0.320 m linear, 0.506 m quadratic drag",
    },
    Case {
        name: "ball-yellow-whiffle",
        rig: "rigs/recorded/ball.toml",
        device: "yellow whiffle ball, falling 47 m",
        signal: "height_m",
        fit: &[Source::new(
            "ball_drops/yellow_whiffle_ball_drop1.csv",
            Part::Whole,
        )],
        check: &[Source::new(
            "ball_drops/yellow_whiffle_ball_drop2.csv",
            Part::Whole,
        )],
        test: &[],
        known: &["quadratic_drag", "viscous_damping"],
        slight: false,
        published: "1.05 m linear, 0.651 m quadratic drag",
    },
    Case {
        name: "ball-orange-whiffle",
        rig: "rigs/recorded/ball.toml",
        device: "orange whiffle ball, falling 47 m",
        signal: "height_m",
        fit: &[Source::new(
            "ball_drops/orange_whiffle_ball_drop1.csv",
            Part::Whole,
        )],
        check: &[Source::new(
            "ball_drops/orange_whiffle_ball_drop2.csv",
            Part::Whole,
        )],
        test: &[],
        known: &["quadratic_drag", "viscous_damping"],
        slight: false,
        published: "0.517 m linear, 1.28 m quadratic drag",
    },
    Case {
        name: "ball-tennis",
        rig: "rigs/recorded/ball.toml",
        device: "tennis ball, falling 47 m",
        signal: "height_m",
        fit: &[Source::new("ball_drops/tennis_ball_drop1.csv", Part::Whole)],
        check: &[Source::new("ball_drops/tennis_ball_drop2.csv", Part::Whole)],
        test: &[],
        known: &["quadratic_drag", "viscous_damping"],
        slight: false,
        published: "0.837 m linear, 1.24 m quadratic drag",
    },
    Case {
        name: "ball-volleyball",
        rig: "rigs/recorded/ball.toml",
        device: "volleyball, falling 47 m",
        signal: "height_m",
        fit: &[Source::new("ball_drops/volleyball_drop1.csv", Part::Whole)],
        check: &[Source::new("ball_drops/volleyball_drop2.csv", Part::Whole)],
        test: &[],
        known: &["quadratic_drag", "viscous_damping"],
        slight: false,
        published: "0.394 m linear, 0.849 m quadratic drag",
    },
    Case {
        name: "ball-whiffle-2",
        rig: "rigs/recorded/ball.toml",
        device: "second whiffle ball, falling 47 m",
        signal: "height_m",
        fit: &[Source::new(
            "ball_drops/whiffle_ball_2_drop1.csv",
            Part::Whole,
        )],
        check: &[Source::new(
            "ball_drops/whiffle_ball_2_drop2.csv",
            Part::Whole,
        )],
        test: &[],
        known: &["quadratic_drag", "viscous_damping"],
        slight: false,
        published: "",
    },
    Case {
        name: "ball-blue-basketball",
        rig: "rigs/recorded/ball.toml",
        device: "blue basketball, falling 47 m",
        signal: "height_m",
        fit: &[Source::new(
            "ball_drops/blue_basketball_drop1.csv",
            Part::Whole,
        )],
        check: &[Source::new(
            "ball_drops/blue_basketball_drop2.csv",
            Part::Whole,
        )],
        test: &[],
        known: &["quadratic_drag", "viscous_damping"],
        slight: false,
        published: "",
    },
    Case {
        name: "ball-green-basketball",
        rig: "rigs/recorded/ball.toml",
        device: "green basketball, falling 47 m",
        signal: "height_m",
        fit: &[Source::new(
            "ball_drops/green_basketball_drop1.csv",
            Part::Whole,
        )],
        check: &[Source::new(
            "ball_drops/green_basketball_drop2.csv",
            Part::Whole,
        )],
        test: &[],
        known: &["quadratic_drag", "viscous_damping"],
        slight: false,
        published: "",
    },
    Case {
        name: "ball-baseball",
        rig: "rigs/recorded/ball.toml",
        device: "baseball: nearly a control, falling 47 m",
        signal: "height_m",
        fit: &[Source::new("ball_drops/baseball_drop1.csv", Part::Whole)],
        check: &[Source::new("ball_drops/baseball_drop2.csv", Part::Whole)],
        test: &[],
        known: &["quadratic_drag", "viscous_damping"],
        slight: true,
        published: "1.04 m linear, 1.19 m in free fall",
    },
    Case {
        name: "ball-golf",
        rig: "rigs/recorded/ball.toml",
        device: "golf ball: nearly a control, falling 47 m",
        signal: "height_m",
        fit: &[Source::new("ball_drops/golf_ball_drop1.csv", Part::Whole)],
        check: &[Source::new("ball_drops/golf_ball_drop2.csv", Part::Whole)],
        test: &[],
        known: &["quadratic_drag", "viscous_damping"],
        slight: true,
        published: "0.728 m linear, 0.789 m in free fall",
    },
    Case {
        name: "ball-bowling",
        rig: "rigs/recorded/ball.toml",
        device: "bowling ball: nearly a control, falling 47 m",
        signal: "height_m",
        fit: &[Source::new(
            "ball_drops/bowling_ball_drop1.csv",
            Part::Whole,
        )],
        check: &[Source::new(
            "ball_drops/bowling_ball_drop2.csv",
            Part::Whole,
        )],
        test: &[],
        known: &[],
        slight: false,
        published: "0.454 m in free fall, worse with drag",
    },
    Case {
        name: "friction-damper",
        rig: "rigs/recorded/friction-damper.toml",
        device: "banded friction damper with play, motion imposed",
        signal: "force_N",
        fit: &[Source::new(
            "friction_damper_backlash/sine_1Hz_1in_36lb.csv",
            Part::Whole,
        )],
        check: &[Source::new(
            "friction_damper_backlash/sine_1Hz_1.5in_36lb.csv",
            Part::Whole,
        )],
        test: &[Source::new(
            "friction_damper_backlash/sine_0.5Hz_1in_36lb.csv",
            Part::Whole,
        )],
        known: &["hysteresis", "backlash"],
        slight: false,
        published: "0.150 of the force's RMS with hysteresis and backlash",
    },
    Case {
        name: "mr-damper",
        rig: "rigs/recorded/mr-damper.toml",
        device: "magneto-rheological damper, motion imposed",
        signal: "force_N",
        fit: &[Source::new("mr_damper/train_white_0_50Hz.csv", Part::Early)],
        check: &[Source::new("mr_damper/train_white_0_50Hz.csv", Part::Late)],
        test: &[Source::new(
            "mr_damper/test_simulated_quake.csv",
            Part::Whole,
        )],
        known: &["coulomb_friction", "hysteresis"],
        slight: false,
        published: "168 N with friction by the voltage, 291 N with Coulomb",
    },
    Case {
        name: "pneumatic-cylinder",
        rig: "rigs/recorded/pneumatic-cylinder.toml",
        device: "pneumatic cylinder at four pressures, motion imposed",
        signal: "force_N",
        fit: &[
            Source::new("pneumatic_cylinder_friction/o-ring_1bar.csv", Part::Whole),
            Source::new("pneumatic_cylinder_friction/o-ring_7bar.csv", Part::Whole),
        ],
        check: &[Source::new(
            "pneumatic_cylinder_friction/o-ring_3bar.csv",
            Part::Whole,
        )],
        test: &[Source::new(
            "pneumatic_cylinder_friction/o-ring_5bar.csv",
            Part::Whole,
        )],
        known: &["load_dependent_friction", "coulomb_friction"],
        slight: false,
        published: "1.25 N with Coulomb friction that grows with pressure",
    },
    Case {
        name: "cylinder-o-ring",
        rig: "rigs/recorded/pneumatic-cylinder.toml",
        device: "the cylinder, fitted to three pressures",
        signal: "force_N",
        fit: &[
            Source::new("pneumatic_cylinder_friction/o-ring_1bar.csv", Part::Whole),
            Source::new("pneumatic_cylinder_friction/o-ring_3bar.csv", Part::Whole),
            Source::new("pneumatic_cylinder_friction/o-ring_7bar.csv", Part::Whole),
        ],
        check: &[Source::new(
            "pneumatic_cylinder_friction/o-ring_5bar.csv",
            Part::Whole,
        )],
        test: &[],
        known: &["load_dependent_friction", "coulomb_friction"],
        slight: false,
        published: "1.25 N with Coulomb friction that grows with pressure",
    },
    Case {
        name: "cylinder-napn",
        rig: "rigs/recorded/pneumatic-cylinder.toml",
        device: "the cylinder with a seal of another make, fitted to three pressures",
        signal: "force_N",
        fit: &[
            Source::new("pneumatic_cylinder_friction/napn_1bar.csv", Part::Whole),
            Source::new("pneumatic_cylinder_friction/napn_3bar.csv", Part::Whole),
            Source::new("pneumatic_cylinder_friction/napn_7bar.csv", Part::Whole),
        ],
        check: &[Source::new(
            "pneumatic_cylinder_friction/napn_5bar.csv",
            Part::Whole,
        )],
        test: &[],
        known: &["load_dependent_friction", "coulomb_friction"],
        slight: false,
        published: "1.35 N with Coulomb friction that grows with pressure",
    },
    Case {
        name: "cylinder-o-ring257",
        rig: "rigs/recorded/pneumatic-cylinder.toml",
        device: "the cylinder with a thicker O-ring, fitted to three pressures",
        signal: "force_N",
        fit: &[
            Source::new(
                "pneumatic_cylinder_friction/o-ring257_1bar.csv",
                Part::Whole,
            ),
            Source::new(
                "pneumatic_cylinder_friction/o-ring257_3bar.csv",
                Part::Whole,
            ),
            Source::new(
                "pneumatic_cylinder_friction/o-ring257_7bar.csv",
                Part::Whole,
            ),
        ],
        check: &[Source::new(
            "pneumatic_cylinder_friction/o-ring257_5bar.csv",
            Part::Whole,
        )],
        test: &[],
        known: &["load_dependent_friction", "coulomb_friction"],
        slight: false,
        published: "1.11 N with Coulomb friction that grows with pressure",
    },
];

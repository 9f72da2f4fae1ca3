//! The rigs that are written, and what is refused.

use crate::rig_file::ControlTable;
use sinew_sim::{Plant, Rig};

use super::*;

fn recording(header: &str) -> Recording {
    let fields = header.split(',').count() - 1;
    let mut text = format!("{header}\n");
    for row in 0..60 {
        text.push_str(&format!("{}", 0.01 * f64::from(row)));
        for field in 0..fields {
            text.push_str(&format!(
                ",{:.4}",
                (0.3 * f64::from(row) + field as f64).sin()
            ));
        }
        text.push('\n');
    }
    Recording::parse(text.as_bytes(), "axis.csv").unwrap()
}

fn written(header: &str, args: &NewRigOptions) -> (String, Rig, Vec<String>) {
    let written = rig_text(args, &recording(header), None).unwrap();
    let rig = Rig::parse(&written.text, "axis.toml").unwrap();
    (written.text, rig, written.unused)
}

#[test]
fn a_force_and_a_position_make_a_rig_that_can_be_fitted() {
    let (text, rig, unused) = written(
        "t,u_N,q_m",
        &NewRigOptions {
            spring: Some(true),
            inertia: Some(1.2),
            ..NewRigOptions::default()
        },
    );
    insta::assert_snapshot!("force_and_position", text);
    let plant = Plant::new(&rig).unwrap();
    let free: Vec<&str> = plant
        .free_slots()
        .into_iter()
        .map(|slot| plant.parameters()[slot].name.as_str())
        .collect();
    assert_eq!(
        free,
        [
            "body.inertia",
            "body_spring.stiffness",
            "body_damper.damping"
        ]
    );
    assert!(unused.is_empty());
    let fit = sinew_ident::fit::fit(
        &rig,
        &[recording("t,u_N,q_m")],
        &sinew_ident::fit::FitOptions::default(),
        &mut |_| {},
    );
    assert!(fit.is_ok(), "{}", fit.unwrap_err());
}

#[test]
fn columns_like_those_of_emps_are_told_apart() {
    let args = NewRigOptions {
        spring: Some(false),
        ..NewRigOptions::default()
    };
    let (text, rig, unused) = written("t,q_m,qref_m,u_V,force_N", &args);
    assert_eq!(rig.actuators[0].input, "u_V");
    assert_eq!(rig.actuators.len(), 1);
    assert_eq!(
        (rig.sensors.len(), rig.sensors[0].signal.as_str()),
        (1, "q_m")
    );
    assert_eq!(
        ControlTable::read(&rig).unwrap().unwrap().reference,
        ["qref_m"],
        "{text}"
    );
    assert_eq!(unused, ["force_N"]);
    assert!(rig.springs.is_empty());
    // Volts: the gain is found and the inertia held, never both free.
    assert!(rig.actuators[0].gain.free && !rig.bodies[0].inertia.free);
}

#[test]
fn units_that_are_not_si_are_converted_by_the_rig() {
    let (_, rig, _) = written("t,tau_mNm,arm_deg,arm_deg_s", &NewRigOptions::default());
    assert_eq!(rig.bodies[0].name, "arm");
    assert_eq!(rig.bodies[0].motion, sinew_sim::unit::Motion::Hinge);
    assert_eq!(rig.actuators[0].column_factor, 1e-3);
    assert!((rig.sensors[0].column_factor - std::f64::consts::PI / 180.0).abs() < 1e-12);
    assert_eq!(rig.sensors.len(), 2);
}

#[test]
fn two_positions_make_two_bodies() {
    let (_, rig, _) = written(
        "t,u1_V,u2_V,q1_m,q2_m",
        &NewRigOptions {
            name: Some("a \"pair\"".into()),
            ..NewRigOptions::default()
        },
    );
    assert_eq!(
        rig.bodies
            .iter()
            .map(|body| body.name.as_str())
            .collect::<Vec<_>>(),
        ["q1", "q2"]
    );
    assert_eq!(rig.actuators.len(), 2);
    assert_eq!(rig.name, "a \"pair\"");
}

#[test]
fn answers_are_taken_from_a_person() {
    let mut typed: &[u8] = b"heavy\n2.5\nperhaps\ny\n";
    let mut shown = Vec::new();
    let terminal = Terminal {
        input: &mut typed,
        output: &mut shown,
    };
    let written = rig_text(
        &NewRigOptions::default(),
        &recording("t,u_N,q_m"),
        Some(terminal),
    )
    .unwrap();
    let rig = Rig::parse(&written.text, "axis.toml").unwrap();
    assert!(written.guesses.is_empty());
    assert_eq!((rig.bodies[0].inertia.value, rig.springs.len()), (2.5, 1));
    let shown = String::from_utf8(shown).unwrap();
    assert_eq!(
        (
            shown.matches("How heavy").count(),
            shown.matches("spring").count()
        ),
        (2, 2)
    );
}

/// A mass under pushes, with a spring or without, by small steps of symplectic Euler.
fn pushed(stiffness: f64) -> Recording {
    let mut text = "t,u_N,q_m\n".to_owned();
    let (mut q, mut v) = (0.0, 0.0);
    for row in 0..400 {
        let t = 0.01 * f64::from(row);
        let push = 3.0 * (2.0 * t).sin() + 2.0 * (9.0 * t + 1.0).sin();
        text.push_str(&format!("{t},{push},{q:.5}\n"));
        for _ in 0..50 {
            v += 2e-4 * (push - stiffness * q - 1.5 * v) / 1.3;
            q += 2e-4 * v;
        }
    }
    Recording::parse(text.as_bytes(), "pushed.csv").unwrap()
}

/// A guess of "no spring" once made a controller that was 0.6 m off, of a mass that hung on one.
#[test]
fn whether_there_is_a_spring_is_asked_of_the_recording_where_nobody_says() {
    for (stiffness, springs) in [(40.0, 1), (0.0, 0)] {
        let args = NewRigOptions {
            quiet: true,
            ..NewRigOptions::default()
        };
        let written = rig_text(&args, &pushed(stiffness), None).unwrap();
        let rig = Rig::parse(&written.text, "pushed.toml").unwrap();
        assert_eq!(rig.springs.len(), springs, "{:?}", written.guesses);
        assert_eq!(written.guesses.len(), 2);
        let said = NewRigOptions {
            spring: Some(springs != 1),
            ..args
        };
        let written = rig_text(&said, &pushed(stiffness), None).unwrap();
        let rig = Rig::parse(&written.text, "pushed.toml").unwrap();
        assert_eq!(rig.springs.len(), 1 - springs, "a person knows better");
    }
}

#[test]
fn what_cannot_be_told_is_asked_for() {
    let refusal = |header: &str, args: &NewRigOptions| {
        rig_text(args, &recording(header), None)
            .unwrap_err()
            .to_string()
    };
    assert!(refusal("t,q_m", &NewRigOptions::default()).contains("--input COLUMN"));
    assert!(refusal("t,u_V", &NewRigOptions::default()).contains("--output COLUMN"));
    let typo = NewRigOptions {
        inputs: vec!["u_v".into()],
        ..NewRigOptions::default()
    };
    assert!(refusal("t,u_V,q_m", &typo).contains("did you mean `u_V`?"));
    let weightless = NewRigOptions {
        inertia: Some(0.0),
        ..NewRigOptions::default()
    };
    assert!(refusal("t,u_V,q_m", &weightless).contains("more than 0; got 0"));
}

#[test]
fn an_existing_rig_is_not_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("axis.csv");
    recording("t,u_N,q_m").write(&path).unwrap();
    let args = NewRigOptions {
        recording: path,
        guess: true,
        ..NewRigOptions::default()
    };
    assert_eq!(run(&args).unwrap().path, folder.path().join("axis.toml"));
    assert!(
        run(&args)
            .unwrap_err()
            .to_string()
            .contains("exists already")
    );
    assert!(
        run(&NewRigOptions {
            replace: true,
            ..args
        })
        .is_ok()
    );
}

/// A rig on which each body hung on the ground could move the first one only.
#[test]
fn fewer_inputs_than_positions_make_a_chain() {
    let args = NewRigOptions {
        spring: Some(false),
        ..NewRigOptions::default()
    };
    let (text, rig, _) = written("t,u_N,x1_m,x2_m,x3_m", &args);
    let joined: Vec<(&str, &str)> = (rig.springs.iter())
        .map(|spring| (rig.end_name(spring.from), rig.end_name(spring.to)))
        .collect();
    assert_eq!(joined, [("x1", "x2"), ("x2", "x3")]);
    assert_eq!(rig.end_name(rig.dampers[2].from), "x2");
    assert_eq!(
        text.matches("# A guess: no input drives this body").count(),
        2
    );
    let guesses = rig_text(&args, &recording("t,u_N,x1_m,x2_m,x3_m"), None);
    let guesses = guesses.unwrap().guesses.join("; ");
    assert!(guesses.contains("3 bodies in a chain"), "{guesses}");
    // As many inputs as positions: each body has its own.
    let (_, rig, _) = written("t,u1_V,u2_V,q1_m,q2_m", &args);
    assert!(rig.springs.is_empty());
}

/// A current that stands beside a duty cycle or a voltage was measured.
#[test]
fn a_duty_cycle_or_a_voltage_is_the_input_and_no_measured_current() {
    let args = NewRigOptions {
        spring: Some(true),
        ..NewRigOptions::default()
    };
    let input = |columns: &str| written(columns, &args).1.actuators[0].input.clone();
    assert_eq!(input("t,I_mA,Motor1_PWM,q_rad"), "Motor1_PWM");
    assert_eq!(input("t,I_A,motor_V,q_rad"), "motor_V");
    assert_eq!(input("t,motor_A,q_rad"), "motor_A");
    assert_eq!(input("t,duty_ref_pct,duty_pct,q_rad"), "duty_pct");
}

#[test]
fn an_encoder_in_counts_has_a_gain_and_a_torque_turns() {
    let args = NewRigOptions {
        spring: Some(true),
        ..NewRigOptions::default()
    };
    let (text, rig, unused) = written("t,tau_Nm,enc_counts", &args);
    assert_eq!(rig.bodies[0].motion, sinew_sim::unit::Motion::Hinge);
    assert!((rig.sensors[0].gain.value - 4096.0 / std::f64::consts::TAU).abs() < 1e-6);
    assert!(text.contains("# counts per rad, a guess"), "{text}");
    assert!(unused.is_empty());
    let written_text = rig_text(&args, &recording("t,tau_Nm,enc_counts"), None).unwrap();
    assert!(
        written_text
            .guesses
            .iter()
            .any(|guess| guess.contains("`enc_counts`"))
    );
    // Beside a position in a unit the counts have no part.
    let (_, _, unused) = written("t,tau_Nm,enc_counts,q_rad", &args);
    assert_eq!(unused, ["enc_counts"]);
}

#[test]
fn milliseconds_are_refused_until_a_flag_says_the_unit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("ms.csv");
    let rows: String = (0..60)
        .map(|row| {
            format!(
                "{},{},{}\n",
                5 * row,
                (0.3 * f64::from(row)).sin(),
                0.01 * f64::from(row * row)
            )
        })
        .collect();
    std::fs::write(&path, format!("t,u_N,q_m\n{rows}")).unwrap();
    let args = NewRigOptions {
        recording: path,
        guess: true,
        quiet: true,
        ..NewRigOptions::default()
    };
    let refused = run(&args).unwrap_err().to_string();
    assert!(
        refused.contains("--time-unit ms, or --time-unit s"),
        "{refused}"
    );
    assert!(!folder.path().join("ms.toml").exists());
}

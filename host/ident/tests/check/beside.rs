//! Times in minutes, columns under other names, sensors that are dead or late, and faults that a
//! diagnosis meets.

use sinew_ident::check::{Check, check};
use sinew_ident::diagnose::{DiagnoseOptions, Diagnosis, Recordings, Verdict, diagnose};
use sinew_ident::recording::repair::{Repair, TimeUnit};
use sinew_ident::recording::{Column, Recording};
use sinew_sim::Rig;

use crate::shifted::{moved, sound};
use crate::siblings::{TWO, driven, with_load};

fn named(rig: &Rig, recording: &Recording) -> Vec<Check> {
    check(std::slice::from_ref(recording), Some(rig))
}

fn only(rig: &Rig, recording: &Recording) -> Check {
    let found = named(rig, recording);
    assert_eq!(found.len(), 1, "{found:?}");
    found[0].clone()
}

/// The recording with other times and columns.
fn read_as(
    recording: &Recording,
    time: impl Fn(f64) -> f64,
    reading: impl Fn(&str, usize, &[f64]) -> f64,
) -> Recording {
    let columns = recording.columns().iter().map(|column| {
        let rows = 0..column.values.len();
        let values = rows.map(|row| reading(&column.name, row, &column.values));
        Column {
            name: column.name.clone(),
            values: values.collect(),
        }
    });
    let t = recording.t().iter().map(|t| time(*t)).collect();
    Recording::new(recording.path(), t, columns.collect()).unwrap()
}

/// Two recordings by their roles, under names of their own.
fn roles(fit: &Recording, check: &Recording) -> Recordings {
    let [fit, check] = [(fit, "fit.csv"), (check, "check.csv")].map(|(recording, name)| {
        let (t, columns) = (recording.t().to_vec(), recording.columns().to_vec());
        Recording::new(name, t, columns).unwrap()
    });
    Recordings {
        fit: vec![fit],
        check: vec![check],
        test: Vec::new(),
    }
}

/// The diagnosis beside the checks of its recordings, as the command line gives it.
pub fn diagnosed(rig: &Rig, recordings: &Recordings) -> Diagnosis {
    let all = [&recordings.fit[..], &recordings.check, &recordings.test].concat();
    let options = DiagnoseOptions {
        checks: check(&all, Some(rig)),
        ..DiagnoseOptions::default()
    };
    diagnose(rig, recordings, &options, &|_, _, _| {}).unwrap()
}

#[test]
fn times_in_minutes_and_hours_are_named_and_mended() {
    let (rig, sound) = sound();
    for (seconds, unit, kind, flag) in [
        (60.0, TimeUnit::Minutes, "time_in_minutes", "min"),
        (3600.0, TimeUnit::Hours, "time_in_hours", "h"),
    ] {
        let long = read_as(&sound, |t| t / seconds, |_, row, values| values[row]);
        let found = only(&rig, &long);
        assert_eq!((found.kind, found.certain), (kind, true), "{found:?}");
        assert_eq!(found.remedy, format!("--time-unit {flag}"));
        let repair = Repair {
            time_unit: unit,
            ..Repair::default()
        };
        let mended = repair.apply(long).unwrap();
        let off = mended.t().iter().zip(sound.t()).map(|(a, b)| (a - b).abs());
        assert!(off.fold(0.0, f64::max) < 1e-9);
        assert_eq!(named(&rig, &mended), []);
    }
}

/// Refitted, a mass of 1.6 kg became one of 649 kg that no input moves.
#[test]
fn sensors_that_answer_to_no_input_are_named() {
    let (rig, sound) = sound();
    let spread = |recording: &Recording| {
        let values = recording.column("q_m").unwrap();
        values.iter().map(|q| q * q).sum::<f64>().sqrt()
    };
    let square = |t: f64| if t % 1.0 < 0.5 { 0.02 } else { -0.02 };
    let t = sound.t().to_vec();
    let alone = read_as(
        &sound,
        |t| t,
        |name, row, values| match name {
            "q_m" => square(t[row]),
            _ => values[row],
        },
    );
    assert!(
        spread(&alone) < spread(&sound),
        "the input is expected to move it farther"
    );
    let found = only(&rig, &alone);
    assert_eq!((found.kind, found.certain), ("unanswered_input", false));
    // Beside the motion by the input, the wave is a disturbance.
    let beside = read_as(
        &sound,
        |t| t,
        |name, row, values| match name {
            "q_m" => values[row] + square(t[row]),
            _ => values[row],
        },
    );
    let found = named(&rig, &beside);
    assert!(
        found.iter().all(|it| it.kind != "unanswered_input"),
        "{found:?}"
    );
}

/// With the drive off a device only swings out. The fit could follow by a mass of tons.
#[test]
fn a_motion_that_the_rig_explains_without_its_inputs_alone_is_certain() {
    let (rig, sound) = sound();
    let swing = |t: f64| 0.05 * (-0.4 * t).exp() * (5.0 * t).cos();
    let t = sound.t().to_vec();
    let off = read_as(
        &sound,
        |t| t,
        |name, row, values| match name {
            "q_m" => swing(t[row]) + 1e-4 * (1e3 * t[row].sin()).sin(),
            _ => values[row],
        },
    );
    let found = only(&rig, &off);
    assert_eq!((found.kind, found.certain), ("unanswered_input", true));
    assert!(found.sentence.contains("with u_N at 0"), "{found:?}");
}

#[test]
fn an_input_and_a_sensor_under_each_others_names_are_named() {
    let (rig, sound) = sound();
    let other = |name: &str| if name == "q_m" { "u_N" } else { "q_m" };
    let swapped = read_as(
        &sound,
        |t| t,
        |name, row, _| sound.column(other(name)).unwrap()[row],
    );
    let found = named(&rig, &swapped);
    let certain: Vec<&Check> = found.iter().filter(|it| it.certain).collect();
    assert_eq!(certain.len(), 1, "{found:?}");
    assert_eq!(certain[0].kind, "swapped_columns");
}

#[test]
fn hundredths_of_a_second_are_not_called_milliseconds() {
    let (rig, sound) = sound();
    for (factor, kind, remedy) in [
        (1e2, "time_in_other_unit", "divide the column t by 100"),
        (1e3, "time_in_milliseconds", "--time-unit ms"),
        (1e4, "time_in_other_unit", "divide the column t by 10000"),
        (1e6, "time_in_microseconds", "--time-unit us"),
    ] {
        let long = read_as(&sound, |t| t * factor, |_, row, values| values[row]);
        let found = only(&rig, &long);
        assert_eq!((found.kind, found.certain), (kind, true), "{found:?}");
        assert_eq!(found.remedy, remedy);
    }
}

/// A second recording of which a rig leaves as much as of a sound one is not searched for faults.
/// One of which it leaves more is.
#[test]
fn a_fault_of_the_second_recording_alone_is_named() {
    let (rig, sound) = sound();
    let turned = |name: &str, row: usize, values: &[f64]| match name {
        "q_m" => -values[row],
        _ => values[row],
    };
    let late = |name: &str, row: usize, values: &[f64]| match name {
        "u_N" => values[row.saturating_sub(3)],
        _ => values[row],
    };
    let in_millimetres = |name: &str, row: usize, values: &[f64]| match name {
        "q_m" => 1e3 * values[row],
        _ => values[row],
    };
    /// Value by column, row and the values as recorded.
    type Fault<'a> = &'a dyn Fn(&str, usize, &[f64]) -> f64;
    let faults: [(&str, Fault); 3] = [
        ("wrong_sign", &turned),
        ("input_lags", &late),
        ("millimetres_for_metres", &in_millimetres),
    ];
    for (kind, fault) in faults {
        let faulty = read_as(&sound, |t| t, fault);
        let both = [sound.clone(), faulty];
        let kinds: Vec<&str> = check(&both, Some(&rig)).iter().map(|it| it.kind).collect();
        assert_eq!(kinds, [kind]);
    }
}

fn two() -> Rig {
    Rig::parse(TWO, "two.toml").unwrap()
}

#[test]
fn two_sensors_under_each_others_names_are_named() {
    let sound = with_load(0.1, 1.0);
    let other = |name: &str| match name {
        "motor_rad" => "load_rad",
        "load_rad" => "motor_rad",
        _ => "u_Nm",
    };
    let swapped = read_as(
        &sound,
        |t| t,
        |name, row, _| sound.column(other(name)).unwrap()[row],
    );
    let found = only(&two(), &swapped);
    assert_eq!((found.kind, found.certain), ("swapped_columns", true));
}

#[test]
fn one_of_two_sensors_that_is_late_is_named_and_no_input() {
    let sound = with_load(0.1, 1.0);
    for name in ["motor_rad", "load_rad"] {
        let late = read_as(
            &sound,
            |t| t,
            |column, row, values| {
                let late = if column == name { 2 } else { 0 };
                values[row.saturating_sub(late)]
            },
        );
        let found = only(&two(), &late);
        assert_eq!((found.kind, found.certain), ("sensor_lags", false));
        assert_eq!(found.remedy, format!("--late {name}=2"));
    }
}

/// Noise of a milliradian.
fn noise(row: usize) -> f64 {
    let mut mixed = (row as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    for factor in [0xff51_afd7_ed55_8ccd, 0xc4ce_b9fe_1a85_ec53_u64] {
        mixed = (mixed ^ (mixed >> 33)).wrapping_mul(factor);
    }
    1e-3 * ((mixed >> 11) as f64 / (1_u64 << 52) as f64 - 1.0)
}

/// Constant, or noise of a milliradian.
#[test]
fn one_of_two_sensors_that_is_dead_is_certain() {
    let sound = with_load(0.1, 1.0);
    for scale in [0.0, 1.0] {
        let dead = read_as(
            &sound,
            |t| t,
            |name, row, values| match name {
                "load_rad" => 0.3 + scale * noise(row),
                _ => values[row],
            },
        );
        let found = only(&two(), &dead);
        assert_eq!((found.kind, found.certain), ("dead_channel", true));
        assert!(found.sentence.starts_with("load_rad"), "{found:?}");
    }
}

/// A cable that breaks in the middle of an experiment. Nothing was said, and what was missing "sat
/// at the shaft".
#[test]
fn one_of_two_sensors_that_falls_silent_is_named() {
    let sound = with_load(0.1, 1.0);
    let broken = sound.len() * 6 / 10;
    for silent in ["motor_rad", "load_rad"] {
        let dead = read_as(
            &sound,
            |t| t,
            |name, row, values| {
                if name == silent && row >= broken {
                    values[broken] + noise(row)
                } else {
                    values[row]
                }
            },
        );
        let found = only(&two(), &dead);
        assert_eq!((found.kind, found.certain), ("dead_channel", false));
        let begin = format!("{silent} shows no motion from t = ");
        assert!(found.sentence.starts_with(&begin), "{found:?}");
    }
}

/// The drive falls to a tenth, dry friction holds the motor, and the load swings on.
#[test]
fn a_body_that_friction_holds_under_a_weaker_drive_is_no_dead_sensor() {
    let stuck = driven([0.1, 1.0, 1.5], |at| {
        let size = if at < 1.6 { 1.5 } else { 0.15 };
        size * ((2.0 * at).sin() + (7.0 * at).cos())
    });
    let motor = stuck.column("motor_rad").unwrap();
    let still = motor[250..].iter().all(|it| (it - motor[250]).abs() < 3e-3);
    assert!(still, "{:?}", &motor[250..]);
    let found = check(&[stuck], Some(&two()));
    assert!(
        found.iter().all(|it| it.kind != "dead_channel"),
        "{found:?}"
    );
}

#[test]
fn a_device_that_is_a_tenth_heavier_is_another_device() {
    let recordings = [with_load(0.1, 1.0), with_load(0.11, 1.0)];
    let found = check(&recordings, Some(&two()));
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!(
        (found[0].kind, found[0].certain),
        ("different_devices", false)
    );
    let same = [with_load(0.1, 1.0), with_load(0.1001, 1.0)];
    assert_eq!(check(&same, Some(&two())), []);
}

/// Halves of one sound recording, to fit and to check.
fn halves(recording: &Recording) -> Recordings {
    let count = recording.len();
    let [fit, check] = [0..count / 2, count / 2..count].map(|rows| recording.rows(rows).unwrap());
    roles(&fit, &check)
}

/// Once called a curvature of the sensor.
#[test]
fn samples_that_a_sensor_cut_off_are_left_out_of_a_diagnosis() {
    let (rig, sound) = sound();
    let q = sound.column("q_m").unwrap();
    let high = q.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let cut = read_as(
        &sound,
        |t| t,
        |name, row, values| match name {
            "q_m" => values[row].min(0.6 * high),
            _ => values[row],
        },
    );
    let found = diagnosed(&rig, &halves(&cut));
    assert!(
        found.checks.iter().any(|it| it.kind == "clipped"),
        "{:?}",
        found.checks
    );
    assert_eq!(found.verdict, Verdict::Parameters, "{}", found.sentence);
    let said = "at an end of a sensor's range are left out";
    assert!(found.sentence.contains(said), "{}", found.sentence);
}

#[test]
fn a_late_sensor_is_said_beside_a_late_input_that_is_less_sure() {
    let (rig, sound) = sound();
    let early = moved(&sound, 2);
    let late = early.rows(0..early.len() - 2).unwrap();
    let found = diagnosed(&rig, &halves(&late));
    let effect = &found.effects[0];
    assert_eq!(effect.kind, "input_delay", "{}", found.sentence);
    let mut alike = effect.indistinguishable_from.iter();
    assert!(alike.any(|it| it.kind == "sensor_lags" && it.component == "encoder"));
    assert!(effect.confidence < 0.75, "{}", effect.confidence);
    assert!(found.sentence.contains("input_leads"), "{}", found.sentence);
}

#[test]
fn another_device_is_said_beside_what_nothing_explains() {
    let found = diagnosed(&two(), &roles(&with_load(0.1, 1.0), &with_load(0.11, 1.0)));
    assert!(
        found.sentence.contains("different_devices"),
        "{}",
        found.sentence
    );
    assert!(found.effects.iter().all(|effect| effect.confidence < 0.75));
}

/// Noise that differences of samples show is motion where a period has three rows.
#[test]
fn a_rig_that_is_wrong_is_not_consistent_with_few_rows_a_period() {
    let (rig, sound) = sound();
    let rows: Vec<usize> = (0..sound.len()).step_by(64).collect();
    let text = sound.to_csv();
    let lines: Vec<&str> = text.lines().collect();
    let kept = rows.iter().map(|row| lines[row + 1]);
    let kept: Vec<&str> = std::iter::once(lines[0]).chain(kept).collect();
    let coarse = Recording::parse(kept.join("\n").as_bytes(), "coarse.csv").unwrap();
    let found = named(&rig, &coarse);
    assert!(
        found.iter().any(|it| it.kind == "coarse_sampling"),
        "{found:?}"
    );
}

//! Commands that were logged late or early, and sensors that read zero for no value.

use std::path::PathBuf;

use sinew_ident::check::{Check, check};
use sinew_ident::recording::repair::Repair;
use sinew_ident::recording::{Column, Recording};
use sinew_sim::Rig;

/// A device whose command was written a row late, mended: sound.
pub fn sound() -> (Rig, Recording) {
    let case = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/cases/31-command-a-row-late");
    let recording = Recording::read(case.join("A.csv")).unwrap();
    let recording = moved(&recording, 1);
    let rows = recording.len() - 1;
    let rig = Rig::load(case.join("rig.toml")).unwrap();
    (rig, recording.rows(0..rows).unwrap())
}

/// The recording with its command so many rows earlier.
pub fn moved(recording: &Recording, rows: i64) -> Recording {
    let repair = Repair {
        late: vec![("u_N".into(), rows)],
        ..Repair::default()
    };
    repair.apply(recording.clone()).unwrap()
}

fn named(rig: &Rig, recording: &Recording) -> Vec<Check> {
    check(std::slice::from_ref(recording), Some(rig))
}

#[test]
fn a_command_that_was_logged_late_is_named_by_its_rows_and_an_early_one_is_not_certain() {
    let (rig, sound) = sound();
    assert_eq!(named(&rig, &sound), []);
    for rows in [2, 7, 10] {
        let late = moved(&sound, -rows);
        let count = usize::try_from(rows).unwrap();
        let found = named(&rig, &late.rows(count..late.len()).unwrap());
        assert_eq!(found.len(), 1, "{rows}: {found:?}");
        assert_eq!(found[0].kind, "input_lags");
        assert!(found[0].certain);
        assert_eq!(found[0].remedy, format!("--late u_N={rows}"));
    }
    let early = moved(&sound, 1);
    let found = named(&rig, &early.rows(0..early.len() - 1).unwrap());
    assert_eq!(found.len(), 1, "{found:?}");
    assert_eq!((found[0].kind, found[0].certain), ("input_leads", false));
    assert!(found[0].remedy.starts_with("--late u_N=-1"), "{found:?}");
}

/// The recording with zeros in the column for `length` rows from every one of these.
fn zeroed(recording: &Recording, from: &[usize], length: usize) -> Recording {
    let columns = recording.columns().iter().map(|column| {
        let mut values = column.values.clone();
        if column.name == "q_m" {
            for &row in from {
                values[row..row + length].fill(0.0);
            }
        }
        Column {
            name: column.name.clone(),
            values,
        }
    });
    let t = recording.t().to_vec();
    Recording::new(recording.path(), t, columns.collect()).unwrap()
}

#[test]
fn a_sensor_that_reads_zero_for_no_value_is_named_and_its_column_alone_is_mended() {
    let (rig, sound) = sound();
    let q = sound.column("q_m").unwrap();
    // Where the device is far from zero.
    let mut rows: Vec<usize> = (100..sound.len() - 20).step_by(40).collect();
    rows.sort_by(|a, b| q[*b].abs().total_cmp(&q[*a].abs()));
    for length in [2, 5, 12] {
        let faulty = zeroed(&sound, &rows[..4], length);
        let found = named(&rig, &faulty);
        assert_eq!(found.len(), 1, "{length}: {found:?}");
        assert_eq!((found[0].kind, found[0].certain), ("sentinel", true));
        assert_eq!(found[0].remedy, "--missing q_m=0");
        let count = format!("0 stands in {} rows of q_m", 4 * length);
        assert!(found[0].sentence.starts_with(&count), "{found:?}");
        let repair = Repair {
            missing_in: vec![("q_m".into(), 0.0)],
            ..Repair::default()
        };
        assert_eq!(named(&rig, &repair.apply(faulty).unwrap()), []);
    }
}

#[test]
fn shipped_recordings_have_neither_fault() {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../rigs");
    for name in ["mass-spring-damper", "damper-stand"] {
        let rig = Rig::load(folder.join(format!("{name}.toml"))).unwrap();
        for role in ["fit", "test"] {
            let file = folder.join(format!("{name}.{role}.csv"));
            let recording = Recording::read(file).unwrap();
            assert_eq!(named(&rig, &recording), [], "{name} {role}");
        }
    }
}

#[test]
fn a_recording_of_a_few_rows_is_named() {
    for (rows, few) in [(20, true), (21, false)] {
        let text: String = (0..rows)
            .map(|k| format!("{},{}\n", 0.01 * f64::from(k), f64::from(k).sin()))
            .collect();
        let recording = Recording::parse(format!("t,q_m\n{text}").as_bytes(), "a.csv").unwrap();
        let found = check(&[recording], None);
        assert_eq!(
            found.iter().any(|it| it.kind == "few_rows"),
            few,
            "{found:?}"
        );
    }
}

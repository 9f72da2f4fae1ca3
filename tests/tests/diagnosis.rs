//! `sinew diagnose` on recordings with concealed physics that foreign physics wrote: eight of the
//! committed cases (`tests/foreign/cases`, made by `tests/foreign/hardlaw/committed.py`). All are
//! `cargo xtask proof --committed`, the hundreds `cargo xtask proof`.

use std::fs;
use std::path::{Path, PathBuf};

use sinew_ident::diagnose::{self, DiagnoseOptions, Recordings, output};
use sinew_ident::recording::Recording;
use sinew_scorer::{Answer, Scored, Truth, outcome, table};
use sinew_sim::Rig;

/// The quickest with Stribeck friction, friction that grows with the load, quadratic drag, a cross
/// coupling and a dead zone; a rig that is exact, one with wrong parameters, heavy noise. `cargo
/// xtask proof --brief`, a stage of continuous integration, asks every sort.
const CASES: [usize; 8] = [7, 8, 10, 12, 14, 15, 20, 21];

fn foreign() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("foreign")
}

/// Answer of the program about a case, by way of the JSON that a user gets.
fn answer(folder: &Path) -> Answer {
    let path = folder.join("rig.toml");
    let text = fs::read_to_string(&path).expect("the case has a rig");
    let rig = Rig::parse(&text, "rig.toml").unwrap_or_else(|error| panic!("{error}"));
    let read =
        |name: &str| Recording::read(folder.join(name)).unwrap_or_else(|error| panic!("{error}"));
    let recordings = Recordings {
        fit: vec![read("fit-a.csv"), read("fit-b.csv")],
        check: vec![read("check.csv")],
        test: vec![read("test.csv")],
    };
    let found = diagnose::diagnose(
        &rig,
        &recordings,
        &DiagnoseOptions::default(),
        &|_, _, _| {},
    )
    .unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let json = output::json(&found).expect("a finding can be written");
    serde_json::from_str(&json).expect("the JSON has the contract's form")
}

#[test]
fn concealed_physics_is_named_and_nothing_else_is() {
    // Every answer first, then every truth.
    let answers: Vec<Answer> = CASES
        .iter()
        .map(|case| answer(&foreign().join(format!("cases/case-{case:02}"))))
        .collect();
    let scored: Vec<Scored> = (answers.into_iter().zip(CASES))
        .map(|(answer, case)| {
            let path = foreign().join(format!("truth/case-{case:02}.json"));
            let text = fs::read_to_string(path).expect("the case has a truth");
            let truth: Truth = serde_json::from_str(&text).expect("a truth");
            Scored {
                case: format!("case-{case:02}"),
                outcome: outcome(Some(&answer), &truth),
                truth,
                answer: Some(answer),
            }
        })
        .collect();
    println!("{}", table::page(&scored));
    for case in &scored {
        assert!(case.allowed(), "{}: {:?}", case.case, case.outcome);
    }
}

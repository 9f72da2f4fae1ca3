//! Numbers and bounds of a rig that are wrong. The recordings are of another writer.

use crate::diagnose::{DiagnoseOptions, Diagnosis, Recordings, Verdict, diagnose};
use crate::recording::Recording;
use sinew_sim::Rig;

/// A file of case 24.
pub fn path(name: &str) -> String {
    let root = env!("CARGO_MANIFEST_DIR");
    format!("{root}/tests/cases/24-wrong-bare-mass/{name}")
}

/// The diagnosis of a rig with the recordings of case 24.
pub fn diagnosed_with(rig: &Rig) -> Diagnosis {
    let read = |name: &str| Recording::read(path(name)).expect("the recording is there");
    let recordings = Recordings {
        fit: vec![read("A.csv")],
        check: vec![read("B.csv")],
        test: Vec::new(),
    };
    let found = diagnose(rig, &recordings, &DiagnoseOptions::default(), &|_, _, _| {});
    found.expect("the rig can be diagnosed")
}

/// 1.6 kg for 2.0, 40 N/m for 50 and 3.0 N s/m for 1.5. The other numbers are free, so a gain
/// explains as much: mass, stiffness and damping would scale with it.
#[test]
fn a_bare_number_that_is_wrong_is_suspected_with_all_that_are_as_good() {
    for (file, number) in [
        ("mass.toml", "mass.inertia"),
        ("stiffness.toml", "spring.stiffness"),
        ("damping.toml", "damper.damping"),
    ] {
        let found = diagnosed_with(&Rig::load(path(file)).expect("the text is a rig"));
        assert_eq!(found.verdict, Verdict::Unexplained, "{}", found.sentence);
        let several = found.sentence.starts_with("One of the numbers");
        let named = found.sentence.contains(&format!("`{number}`"));
        assert!(several && named, "{file}: {}", found.sentence);
    }
}

#[test]
fn a_bound_that_excludes_the_truth_is_suspected() {
    let text = std::fs::read_to_string(path("mass.toml")).expect("the text is a rig");
    let text = text.replace("inertia = 1.6", "inertia = { value = 1.5, max = 1.8 }");
    let found = diagnosed_with(&Rig::parse(&text, "bound.toml").expect("the text is a rig"));
    assert_eq!(found.verdict, Verdict::Unexplained, "{}", found.sentence);
    let said = "A bound of the rig is suspected: `mass.inertia` rests at its bound of 1.80 kg; \
                without it 2.00 kg would leave";
    assert!(found.sentence.starts_with(said), "{}", found.sentence);
}

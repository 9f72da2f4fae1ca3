//! The same rows in two files.

use sinew_ident::check::check;
use sinew_ident::recording::Recording;

fn recording(name: &str, last: &str) -> Recording {
    let rows: String = (0..40)
        .map(|k| format!("{},{},{last}\n", 0.01 * f64::from(k), f64::from(k).sin()))
        .collect();
    Recording::parse(format!("t,q_m,u_N\n{rows}").as_bytes(), name).unwrap()
}

#[test]
fn a_copy_is_named_with_both_files_and_another_recording_is_not() {
    // A missing sample is the same in both.
    for last in ["1", ""] {
        let [a, b] = ["a.csv", "b.csv"].map(|name| recording(name, last));
        let found = check(&[a, recording("c.csv", "2"), b], None);
        let copies: Vec<_> = found
            .iter()
            .filter(|c| c.kind == "same_recording")
            .collect();
        assert_eq!(copies.len(), 1, "{found:?}");
        assert_eq!(copies[0].file, "b.csv");
        assert!(
            copies[0].sentence.contains("a.csv"),
            "{}",
            copies[0].sentence
        );
        assert!(!copies[0].certain);
    }
}

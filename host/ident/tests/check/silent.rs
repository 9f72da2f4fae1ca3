//! A sensor that gave next to nothing.

use sinew_ident::check::check;
use sinew_ident::recording::Recording;

/// Forty rows in which the sensor has a value in the first `valid` ones.
fn recording(valid: u32) -> Recording {
    let rows: String = (0..40)
        .map(|k| match k < valid {
            true => format!("{},{},1\n", 0.01 * f64::from(k), f64::from(k).sin()),
            false => format!("{},,1\n", 0.01 * f64::from(k)),
        })
        .collect();
    Recording::parse(format!("t,q_m,u_N\n{rows}").as_bytes(), "a.csv").unwrap()
}

#[test]
fn a_sensor_with_next_to_no_value_is_named_and_a_slow_one_is_not() {
    for (valid, said) in [
        (1, "q_m has 1 value in 40 rows"),
        (7, "q_m has 7 values in 40 rows"),
    ] {
        let found = check(&[recording(valid)], None);
        let found: Vec<_> = found.iter().filter(|c| c.kind == "dead_channel").collect();
        assert_eq!(found.len(), 1, "{valid}: {found:?}");
        assert_eq!(found[0].sentence, said);
    }
    let found = check(&[recording(12)], None);
    assert!(found.iter().all(|c| c.kind != "dead_channel"), "{found:?}");
}

//! Time of a check beside the number of rows.

use std::time::{Duration, Instant};

use sinew_ident::check::check;
use sinew_ident::recording::{Column, Recording};

/// An hour at 100 Hz: a motion of which no two neighbours are equal, and one in coarse steps.
fn long(rows: usize) -> Recording {
    let t: Vec<f64> = (0..rows).map(|k| 0.01 * k as f64).collect();
    let column = |name: &str, value: &dyn Fn(f64) -> f64| Column {
        name: name.into(),
        values: t.iter().map(|t| value(*t)).collect(),
    };
    let columns = vec![
        column("u_N", &|t| (0.7 * t).sin()),
        column("q_m", &|t| (1.3 * t).sin() + 0.3 * (17.0 * t).cos()),
        column("x_m", &|t| (1e3 * (1.3 * t).sin()).round() * 1e-3),
    ];
    Recording::new("long.csv", t.clone(), columns).unwrap()
}

#[test]
fn an_hour_of_rows_is_checked_in_seconds() {
    let recording = long(400_000);
    let begun = Instant::now();
    check(&[recording], None);
    let took = begun.elapsed();
    assert!(took < Duration::from_secs(10), "{took:?}");
}

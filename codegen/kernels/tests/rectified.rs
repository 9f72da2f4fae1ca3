//! Derivatives that pass by shut units, against those through all of them, for every set of open
//! units.

use sinew_kernels::layers::activation::Relu;
use sinew_kernels::layers::dense::{dense_back, dense_seed_activated};
use sinew_kernels::layers::rectified::rectified_back;
use sinew_kernels::layers::rows::{Int8, Rows, Weight};

/// Weights from 1 to `-1` in steps that no two places share.
fn weight(row: usize, column: usize) -> f32 {
    1.0 - ((31 * row + 17 * column) % 97) as f32 / 48.0
}

fn matrix<const ROWS: usize, const COLUMNS: usize>() -> [[f32; COLUMNS]; ROWS] {
    core::array::from_fn(|row| core::array::from_fn(|column| weight(row, column)))
}

/// Both ways for each of the 256 sets; `-0` is nought.
fn compare<V: Weight, W: Weight, const IN: usize, const OUT: usize>(
    w2: &impl Rows<OUT, Row = [W; 8]>,
    w1: &impl Rows<8, Row = [V; IN]>,
) {
    let outer = core::array::from_fn(|r| 0.5 + 0.25 * r as f32);
    for set in 0..1_u32 << 8 {
        let a = core::array::from_fn(|h| if set >> h & 1 == 1 { 0.3 } else { 0.0 });
        let mut found = [[f32::NAN; OUT]; IN];
        rectified_back(w2, &outer, &a, w1, &mut found);
        let mut expected = [[f32::NAN; OUT]; IN];
        dense_back(
            w1,
            &dense_seed_activated(w2, &outer, Relu, &a),
            &mut expected,
        );
        assert_eq!(found, expected, "{IN} inputs, open: {set:08b}");
        let nought = expected.iter().flatten().all(|t| *t == 0.0);
        assert_eq!(nought, set == 0, "{IN} inputs, open: {set:08b}");
    }
}

#[test]
fn what_passes_by_shut_units_is_what_passes_through_all() {
    compare(&matrix::<3, 8>(), &matrix::<8, 26>());
    compare(&matrix::<2, 8>(), &matrix::<8, 1>());
    // More adjoints than registers hold.
    compare(&matrix::<4, 8>(), &matrix::<8, 9>());
}

#[test]
fn the_gains_of_integers_reach_the_same_units() {
    let integers = |row: usize, column: usize| (127.0 * weight(row, column)) as i8;
    let first = Int8 {
        rows: core::array::from_fn::<[i8; 11], 8, _>(|r| core::array::from_fn(|c| integers(r, c))),
        scale: core::array::from_fn(|r| 0.01 * (1 + r) as f32),
    };
    let last = Int8 {
        rows: core::array::from_fn::<[i8; 8], 3, _>(|r| core::array::from_fn(|c| integers(c, r))),
        scale: [0.01, 0.02, 0.03],
    };
    compare(&last, &first);
}

#[test]
fn what_is_not_a_number_counts_as_open() {
    let through = |outer: &[f32; 3], a: &[f32; 8]| {
        let mut found = [[0.0; 3]; 26];
        rectified_back(&matrix::<3, 8>(), outer, a, &matrix::<8, 26>(), &mut found);
        found
    };
    let mut a = [0.0, 0.3, 0.0, 0.0, 1.2, 0.0, 0.0, 0.0];
    a[2] = 1.0;
    let open = through(&[1.0, 0.5, 2.0], &a);
    a[2] = f32::NAN;
    assert_eq!(through(&[1.0, 0.5, 2.0], &a), open);
    // What comes after a unit without a number has none either, and that reaches every input.
    let lost = through(&[f32::NAN; 3], &[f32::NAN; 8]);
    assert!(lost.iter().flatten().all(|t| t.is_nan()), "{lost:?}");
}

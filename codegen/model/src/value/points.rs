//! Operating points along the motions that a controller is to follow.

use super::matrix::Matrix;
use crate::spec::{MAX_POINTS, Signal, ValueSpec};

/// A cost-to-go of `rows` rows and `ahead` rows of the reference behind the horizon, at no more
/// than `points` operating points on `motions` (rows of outputs, physical units). Where the points
/// of a curved motion would not go one way, there are fewer. `None` without a motion.
#[must_use]
pub fn on_motions(
    motions: &[Vec<f64>],
    outputs: &[Signal],
    (rows, ahead, points): (usize, usize, usize),
) -> Option<ValueSpec> {
    let scaled: Vec<Vec<f64>> = motions
        .iter()
        .map(|row| {
            let signals = row.iter().zip(outputs);
            signals.map(|(y, s)| (y - s.offset) / s.span).collect()
        })
        .collect();
    let physical = |point: Vec<f64>| -> Vec<f64> {
        let signals = point.iter().zip(outputs);
        signals.map(|(y, s)| y * s.span + s.offset).collect()
    };
    let of = |count: usize| ValueSpec {
        rows,
        ahead,
        points: (along(&scaled, count).into_iter().map(physical)).collect(),
    };
    (1..=points.min(MAX_POINTS))
        .rev()
        .map(of)
        .find(|value| !value.points.is_empty() && value.goes_one_way(outputs))
}

/// `count` points along the direction in which the rows vary most, at equal distances from one end
/// to the other: each is the mean of the rows around it, weighted by how near they are. One point
/// is the mean of all; rows that do not vary have one. Without rows there are no points. Numbers
/// beyond the length of the first row are left out, and missing ones are zero.
#[must_use]
pub fn along(rows: &[Vec<f64>], count: usize) -> Vec<Vec<f64>> {
    let Some(n) = rows.first().map(Vec::len) else {
        return Vec::new();
    };
    let rows: Vec<Vec<f64>> = rows.iter().map(|row| resized(row, n)).collect();
    let weighted = |weight: &dyn Fn(&[f64]) -> f64| -> Option<Vec<f64>> {
        let (mut sum, mut total) = (vec![0.0; n], 0.0);
        for row in &rows {
            let weight = weight(row);
            total += weight;
            for (sum, value) in sum.iter_mut().zip(row) {
                *sum += weight * value;
            }
        }
        (total > 0.0).then(|| sum.iter().map(|sum| sum / total).collect())
    };
    let mean = weighted(&|_| 1.0).unwrap_or_default();
    let mut spread = Matrix::zero(n, n);
    for row in &rows {
        for i in 0..n {
            for j in 0..n {
                spread[(i, j)] += (row[i] - mean[i]) * (row[j] - mean[j]);
            }
        }
    }
    let (_, vectors) = spread.eigen();
    if n == 0 {
        return Vec::new();
    }
    let place = |row: &[f64]| -> f64 { (0..n).map(|i| vectors[(i, 0)] * row[i]).sum() };
    let (mut first, mut last) = (f64::INFINITY, f64::NEG_INFINITY);
    for row in &rows {
        first = first.min(place(row));
        last = last.max(place(row));
    }
    let varies = last > first;
    if count < 2 || !varies {
        return vec![mean];
    }
    let distance = (last - first) / (count - 1) as f64;
    (0..count)
        .filter_map(|index| {
            let centre = first + distance * index as f64;
            weighted(&|row: &[f64]| (1.0 - (place(row) - centre).abs() / distance).max(0.0))
        })
        .collect()
}

fn resized(row: &[f64], n: usize) -> Vec<f64> {
    let mut row = row.to_vec();
    row.resize(n, 0.0);
    row
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_rows_have_no_points() {
        assert!(along(&[], 3).is_empty());
        assert!(along(&[vec![], vec![]], 3).is_empty());
        assert_eq!(along(&[vec![1.0, 2.0], vec![3.0]], 1), [[2.0, 1.0]]);
    }

    #[test]
    fn points_of_a_straight_motion_lie_on_it_in_order() {
        let rows: Vec<Vec<f64>> = (0..=100)
            .map(|i| f64::from(i) / 100.0)
            .map(|t| vec![2.0 * t, 1.0 - t])
            .collect();
        let points = along(&rows, 3);
        assert_eq!(points.len(), 3);
        for point in &points {
            assert!((0.5 * point[0] + point[1] - 1.0).abs() < 1e-12, "{point:?}");
        }
        assert!(points.is_sorted_by(|a, b| a[0] < b[0]));
        assert!((points[1][0] - 1.0).abs() < 1e-12, "{points:?}");
    }

    #[test]
    fn points_on_motions_go_one_way_or_are_fewer() {
        let output = |name: &str, span| Signal {
            name: name.into(),
            unit: "mm".into(),
            span,
            offset: 3.0,
        };
        let outputs = [output("x", 10.0), output("y", 20.0)];
        let turn = |i: i32| f64::from(i) * std::f64::consts::TAU / 100.0;
        let straight: Vec<Vec<f64>> = (0..100)
            .map(|i| vec![3.0 + f64::from(i) / 10.0, 3.0])
            .collect();
        let value = on_motions(&straight, &outputs, (2, 4, 5)).expect("there are motions");
        assert_eq!((value.rows, value.ahead, value.points.len()), (2, 4, 5));
        // Means of an end's neighbours lie a little inside.
        let last = value.points[4][0];
        assert!((12.0..12.5).contains(&last), "{last}");
        // An S that folds back on itself: means of its parts turn round.
        let folded: Vec<Vec<f64>> = (0..100)
            .map(|i| vec![10.0 * turn(i).cos(), 20.0 * (3.0 * turn(i)).cos()])
            .collect();
        let value = on_motions(&folded, &outputs, (2, 4, 9)).expect("there are motions");
        assert!(value.goes_one_way(&outputs), "{:?}", value.points);
        assert_eq!(on_motions(&[], &outputs, (2, 4, 5)), None);
    }

    #[test]
    fn rows_that_do_not_vary_have_one_point() {
        assert_eq!(along(&vec![vec![0.5]; 4], 5), [[0.5]]);
        assert_eq!(along(&[vec![1.0], vec![3.0]], 1), [[2.0]]);
    }
}

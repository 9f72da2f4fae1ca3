//! Operating points along the motions that a controller is to follow.

use super::matrix::Matrix;

/// `count` points along the direction in which the rows vary most, at equal distances from one end
/// to the other: each is the mean of the rows around it, weighted by how near they are. One point
/// is the mean of all; rows that do not vary have one.
///
/// # Panics
/// Without a row.
#[must_use]
pub fn along(rows: &[Vec<f64>], count: usize) -> Vec<Vec<f64>> {
    let n = rows.first().expect("at least one row").len();
    let weighted = |weight: &dyn Fn(&[f64]) -> f64| -> Option<Vec<f64>> {
        let (mut sum, mut total) = (vec![0.0; n], 0.0);
        for row in rows {
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
    for row in rows {
        for i in 0..n {
            for j in 0..n {
                spread[(i, j)] += (row[i] - mean[i]) * (row[j] - mean[j]);
            }
        }
    }
    let (_, vectors) = spread.eigen();
    let place = |row: &[f64]| -> f64 { (0..n).map(|i| vectors[(i, 0)] * row[i]).sum() };
    let (mut first, mut last) = (f64::INFINITY, f64::NEG_INFINITY);
    for row in rows {
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

#[cfg(test)]
mod tests {
    use super::*;

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
    fn rows_that_do_not_vary_have_one_point() {
        assert_eq!(along(&vec![vec![0.5]; 4], 5), [[0.5]]);
        assert_eq!(along(&[vec![1.0], vec![3.0]], 1), [[2.0]]);
    }
}

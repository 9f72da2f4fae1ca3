//! Long series in few points that draw the same picture.

/// Indices of the points to draw: in each of `columns` equal stretches of `low..high`, the first,
/// the lowest, the highest and the last, in their order. Every extreme stays visible, and a series
/// of 100,000 samples becomes at most four points a column. Points without a number are kept where
/// they break a line; those outside the range are left out but for the nearest on each side.
pub(super) fn indices(x: &[f64], y: &[f64], low: f64, high: f64, columns: usize) -> Vec<usize> {
    let len = x.len().min(y.len());
    let begin = x[..len]
        .partition_point(|value| *value < low)
        .saturating_sub(1);
    let end = (x[..len].partition_point(|value| *value <= high) + 1).min(len);
    if end - begin <= 4 * columns {
        return (begin..end).collect();
    }
    let column_of = |i: usize| ((x[i] - low) / (high - low) * columns as f64).floor();
    let mut kept = Vec::with_capacity(4 * columns);
    let mut start = begin;
    while start < end {
        let column = column_of(start);
        // A break in the line is a bucket's end, so that it stays where it is.
        let broken = y[start].is_nan();
        let mut stop = start + 1;
        while stop < end && column_of(stop) == column && y[stop].is_nan() == broken {
            stop += 1;
        }
        if broken {
            kept.push(start);
        } else {
            let mut bucket = [start, start, start, stop - 1];
            for i in start..stop {
                if y[i] < y[bucket[1]] {
                    bucket[1] = i;
                }
                if y[i] > y[bucket[2]] {
                    bucket[2] = i;
                }
            }
            bucket.sort_unstable();
            for i in bucket {
                if kept.last() != Some(&i) {
                    kept.push(i);
                }
            }
        }
        start = stop;
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_single_spike_survives() {
        let x: Vec<f64> = (0..100_000).map(f64::from).collect();
        let mut y = vec![0.0; x.len()];
        y[54_321] = 1.0;
        y[54_322] = -1.0;
        let kept = indices(&x, &y, 0.0, 99_999.0, 500);
        assert!(kept.len() <= 4 * 501 && kept.contains(&54_321) && kept.contains(&54_322));
        assert_eq!((kept[0], *kept.last().unwrap()), (0, 99_999));
        assert!(kept.windows(2).all(|pair| pair[0] < pair[1]));
    }

    #[test]
    fn a_gap_stays_a_gap() {
        let x: Vec<f64> = (0..10_000).map(f64::from).collect();
        let mut y = vec![1.0; x.len()];
        y[5_000] = f64::NAN;
        assert!(indices(&x, &y, 0.0, 9_999.0, 100).contains(&5_000));
    }

    #[test]
    fn only_what_is_in_sight_is_kept() {
        let x: Vec<f64> = (0..100).map(f64::from).collect();
        assert_eq!(indices(&x, &x, 10.0, 12.0, 100), [9, 10, 11, 12, 13]);
        assert!(indices(&[], &[], 0.0, 1.0, 10).is_empty());
    }
}

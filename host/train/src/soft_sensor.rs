//! Calibration of a soft sensor: the quadratic map from channels to outputs that one recording of
//! both determines (docs/explanation/controller.md, eq. 21).

use std::path::Path;

use nalgebra::{Cholesky, DMatrix, DVector};
use sinew_ident::error::{Error, Result};
use sinew_ident::recording::Column;
use sinew_model::spec::SoftSensorSpec;

use crate::channel_watch;

/// Contiguous stretches, each of which judges the map of all others.
const STRETCHES: usize = 5;
/// Ridges that are tried, as parts of the rows.
const RIDGES: [f64; 8] = [1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2];
/// Most of an output's variance that the map may leave on unseen readings: with more, the channels
/// say hardly anything of it.
const MOST_LEFT: f64 = 0.5;
/// Rows a weight: with fewer the map follows the noise.
const ROWS_A_WEIGHT: usize = 3;

/// A calibrated soft sensor. Spans and offsets are those of its channels and outputs:
/// `model = (physical - offset) / span`.
#[derive(Clone, Debug, PartialEq)]
pub struct Calibrated {
    /// Weights in model units, and the error in physical ones.
    pub spec: SoftSensorSpec,
    /// Span and offset of each channel.
    pub channels: Vec<(f64, f64)>,
    /// Ridge that was chosen.
    pub ridge: f64,
    /// Rows that have every channel and output.
    pub rows: usize,
}

/// Calibrates on readings of `channels` and `outputs`, which `file` has. `scaling` is span and
/// offset of each output in the model.
///
/// The ridge is the one with the least error on stretches that its weights have not seen.
///
/// # Errors
/// Too few whole rows, a channel that never changes, or an output that the channels do not say.
pub fn calibrate(
    channels: &[Column],
    outputs: &[Column],
    scaling: &[(f64, f64)],
    file: &Path,
) -> Result<Calibrated> {
    let (n_s, n_y) = (channels.len(), outputs.len());
    let features = 1 + n_s + SoftSensorSpec::products(n_s);
    let length = channels
        .iter()
        .chain(outputs)
        .map(|one| one.values.len())
        .min();
    let whole: Vec<usize> = (0..length.unwrap_or(0))
        .filter(|k| {
            channels
                .iter()
                .chain(outputs)
                .all(|one| one.values[*k].is_finite())
        })
        .collect();
    let least = ROWS_A_WEIGHT * features;
    if whole.len() < least {
        return Err(Error::file(
            file,
            format!(
                "the soft sensor has {features} weights an output and {} rows to calibrate them",
                whole.len()
            ),
        )
        .expected(format!(
            "at least {least} rows with every channel and output, or fewer channels in `sensed_by`"
        )));
    }
    let of_channels = channel_scalings(channels, &whole, file)?;
    let z = DMatrix::from_fn(whole.len(), n_s, |row, i| {
        let (span, offset) = of_channels[i];
        (channels[i].values[whole[row]] - offset) / span
    });
    let y = DMatrix::from_fn(whole.len(), n_y, |row, r| {
        let (span, offset) = scaling[r];
        (outputs[r].values[whole[row]] - offset) / span
    });
    let a = features_of(&z);
    let sums: Vec<Sums> = stretches(whole.len())
        .map(|(from, to)| Sums::of(&a, &y, from, to))
        .collect();
    let (ridge, squares) = chosen(&a, &y, &sums)?;
    refuse_unsaid(squares.as_slice(), &y, outputs, file)?;
    let all = Sums::total(&sums, None);
    let weights = all.solve(ridge).ok_or_else(not_positive)?;
    let row = |from: usize, count: usize| -> Vec<f32> {
        let weights = &weights;
        (0..n_y)
            .flat_map(|r| (from..from + count).map(move |i| weights[(i, r)] as f32))
            .collect()
    };
    let error = squares.iter().zip(scaling);
    Ok(Calibrated {
        spec: SoftSensorSpec {
            error: error
                .map(|(square, (span, _))| span * square.sqrt())
                .collect(),
            bias: row(0, 1),
            linear: row(1, n_s),
            quadratic: row(1 + n_s, SoftSensorSpec::products(n_s)),
            watch: channel_watch::calibrate(&z, stretches(whole.len())),
        },
        channels: of_channels,
        ridge,
        rows: whole.len(),
    })
}

/// Half range and middle of each channel over the whole rows.
fn channel_scalings(channels: &[Column], whole: &[usize], file: &Path) -> Result<Vec<(f64, f64)>> {
    let of_channels: Vec<(f64, f64)> = channels
        .iter()
        .map(|channel| {
            let values = whole.iter().map(|k| channel.values[*k]);
            let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
                (low.min(v), high.max(v))
            });
            ((high - low) / 2.0, f64::midpoint(high, low))
        })
        .collect();
    if let Some(still) = of_channels.iter().position(|(span, _)| *span <= 0.0) {
        return Err(Error::file(
            file,
            format!(
                "`{}`, a channel of the soft sensor, never changes",
                channels[still].name
            ),
        )
        .expected("channels that move with the outputs"));
    }
    Ok(of_channels)
}

/// Refuses an output of whose variance the map leaves too much.
fn refuse_unsaid(squares: &[f64], y: &DMatrix<f64>, outputs: &[Column], file: &Path) -> Result<()> {
    for (r, square) in squares.iter().enumerate() {
        let left = square / y.column(r).variance().max(f64::MIN_POSITIVE);
        if left > MOST_LEFT {
            return Err(Error::file(file, format!(
                "the channels do not say `{}`: their best map leaves {:.0} % of its variance on \
                 readings that it has not seen",
                outputs[r].name,
                100.0 * left
            ))
            .expected(format!(
                "at most {:.0} %: other channels in `sensed_by`, or a longer recording that moves",
                100.0 * MOST_LEFT
            )));
        }
    }
    Ok(())
}

/// 1, z_i, z_i z_j with j >= i.
fn features_of(z: &DMatrix<f64>) -> DMatrix<f64> {
    let (rows, n) = z.shape();
    let mut a = DMatrix::zeros(rows, 1 + n + SoftSensorSpec::products(n));
    for row in 0..rows {
        a[(row, 0)] = 1.0;
        let mut place = 1 + n;
        for i in 0..n {
            a[(row, 1 + i)] = z[(row, i)];
            for j in i..n {
                a[(row, place)] = z[(row, i)] * z[(row, j)];
                place += 1;
            }
        }
    }
    a
}

fn stretches(rows: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..STRETCHES).map(move |k| (k * rows / STRETCHES, (k + 1) * rows / STRETCHES))
}

/// Sums of the normal equations over some rows.
#[derive(Clone)]
struct Sums {
    gram: DMatrix<f64>,
    right: DMatrix<f64>,
    rows: usize,
}

impl Sums {
    fn of(a: &DMatrix<f64>, y: &DMatrix<f64>, from: usize, to: usize) -> Self {
        let (a, y) = (a.rows(from, to - from), y.rows(from, to - from));
        Self {
            gram: a.tr_mul(&a),
            right: a.tr_mul(&y),
            rows: to - from,
        }
    }

    /// The sum of all but one.
    fn total(sums: &[Self], without: Option<usize>) -> Self {
        let mut kept = sums.iter().enumerate().filter(|(k, _)| Some(*k) != without);
        let first = kept.next().map(|(_, sum)| sum.clone());
        let first = first.expect("there are several stretches");
        kept.fold(first, |total, (_, sum)| Self {
            gram: total.gram + &sum.gram,
            right: total.right + &sum.right,
            rows: total.rows + sum.rows,
        })
    }

    /// Weights, a column an output; the constant is not held back.
    fn solve(&self, ridge: f64) -> Option<DMatrix<f64>> {
        let mut gram = self.gram.clone();
        for i in 1..gram.nrows() {
            gram[(i, i)] += ridge * self.rows as f64;
        }
        Cholesky::new(gram).map(|factor| factor.solve(&self.right))
    }
}

/// The ridge with the least error on unseen stretches, and that error's mean square, an output
/// each.
fn chosen(a: &DMatrix<f64>, y: &DMatrix<f64>, sums: &[Sums]) -> Result<(f64, DVector<f64>)> {
    let mut best: Option<(f64, DVector<f64>)> = None;
    for ridge in RIDGES {
        let mut squares = DVector::zeros(y.ncols());
        let mut solved = true;
        for (k, (from, to)) in stretches(y.nrows()).enumerate() {
            let Some(weights) = Sums::total(sums, Some(k)).solve(ridge) else {
                solved = false;
                break;
            };
            let error = a.rows(from, to - from) * weights - y.rows(from, to - from);
            for (square, column) in squares.iter_mut().zip(error.column_iter()) {
                *square += column.norm_squared() / y.nrows() as f64;
            }
        }
        let better = |found: &(f64, DVector<f64>)| squares.sum() < found.1.sum();
        if solved && best.as_ref().is_none_or(better) {
            best = Some((ridge, squares));
        }
    }
    best.ok_or_else(not_positive)
}

fn not_positive() -> Error {
    Error::failed("the channels of the soft sensor say the same: its weights are not determined")
        .expected("channels that differ")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two channels that bend with two coordinates, and outputs that are their quadratics.
    fn bent(rows: usize, noise: f64) -> (Vec<Column>, Vec<Column>) {
        let p = |k: usize| (0.031 * k as f64).sin();
        let q = |k: usize| (0.017 * k as f64 + 0.4).cos();
        let rough = |k: usize, i: usize| noise * ((k * (7 + 6 * i)) as f64 * 1.7).sin();
        let readings = |name: &str, of: &dyn Fn(usize) -> f64| Column {
            name: name.into(),
            values: (0..rows).map(of).collect(),
        };
        let channels = vec![
            readings("light1_1", &|k| 3.0 + 0.5 * p(k) + rough(k, 0)),
            readings("light2_1", &|k| -1.0 + 2.0 * q(k) + rough(k, 1)),
        ];
        let outputs = vec![
            readings("x_m", &|k| 0.01 * (p(k) + 0.3 * p(k) * q(k))),
            readings("y_m", &|k| 0.02 * (q(k) - 0.2 * p(k) * p(k))),
        ];
        (channels, outputs)
    }

    const SCALING: [(f64, f64); 2] = [(0.01, 0.0), (0.02, 0.001)];

    #[test]
    fn a_quadratic_is_found_to_the_precision_of_its_weights() {
        let (channels, outputs) = bent(600, 0.0);
        let found = calibrate(&channels, &outputs, &SCALING, Path::new("a.csv")).unwrap();
        assert_eq!(found.ridge, RIDGES[0]);
        for k in [3, 200, 599] {
            let each = channels.iter().zip(&found.channels);
            let z: Vec<f64> = each
                .map(|(c, (span, offset))| (c.values[k] - offset) / span)
                .collect();
            let said = found.spec.outputs(&z);
            for ((said, output), (span, offset)) in said.iter().zip(&outputs).zip(SCALING) {
                assert!(
                    (span * said + offset - output.values[k]).abs() < 1e-8,
                    "{said}"
                );
            }
        }
        assert!(
            found.spec.error.iter().all(|e| *e < 1e-7),
            "{:?}",
            found.spec.error
        );
    }

    #[test]
    fn the_error_is_that_of_readings_it_has_not_seen() {
        let (channels, outputs) = bent(900, 0.05);
        let found = calibrate(&channels, &outputs, &SCALING, Path::new("a.csv")).unwrap();
        // 0.05 / sqrt(2) of a channel that moves by 0.5 is 0.07 of an output of 0.01.
        assert!(
            (2e-4..1.5e-3).contains(&found.spec.error[0]),
            "{:?}",
            found.spec.error
        );
    }

    #[test]
    fn rows_with_a_gap_are_left_out() {
        let (mut channels, mut outputs) = bent(700, 0.01);
        for k in (0..700).step_by(10) {
            channels[k % 2].values[k] = f64::NAN;
            outputs[1].values[k + 1] = f64::NAN;
        }
        let found = calibrate(&channels, &outputs, &SCALING, Path::new("a.csv")).unwrap();
        assert_eq!(found.rows, 700 - 140);
    }

    #[test]
    fn channels_that_say_nothing_of_an_output_are_refused() {
        let (mut channels, mut outputs) = bent(600, 0.01);
        let rough = |k: usize| ((k * k) as f64 * 0.37).sin();
        outputs[1].values = (0..600).map(rough).collect();
        let unsaid = calibrate(&channels, &outputs, &SCALING, Path::new("a.csv"))
            .unwrap_err()
            .to_string();
        assert!(
            unsaid.contains("a.csv: the channels do not say `y_m`"),
            "{unsaid}"
        );
        channels
            .iter_mut()
            .for_each(|channel| channel.values = (0..600).map(rough).collect());
        outputs.truncate(1);
        let unsaid = calibrate(&channels, &outputs, &SCALING[..1], Path::new("a.csv"))
            .unwrap_err()
            .to_string();
        assert!(unsaid.contains("do not say `x_m`"), "{unsaid}");
    }

    #[test]
    fn what_does_not_determine_it_is_refused() {
        let (channels, outputs) = bent(17, 0.0);
        let few = calibrate(&channels, &outputs, &SCALING, Path::new("a.csv"))
            .unwrap_err()
            .to_string();
        assert!(few.contains("6 weights an output and 17 rows"), "{few}");
        let (mut channels, outputs) = bent(300, 0.0);
        channels[1].values.fill(0.25);
        let still = calibrate(&channels, &outputs, &SCALING, Path::new("a.csv"))
            .unwrap_err()
            .to_string();
        assert!(still.contains("a.csv: `light2_1`"), "{still}");
    }
}

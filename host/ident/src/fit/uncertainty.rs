//! Confidence intervals of the parameters (docs/explanation/identification.md, eq. 10 to 13).
//!
//! Missing physics makes residuals that follow each other for seconds, and a formula that takes
//! them for independent noise would claim far too much. The covariance is therefore the sandwich
//! `H^-1 B H^-1`, where `B` is summed over blocks of time longer than the residuals' memory.

use nalgebra::{DMatrix, DVector, SymmetricEigen};

use super::bounds::bounds;
use super::derivatives::{Normal, Rows};
use super::experiment::ANCHORED;
use super::levenberg::{DecisionVariables, Prior};
use super::segment::{Problem, Segment};

/// A direction of the parameters whose standard deviation exceeds this part of their size is not
/// determined.
const LOOSE: f64 = 1.0;

/// A parameter with more than this part of its square in loose directions is not determined.
const SHARE: f64 = 0.01;

/// Fewest readings for each parameter, beside one for each start state: with as many readings as
/// unknowns every residual is zero, whatever the numbers.
const READINGS: usize = 2;

/// Least distance beyond a bound, in standard deviations of white noise, to which a recording draws
/// a value that rests there for a reason.
const PUSHED: f64 = 3.0;

/// The 97.5 % quantile of the normal distribution.
const NORMAL_95: f64 = 1.959_963_984_540_054;

/// Readings for each unknown from which on it does not matter how many a fit takes from the noise.
const PLENTY: usize = 20;

/// Certainty of a fitted value.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Width {
    /// The data do not determine it, wherever the search left it.
    Open,
    /// It rests at a bound, and the data leave it no way back.
    AtBound,
    /// Half the width of its 95 % interval, SI.
    Half(f64),
}

impl Width {
    /// Half the width of the interval; `None` where there is none.
    pub fn half(self) -> Option<f64> {
        match self {
            Self::Half(half) => Some(half),
            Self::Open | Self::AtBound => None,
        }
    }
}

/// Certainty of all fitted values.
pub(crate) struct HalfWidths {
    /// One entry a fitted parameter.
    pub parameters: Vec<Width>,
    /// One entry a segment, each with one a local parameter.
    pub local: Vec<Vec<Width>>,
    /// Covariance of the fitted parameters, SI; zero where there is none.
    pub covariance: DMatrix<f64>,
}

/// Half widths of all fitted values.
pub(crate) fn half_widths(
    problem: &Problem,
    belief: &Prior,
    segments: &[Segment],
    unknowns: &DecisionVariables,
) -> HalfWidths {
    let parameters = problem.parameters();
    let nothing = || HalfWidths {
        parameters: vec![Width::Open; parameters],
        local: vec![vec![Width::Open; problem.local.len()]; segments.len()],
        covariance: DMatrix::zeros(parameters, parameters),
    };
    let mut information = DMatrix::<f64>::zeros(parameters, parameters);
    let mut scores: Vec<DVector<f64>> = Vec::new();
    let mut memory: f64 = 1.0;
    let mut starts = Vec::with_capacity(segments.len());
    let (mut readings, mut unknown) = (0, READINGS * parameters);
    for (segment, state) in segments.iter().zip(&unknowns.states) {
        let Some(rows) = problem.rows(segment, &unknowns.values, state) else {
            return nothing();
        };
        let mut normal = problem.normal(segment, &rows, state);
        normal.xx -= &segment.anchor.weight * (1.0 - ANCHORED);
        let Some(back) = elimination(&normal) else {
            return nothing();
        };
        information += &normal.zz - &normal.zx * &back;
        readings += rows.residual.len();
        unknown += problem.start_states(state);
        let correlated = memory_of(&rows, problem.sigma.len());
        memory = memory.max(correlated);
        scores.extend(block_scores(
            &rows,
            &back,
            parameters,
            block_length(rows.residual.len(), correlated),
        ));
        let is_open = rows.residual.len() <= state.len();
        starts.push(((normal.xx, normal.bx), back, correlated, is_open));
    }
    if readings < unknown {
        return nothing();
    }
    // Residuals of a fit to few readings are smaller than the noise by what the fit took of it.
    let taken = unknown - (READINGS - 1) * parameters;
    let spare = (readings - taken) as f64;
    let few = if readings < PLENTY * taken {
        readings as f64 / spare
    } else {
        1.0
    };
    let fleet = belief.curvature(problem, &unknowns.values);
    // A fleet knows what the recordings do not show.
    let determined = match &fleet {
        Some(_) => vec![true; parameters],
        None => determined(&information, memory),
    };
    let mut information = information
        + DMatrix::from_diagonal(&DVector::from_iterator(
            parameters,
            belief.widths.iter().map(|width| width.powi(-2)),
        ));
    let mut middle = DMatrix::<f64>::zeros(parameters, parameters);
    if let Some(fleet) = fleet {
        information += &fleet;
        middle += fleet;
    }
    let Some(inverse) = information.cholesky() else {
        return nothing();
    };
    let inverse = inverse.inverse();
    for score in &scores {
        middle += score * score.transpose();
    }
    let blocks = scores.len() as f64;
    let freedom = (blocks - parameters as f64).max(1.0);
    let sandwich = &inverse * middle * &inverse * (blocks / freedom);
    let quantile = student_95(freedom.min(spare));
    let of_parameters = (0..parameters).map(|j| {
        let [low, high] = belief.bounds[j];
        let value = unknowns.values[problem.slots[j]];
        if !determined[j] {
            return Width::Open;
        }
        if value <= low || value >= high {
            return Width::AtBound;
        }
        // Never below what independent noise of this size would leave.
        let variance = few * sandwich[(j, j)].max(inverse[(j, j)]);
        Width::Half(quantile * variance.sqrt() * problem.scale[j])
    });
    // The same as a matrix, with the correlations of the sandwich.
    let sizes = DVector::from_fn(parameters, |j, _| {
        let larger = inverse[(j, j)].max(sandwich[(j, j)]) / sandwich[(j, j)];
        larger.sqrt() * few.sqrt() * quantile / NORMAL_95 * problem.scale[j]
    });
    let covariance = DMatrix::from_fn(parameters, parameters, |row, column| {
        let entry = sandwich[(row, column)] * sizes[row] * sizes[column];
        if entry.is_finite() { entry } else { 0.0 }
    });
    let of_segment = |((own, back, memory, is_open), state): (&(_, _, f64, bool), &Vec<f64>)| {
        if *is_open {
            return vec![Width::Open; problem.local.len()];
        }
        local(
            problem,
            &unknowns.values,
            state,
            (own, back, *memory),
            &sandwich,
        )
        .into_iter()
        .map(|width| match width {
            Width::Half(deviation) => Width::Half(quantile * deviation),
            other => other,
        })
        .collect()
    };
    HalfWidths {
        parameters: of_parameters.collect(),
        local: starts
            .iter()
            .zip(&unknowns.states)
            .map(of_segment)
            .collect(),
        covariance,
    }
}

/// Standard deviations of a segment's own values, SI: what its rows leave open, its residuals'
/// memory counted, and what the shared parameters `shared` leave open.
fn local(
    problem: &Problem,
    values: &[f64],
    state: &[f64],
    ((xx, slope), back, memory): (&(DMatrix<f64>, DVector<f64>), &DMatrix<f64>, f64),
    shared: &DMatrix<f64>,
) -> Vec<Width> {
    let first = problem.plant.state_len();
    let Some(alone) = xx.clone().cholesky().map(|factor| factor.inverse()) else {
        return vec![Width::Open; problem.local.len()];
    };
    let passed_on = back * shared * back.transpose();
    let own = problem.local.iter().enumerate().map(|(index, &slot)| {
        let at = first + index;
        let [low, high] = bounds(&problem.plant.parameters()[slot]);
        let value = problem.own_value(values, index, state[at]);
        let deviation = (alone[(at, at)] * memory + passed_on[(at, at)]).sqrt();
        if value > low && value < high {
            // A deviation that is no number is open, too.
            return if deviation < LOOSE {
                Width::Half(deviation * problem.state_scale[at])
            } else {
                Width::Open
            };
        }
        // What a bound leaves has a long memory, and may be all that speaks for the bound.
        let beyond = (alone.row(at) * slope)[0].abs() / alone[(at, at)].sqrt();
        if deviation < LOOSE || beyond > PUSHED {
            Width::AtBound
        } else {
            Width::Open
        }
    });
    own.collect()
}

/// Interval about a value.
pub(crate) fn interval(value: f64, half: f64) -> [f64; 2] {
    [value - half, value + half]
}

/// `A_xx^-1 A_xz`: how the start state answers to the parameters.
fn elimination(normal: &Normal) -> Option<DMatrix<f64>> {
    Some(normal.xx.clone().cholesky()?.solve(&normal.zx.transpose()))
}

/// Rows a block: five times the residuals' memory, but no fewer than 20 blocks and no more than
/// 400.
fn block_length(samples: usize, memory: f64) -> usize {
    let wanted = (5.0 * memory) as usize;
    wanted.clamp(samples / 400, (samples / 20).max(1)).max(1)
}

/// Sums of `J~' r` over blocks of rows, where `J~` is what the start state cannot imitate.
fn block_scores(
    rows: &Rows,
    back: &DMatrix<f64>,
    parameters: usize,
    length: usize,
) -> Vec<DVector<f64>> {
    let width = parameters + back.nrows();
    let mut blocks = Vec::new();
    for (jacobian, residual) in rows
        .jacobian
        .chunks(length * width.max(1))
        .zip(rows.residual.chunks(length))
    {
        let mut sum = DVector::<f64>::zeros(width);
        for (row, residual) in jacobian.chunks_exact(width).zip(residual) {
            for (total, derivative) in sum.iter_mut().zip(row) {
                *total += derivative * residual;
            }
        }
        blocks
            .push(sum.rows(0, parameters) - back.transpose() * sum.rows(parameters, back.nrows()));
    }
    blocks
}

/// Integrated autocorrelation of the residuals in samples, the longest of the sensors: 1 for white
/// noise.
fn memory_of(rows: &Rows, sensors: usize) -> f64 {
    let mut longest: f64 = 1.0;
    for sensor in 0..sensors {
        let series: Vec<f64> = rows
            .residual
            .iter()
            .zip(&rows.origin)
            .filter(|(_, origin)| origin.1 == sensor)
            .map(|(residual, _)| *residual)
            .collect();
        longest = longest.max(integrated_autocorrelation(&series) * sensors as f64);
    }
    longest
}

/// `1 + 2 sum rho_k` up to the first correlation below 0.05, lags taken ever more sparsely.
pub(crate) fn integrated_autocorrelation(series: &[f64]) -> f64 {
    let power: f64 = series.iter().map(|value| value * value).sum();
    if power <= 0.0 {
        return 1.0;
    }
    let mut sum = 1.0;
    let mut lag = 1;
    while lag < series.len() / 4 {
        let product: f64 = series.iter().zip(&series[lag..]).map(|(a, b)| a * b).sum();
        let correlation = product / power;
        if correlation < 0.05 {
            break;
        }
        // The step to the next lag grows with the lag: logarithmic in the length of the memory.
        let stride = (lag / 8).max(1);
        sum += 2.0 * correlation * stride as f64;
        lag += stride;
    }
    sum
}

/// Parameters that the data determine: those that hardly take part in directions `v` (eigenvectors
/// of the information) along which they leave more than their own size open.
fn determined(information: &DMatrix<f64>, memory: f64) -> Vec<bool> {
    let parameters = information.nrows();
    if parameters == 0 {
        return Vec::new();
    }
    let eigen = SymmetricEigen::new(information.clone());
    (0..parameters)
        .map(|j| {
            let loose: f64 = (0..parameters)
                .filter(|&k| eigen.eigenvalues[k].max(0.0) / memory < LOOSE.powi(-2))
                .map(|k| eigen.eigenvectors[(j, k)].powi(2))
                .sum();
            loose < SHARE
        })
        .collect()
}

/// The 97.5 % quantile of Student's t (Cornish–Fisher expansion about the normal one; 0.3 % at 4
/// degrees of freedom, better above; below 4 as for 4).
pub(crate) fn student_95(freedom: f64) -> f64 {
    let z = NORMAL_95;
    let n = freedom.max(4.0);
    let (z3, z5, z7) = (z.powi(3), z.powi(5), z.powi(7));
    z + (z3 + z) / (4.0 * n)
        + (5.0 * z5 + 16.0 * z3 + 3.0 * z) / (96.0 * n * n)
        + (3.0 * z7 + 19.0 * z5 + 17.0 * z3 - 15.0 * z) / (384.0 * n.powi(3))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_agree_with_tables() {
        for (freedom, quantile) in [
            (4.0, 2.7764),
            (10.0, 2.2281),
            (30.0, 2.0423),
            (1e9, 1.959_96),
        ] {
            assert!(
                (student_95(freedom) / quantile - 1.0).abs() < 3e-3,
                "{freedom}: {}",
                student_95(freedom)
            );
        }
    }

    #[test]
    fn memory_of_a_filtered_noise_is_found() {
        // A deterministic noise (multiplicative congruence) through a first-order filter of pole
        // 0.9, whose integrated autocorrelation is (1 + 0.9) / (1 - 0.9) = 19.
        let mut seed = 1_u64;
        let mut state = 0.0;
        let white: Vec<f64> = (0..50_000)
            .map(|_| {
                seed = seed
                    .wrapping_mul(6_364_136_223_846_793_005)
                    .wrapping_add(1_442_695_040_888_963_407);
                (seed >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
            })
            .collect();
        let filtered: Vec<f64> = white
            .iter()
            .map(|value| {
                state = 0.9 * state + value;
                state
            })
            .collect();
        assert!(integrated_autocorrelation(&white) < 1.2);
        let memory = integrated_autocorrelation(&filtered);
        assert!((14.0..23.0).contains(&memory), "{memory}");
    }

    #[test]
    fn a_direction_without_information_marks_its_parameters() {
        // Parameters 0 and 1 only show in their sum, 2 by itself.
        let information =
            DMatrix::from_row_slice(3, 3, &[1e4, 1e4, 0.0, 1e4, 1e4, 0.0, 0.0, 0.0, 1e4]);
        assert_eq!(determined(&information, 1.0), [false, false, true]);
    }
}

//! Sizes of parameters: the units of a search, and what an interval bounds.

use super::levenberg::{DecisionVariables, Prior};
use super::segment::{Problem, Segment};
use super::uncertainty::Width;

/// Part of the change that shows in the signals below which a written value counts as zero: people
/// write 1e-8 for none.
const AS_GOOD_AS_ZERO: f64 = 1e-3;

/// Half the width of an interval, as a multiple of the size of what is written, from which on the
/// interval bounds nothing.
const OPEN_WIDTH: f64 = 2.0;

/// Distance from what is written, as a multiple of half the width of the interval, that noise
/// explains.
const MOVED_BY_NOISE: f64 = 2.0;

/// One unit of each parameter: the larger of what the rig says and what was found, so that
/// millimetres and tonnes are alike. A parameter that is as good as zero in both takes what would
/// show in the signals.
pub(super) fn rescale(
    problem: &mut Problem,
    belief: &Prior,
    unknowns: &DecisionVariables,
    silent: &[Option<f64>],
) {
    for (j, &slot) in problem.slots.iter().enumerate() {
        let size = unknowns.values[slot].abs();
        problem.scale[j] = as_written(belief.written[j], silent[j]).max(size);
    }
}

/// Opens the intervals of parameters that noise alone may have moved: the interval is wider than
/// what is written, and what is written is not far from it. A value that noise made large lends
/// its size to the search, so that it seems to be known to its own size.
pub(super) fn open_by_noise(
    problem: &Problem,
    belief: &Prior,
    unknowns: &DecisionVariables,
    (silent, widths): (&[Option<f64>], &mut [Width]),
) {
    for (j, width) in widths.iter_mut().enumerate() {
        let away = (unknowns.values[problem.slots[j]] - belief.written[j]).abs();
        let size = as_written(belief.written[j], silent[j]);
        let half = width.half().unwrap_or(0.0);
        if half > OPEN_WIDTH * size && away <= MOVED_BY_NOISE * half {
            *width = Width::Open;
        }
    }
}

/// Size of a parameter before any fit: what is written, or the change that would show where that
/// is as good as zero.
fn as_written(written: f64, shown: Option<f64>) -> f64 {
    let written = written.abs();
    match shown {
        Some(shown) if written <= AS_GOOD_AS_ZERO * shown => shown,
        None if written == 0.0 => 1.0,
        _ => written,
    }
}

/// For each parameter the change that moves the signals by a hundredth of themselves; `None` where
/// no change does.
pub(super) fn silent_scales(
    problem: &Problem,
    segments: &[Segment],
    unknowns: &DecisionVariables,
) -> Vec<Option<f64>> {
    let parameters = problem.parameters();
    let Some(normals) = problem.linearise(segments, &unknowns.values, &unknowns.states) else {
        return vec![None; parameters];
    };
    let samples = sample_count(problem, segments) as f64;
    (0..parameters)
        .map(|j| {
            let sensitivity =
                (normals.iter().map(|normal| normal.zz[(j, j)]).sum::<f64>() / samples).sqrt();
            // Residuals are in thousandths of the signals' spread here: ten of them are a
            // hundredth.
            let scale = 10.0 / sensitivity;
            (scale.is_finite() && scale > 0.0).then_some(scale)
        })
        .collect()
}

/// Valid samples of all sensors in segments; 1 where there is none.
pub(super) fn sample_count(problem: &Problem, segments: &[Segment]) -> usize {
    let count = segments.iter().map(|segment| {
        let signals = &problem.experiments[segment.experiment].signals;
        signals
            .iter()
            .map(|column| {
                column[segment.rows.clone()]
                    .iter()
                    .filter(|y| y.is_finite())
                    .count()
            })
            .sum::<usize>()
    });
    count.sum::<usize>().max(1)
}

//! Valid samples of a column and their steps, for several detectors.

/// Valid samples of a column with their rows.
pub(super) struct Series {
    /// Row and value.
    pub samples: Vec<(usize, f64)>,
    /// Lowest and highest value.
    pub range: [f64; 2],
}

impl Series {
    /// The valid samples; `None` of fewer than 8.
    pub(super) fn of(values: &[f64]) -> Option<Self> {
        let rows = values.iter().copied().enumerate();
        let samples: Vec<_> = rows.filter(|(_, value)| value.is_finite()).collect();
        let low = samples.iter().map(|s| s.1).fold(f64::INFINITY, f64::min);
        let high = samples
            .iter()
            .map(|s| s.1)
            .fold(f64::NEG_INFINITY, f64::max);
        (samples.len() >= 8).then_some(Self {
            samples,
            range: [low, high],
        })
    }

    /// Highest less lowest value.
    pub(super) fn width(&self) -> f64 {
        self.range[1] - self.range[0]
    }

    /// Changes from each sample to the next.
    pub(super) fn steps(&self) -> Vec<f64> {
        let pairs = self.samples.windows(2);
        pairs.map(|pair| pair[1].1 - pair[0].1).collect()
    }

    /// Runs of one value: index of the first sample and number of samples.
    pub(super) fn runs(&self) -> Vec<(usize, usize)> {
        let mut runs: Vec<(usize, usize)> = Vec::new();
        for (index, (_, value)) in self.samples.iter().enumerate() {
            match runs.last_mut() {
                Some((first, length)) if self.samples[*first].1 == *value => *length += 1,
                _ => runs.push((index, 1)),
            }
        }
        runs
    }
}

/// The value below which a part of all values lies; 0 of none.
pub(super) fn quantile(values: impl IntoIterator<Item = f64>, part: f64) -> f64 {
    let mut values: Vec<f64> = values.into_iter().collect();
    if values.is_empty() {
        return 0.0;
    }
    let at = ((values.len() - 1) as f64 * part).round() as usize;
    *values.select_nth_unstable_by(at, f64::total_cmp).1
}

/// Sizes of steps that are not zero.
pub(super) fn sizes(steps: &[f64]) -> impl Iterator<Item = f64> + '_ {
    steps
        .iter()
        .map(|step| step.abs())
        .filter(|size| *size > 0.0)
}

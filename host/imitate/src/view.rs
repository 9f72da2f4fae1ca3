//! Numbers that a policy sees, and the features that its network takes of them
//! (docs/explanation/imitation.md, eq. 1 and 2).

/// Extent of what a policy sees at step k, in samples and control periods.
///
/// The raw numbers stand in this order: y(k) .. y(k - past_outputs + 1), then u(k-1) ..
/// u(k - past_inputs), then r(k+1) .. r(k + ahead); each sample has one number an output or input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct View {
    /// Measured outputs.
    pub outputs: usize,
    /// Commands.
    pub inputs: usize,
    /// Samples of the outputs, the present one among them.
    pub past_outputs: usize,
    /// Earlier commands.
    pub past_inputs: usize,
    /// Samples of the reference ahead.
    pub ahead: usize,
}

impl View {
    /// Count of raw numbers, and of features.
    pub const fn len(&self) -> usize {
        self.outputs * (self.past_outputs + self.ahead) + self.inputs * self.past_inputs
    }

    /// True if there is nothing to see.
    pub const fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Place of output `i`, `back` samples ago.
    pub const fn output(&self, back: usize, i: usize) -> usize {
        back * self.outputs + i
    }

    /// Place of input `i`, `back` samples ago, from 1 on.
    pub const fn input(&self, back: usize, i: usize) -> usize {
        self.past_outputs * self.outputs + (back - 1) * self.inputs + i
    }

    /// Place of the reference of output `i`, `ahead` samples ahead, from 1 on.
    pub const fn reference(&self, ahead: usize, i: usize) -> usize {
        let first = self.past_outputs * self.outputs + self.past_inputs * self.inputs;
        first + (ahead - 1) * self.outputs + i
    }
}

/// A feature: a difference of two raw numbers, or one from an offset, in its scale (eq. 2).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Feature {
    pub plus: usize,
    pub minus: Option<usize>,
    pub offset: f64,
    pub gain: f64,
}

impl Feature {
    pub(crate) fn of(&self, raw: &[f64]) -> f64 {
        let minus = self.minus.map_or(self.offset, |at| raw[at]);
        (raw[self.plus] - minus) * self.gain
    }
}

/// Features of a view, scaled by how far the signals of a demonstration move: `y` and `u` have one
/// row a period, `step` is the largest change of each command in one.
pub(crate) fn features(view: &View, y: &[Vec<f64>], u: &[Vec<f64>], step: &[f64]) -> Vec<Feature> {
    let ends = |rows: &[Vec<f64>], i: usize| {
        let column = rows.iter().map(|row| row[i]);
        column.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| {
            (low.min(v), high.max(v))
        })
    };
    // Farthest that output i moves in so many periods; a hundredth of its range at least, so that
    // noise does not look like motion.
    let moved = |periods: usize, i: usize| {
        let (low, high) = ends(y, i);
        let pairs = y.iter().zip(y.iter().skip(periods));
        let most = pairs.map(|(a, b)| (b[i] - a[i]).abs()).fold(0.0, f64::max);
        most.max(0.01 * (high - low)).max(f64::MIN_POSITIVE)
    };
    let mut all = vec![
        Feature {
            plus: 0,
            minus: None,
            offset: 0.0,
            gain: 0.0
        };
        view.len()
    ];
    for i in 0..view.outputs {
        let (low, high) = ends(y, i);
        let now = view.output(0, i);
        all[now] = Feature {
            plus: now,
            minus: None,
            offset: 0.5 * (low + high),
            gain: 2.0 / (high - low).max(f64::MIN_POSITIVE),
        };
        for back in 1..view.past_outputs {
            all[view.output(back, i)] = Feature {
                plus: now,
                minus: Some(view.output(back, i)),
                offset: 0.0,
                gain: 1.0 / moved(back, i),
            };
        }
        for ahead in 1..=view.ahead {
            all[view.reference(ahead, i)] = Feature {
                plus: view.reference(ahead, i),
                minus: Some(now),
                offset: 0.0,
                gain: 1.0 / moved(ahead, i),
            };
        }
    }
    for i in 0..view.inputs {
        let (low, high) = ends(u, i);
        let last = view.input(1, i);
        all[last] = Feature {
            plus: last,
            minus: None,
            offset: 0.5 * (low + high),
            gain: 2.0 / (high - low).max(step[i]),
        };
        for back in 2..=view.past_inputs {
            all[view.input(back, i)] = Feature {
                plus: last,
                minus: Some(view.input(back, i)),
                offset: 0.0,
                gain: 1.0 / step[i],
            };
        }
    }
    all
}

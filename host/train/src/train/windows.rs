//! Training windows cut from episodes: a history to start from and the steps that follow.

use nalgebra::DMatrix;

use crate::dataset::{Episode, Sensitivity};

/// Counts that decide the length and order of a regressor.
///
/// ```
/// use sinew_train::train::Shape;
///
/// let shape = Shape { n_u: 1, n_y: 2, past_inputs: 3, past_outputs: 4, n_s: 1 };
/// assert_eq!((shape.regressor_len(), shape.history()), (3 + 2 * 4 + 1, 3));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shape {
    /// Inputs.
    pub n_u: usize,
    /// Outputs.
    pub n_y: usize,
    /// Input values looked at, the current one included.
    pub past_inputs: usize,
    /// Output values looked at, the current one included.
    pub past_outputs: usize,
    /// Sensor channels, of which the last reading is looked at and held over a rollout, as the
    /// firmware does.
    pub n_s: usize,
}

impl Shape {
    /// Length of the flattened regressor.
    pub fn regressor_len(&self) -> usize {
        self.n_u * self.past_inputs + self.n_y * self.past_outputs + self.n_s
    }

    /// Steps of history before the first prediction.
    pub fn history(&self) -> usize {
        self.past_inputs.max(self.past_outputs) - 1
    }
}

/// An episode in model units.
///
/// ```
/// use sinew_train::train::{Scaled, Shape, Windows};
///
/// let shape = Shape { n_u: 1, n_y: 1, past_inputs: 1, past_outputs: 2, n_s: 0 };
/// let y: Vec<f64> = (0..11).map(|k| 0.1 * f64::from(k)).collect();
/// let episode = Scaled {
///     u: vec![1.0; 10],
///     measured: y.clone(),
///     y,
///     channels: vec![],
///     sensitivities: vec![],
///     steps: 10,
/// };
/// let mut x = Vec::new();
/// episode.regressor(&shape, 3, &mut x);
/// assert_eq!(x.len(), shape.regressor_len());
/// assert_eq!(x[0], 1.0);
/// assert_eq!(Windows::new(shape, 0, 4, &[episode]).len(), 6);
/// ```
#[derive(Clone, Debug)]
pub struct Scaled {
    /// Inputs, `[steps][n_u]`.
    pub u: Vec<f64>,
    /// Outputs without noise, `[steps + 1][n_y]`.
    pub y: Vec<f64>,
    /// Sensor signal: `y` with noise.
    pub measured: Vec<f64>,
    /// Channels with noise, `[steps + 1][n_s]`.
    pub channels: Vec<f64>,
    /// Sensitivities of the simulator, where they are asked for.
    pub sensitivities: Vec<Sensitivity>,
    /// Number of steps.
    pub steps: usize,
}

impl Scaled {
    /// The flattened regressor at k, appended to `x`; k is [`Shape::history`] or more.
    pub fn regressor(&self, shape: &Shape, k: usize, x: &mut Vec<f64>) {
        for lag in 0..shape.past_inputs {
            x.extend_from_slice(row(&self.u, shape.n_u, k - lag));
        }
        for lag in 0..shape.past_outputs {
            x.extend_from_slice(row(&self.measured, shape.n_y, k - lag));
        }
        x.extend_from_slice(row(&self.channels, shape.n_s, k));
    }
}

/// All windows of a set of episodes: (episode, k) for every k from which `rollout` steps follow.
pub struct Windows<'a> {
    shape: Shape,
    burn_in: usize,
    rollout: usize,
    episodes: &'a [Scaled],
    starts: Vec<(u32, u32)>,
}

impl<'a> Windows<'a> {
    /// Windows of `rollout` steps, with `burn_in` regressors before them; episodes too short for
    /// one give none.
    pub fn new(shape: Shape, burn_in: usize, rollout: usize, episodes: &'a [Scaled]) -> Self {
        let mut starts = Vec::new();
        for (e, episode) in episodes.iter().enumerate() {
            for k in shape.history() + burn_in..(episode.steps + 1).saturating_sub(rollout) {
                starts.push((e as u32, k as u32));
            }
        }
        Self {
            shape,
            burn_in,
            rollout,
            episodes,
            starts,
        }
    }

    /// Number of windows.
    pub fn len(&self) -> usize {
        self.starts.len()
    }

    /// True without any.
    pub fn is_empty(&self) -> bool {
        self.starts.is_empty()
    }

    /// Steps before each window that a network may look at to begin with.
    pub fn burn_in(&self) -> usize {
        self.burn_in
    }

    /// True if window `w` is the first of its episode; the next ones begin a step later each.
    pub fn begins_episode(&self, w: usize) -> bool {
        w == 0 || self.starts[w - 1].0 != self.starts[w].0
    }

    /// The flattened regressor that stands at the start of window `w`, appended to `x`.
    pub fn regressor(&self, w: usize, x: &mut Vec<f64>) {
        self.regressor_before(w, 0, x);
    }

    /// The regressor `back` steps before, at most [`Windows::burn_in`].
    pub fn regressor_before(&self, w: usize, back: usize, x: &mut Vec<f64>) {
        let (episode, k) = self.at(w);
        episode.regressor(&self.shape, k - back, x);
    }

    /// Inputs u(k) .. u(k + rollout - 1) of window `w`, one row of `n_u` a step.
    pub fn inputs(&self, w: usize) -> &[f64] {
        self.inputs_from(w, 0)
    }

    /// The same from u(k - back) on, at most [`Windows::burn_in`] steps before.
    pub fn inputs_from(&self, w: usize, back: usize) -> &[f64] {
        let (episode, k) = self.at(w);
        &episode.u[(k - back) * self.shape.n_u..(k + self.rollout) * self.shape.n_u]
    }

    /// Measurements at k - back + 1 .. k of window `w`, one row of `n_y` a step.
    pub fn measured_since(&self, w: usize, back: usize) -> &[f64] {
        let (episode, k) = self.at(w);
        &episode.measured[(k + 1 - back) * self.shape.n_y..(k + 1) * self.shape.n_y]
    }

    /// Channels s(k - back) .. s(k) of window `w`, one row of `n_s` a step.
    pub fn channels_since(&self, w: usize, back: usize) -> &[f64] {
        let (episode, k) = self.at(w);
        &episode.channels[(k - back) * self.shape.n_s..(k + 1) * self.shape.n_s]
    }

    /// Outputs y(k + 1) .. y(k + rollout) without noise of window `w`.
    pub fn targets(&self, w: usize) -> &[f64] {
        let (episode, k) = self.at(w);
        &episode.y[(k + 1) * self.shape.n_y..(k + 1 + self.rollout) * self.shape.n_y]
    }

    /// The sensitivities that begin where a window does and have `length` entries or more, each
    /// with its window.
    pub fn sensitivities(&self, length: usize) -> Vec<(usize, &'a Sensitivity)> {
        let mut sensitivities = Vec::new();
        for (w, (e, k)) in self.starts.iter().enumerate() {
            let here = self.episodes[*e as usize].sensitivities.iter();
            let here = here.filter(|s| s.from == *k as usize && s.of.len() >= length);
            sensitivities.extend(here.map(|sensitivity| (w, sensitivity)));
        }
        sensitivities
    }

    /// Regressors of all windows, `[len][n]`.
    pub fn regressors(&self) -> DMatrix<f64> {
        let mut x = Vec::with_capacity(self.len() * self.shape.regressor_len());
        (0..self.len()).for_each(|w| self.regressor(w, &mut x));
        DMatrix::from_row_slice(self.len(), self.shape.regressor_len(), &x)
    }

    fn at(&self, w: usize) -> (&Scaled, usize) {
        let (e, k) = self.starts[w];
        (&self.episodes[e as usize], k as usize)
    }
}

fn row(values: &[f64], width: usize, k: usize) -> &[f64] {
    &values[k * width..(k + 1) * width]
}

/// Span and offset that bring a signal's range over `episodes` to about -1 .. 1.
pub fn scaling(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (low, high) = values
        .filter(|v| v.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| {
            (l.min(v), h.max(v))
        });
    let span = (high - low) / 2.0;
    if span > 0.0 && span.is_finite() {
        (span, (high + low) / 2.0)
    } else {
        (1.0, 0.0)
    }
}

/// Episodes to model units, with the noise of each output's sensor added to what is measured.
pub fn scale(
    episodes: &[Episode],
    u_scaling: &[(f64, f64)],
    y_scaling: &[(f64, f64)],
    s_scaling: &[(f64, f64)],
) -> Vec<Scaled> {
    let to_model = |values: &[f64], scaling: &[(f64, f64)]| -> Vec<f64> {
        values
            .iter()
            .zip(scaling.iter().cycle())
            .map(|(v, (span, offset))| (v - offset) / span)
            .collect()
    };
    episodes
        .iter()
        .map(|episode| Scaled {
            u: to_model(&episode.u, u_scaling),
            y: to_model(&episode.y, y_scaling),
            measured: to_model(&episode.measured, y_scaling),
            channels: to_model(&episode.channels, s_scaling),
            sensitivities: vec![],
            steps: episode.u.len() / u_scaling.len(),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_window_holds_newest_first_and_the_steps_that_follow() {
        let shape = Shape {
            n_u: 1,
            n_y: 1,
            past_inputs: 2,
            past_outputs: 3,
            n_s: 1,
        };
        let y: Vec<f64> = (0..7).map(|k| f64::from(k) + 100.0).collect();
        let episode = Scaled {
            u: (0..6).map(f64::from).collect(),
            measured: y.clone(),
            channels: y.iter().map(|y| y + 100.0).collect(),
            sensitivities: vec![],
            y,
            steps: 6,
        };
        let episodes = [episode];
        let windows = Windows::new(shape, 0, 3, &episodes);
        assert_eq!(windows.len(), 2);
        let mut x = Vec::new();
        windows.regressor(1, &mut x);
        assert_eq!(x, [3.0, 2.0, 103.0, 102.0, 101.0, 203.0]);
        assert_eq!(windows.inputs(1), [3.0, 4.0, 5.0]);
        assert_eq!(windows.targets(1), [104.0, 105.0, 106.0]);
        // With a step before it only the later one is left.
        let windows = Windows::new(shape, 1, 3, &episodes);
        assert_eq!(windows.len(), 1);
        x.clear();
        windows.regressor_before(0, 1, &mut x);
        assert_eq!(x, [2.0, 1.0, 102.0, 101.0, 100.0, 202.0]);
        assert_eq!(windows.inputs(0), [3.0, 4.0, 5.0]);
    }
}

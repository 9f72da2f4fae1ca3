//! Worth of a design: how far the hardest effects are from everything else, and how wide the widest
//! interval of a parameter is (docs/explanation/experiments.md, eq. 8).

use super::information::Measure;
use crate::excite::reveal::{Revelation, WEAKLY};
use crate::order;

/// Number of effects that decide.
pub(super) const HARDEST: usize = 5;
/// Distance from which on an effect can be shown at all, of the best experiment known.
const SHOWS: f64 = WEAKLY;
/// A distance far below what can be guessed at, so that its logarithm stays finite.
const NOTHING: f64 = 0.1;
/// A linear distance this many times the true one is made of what higher orders imitate.
const IMITATED: f64 = 4.0;

/// Geometric mean of distances; 1 of none.
pub(super) fn mean(distances: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = distances.len().max(1) as f64;
    let logarithms: f64 = distances.map(|distance| distance.max(NOTHING).ln()).sum();
    (logarithms / count).exp()
}

/// Effects and parameters that a design is judged by.
pub(super) struct Goal {
    /// One entry an effect: whether any known experiment shows it.
    shows: Vec<bool>,
    /// One entry a free parameter: its smallest half interval in a family, SI; none for
    /// one that no family determines.
    narrowest: Vec<Option<f64>>,
}

impl Goal {
    /// Of experiments that were simulated, the families first, and of the linear measure of an
    /// average design.
    pub(super) fn of(known: &[Revelation], families: usize, linear: Option<Measure>) -> Self {
        let linear = linear.unwrap_or_else(|| Measure {
            distances: Vec::new(),
            half_widths: Vec::new(),
        });
        let effects = known.first().map_or(0, |found| found.effects.len());
        let best = |effect: usize| {
            let distances = known
                .iter()
                .filter_map(|found| found.effects[effect].distance);
            distances.fold(0.0, f64::max)
        };
        let shows = |effect: usize| {
            let linear = linear.distances.get(effect).copied().unwrap_or(0.0);
            let best = best(effect);
            // What no family shows, segments together may: unless higher orders imitate it.
            best >= SHOWS || (linear >= SHOWS && linear < IMITATED * best)
        };
        let parameters = known.first().map_or(0, |found| found.half_widths.len());
        let narrowest = (0..parameters).map(|parameter| {
            let widths = known[..families]
                .iter()
                .map(|found| found.half_widths[parameter]);
            let width = widths.fold(f64::INFINITY, f64::min);
            width.is_finite().then_some(width)
        });
        Self {
            shows: (0..effects).map(shows).collect(),
            narrowest: narrowest.collect(),
        }
    }

    /// Mean logarithm of the distances of the hardest effects, less that of the widest interval
    /// beside the narrowest of any family, where it is wider (8).
    pub(super) fn worth(&self, measure: &Measure) -> f64 {
        self.of_both(&measure.distances, &measure.half_widths)
    }

    /// The same, of an experiment that was simulated.
    pub(super) fn worth_of(&self, found: &Revelation) -> f64 {
        self.of_both(&found.distances(), &found.half_widths)
    }

    fn of_both(&self, distances: &[f64], half_widths: &[f64]) -> f64 {
        let hardest = self.hardest(distances);
        let effects = mean(hardest.iter().map(|&k| distances[k])).ln();
        let widest = self.widest(half_widths).unwrap_or(1.0);
        effects - widest.clamp(1.0, f64::MAX).ln()
    }

    /// Effects with the smallest distances among those that can be shown, the hardest first.
    pub(super) fn hardest(&self, distances: &[f64]) -> Vec<usize> {
        let mut able: Vec<usize> = (0..distances.len()).filter(|&k| self.shows[k]).collect();
        order::sort_up(&mut able, |&index| distances[index]);
        able.truncate(HARDEST);
        able
    }

    /// Widest half interval beside the narrowest known of that parameter.
    fn widest(&self, half_widths: &[f64]) -> Option<f64> {
        let pairs = self.narrowest.iter().zip(half_widths);
        pairs
            .filter_map(|(narrowest, width)| Some(width / (*narrowest)?))
            .reduce(f64::max)
    }
}

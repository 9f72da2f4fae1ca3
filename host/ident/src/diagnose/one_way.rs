//! Motions that never come back, which make one effect of many.

use crate::diagnose::case::Case;
use crate::diagnose::config::CONFIG;
use crate::diagnose::data::Data;
use crate::diagnose::term::Term;
use sinew_sim::effects::Family;

/// Sentence of a report where [`one_way`] holds.
pub(crate) const NOTE: &str = "nothing drives the device and nothing that was recorded comes back \
     to where it was; another weight or load, a dry friction or a bent scale would be nearly one \
     motion with a law of speed, and only those were asked for";

/// Tells whether nothing drives the device and nothing that was recorded comes back: each signal
/// crosses its middle once at most in each recording. In a fall position, speed and time are one.
pub(crate) fn one_way(case: &Case) -> bool {
    [case.fit, case.check].into_iter().all(never_comes_back)
}

/// The terms that the recordings can tell from others: in a motion that never comes back, laws that
/// are smooth in speed, which any device has, stand for all that move alike.
pub(crate) fn can_be_told(case: &Case, mut terms: Vec<Term>) -> Vec<Term> {
    if one_way(case) {
        terms.retain(|term| term.family() == Some(Family::Damping));
    }
    terms
}

fn never_comes_back(data: &Data) -> bool {
    let mut inputs = data.experiments.iter().flat_map(|e| &e.inputs);
    let mut signals = data.experiments.iter().flat_map(|e| &e.signals);
    let constant = |input: &Vec<f64>| input.windows(2).all(|pair| pair[0] == pair[1]);
    inputs.all(constant) && signals.all(|signal| crossings(signal) <= 1)
}

/// Number of times that a signal passes from one side of its middle to the other.
fn crossings(signal: &[f64]) -> usize {
    let known = || signal.iter().copied().filter(|value| value.is_finite());
    let (low, high) = known().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
        (low.min(value), high.max(value))
    });
    let band = CONFIG.split.crossing_band * (high - low);
    let middle = 0.5 * (low + high);
    let sides = known().filter(|value| (value - middle).abs() > band);
    let mut sides = sides.map(|value| value > middle);
    let Some(mut side) = sides.next() else {
        return 0;
    };
    let mut count = 0;
    for next in sides {
        count += usize::from(next != side);
        side = next;
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fall_passes_its_middle_once_and_a_swing_again_and_again() {
        let fall: Vec<f64> = (0..50)
            .map(|k| 47.0 - 4.9 * (f64::from(k) / 16.0).powi(2))
            .collect();
        assert_eq!(crossings(&fall), 1);
        let noisy: Vec<f64> = (0..50)
            .map(|k| f64::from(k) + if k % 2 == 0 { 1.0 } else { -1.0 })
            .collect();
        assert_eq!(crossings(&noisy), 1);
        let swing: Vec<f64> = (0..100).map(|k| (0.3 * f64::from(k)).sin()).collect();
        assert!(crossings(&swing) > 5);
        assert_eq!(crossings(&[f64::NAN, 1.0, 1.0]), 0);
    }
}

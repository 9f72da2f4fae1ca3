//! Effects whose strengths depend on a signal of the rig, as on a temperature.

use crate::diagnose::config::CONFIG;
use sinew_sim::effects::{ParameterSpec, Role, Sign};

/// Signal of the rig that the strengths of an effect depend on.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct BySignal {
    /// Its name in the rig.
    pub name: String,
    /// Unit of its column.
    pub unit: String,
    /// Smallest and largest value in the fit recordings.
    pub range: [f64; 2],
}

impl BySignal {
    /// Start values of the parameters at one component from those of the effect alone: strengths
    /// half constant and half proportional to the signal, and nearly proportional to it.
    pub fn with_slopes(&self, specs: &[ParameterSpec], start: &[f64]) -> Vec<Vec<f64>> {
        let largest = self.range[0].abs().max(self.range[1].abs());
        let with = CONFIG.model.signal_starts.map(|(constant, proportional)| {
            let strengths = specs
                .iter()
                .zip(start)
                .filter(|(spec, _)| is_strength(spec));
            let slopes = strengths.map(|(_, value)| proportional * value / largest);
            let own = specs.iter().zip(start);
            let own = own.map(|(spec, value)| {
                if is_strength(spec) {
                    constant * value
                } else {
                    *value
                }
            });
            own.chain(slopes).collect()
        });
        with.into()
    }

    /// Parameters at one component at both ends of the signal's range; a strength that is nearly
    /// zero at one of them is zero there.
    pub fn over_its_range(&self, specs: &[ParameterSpec], own: &[f64]) -> Vec<Vec<f64>> {
        let at = |signal: f64| -> Vec<f64> {
            let mut slopes = own[specs.len()..].iter();
            let own = specs.iter().zip(own).map(|(spec, value)| {
                let slope = is_strength(spec).then(|| slopes.next()).flatten();
                value + slope.map_or(0.0, |slope| slope * signal)
            });
            own.collect()
        };
        let mut ends = self.range.map(at);
        for (which, spec) in specs
            .iter()
            .enumerate()
            .filter(|(_, spec)| is_strength(spec))
        {
            let largest = ends[0][which].abs().max(ends[1][which].abs());
            for end in &mut ends {
                if spec.sign == Sign::NonNegative
                    && end[which] > -CONFIG.model.nearly_zero * largest
                {
                    end[which] = end[which].max(0.0);
                }
            }
        }
        ends.into()
    }
}

/// Tells whether a parameter follows the signal: a strength that is fitted.
pub(crate) fn is_strength(spec: &ParameterSpec) -> bool {
    spec.role == Role::Strength && !spec.held
}

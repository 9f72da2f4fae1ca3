//! Warnings of a refitted rig: it does not explain its recordings, or only with values that no
//! device of its kind has.

use super::own_values::only_one;
use super::{quantity, significant};
use crate::fit::{BeyondBounds, Fit, FittedParameter, Runaway, SensorError, SensorFit};

/// Smallest change of a parameter, as a factor, that speaks for a column in another unit.
const ANOTHER_UNIT: f64 = 50.0;

/// Largest one: a parameter that grew by more was written as next to nothing, for "none yet".
const NONE_YET: f64 = 1e6;

/// Error of a free run, in the noise, that is more than noise: its start is known by a few rows.
const LEFT: f64 = 3.0;

/// Error in recordings that a fit has not seen, beside that in its own, that is said.
const UNSEEN: f64 = 2.0;

/// Error beside the motion that is the integrator's or the recorder's digits.
const EXACT: f64 = 1e-3;

/// Warnings for a person, none where the refitted rig explains its recordings.
pub fn warnings(fit: &Fit) -> Vec<String> {
    let far = another_unit(&fit.parameters).into_iter();
    let beyond = fit.beyond.iter().map(|it| beyond_bounds(it, &fit.sensors));
    let missed = match &fit.runaway {
        Some(runaway) => vec![runs_away(runaway)],
        None => {
            let each = fit.sensors.iter();
            each.filter_map(|it| unexplained(it).or_else(|| above_noise(it)))
                .collect()
        }
    };
    let alone = only_one(&fit.parameters);
    far.chain(beyond).chain(missed).chain(alone).collect()
}

/// Warning of parameters that changed as they do where time, an input or a sensor is in another
/// unit; `None` without any.
fn another_unit(parameters: &[FittedParameter]) -> Option<String> {
    let changed = parameters.iter().filter_map(|parameter| {
        let times = parameter.value / parameter.as_written;
        let known = parameter.ci95.is_some() && times > 0.0;
        let far = times * ANOTHER_UNIT < 1.0 || (ANOTHER_UNIT..NONE_YET).contains(&times);
        let said = || format!("`{}` by {}", parameter.name, significant(times, 2));
        (known && far).then(said)
    });
    let changed: Vec<String> = changed.collect();
    let list = changed.join(", ");
    let warning = format!(
        "the fit multiplied {list}: is a column, or the time, in another unit than the rig says?"
    );
    (!changed.is_empty()).then_some(warning)
}

/// Warning of a signal; `None` where the refitted rig explains it ([`SensorFit::is_explained`]).
pub fn unexplained(fit: &SensorFit) -> Option<String> {
    (!fit.is_explained()).then(|| {
        format!(
            "the refitted rig misses {} by {} where it moves by {}: it lacks something, and what \
             is made of it will too. Is there a spring, is the input right? `sinew diagnose` \
             looks for what is missing",
            fit.signal,
            quantity(fit.rms, &fit.unit),
            quantity(fit.spread, &fit.unit)
        )
    })
}

/// Warning of a signal that the refitted rig explains for the most part, and leaves more of than
/// noise: the intervals of the parameters take all that is left for noise.
fn above_noise(fit: &SensorFit) -> Option<String> {
    let times = fit.rms / fit.noise;
    let left = times > LEFT && fit.rms > EXACT * fit.spread;
    left.then(|| {
        format!(
            "the refitted rig leaves {} of {}, {} times its noise: the intervals do not count \
             what it lacks. `sinew diagnose` looks for it",
            quantity(fit.rms, &fit.unit),
            fit.signal,
            significant(times, 2)
        )
    })
}

/// Warnings of signals that are missed by far more in recordings that the fit has not seen.
/// `tested` is their error by the refitted rig, in the order of the fit's sensors.
pub fn unseen<'a>(fit: &Fit, tested: impl IntoIterator<Item = &'a SensorError>) -> Vec<String> {
    let pairs = fit.sensors.iter().zip(tested);
    let pairs = pairs.filter(|(fitted, _)| fitted.is_explained() && fit.runaway.is_none());
    let worse = pairs.filter(|(fitted, test)| {
        test.rms > UNSEEN * fitted.rms.max(fitted.noise) && test.rms > EXACT * test.spread
    });
    let said = worse.map(|(fitted, test)| {
        format!(
            "{} is missed by {} in the test recordings and by {} in those of the fit: these show \
             too little of the device, or the rig lacks something and the intervals do not count \
             it. `sinew diagnose` looks for it",
            test.signal,
            quantity(test.rms, &test.unit),
            quantity(fitted.rms, &fitted.unit)
        )
    });
    said.collect()
}

/// Warning of bounds that keep parameters from better values.
pub fn beyond_bounds(beyond: &BeyondBounds, within: &[SensorFit]) -> String {
    let values = beyond.parameters.iter().map(|parameter| {
        format!(
            "`{}` rests at its bound of {}; without it {}",
            parameter.name,
            quantity(parameter.bound, &parameter.unit),
            quantity(parameter.value, &parameter.unit)
        )
    });
    let values: Vec<String> = values.collect();
    let errors = beyond.sensors.iter().zip(within).map(|(free, bounded)| {
        format!(
            "{} of the {} that {} is missed by",
            quantity(free.rms, &free.unit),
            quantity(bounded.rms, &bounded.unit),
            free.signal
        )
    });
    let errors: Vec<String> = errors.collect();
    format!("{} would leave {}", values.join(" and "), errors.join(", "))
}

/// Warning of a plant that runs away by itself.
pub fn runs_away(runaway: &Runaway) -> String {
    if runaway.blind_after <= 0.0 {
        return format!(
            "the rig runs away by itself: a small error grows {} times a second. Fitted in \
             intervals of {} it still leaves 0.3 of the motion or more, so no length of the \
             recordings would judge it. A number that is written bare may be wrong: write those \
             that you trust least as {{ value = ... }} and fit again",
            significant(runaway.rate.exp(), 2),
            quantity(runaway.interval, "s"),
        );
    }
    format!(
        "the rig runs away by itself: a small error grows {} times a second, and after {} noise \
         is as large as the motion. Parameters are fitted in intervals of {}; free-run errors of \
         longer recordings say nothing. Cut the recordings to {} to judge the rig",
        significant(runaway.rate.exp(), 2),
        quantity(runaway.blind_after, "s"),
        quantity(runaway.interval, "s"),
        quantity(runaway.blind_after, "s"),
    )
}

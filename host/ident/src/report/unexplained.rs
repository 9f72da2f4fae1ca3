//! Warnings of a refitted rig that does not explain its recordings.

use super::{quantity, significant};
use crate::fit::{BeyondBounds, Fit, Runaway, SensorFit};

/// Warnings for a person, none where the refitted rig explains its recordings.
pub fn warnings(fit: &Fit) -> Vec<String> {
    let beyond = fit.beyond.iter().map(|it| beyond_bounds(it, &fit.sensors));
    let missed = match &fit.runaway {
        Some(runaway) => vec![runs_away(runaway)],
        None => fit.sensors.iter().filter_map(unexplained).collect(),
    };
    beyond.chain(missed).collect()
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

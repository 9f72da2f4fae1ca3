//! Rows that lie further apart than a period of the rig: times that are no seconds.

use std::f64::consts::TAU;

use sinew_sim::Rig;
use sinew_sim::rig::End;

use super::finding::{Check, number};
use super::refitted::{BELIEVED, GOOD, Refit, is_small};
use crate::recording::Recording;

/// Units of a second that loggers write, their flags and kinds.
const UNITS: [(f64, &str, &str, &str); 3] = [
    (1e3, "ms", "milliseconds", "time_in_milliseconds"),
    (1e6, "us", "microseconds", "time_in_microseconds"),
    (1e9, "ns", "nanoseconds", "time_in_nanoseconds"),
];

/// Powers of ten between them.
const POWERS: [f64; 4] = [1e1, 1e2, 1e4, 1e5];

/// Rows that show which.
const ROWS: usize = 1200;

/// Fewest rows a period of a recording that shows the motion.
const FEWEST: f64 = 4.0;

/// Longest time of a rig in rows that a recorder would take.
const MOST: f64 = 1e5;

/// `time_in_milliseconds` and its like, where the rig moves faster than the rows follow.
pub(super) fn detect(rig: &Rig, recording: &Recording) -> Option<Check> {
    let step = recording.interval()?;
    let time = slowest(rig)?;
    if step < time || recording.len() < 16 {
        return None;
    }
    let (_, flag, words, kind) = UNITS.into_iter().find(|(units, ..)| {
        let rows = time * units / step;
        (FEWEST..MOST).contains(&rows)
    })?;
    let sentence = format!(
        "rows are {} s apart while the rig moves within {} s: the times look like {words}",
        number(step),
        number(time)
    );
    if let Some(other) = other_power(rig, recording, time) {
        return Some(other);
    }
    if is_guessed(rig) {
        let sentence = format!("{sentence}, if the guesses in the rig are near the truth");
        let remedy = format!("--time-unit {flag} if they are");
        return Some(Check::likely(recording, 0, kind, sentence, remedy));
    }
    let remedy = format!("--time-unit {flag}");
    Some(Check::certain(recording, 0, kind, sentence, remedy))
}

/// `time_in_other_unit`: the refitted rig is as believed with times a power of ten smaller that is
/// none of the units that loggers write, and not in one of those.
fn other_power(rig: &Rig, recording: &Recording, time: f64) -> Option<Check> {
    if !is_small(rig) || is_guessed(rig) {
        return None;
    }
    let part = recording.rows(0..recording.len().min(ROWS)).ok()?;
    let step = part.interval()?;
    let as_believed = |units: f64| {
        let t = part.t().iter().map(|t| t / units).collect();
        let seconds = Recording::new(part.path(), t, part.columns().to_vec()).ok()?;
        let refit = Refit::below(GOOD * GOOD, rig, &seconds)?;
        (refit.error() < GOOD && refit.farthest() < BELIEVED).then_some(units)
    };
    let shows = |units: &f64| (FEWEST..MOST).contains(&(time * units / step));
    let mut of_loggers = UNITS.iter().map(|unit| unit.0).filter(shows);
    let power = POWERS.into_iter().filter(shows).find_map(as_believed)?;
    if of_loggers.any(|units| as_believed(units).is_some()) {
        return None;
    }
    let sentence = format!(
        "rows are {} s apart while the rig moves within {} s: it moves as it says with times {} \
         times as small",
        number(step),
        number(time),
        number(power)
    );
    let remedy = format!("divide the column t by {}", number(power));
    Some(Check::certain(
        recording,
        0,
        "time_in_other_unit",
        sentence,
        remedy,
    ))
}

/// `coarse_sampling`: a period or time constant of the rig has fewer than four rows, and it moves
/// between them unseen. `time_in_other_unit` where smaller times mend that.
pub(super) fn coarse(rig: &Rig, recording: &Recording) -> Option<Check> {
    let step = recording.interval()?;
    let time = slowest(rig)?;
    let is_coarse = step < time && time < FEWEST * step && recording.len() >= 16;
    if !is_coarse {
        return None;
    }
    other_power(rig, recording, time).or_else(|| {
        let sentence = format!(
            "rows are {} s apart, and the rig moves within {} s: what it does between two rows is \
             not seen",
            number(step),
            number(time)
        );
        let remedy = "record at least ten rows a period";
        Some(Check::likely(
            recording,
            0,
            "coarse_sampling",
            sentence,
            remedy,
        ))
    })
}

/// True where a comment of the rig calls a number of its motion a guess, as `sinew new` writes.
pub(super) fn is_guessed(rig: &Rig) -> bool {
    rig.to_toml().lines().any(|line| {
        let (entry, comment) = line.split_once('#').unwrap_or((line, ""));
        let key = entry.split('=').next().unwrap_or_default().trim();
        matches!(key, "inertia" | "stiffness" | "damping") && comment.contains("a guess")
    })
}

/// Period or time constant of the slowest body that has one by its own springs, weight or dampers,
/// s.
fn slowest(rig: &Rig) -> Option<f64> {
    let times = (0..rig.bodies.len()).filter_map(|body| {
        let inertia = rig.bodies[body].inertia.value;
        let ends = |from: End, to: End| from == End::Body(body) || to == End::Body(body);
        let springs = (0..rig.springs.len()).filter(|&s| {
            let spring = &rig.springs[s];
            ends(spring.from, spring.to)
        });
        let weights = rig.gravities.iter().filter(|g| g.body == body);
        let stiffness = springs.map(|s| rig.stiffness_at_rest(s)).sum::<f64>()
            + weights.map(|g| g.amplitude.value.abs()).sum::<f64>();
        let dampers = (0..rig.dampers.len()).filter(|&d| {
            let damper = &rig.dampers[d];
            ends(damper.from, damper.to)
        });
        let damping: f64 = dampers.map(|d| rig.damping_at_rest(d)).sum();
        let time = match (stiffness > 0.0, damping > 0.0) {
            (true, _) => TAU * (inertia / stiffness).sqrt(),
            (false, true) => TAU * inertia / damping,
            (false, false) => return None,
        };
        (time.is_finite() && time > 0.0).then_some(time)
    });
    times.max_by(f64::total_cmp)
}

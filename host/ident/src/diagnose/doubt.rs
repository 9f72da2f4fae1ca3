//! Doubts about a finding that the evidence for it does not show.

use sinew_sim::{Plant, Rig};

use crate::diagnose::calibration::Known;
use crate::diagnose::candidate::Candidate;
use crate::diagnose::case::Case;
use crate::diagnose::config::CONFIG;
use crate::diagnose::finding::FoundEffect;
use crate::diagnose::one_way::{NOTE, one_way};
use crate::error::Result;
use crate::report::{quantity, significant};

/// Lowers the confidence of what is named where the corrected model gives reason to, and says each
/// reason.
///
/// # Errors
/// A rig that cannot be compiled.
pub(crate) fn lower(
    effects: &mut [FoundEffect],
    named: &Candidate,
    corrected: &Rig,
    known: &Known,
    case: &Case,
) -> Result<Vec<String>> {
    let mut reasons = at_bounds(corrected, known)?;
    reasons.extend(stopped(case).map(|stopped| format!("less sure: {stopped}")));
    reasons.extend(one_way(case).then(|| format!("less sure: {NOTE}")));
    reasons.extend(fit_left_behind(named));
    let all = CONFIG
        .calibration
        .doubt
        .powi(i32::try_from(reasons.len()).unwrap_or(i32::MAX));
    for effect in effects {
        let open = spans_everything(effect);
        effect.confidence *= if open { CONFIG.calibration.doubt } else { 1.0 } * all;
        if open {
            let placed = format!("{} at {}", effect.kind, effect.component);
            let reason = "every interval of its parameters is wider than its value";
            reasons.push(format!("less sure: {placed}: {reason}"));
        }
    }
    Ok(reasons)
}

/// Sentence of a search that had no time to end.
pub(crate) fn stopped(case: &Case) -> Option<String> {
    let untried = case.untried.names();
    (!untried.is_empty()).then(|| {
        let moves = untried.join(", ");
        format!("the search was stopped before it ended; not tried, or in part: {moves}")
    })
}

/// Parameters that rest at a bound which the rig's owner gave.
fn at_bounds(corrected: &Rig, known: &Known) -> Result<Vec<String>> {
    let plant = Plant::new(corrected)?;
    let reached = plant.parameters().iter().filter_map(|parameter| {
        let value = known.get(&parameter.name)?.value;
        let below = parameter.min.filter(|min| value <= *min && *min != 0.0);
        let bound = below.or(parameter.max.filter(|max| value >= *max))?;
        let bound = quantity(bound, &parameter.unit);
        let name = &parameter.name;
        Some(format!(
            "less sure: `{name}` rests at its bound of {bound}, which may be wrong"
        ))
    });
    Ok(reached.collect())
}

/// A fit that leaves many times the error of the check is no fit.
fn fit_left_behind(named: &Candidate) -> Option<String> {
    let sensors = 0..named.fit.series.len();
    let times = sensors.map(|s| named.fit.rms(s) / named.check.rms(s).max(f64::MIN_POSITIVE));
    let worst = times.fold(0.0, f64::max);
    (worst > CONFIG.calibration.left_behind).then(|| {
        let times = significant(worst, 2);
        format!(
            "less sure: the fit recordings keep {times} times the error of the check recordings"
        )
    })
}

/// Tells whether no parameter has an interval that is narrower than its own value; unknown
/// intervals say nothing here.
fn spans_everything(effect: &FoundEffect) -> bool {
    let widths = effect.parameters.values().filter_map(|estimate| {
        let [low, high] = estimate.ci95?;
        Some(0.5 * (high - low) > estimate.value.abs())
    });
    let widths: Vec<bool> = widths.collect();
    !widths.is_empty() && widths.iter().all(|wide| *wide)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::example::carriage;

    #[test]
    fn an_interval_wider_than_the_value_spans_everything_and_an_unknown_one_says_nothing() {
        let of = |ci95| {
            let mut effect = carriage().effects.remove(0);
            effect
                .parameters
                .get_mut("level")
                .expect("friction has a level")
                .ci95 = ci95;
            spans_everything(&effect)
        };
        assert!(of(Some([-1.0, 41.2])));
        assert!(!of(Some([19.8, 20.4])));
        assert!(!of(None));
    }

    #[test]
    fn a_parameter_at_its_owners_bound_is_said_and_one_within_is_not() -> Result<()> {
        let found = carriage();
        let text = found.mended.to_toml();
        let bounded = |max: &str| -> Result<Vec<String>> {
            let text = text.replace("min = 1.0", &format!("min = 1.0, max = {max}"));
            let rig = Rig::parse(&text, "axis.toml")?;
            at_bounds(&rig, &found.parameters)
        };
        let said = bounded("95.2")?;
        assert_eq!(said.len(), 1);
        assert!(said[0].contains("carriage.inertia"), "{said:?}");
        assert_eq!(bounded("200.0")?, Vec::<String>::new());
        Ok(())
    }
}

//! Mismatch that the findings leave: its share, its place and a sentence.

use std::collections::BTreeMap;

use sinew_sim::Rig;

use crate::diagnose::acceptance::leaves_something;
use crate::diagnose::case::Case;
use crate::diagnose::finding::{FoundEffect, Location, Remainder};
use crate::diagnose::locate::locate;
use crate::diagnose::pool::Pool;
use crate::diagnose::share::{above_noise, share_left};
use crate::diagnose::wording::{share_of, with_article};
use crate::error::Result;
use crate::report::significant;

/// Remainder beside the candidate that is named; `None` where it leaves nothing but noise. A force
/// at one place of the corrected rig shows where it sits.
///
/// # Errors
/// None that reading the recordings has not excluded.
pub(crate) fn beside(
    found: &Pool,
    index: usize,
    corrected: &Rig,
    effects: &[FoundEffect],
    case: &Case,
) -> Result<Option<Remainder>> {
    let named = &found.candidates[index];
    if !leaves_something(case, named) {
        return Ok(None);
    }
    let located = locate(corrected, case.fit, None, None)?;
    let [component, follows] = match located {
        Some(located) => [located.component, located.follows],
        None => [
            effects
                .first()
                .map_or_else(String::new, |e| e.component.clone()),
            "no quantity that was recorded".into(),
        ],
    };
    let share = share_left(case, named, &found.baseline);
    let above_noise = above_noise(case, named);
    let sentence = format!(
        "{} of the mismatch remain, {} times the noise, at {component}, following {}; no effect of \
         the vocabulary takes them.",
        share_of(share),
        significant(above_noise, 2),
        with_article(&follows)
    );
    Ok(Some(Remainder {
        share,
        above_noise,
        component,
        follows,
        sentence,
    }))
}

/// Remainder where nothing is named: all of the mismatch.
pub(crate) fn whole(found: Option<&Pool>, location: Option<&Location>, case: &Case) -> Remainder {
    let above_noise = found.map_or(f64::NAN, |found| above_noise(case, &found.baseline));
    let (component, follows) = location.map_or_else(
        || (String::new(), "no quantity that was recorded".to_owned()),
        |at| (at.component.clone(), at.follows.clone()),
    );
    let times = match found {
        Some(_) => format!(", {} times the noise", significant(above_noise, 2)),
        None => String::new(),
    };
    Remainder {
        share: 1.0,
        above_noise,
        sentence: format!("All of the mismatch remains{times}."),
        component,
        follows,
    }
}

/// Basis on which each signal was judged.
pub(crate) fn judged(
    case: &Case,
    signals: impl Iterator<Item = String>,
) -> BTreeMap<String, String> {
    let over = match windows(case) {
        None => "free runs of whole recordings".to_owned(),
        Some(longest) => format!("windows of {} s", significant(longest, 2)),
    };
    signals.map(|signal| (signal, over.clone())).collect()
}

/// Longest window over which the check recordings were judged, s; `None` where they were judged
/// over free runs of whole recordings.
pub(crate) fn windows(case: &Case) -> Option<f64> {
    if case.check.cut(1) == case.check_intervals {
        return None;
    }
    let seconds = case.check_intervals.iter().map(|(index, rows)| {
        let t = &case.check.experiments[*index].t;
        t[rows.end - 1] - t[rows.start]
    });
    Some(seconds.fold(0.0, f64::max))
}

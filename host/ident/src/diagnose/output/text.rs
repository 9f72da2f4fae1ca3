//! A finding for a terminal: the sentence first, then where, what, how well, what else, what next.

use std::fmt::Write;

use super::{interval, percent, placed};
use crate::diagnose::wording::share_of;
use crate::diagnose::{Diagnosis, Errors, Finalist, FoundEffect, Rival, SignalFit, Verdict};
use crate::order;
use crate::report::{own_value, quantity};

/// Stretches that are named; the report marks all of them.
const STRETCHES: usize = 4;

/// Explanations that are told of where none is believed; the report has all of them.
const NEAREST: usize = 3;

/// The finding as lines, the last one ended.
pub fn text(diagnosis: &Diagnosis) -> String {
    let mut text = format!("{}\n", diagnosis.sentence);
    place(&mut text, diagnosis);
    for effect in &diagnosis.effects {
        law(&mut text, effect);
    }
    if let Some(remainder) = diagnosis.remainder.as_ref().filter(|left| left.share < 1.0) {
        line(&mut text, "left", &remainder.sentence);
    }
    fit(&mut text, diagnosis);
    parameters(&mut text, diagnosis);
    others(&mut text, diagnosis);
    nearest(&mut text, diagnosis);
    let details = &diagnosis.details;
    if let Some(aside) = &details.set_aside {
        line(
            &mut text,
            "set aside",
            &format!("{aside}, to check by; --check names other recordings"),
        );
    }
    for note in &diagnosis.notes {
        line(&mut text, "note", note);
    }
    if !diagnosis.next_experiment.is_empty() {
        line(&mut text, "next", &diagnosis.next_experiment);
    }
    text
}

/// A title in the left column, text beside it.
fn line(text: &mut String, title: &str, what: &str) {
    // Writing to a String cannot fail, here and below.
    let _ = writeln!(text, "  {title:<12}{what}");
}

fn place(text: &mut String, diagnosis: &Diagnosis) {
    let Some(location) = &diagnosis.location else {
        return;
    };
    let follows = match location.follows.as_str() {
        "" => String::new(),
        what => format!(", following {}", super::with_article(what)),
    };
    line(text, "where", &format!("{}{follows}", location.component));
    if let Some(regime) = &location.regime {
        line(text, "acts", &regime.sentence());
    }
    for (index, stretch) in location.intervals.iter().take(STRETCHES).enumerate() {
        let what = format!(
            "{:.2} s to {:.2} s of {}: {:.1} times the noise",
            stretch.t_start_s, stretch.t_end_s, stretch.recording, stretch.score
        );
        line(text, if index == 0 { "when" } else { "" }, &what);
    }
    let more = location.intervals.len().saturating_sub(STRETCHES);
    if more > 0 {
        line(
            text,
            "",
            &format!("and {more} more stretches; --report marks them"),
        );
    }
}

fn law(text: &mut String, effect: &FoundEffect) {
    let kind = placed(&effect.kind, &effect.component);
    line(
        text,
        "found",
        &format!("{kind}, {} sure", percent(effect.confidence)),
    );
    let explains = format!("{} of the mismatch", share_of(effect.share));
    line(text, "explains", &explains);
    line(text, "law", &effect.equation);
    for (name, estimate) in &effect.parameters {
        let value = quantity(estimate.value, &estimate.unit);
        line(
            text,
            "",
            &format!("{name:<14}{value:>14}   ({})", interval(estimate)),
        );
    }
}

fn fit(text: &mut String, diagnosis: &Diagnosis) {
    let title = format!(
        "{:<14}{:>14}{:>14}{:>14}",
        "free-run RMS", "as written", "refitted", "corrected"
    );
    line(text, "fit", &title);
    for (signal, fit) in &diagnosis.fit {
        for (role, errors) in roles(fit) {
            line(
                text,
                "",
                &row(&format!("{signal} {role}"), errors, &fit.unit),
            );
            if let Some(judged) = errors.judged_rms {
                let judged = quantity(judged, &fit.unit);
                line(
                    text,
                    "",
                    &format!("{:<42}{judged:>14}", "  as judged, over windows"),
                );
            }
        }
        let noise = quantity(fit.noise_rms, &fit.unit);
        line(
            text,
            "",
            &format!("{:<14}{noise:>14}", format!("{signal} noise")),
        );
    }
}

/// The roles of a signal that have recordings.
pub(super) fn roles(fit: &SignalFit) -> impl Iterator<Item = (&'static str, Errors)> {
    [
        ("fit", Some(fit.fit)),
        ("check", Some(fit.check)),
        ("test", fit.test),
    ]
    .into_iter()
    .filter_map(|(role, errors)| errors.map(|errors| (role, errors)))
}

fn row(title: &str, errors: Errors, unit: &str) -> String {
    format!(
        "{title:<14}{:>14}{:>14}{:>14}",
        quantity(errors.as_written_rms, unit),
        quantity(errors.before_rms, unit),
        after(errors, unit)
    )
}

/// Free-run error of the corrected rig, or a dash where free runs mean nothing.
pub(super) fn after(errors: Errors, unit: &str) -> String {
    errors
        .after_rms
        .map_or_else(|| "—".to_owned(), |rms| quantity(rms, unit))
}

fn parameters(text: &mut String, diagnosis: &Diagnosis) {
    for (index, (name, estimate)) in diagnosis.parameters.iter().enumerate() {
        let value = quantity(estimate.value, &estimate.unit);
        let what = format!("{name:<26}{value:>14}   ({})", interval(estimate));
        line(text, if index == 0 { "parameters" } else { "" }, &what);
        for own in &estimate.recordings {
            line(
                text,
                "",
                &format!("    {}: {}", own.recording, own_value(own)),
            );
        }
    }
}

/// Rivals with why they lost, and what these data cannot tell apart.
fn others(text: &mut String, diagnosis: &Diagnosis) {
    let mut told: Vec<String> = Vec::new();
    for effect in &diagnosis.effects {
        for rival in &effect.rivals {
            let rivalry = rivalry(diagnosis, rival);
            // Effects that were found together have the same rivals.
            if !told.contains(&rivalry) {
                line(text, "rival", &rivalry);
                told.push(rivalry);
            }
        }
        for twin in &effect.indistinguishable_from {
            let name = placed(&twin.kind, &twin.component);
            let of = placed(&effect.kind, &effect.component);
            line(
                text,
                "the same",
                &format!("{name} with these recordings looks like {of}"),
            );
        }
    }
}

fn rivalry(diagnosis: &Diagnosis, rival: &Rival) -> String {
    let name = placed(&rival.kind, &rival.component);
    let lost = diagnosis
        .candidates
        .iter()
        .find(|finalist| finalist.name == name && !finalist.lost.is_empty())
        .map_or(String::new(), |finalist| format!(": {}", finalist.lost));
    format!("{name}, {}{lost}", percent(rival.confidence))
}

/// Of what nothing explains, what came nearest: no names, but where to look.
fn nearest(text: &mut String, diagnosis: &Diagnosis) {
    if diagnosis.verdict != Verdict::Unexplained {
        return;
    }
    let gains = |finalist: &&Finalist| finalist.fit_error < 1.0;
    let mut nearest: Vec<&Finalist> = diagnosis.candidates.iter().filter(gains).collect();
    order::sort_up(&mut nearest, |it| it.fit_error);
    for (index, finalist) in nearest.into_iter().take(NEAREST).enumerate() {
        let what = format!(
            "{}: leaves {} of the error on the fit recordings, {} on the check recordings; {}",
            finalist.name,
            percent(finalist.fit_error),
            percent(finalist.check_error),
            finalist.lost
        );
        line(text, if index == 0 { "not named" } else { "" }, &what);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::{Details, example};

    #[test]
    fn a_finding_in_words() {
        let mut diagnosis = example::carriage();
        diagnosis.details = Details {
            set_aside: Some("the last 4 s of A.csv".into()),
            recovered: None,
        };
        diagnosis.notes = vec!["u_V: 3 samples are missing and held their last value".into()];
        diagnosis.candidates = vec![Finalist {
            name: "stribeck_friction at carriage".into(),
            parameters: 5,
            fit_error: 0.07,
            check_error: 0.08,
            remainder: 0.01,
            probability: 0.01,
            lost: "two parameters more for the same error".into(),
        }];
        insta::assert_snapshot!(text(&diagnosis));
    }

    #[test]
    fn where_nothing_is_named_what_came_nearest_is_told_and_what_gains_nothing_is_not() {
        let mut diagnosis = example::carriage();
        diagnosis.verdict = Verdict::Unexplained;
        diagnosis.sentence = "Something is missing from the model.".into();
        diagnosis.effects.clear();
        let of = |name: &str, fit_error: f64, check_error: f64| Finalist {
            name: name.into(),
            parameters: 5,
            fit_error,
            check_error,
            remainder: check_error * check_error,
            probability: 0.0,
            lost: "does not hold on the check recordings".into(),
        };
        diagnosis.candidates = vec![
            of("coulomb_friction at carriage", 0.84, 1.3),
            of("load_dependent_friction at carriage", 0.41, 1.21),
            of("sensor_lag at encoder", 2.3, 0.9),
        ];
        insta::assert_snapshot!(text(&diagnosis));
    }

    #[test]
    fn nothing_missing_in_words() {
        let mut diagnosis = example::carriage();
        diagnosis.verdict = Verdict::Consistent;
        diagnosis.sentence = "The rig explains the recordings as it is written.".into();
        diagnosis.effects.clear();
        diagnosis.location = None;
        diagnosis.next_experiment.clear();
        insta::assert_snapshot!(text(&diagnosis));
    }
}

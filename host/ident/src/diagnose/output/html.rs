//! A finding as a page that stands alone.

use sinew_sim::Rig;

use super::text::{after, roles};
use super::{mended, percent, placed, plots, tables};
use crate::diagnose::wording::share_of;
use crate::diagnose::{Diagnosis, Verdict};
use crate::error::Result;
use crate::fit::{FreeRun, free_run};
use crate::recording::Recording;
use crate::report::{Block, Provenance, Report, Section, Tone, quantity};
use crate::validation::{Free, Model, chapters, fit_table, motions};

/// Recordings drawn at most; the table of errors counts all.
const DRAWN: usize = 8;

/// A recording of the page and what it was for: `fit`, `check` or `test`.
#[derive(Clone, Copy, Debug)]
pub struct Shown<'a> {
    /// Its role.
    pub role: &'a str,
    /// The recording, whole.
    pub recording: &'a Recording,
}

/// The page. `written` is the rig as it came; `made` is the command that made the page.
///
/// # Errors
/// As [`free_run`].
pub fn report(
    diagnosis: &Diagnosis,
    written: &Rig,
    shown: &[Shown<'_>],
    made: &Provenance,
) -> Result<Report> {
    let runs = [written, &diagnosis.refitted, &diagnosis.mended].map(|rig| {
        let all = shown.iter().map(|shown| free_run(rig, shown.recording));
        all.collect::<Result<Vec<FreeRun>>>()
    });
    let [as_written, refitted, corrected] = runs;
    let (as_written, refitted, corrected) = (as_written?, refitted?, corrected?);
    let model = |name, tone, runs| Model { name, tone, runs };
    let mut models = vec![
        model("as written", Tone::Green, &as_written[..]),
        model("refitted", Tone::Orange, &refitted),
    ];
    // The corrected rig is the refitted one if nothing is named.
    if corrected_differs(diagnosis) {
        models.push(model("corrected", Tone::Blue, &corrected));
    }
    let free = Free {
        rig: &diagnosis.mended,
        recordings: (shown.iter()).map(|it| (it.role, it.recording)).collect(),
        models,
    };
    let mut page = Report::new(format!("{}: {}", written.name, heading(diagnosis.verdict)))
        .lead(diagnosis.sentence.clone())
        .next(diagnosis.next_experiment.clone())
        .section(when(diagnosis, &free));
    for (signal, fit) in &diagnosis.fit {
        let (role, errors) = match fit.test {
            Some(test) => ("test", test),
            None => ("check", fit.check),
        };
        page = page.fact(
            format!("{signal}, {role}"),
            after(errors, &fit.unit),
            format!(
                "{}before {}; {}noise {}",
                match free.fit_text(role, signal) {
                    // Free runs that mean nothing have no fit.
                    percent if percent.is_empty() || errors.after_rms.is_none() => String::new(),
                    percent => format!("fit {percent}; "),
                },
                quantity(errors.before_rms, &fit.unit),
                errors.judged_rms.map_or_else(String::new, |rms| {
                    format!("over windows, as judged, {}; ", quantity(rms, &fit.unit))
                }),
                quantity(fit.noise_rms, &fit.unit)
            ),
        );
    }
    for effect in &diagnosis.effects {
        page = page.fact(
            placed(&effect.kind, &effect.component),
            percent(effect.confidence),
            format!(
                "how sure; removes {} of the mismatch",
                share_of(effect.share)
            ),
        );
    }
    if let Some(remainder) = &diagnosis.remainder {
        page = page.fact(
            "left",
            share_of(remainder.share),
            remainder.sentence.clone(),
        );
    }
    if diagnosis.details.recovered.is_some() {
        page = page.section(follows(diagnosis));
    }
    let page = page
        .section(what(diagnosis, written))
        .section(how_well(diagnosis, &free))
        .section(what_else(diagnosis));
    let page = chapters(&free)?.into_iter().fold(page, Report::section);
    Ok(page
        .section(what_next(diagnosis))
        .made(&made.clone().seconds(diagnosis.seconds)))
}

/// True where the mended rig is another one than the refitted.
fn corrected_differs(diagnosis: &Diagnosis) -> bool {
    diagnosis.mended.to_toml() != diagnosis.refitted.to_toml()
}

fn heading(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Consistent => "nothing is missing",
        Verdict::Parameters => "other numbers, no missing physics",
        Verdict::MissingPhysics => "missing physics",
        Verdict::Unexplained => "something unnamed is missing",
    }
}

fn when(diagnosis: &Diagnosis, free: &Free<'_>) -> Section {
    let mut section = Section::new("Where and when").text(match &diagnosis.location {
        Some(location) if location.intervals.is_empty() => format!(
            "The mismatch sits at {}, all along the recordings.",
            location.component
        ),
        Some(location) => format!(
            "The mismatch sits at {}. The shaded stretches are those where it is largest.",
            location.component
        ),
        None => "No stretch of the recordings stands out.".into(),
    });
    if let Some(aside) = &diagnosis.details.set_aside {
        section = section.with(Block::Notice(format!(
            "No recording was given to check by, so part was set aside: {aside}."
        )));
    }
    for note in &diagnosis.notes {
        section = section.with(Block::Notice(note.clone()));
    }
    let mut order: Vec<usize> = (0..free.recordings.len()).collect();
    // What judges comes first: these recordings chose nothing.
    order.sort_by_key(|&index| {
        ["test", "check", "fit"]
            .iter()
            .position(|role| *role == free.recordings[index].0)
    });
    for &index in order.iter().take(DRAWN) {
        let (role, recording) = free.recordings[index];
        let name = recording.name();
        let bands: Vec<[f64; 2]> = (diagnosis.location.iter())
            .flat_map(|location| &location.intervals)
            .filter(|stretch| stretch.recording == name)
            .map(|stretch| [stretch.t_start_s, stretch.t_end_s])
            .collect();
        for plot in motions(&free.models, index, role, &bands) {
            section = section.with(Block::Plot(plot));
        }
    }
    if order.len() > DRAWN {
        let rest = order[DRAWN..].iter();
        let rest: Vec<String> = rest.map(|&i| free.recordings[i].1.name()).collect();
        section = section.text(format!("Not drawn: {}.", rest.join(", ")));
    }
    section
}

fn follows(diagnosis: &Diagnosis) -> Section {
    let mut section = Section::new("What it follows").text(match &diagnosis.location {
        Some(location) if !location.follows.is_empty() => format!(
            "The force that the refitted rig lacks at {}, recovered from the recordings, follows {}.",
            location.component,
            super::with_article(&location.follows)
        ),
        _ => "The force that the refitted rig lacks, recovered from the recordings.".into(),
    });
    let regime = diagnosis
        .location
        .as_ref()
        .and_then(|at| at.regime.as_ref());
    if let Some(regime) = regime {
        section = section.text(format!("It acts {}.", regime.sentence()));
    }
    if let Some(recovered) = &diagnosis.details.recovered {
        let named = law_name(diagnosis);
        if recovered.traces.iter().any(|trace| !trace.law.is_empty()) {
            section = section.text(
                "Over it lies what the corrected rig has more than the refitted one: the named \
                 effects, and the rig's own numbers where they moved.",
            );
        }
        for plot in plots::recovered(recovered, &named) {
            section = section.with(Block::Plot(plot));
        }
    }
    section
}

/// The law that is drawn over the recovered force: the name of the effect, of several all.
fn law_name(diagnosis: &Diagnosis) -> String {
    let kinds = diagnosis.effects.iter();
    let kinds: Vec<String> = kinds.map(|effect| effect.kind.replace('_', " ")).collect();
    format!("{} as named", kinds.join(" and "))
}

fn what(diagnosis: &Diagnosis, written: &Rig) -> Section {
    let mut section = Section::new("What was found");
    for effect in &diagnosis.effects {
        section = section
            .text(effect.sentence.clone())
            .with(Block::Code(effect.equation.clone()))
            .with(Block::Table(tables::estimates(
                &placed(&effect.kind, &effect.component),
                &effect.parameters,
            )));
    }
    if diagnosis.effects.is_empty() {
        section = section.text(diagnosis.sentence.clone());
    }
    if !diagnosis.parameters.is_empty() {
        section = section.with(Block::Table(tables::numbers(diagnosis, written)));
    }
    section
}

fn how_well(diagnosis: &Diagnosis, free: &Free<'_>) -> Section {
    Section::new("Before and after")
        .text(
            "Free runs: the simulator sees only the inputs. Its start state comes from the first 5 % of each \
             recording; the error is taken over the rest. Fit recordings gave the numbers, check recordings \
             decided what is believed, test recordings chose nothing. Fit is 100 % without an error, and 0 % \
             where the mean of the measurement would do as well.",
        )
        .with(Block::Table(fit_table(free)))
        .with(Block::Table(
            // Rows that were set aside are no file of their own, and windows are no free runs.
            if diagnosis.details.set_aside.is_some() || over_windows(diagnosis) {
                tables::errors(diagnosis)
            } else {
                tables::noise(diagnosis)
            },
        ))
}

/// True where a signal was judged over windows, not over free runs of whole recordings.
fn over_windows(diagnosis: &Diagnosis) -> bool {
    let mut all = diagnosis.fit.values().flat_map(roles);
    all.any(|(_, errors)| errors.judged_rms.is_some())
}

/// The finding in short, as a chapter of another page.
pub fn chapter(diagnosis: &Diagnosis) -> Section {
    let laws = (diagnosis.effects.iter()).map(|effect| Block::Code(effect.equation.clone()));
    let section = Section::new("What the rig lacks").text(diagnosis.sentence.clone());
    laws.fold(section, Section::with)
        .with(Block::Table(tables::errors(diagnosis)))
        .text("The mended rig is mended.toml, beside this page.")
}

fn what_else(diagnosis: &Diagnosis) -> Section {
    let mut section = Section::new("What else it could be");
    if !diagnosis.candidates.is_empty() {
        section = section.with(Block::Table(tables::finalists(diagnosis)));
    }
    let rivals = tables::rivals(diagnosis);
    if rivals.rows.is_empty() {
        section = section.text("No rival has any share of the evidence.");
    } else {
        section = section.with(Block::Table(rivals));
    }
    section
}

fn what_next(diagnosis: &Diagnosis) -> Section {
    let mut section = Section::new("What next");
    if !diagnosis.next_experiment.is_empty() {
        section = section.text(diagnosis.next_experiment.clone());
    }
    section
        .text("The corrected rig, which every other verb simulates and trains on (--rig-out):")
        .with(Block::Code(mended(diagnosis)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::{Finalist, ForceTrace, Recovered, example};
    use crate::recording::Column;

    /// A carriage that was pushed, and stuck for a while.
    fn recording() -> Recording {
        let t: Vec<f64> = (0..200).map(|k| 0.01 * f64::from(k)).collect();
        let column = |name: &str, of: fn(f64) -> f64| Column {
            name: name.into(),
            values: t.iter().map(|&t| of(t)).collect(),
        };
        let columns = vec![
            column("u_V", |t| t.sin()),
            column("q_m", |t| 0.05 * (1.0 - t.cos())),
        ];
        Recording::new("A.csv", t, columns).expect("the recording is sound")
    }

    #[test]
    fn the_page_shows_where_what_how_well_what_else_and_what_next() {
        let mut diagnosis = example::carriage();
        let t: Vec<f64> = (0..50).map(|k| 0.1 * f64::from(k)).collect();
        let velocity: Vec<f64> = t.iter().map(|t| t.cos()).collect();
        diagnosis.details.recovered = Some(Recovered {
            component: "carriage".into(),
            unit: "N".into(),
            position_unit: "m".into(),
            traces: vec![ForceTrace {
                recording: "A.csv".into(),
                position: t.iter().map(|t| t.sin()).collect(),
                force: velocity.iter().map(|v| -20.0 * v.signum()).collect(),
                law: velocity.iter().map(|v| -20.1 * v.signum()).collect(),
                velocity,
                t,
            }],
        });
        diagnosis.candidates = vec![Finalist {
            name: "stribeck_friction at carriage".into(),
            parameters: 5,
            fit_error: 0.07,
            check_error: 0.08,
            remainder: 0.01,
            probability: 0.01,
            lost: "two parameters more for the same error".into(),
        }];
        let recording = recording();
        let shown = [Shown {
            role: "test",
            recording: &recording,
        }];
        let written = diagnosis.refitted.clone();
        let page = report(
            &diagnosis,
            &written,
            &shown,
            &Provenance::new("sinew diagnose"),
        )
        .expect("drawn");
        let html = page.to_html();
        for expected in [
            "Dry friction of 20.1 N at carriage is missing from the model.",
            "class=\"band\"",
            "against velocity",
            "against position",
            "over time",
            "two parameters more for the same error",
            "19.8 N to 20.4 N",
            "[[effect]]",
            "coulomb friction as named",
            "carriage.inertia",
            "Coverage of the recordings",
        ] {
            assert!(html.contains(expected), "{expected} is not on the page");
        }
        assert!(!html.contains("http"), "it must load nothing");
    }
}

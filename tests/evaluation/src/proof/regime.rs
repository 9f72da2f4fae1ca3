//! Regime of a mismatch on concealed cases: where in the space of states the named effects act, and
//! where a force without a name does, held against the true law on a recording that no fit saw
//! (docs/explanation/diagnosis.md, eq. 17a to 17c).

use std::fs;
use std::path::Path;

use anyhow::{Context, Result, anyhow, bail};
use serde_json::Value;
use sinew_ident::diagnose::{
    Axis, DiagnoseOptions, ForceSample, Recordings, Regime, acting, agreement, diagnose,
    force_along,
};
use sinew_ident::recording::Recording;
use sinew_scorer::Truth;
use sinew_scorer::truth::{Category, Concealed};
use sinew_sim::Rig;
use sinew_sim::effects::Kind;
use sinew_sim::rig::{Drives, End, Site};

use super::run::{self, Folder};

/// Agreement that is aimed at.
const AIM: f64 = 0.9;

/// Scores of one case.
struct Row {
    case: String,
    effects: String,
    share: f64,
    named: Option<f64>,
    unnamed: Option<f64>,
    /// The region that was said without a vocabulary.
    said: String,
}

/// Scores the regimes of those of these cases that hide effects. They are asked anew, unless the
/// answers that are there are only to be scored.
///
/// # Errors
/// The program does not build, a file cannot be read, or no case hides a force.
pub fn run(folder: &Folder, cases: &[usize], score_only: bool) -> Result<()> {
    let mut numbers = Vec::new();
    for &number in cases {
        let truth = truth(folder, number)?;
        if matches!(truth.category, Category::One | Category::Two) {
            numbers.push(number);
        }
    }
    if !score_only {
        folder.forget_answers()?;
        run::ask(folder, &numbers)?;
    }
    let (mut rows, mut no_force) = (Vec::new(), 0);
    for &number in &numbers {
        match row(folder, number).with_context(|| folder.name(number))? {
            Some(row) => {
                print(&row);
                rows.push(row);
            }
            None => no_force += 1,
        }
    }
    if rows.is_empty() {
        bail!("no case hides a force");
    }
    println!();
    summary(
        "named effects",
        rows.iter().filter_map(|row| row.named).collect(),
        rows.len(),
    );
    summary(
        "no vocabulary",
        rows.iter().filter_map(|row| row.unnamed).collect(),
        rows.len(),
    );
    println!("{no_force} cases hide no force (a sensor's), and are not scored");
    Ok(())
}

fn print(row: &Row) {
    let score = |score: Option<f64>| score.map_or("–".to_owned(), |score| format!("{score:.3}"));
    println!(
        "{}: acts at {:.0} % of the samples; named {}, no vocabulary {} ({}); {}",
        row.case,
        100.0 * row.share,
        score(row.named),
        score(row.unnamed),
        row.said,
        row.effects,
    );
}

fn summary(title: &str, mut scores: Vec<f64>, of: usize) {
    scores.sort_by(f64::total_cmp);
    let reached = scores.iter().filter(|score| **score >= AIM).count();
    let median = scores.get(scores.len() / 2).copied().unwrap_or(f64::NAN);
    let mean = scores.iter().sum::<f64>() / scores.len().max(1) as f64;
    println!(
        "{title}: a region in {} of {of} cases; F1 {median:.3} in the middle, {mean:.3} in the mean, {AIM} or \
         more in {reached}",
        scores.len()
    );
}

/// Scores of a case; `None` where it hides no force.
fn row(folder: &Folder, number: usize) -> Result<Option<Row>> {
    let truth = truth(folder, number)?;
    let case = folder.case(number);
    let believed = Rig::load(case.join("rig.toml"))?;
    let check = [Recording::read(case.join("check.csv"))?];
    let values: Vec<(&str, f64)> = truth
        .parameters
        .iter()
        .map(|(name, value)| (name.as_str(), *value))
        .collect();
    let without = believed.with_values(&values)?;
    let mut with = without.clone();
    for effect in &truth.effects {
        with = concealed(&with, effect)?;
    }
    let Some(place) = truth.effects.iter().find_map(|effect| place(&with, effect)) else {
        return Ok(None);
    };
    let Some(samples) = force_along(&without, &with, &place, &check)? else {
        return Ok(None);
    };
    let acts = acting(&samples);
    let answered = answered(&folder.answer(number))?;
    let named = score(answered, &samples, (&without, &with), (&place, &check))?;
    let recordings = Recordings {
        fit: vec![
            Recording::read(case.join("fit-a.csv"))?,
            Recording::read(case.join("fit-b.csv"))?,
        ],
        check: check.to_vec(),
        test: Vec::new(),
    };
    let blind = DiagnoseOptions {
        effects: Vec::new(),
        ..DiagnoseOptions::default()
    };
    let blind = diagnose(&believed, &recordings, &blind, &|_, _, _| {})?;
    let unnamed = blind.location.and_then(|location| location.regime);
    let said = unnamed
        .as_ref()
        .map_or("no region".to_owned(), Regime::sentence);
    // Numbers that were refitted have taken part of the law: the rest is what is missing.
    let refitted = force_along(&blind.refitted, &with, &place, &check)?;
    let unnamed = match refitted {
        None => None,
        Some(samples) => score(
            unnamed.map(Region::of),
            &samples,
            (&blind.refitted, &with),
            (&place, &check),
        )?,
    };
    Ok(Some(Row {
        case: folder.name(number),
        effects: (truth.effects.iter())
            .map(|effect| format!("{} at {}", effect.kind, effect.component))
            .collect::<Vec<_>>()
            .join(", "),
        share: acts.iter().filter(|acts| **acts).count() as f64 / acts.len().max(1) as f64,
        named,
        unnamed,
        said,
    }))
}

/// Agreement of a region with the samples at which a force acts: that by which the second of two
/// rigs differs from the first at a place. The region may be said at another component.
fn score(
    region: Option<Region>,
    samples: &[ForceSample],
    (without, with): (&Rig, &Rig),
    (place, recordings): (&str, &[Recording]),
) -> Result<Option<f64>> {
    let Some(region) = region else {
        return Ok(None);
    };
    let there = if region.component == place {
        Some(samples.to_vec())
    } else {
        force_along(without, with, &region.component, recordings)?
    };
    Ok(there.map(|there| {
        let said = there.iter().map(|sample| region.holds(sample));
        agreement(said, &acting(samples))
    }))
}

/// A region as an answer says it.
struct Region {
    component: String,
    axis: Axis,
    ends: [Option<f64>; 2],
}

impl Region {
    fn of(regime: Regime) -> Self {
        Self {
            component: regime.component,
            axis: regime.axis,
            ends: [regime.below, regime.above],
        }
    }

    fn holds(&self, sample: &ForceSample) -> bool {
        let [below, above] = self.ends;
        let regime = Regime {
            component: String::new(),
            axis: self.axis,
            unit: String::new(),
            below,
            above,
            share: 0.0,
            agreement: 0.0,
        };
        sample
            .on(self.axis)
            .is_some_and(|value| regime.holds(value))
    }
}

/// The region of a kept answer.
fn answered(path: &Path) -> Result<Option<Region>> {
    if !path.exists() {
        return Ok(None);
    }
    let answer: Value = serde_json::from_str(&fs::read_to_string(path)?)?;
    let Some(regime) = answer.pointer("/location/regime").filter(|r| r.is_object()) else {
        return Ok(None);
    };
    let axis = match regime["axis"].as_str() {
        Some("position") => Axis::Position,
        Some("velocity") => Axis::Velocity,
        Some("input") => Axis::Input,
        Some("everywhere") => Axis::Everywhere,
        other => bail!("{}: no axis {other:?}", path.display()),
    };
    Ok(Some(Region {
        component: regime["component"].as_str().unwrap_or_default().to_owned(),
        axis,
        ends: [regime["below"].as_f64(), regime["above"].as_f64()],
    }))
}

fn truth(folder: &Folder, number: usize) -> Result<Truth> {
    let path = folder.truth(number);
    let text =
        fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()))?;
    serde_json::from_str(&text).with_context(|| format!("{} is no truth", path.display()))
}

/// The rig with one concealed effect.
fn concealed(rig: &Rig, effect: &Concealed) -> Result<Rig> {
    let kind = kind(effect)?;
    let site = rig.site(kind, &effect.component)?;
    let value = |name: &str| effect.parameters.get(name).copied().unwrap_or(0.0);
    let specs = kind.description().parameters.iter();
    let values: Vec<f64> = specs.map(|spec| value(spec.name)).collect();
    Ok(rig.with_effect(kind, site, &values)?)
}

fn kind(effect: &Concealed) -> Result<Kind> {
    let mut kinds = Kind::ALL.iter().copied();
    let found = kinds.find(|kind| kind.description().kind == effect.kind);
    found.ok_or_else(|| anyhow!("no effect `{}`", effect.kind))
}

/// The component at which a concealed effect is a force: its body, its spring between two bodies,
/// or the body that its tendon or actuator moves; `None` of a sensor's.
fn place(rig: &Rig, effect: &Concealed) -> Option<String> {
    let site = rig.site(kind(effect).ok()?, &effect.component).ok()?;
    let of_tendon = |tendon: usize| rig.tendons[tendon].path.first().map(|part| part.0);
    let body = match site {
        Site::Body(body) | Site::Pair(body, _) => Some(body),
        Site::Spring(spring) => match (rig.springs[spring].from, rig.springs[spring].to) {
            (End::Body(_), End::Body(_)) => return Some(effect.component.clone()),
            (End::Body(body), _) | (_, End::Body(body)) => Some(body),
            _ => None,
        },
        Site::Tendon(tendon) => of_tendon(tendon),
        Site::Actuator(actuator) => match rig.actuators[actuator].drives {
            Drives::Body(body) => Some(body),
            Drives::Tendon(tendon) => of_tendon(tendon),
            Drives::Hasel(_) => None,
        },
        Site::Sensor(_) => None,
    }?;
    Some(rig.bodies[body].name.clone())
}

//! One answer against its truth.

use crate::answer::{Answer, Named};
use crate::truth::{Category, Concealed, Truth};

/// Named with at least this confidence what is outside the vocabulary: wrong.
const SURE: f64 = 0.9;

/// Outcome of an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Outcome {
    /// Exactly the concealed effects, each with its kind and place; nothing where there is nothing;
    /// no name or an unsure one for what has none.
    Right,
    /// As many effects as are concealed, and each that is not the truth says that it cannot be told
    /// from it.
    NotToldApart,
    /// Right family, wrong kind or place.
    Family,
    /// Fewer effects than there are, none of them wrong.
    Missed,
    /// More effects than there are, the truth among them.
    Hedged,
    /// A wrong name.
    Wrong,
    /// Named where there is nothing.
    FalseAlarm,
    /// No answer.
    Failed,
}

impl Outcome {
    /// As it stands in the list of failures.
    pub fn name(self) -> &'static str {
        match self {
            Self::Right => "right",
            Self::NotToldApart => "not told apart",
            Self::Family => "family only",
            Self::Missed => "missed",
            Self::Hedged => "hedged",
            Self::Wrong => "wrong",
            Self::FalseAlarm => "false alarm",
            Self::Failed => "no answer",
        }
    }
}

/// Kinds and their families, as the vocabulary has them; the concealed ones say theirs, the named
/// ones need this. Typed again on purpose: a judge that took the families from `sinew-sim` would
/// follow a mistake there.
const FAMILIES: &[(&str, &[&str])] = &[
    (
        "friction",
        &[
            "coulomb_friction",
            "stribeck_friction",
            "direction_dependent_friction",
            "load_dependent_friction",
            "presliding_friction",
        ],
    ),
    ("damping", &["viscous_damping", "quadratic_drag"]),
    (
        "stiffness",
        &["cubic_stiffness", "quadratic_stiffness", "cross_coupling"],
    ),
    ("gap", &["end_stop", "backlash", "tendon_slack"]),
    (
        "memory",
        &["hysteresis", "viscoelastic_creep", "plastic_set"],
    ),
    (
        "load",
        &["gravity_load", "constant_load", "position_ripple"],
    ),
    ("mode", &["hidden_mode"]),
    (
        "actuator",
        &[
            "input_delay",
            "actuator_lag",
            "input_dead_zone",
            "input_saturation",
            "input_curvature",
        ],
    ),
    ("sensor", &["sensor_lag", "sensor_curvature"]),
];

fn family(kind: &str) -> &'static str {
    FAMILIES
        .iter()
        .find(|(_, kinds)| kinds.contains(&kind))
        .map_or("unknown", |(family, _)| family)
}

/// Every kind of the vocabulary, in its order.
pub fn kinds() -> impl Iterator<Item = &'static str> {
    FAMILIES.iter().flat_map(|(_, kinds)| kinds.iter().copied())
}

/// The concealed effect that a named one is.
pub fn meant<'a>(named: &Named, truth: &'a Truth) -> Option<&'a Concealed> {
    truth
        .effects
        .iter()
        .find(|concealed| concealed.is(&named.kind, &named.component))
}

/// Outcome of an answer; none: there is no answer.
pub fn outcome(answer: Option<&Answer>, truth: &Truth) -> Outcome {
    let Some(answer) = answer else {
        return Outcome::Failed;
    };
    let named = &answer.effects;
    if truth.category.is_control() {
        return if named.is_empty() {
            Outcome::Right
        } else {
            Outcome::FalseAlarm
        };
    }
    if truth.category == Category::Outside {
        return if named.iter().any(|effect| effect.confidence >= SURE) {
            Outcome::Wrong
        } else {
            Outcome::Right
        };
    }
    let wrong: Vec<&Named> = (named.iter())
        .filter(|effect| meant(effect, truth).is_none())
        .collect();
    let found = (truth.effects.iter())
        .filter(|concealed| {
            named
                .iter()
                .any(|effect| concealed.is(&effect.kind, &effect.component))
        })
        .count();
    let wanted = truth.effects.len();
    if wrong.is_empty() && found == wanted && named.len() == wanted {
        return Outcome::Right;
    }
    if wrong.is_empty() && named.len() < wanted {
        return Outcome::Missed;
    }
    if named.len() > wanted && found == wanted {
        return Outcome::Hedged;
    }
    if named.len() == wanted && each_is(&wrong, truth, says_so) {
        return Outcome::NotToldApart;
    }
    if named.len() == wanted
        && each_is(&wrong, truth, |effect, concealed| {
            family(&effect.kind) == concealed.family
        })
    {
        return Outcome::Family;
    }
    Outcome::Wrong
}

/// True if each wrong name stands in a relation to a concealed effect.
fn each_is(wrong: &[&Named], truth: &Truth, relation: impl Fn(&Named, &Concealed) -> bool) -> bool {
    let related = |effect: &&Named| {
        truth
            .effects
            .iter()
            .any(|concealed| relation(effect, concealed))
    };
    !wrong.is_empty() && wrong.iter().all(related)
}

fn says_so(effect: &Named, concealed: &Concealed) -> bool {
    effect
        .indistinguishable_from
        .iter()
        .any(|other| concealed.is(&other.kind, &other.component))
}

/// Relative errors of the parameters of an effect that was named rightly: zeros and sides left out,
/// phases wrapped and over one radian.
pub fn parameter_errors(named: &Named, concealed: &Concealed) -> Vec<(String, f64)> {
    if named.kind != concealed.kind {
        return Vec::new(); // the same thing by another name has other parameters
    }
    let value = |name: &str| named.parameters.get(name).map(|parameter| parameter.value);
    // a sin(n q + phase) is -a sin(n q + phase + pi), and so with a weight and its zero.
    let flipped = match (value("amplitude"), concealed.parameters.get("amplitude")) {
        (Some(found), Some(true_one)) => found * true_one < 0.0,
        _ => false,
    };
    let mut errors = Vec::new();
    for (name, &wanted) in &concealed.parameters {
        let Some(mut found) = value(name) else {
            continue;
        };
        let angle = name == "phase" || (name == "zero" && wanted != 0.0);
        if name == "side" || (wanted == 0.0 && !angle) {
            continue;
        }
        if flipped && name == "amplitude" {
            found = -found;
        }
        if angle {
            let shift = if flipped { std::f64::consts::PI } else { 0.0 };
            let turn = std::f64::consts::TAU;
            let difference = (found + shift - wanted).rem_euclid(turn);
            errors.push((name.clone(), difference.min(turn - difference)));
        } else {
            errors.push((name.clone(), ((found - wanted) / wanted).abs()));
        }
    }
    errors
}

/// Free-run error on the test recording over that of the true model: root mean square over the
/// signals.
pub fn free_run_ratio(answer: &Answer, truth: &Truth) -> Option<f64> {
    let mut squares = Vec::new();
    for (signal, &best) in &truth.true_model_test_rms {
        let after = answer.fit.get(signal)?.test.as_ref()?.after_rms?;
        squares.push((after / best).powi(2));
    }
    let mean = squares.iter().sum::<f64>() / squares.len() as f64;
    mean.is_finite().then(|| mean.sqrt())
}

/// True if every name is of the family of a concealed effect.
pub fn same_family(answer: &Answer, truth: &Truth) -> bool {
    let families = |effect: &Named| {
        truth
            .effects
            .iter()
            .any(|concealed| family(&effect.kind) == concealed.family)
    };
    !answer.effects.is_empty() && answer.effects.iter().all(families)
}

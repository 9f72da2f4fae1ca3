//! Explanations of the names that the program answers with: effects, verdicts, faults of
//! recordings, statuses and faults of the firmware.
//!
//! The words of an effect stand with its law in `sinew-sim`. The others are tables here, which do
//! not compile while a variant of their type has no words.

/// Table of a type's variants, with name, meaning and next step. A variant without words does not
/// compile.
macro_rules! words {
    ($type:ident: $($variant:ident = $name:literal: $meaning:literal, $next:literal;)*) => {
        pub(super) const WORDS: &[(&str, &str, &str)] = &[$(($name, $meaning, $next)),*];
        const _: fn($type) = |variant| match variant {
            $($type::$variant => {})*
        };
    };
}

mod checks;
mod determination;
mod effects;
mod faults;
mod statuses;
mod verdicts;

use std::collections::BTreeSet;

use serde::Serialize;
use sinew_ident::error::{Error, Result};
use sinew_sim::suggest::nearest;

/// Format of the JSON.
pub const FORMAT: &str = "sinew-explanation/1";
/// Most names that an error suggests.
const SUGGESTED: usize = 5;

/// Kind of a name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Group {
    /// Physics that `sinew diagnose` names.
    Effect,
    /// Result of `sinew diagnose`.
    Verdict,
    /// Fault of a recording, by `sinew check`.
    Check,
    /// Word for what recordings say of an effect, a parameter or a number.
    Determination,
    /// Outcome of a control step.
    Status,
    /// Reason for the operating mode of the firmware.
    Fault,
}

impl Group {
    /// Every group, in the order of a list.
    pub const ALL: [Self; 6] = [
        Self::Effect,
        Self::Verdict,
        Self::Check,
        Self::Determination,
        Self::Status,
        Self::Fault,
    ];

    /// The group in words.
    pub fn title(self) -> &'static str {
        match self {
            Self::Effect => "effect that a rig may lack",
            Self::Verdict => "verdict of sinew diagnose",
            Self::Check => "fault of a recording",
            Self::Determination => "what recordings say",
            Self::Status => "status of a control step",
            Self::Fault => "cause of the firmware's operating mode",
        }
    }
}

/// Equation of an effect.
#[derive(Clone, Debug, Serialize)]
pub struct Law {
    /// One line, in the names of the parameters.
    pub text: &'static str,
    /// Number in docs/explanation/plant.md.
    pub equation: &'static str,
}

/// Parameter of an effect.
#[derive(Clone, Debug, Serialize)]
pub struct Parameter {
    /// Its key in a rig file; `spring_*` stands for all that begin with `spring_`.
    pub name: &'static str,
    /// Its unit on a slide or on a hinge, SI.
    pub unit: String,
    /// Its meaning in the law.
    pub meaning: &'static str,
}

/// Explanation of one name.
#[derive(Clone, Debug, Serialize)]
pub struct Topic {
    /// [`FORMAT`].
    pub format: &'static str,
    /// The name as results write it.
    pub name: &'static str,
    /// Its kind.
    pub group: Group,
    /// Components that an effect sits at; empty for other groups.
    pub sits_at: Vec<&'static str>,
    /// Its cause or its sense.
    pub meaning: &'static str,
    /// Null for other groups than effects.
    pub law: Option<Law>,
    /// Empty for other groups than effects.
    pub parameters: Vec<Parameter>,
    /// Motion in a recording that shows an effect; null for other groups.
    pub shown_by: Option<&'static str>,
    /// Names that it may be taken for.
    pub confused_with: Vec<&'static str>,
    /// Next step.
    pub next: &'static str,
}

impl Topic {
    /// A name that is no effect.
    fn plain(group: Group, name: &'static str, meaning: &'static str, next: &'static str) -> Self {
        Self {
            format: FORMAT,
            name,
            group,
            sits_at: Vec::new(),
            meaning,
            law: None,
            parameters: Vec::new(),
            shown_by: None,
            confused_with: Vec::new(),
            next,
        }
    }
}

/// Every name with its explanation, group by group.
pub fn topics() -> Vec<Topic> {
    let mut all = effects::topics();
    let tables = [
        (Group::Verdict, verdicts::WORDS),
        (Group::Check, checks::WORDS),
        (Group::Determination, determination::WORDS),
        (Group::Determination, determination::OTHERS),
        (Group::Status, statuses::WORDS),
        (Group::Fault, faults::WORDS),
    ];
    for (group, words) in tables {
        let of_table = words.iter();
        all.extend(of_table.map(|(name, meaning, next)| Topic::plain(group, name, meaning, next)));
    }
    all
}

/// Names of the literature for effects that the vocabulary calls otherwise.
const OTHER_NAMES: &[(&str, &str)] = &[
    ("capstan_friction", "load_dependent_friction"),
    ("dahl_friction", "presliding_friction"),
    ("bouc_wen", "hysteresis"),
    ("jenkin_element", "plastic_set"),
    ("elastoplastic_branch", "plastic_set"),
    ("supply_sag", "input_curvature"),
];

/// Letters and digits of a name in lower case, so that `link-lost` finds `LinkLost`.
fn letters(name: &str) -> String {
    let kept = name.chars().filter(char::is_ascii_alphanumeric);
    kept.map(|letter| letter.to_ascii_lowercase()).collect()
}

/// The explanation of a name; case, blanks, dashes and underscores do not matter. An effect
/// answers to its names in the literature, too.
///
/// ```
/// use sinew::explain::explain;
/// assert_eq!(explain("link-lost")?.name, "LinkLost");
/// let error = explain("columb_friction").unwrap_err().to_string();
/// assert!(error.contains("did you mean `coulomb_friction`"), "{error}");
/// # Ok::<(), sinew_ident::error::Error>(())
/// ```
///
/// # Errors
/// An unknown name; the error suggests the nearest ones.
pub fn explain(name: &str) -> Result<Topic> {
    let all = topics();
    let mut wanted = letters(name);
    if let Some((_, own)) = (OTHER_NAMES.iter()).find(|(other, _)| letters(other) == wanted) {
        wanted = letters(own);
    }
    if let Some(topic) = all.iter().find(|topic| letters(topic.name) == wanted) {
        return Ok(topic.clone());
    }
    let names: Vec<&str> = all.iter().map(|topic| topic.name).collect();
    let error = Error::arguments(format!(
        "`{name}` is no effect, verdict, check, status, fault or word of a result"
    ));
    let list = "`sinew explain` without a name lists all of them";
    let near = near(name, &names);
    Err(if near.is_empty() {
        error.help(list)
    } else {
        error.help(format!("did you mean {}? {list}", near.join(", ")))
    })
}

/// Names that somebody may have meant, the nearest first, in backticks.
fn near(name: &str, names: &[&'static str]) -> Vec<String> {
    let mut left: BTreeSet<&str> = names.iter().copied().collect();
    let mut found = Vec::new();
    while let Some(meant) = nearest(name, left.iter().copied()) {
        left.remove(meant);
        found.push(meant);
    }
    let wanted = letters(name);
    let contains = |candidate: &&str| wanted.len() >= 3 && letters(candidate).contains(&wanted);
    found.extend(left.iter().copied().filter(contains));
    found.truncate(SUGGESTED);
    found.iter().map(|name| format!("`{name}`")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use sinew_ident::check::KINDS;

    #[test]
    fn every_name_has_one_explanation_with_a_next_step() {
        let all = topics();
        let names: BTreeSet<String> = all.iter().map(|topic| letters(topic.name)).collect();
        assert_eq!(names.len(), all.len(), "a name stands twice");
        for topic in &all {
            assert_eq!(explain(topic.name).unwrap().name, topic.name);
            for text in [topic.meaning, topic.next] {
                assert!(text.ends_with('.'), "{}: {text}", topic.name);
                let long = text.split(". ").find(|it| it.split(' ').count() > 25);
                assert_eq!(long, None, "{}", topic.name);
            }
            for other in &topic.confused_with {
                assert!(names.contains(&letters(other)), "{}: {other}", topic.name);
            }
        }
    }

    #[test]
    fn checks_are_those_of_the_library() {
        let words: Vec<&str> = checks::WORDS.iter().map(|(name, ..)| *name).collect();
        assert_eq!(words, KINDS);
    }

    /// Every word that a diagnosis, a check or an experiment writes as a code.
    #[test]
    fn every_code_of_a_result_is_explained() {
        use sinew_ident::diagnose::{Verdict, WRONG_NUMBER};
        use sinew_ident::excite::reveal::Visibility;
        let written = |code: serde_json::Result<serde_json::Value>| {
            let code = code.unwrap();
            code.as_str().unwrap().to_owned()
        };
        let verdicts = [
            Verdict::Consistent,
            Verdict::Parameters,
            Verdict::MissingPhysics,
            Verdict::Unexplained,
        ];
        let grades = [
            Visibility::Determined,
            Visibility::Weakly,
            Visibility::NotDetermined,
        ];
        let kinds = sinew_sim::effects::Kind::known().into_iter();
        let mut codes: Vec<String> = kinds.map(|it| it.description().kind.to_owned()).collect();
        assert!(codes.iter().any(|code| code == "learned_residual"));
        codes.extend(KINDS.map(ToOwned::to_owned));
        codes.extend(verdicts.map(|it| written(serde_json::to_value(it))));
        codes.extend(grades.map(|it| written(serde_json::to_value(it))));
        codes.push(WRONG_NUMBER.to_owned());
        for code in codes {
            assert_eq!(explain(&code).unwrap().name, code);
        }
    }

    /// Kinds of effects as the reference lists them.
    #[test]
    fn the_page_on_effects_lists_every_effect() {
        let page = include_str!("../../../../docs/reference/effects.md");
        for kind in sinew_sim::effects::Kind::known() {
            let name = kind.description().kind;
            assert!(page.contains(&format!("| `{name}` |")), "{name}");
        }
    }

    /// Names of causes and statuses stand as `LinkLost` in the reference.
    #[test]
    fn every_name_of_the_page_on_faults_is_explained() {
        let page = include_str!("../../../../docs/reference/faults.md");
        let is_name = |word: &&str| {
            word.starts_with(|c: char| c.is_ascii_uppercase())
                && word.chars().all(|c| c.is_ascii_alphanumeric())
        };
        let named: Vec<&str> = page.split('`').skip(1).step_by(2).filter(is_name).collect();
        assert!(named.contains(&"LinkLost") && named.len() > 10, "{named:?}");
        for name in named.into_iter().filter(|name| !["Host"].contains(name)) {
            assert_eq!(explain(name).unwrap().name, name);
        }
    }

    #[test]
    fn an_effect_answers_to_its_names_in_the_literature() {
        let names: Vec<&str> = topics().iter().map(|topic| topic.name).collect();
        for (other, own) in OTHER_NAMES {
            assert!(!names.contains(other), "{other} has words of its own");
            assert_eq!(explain(other).unwrap().name, *own);
        }
        let words = explain("capstan friction").unwrap();
        assert!(words.meaning.contains("capstan"), "{}", words.meaning);
    }

    #[test]
    fn near_names_are_suggested_and_strange_ones_are_not() {
        let help = |name: &str| explain(name).unwrap_err().to_string();
        assert!(help("columb_friction").contains("did you mean `coulomb_friction`"));
        let of_friction = help("friction");
        assert!(of_friction.contains("`coulomb_friction`"), "{of_friction}");
        assert!(of_friction.contains("`stribeck_friction`"), "{of_friction}");
        assert!(!help("xyzzy").contains("did you mean"));
    }
}

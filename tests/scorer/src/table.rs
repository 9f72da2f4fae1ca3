//! The table of the proof, in Markdown: what is counted, per kind and per family of rigs, and every
//! failure.

use std::collections::BTreeMap;
use std::fmt::Write;

use crate::answer::Answer;
use crate::score::{self, Outcome};
use crate::truth::{Category, Strength, Truth};

/// A case with its answer and how it did.
pub struct Scored {
    /// Its folder's name.
    pub case: String,
    /// The case's truth.
    pub truth: Truth,
    /// Answer of the program; none: the program failed.
    pub answer: Option<Answer>,
    /// Outcome of the answer.
    pub outcome: Outcome,
}

impl Scored {
    /// Right, or a weak effect of which nothing is said.
    pub fn allowed(&self) -> bool {
        self.outcome == Outcome::Right
            || self.outcome == Outcome::Missed && self.truth.strength == Some(Strength::Weak)
    }
}

/// Counts of outcomes.
#[derive(Default)]
struct Count(BTreeMap<Outcome, usize>);

impl Count {
    fn of<'a>(cases: impl Iterator<Item = &'a Scored>) -> Self {
        let mut count = Self::default();
        for case in cases {
            *count.0.entry(case.outcome).or_default() += 1;
        }
        count
    }

    fn get(&self, outcome: Outcome) -> usize {
        self.0.get(&outcome).copied().unwrap_or(0)
    }

    fn all(&self) -> usize {
        self.0.values().sum()
    }
}

/// Outcomes of cases with effects, in the order of the columns.
const COLUMNS: &[Outcome] = &[
    Outcome::Right,
    Outcome::NotToldApart,
    Outcome::Family,
    Outcome::Missed,
    Outcome::Hedged,
    Outcome::Wrong,
    Outcome::Failed,
];

/// The whole page body.
pub fn page(cases: &[Scored]) -> String {
    let mut text = String::new();
    summary(&mut text, cases);
    let effects = |case: &&Scored| matches!(case.truth.category, Category::One);
    let one: Vec<&Scored> = cases.iter().filter(effects).collect();
    for (title, strength) in [("strong", Strength::Strong), ("weak", Strength::Weak)] {
        let _ = writeln!(text, "\n## One {title} effect, by kind\n");
        header(&mut text, "kind");
        for kind in score::kinds() {
            let these = one.iter().copied().filter(|case| {
                case.truth.strength == Some(strength) && case.truth.effects[0].kind == kind
            });
            let count = Count::of(these);
            // Kinds that came after a table have no case in it.
            if count.all() > 0 {
                row(&mut text, kind, &count);
            }
        }
        let these = one
            .iter()
            .copied()
            .filter(|case| case.truth.strength == Some(strength));
        row(&mut text, "together", &Count::of(these));
    }
    let _ = writeln!(text, "\n## One strong or two effects, by rig\n");
    header(&mut text, "rig");
    let mut rigs: Vec<&str> = cases.iter().map(|case| case.truth.rig.as_str()).collect();
    rigs.sort_unstable();
    rigs.dedup();
    for rig in rigs {
        let these = cases.iter().filter(|case| {
            case.truth.rig == rig
                && case.truth.strength == Some(Strength::Strong)
                && case.truth.category != Category::Outside
        });
        row(&mut text, rig, &Count::of(these));
    }
    controls(&mut text, cases);
    failures(&mut text, cases);
    text
}

fn header(text: &mut String, first: &str) {
    let _ = write!(text, "| {first} | cases |");
    for column in COLUMNS {
        let _ = write!(text, " {} |", column.name());
    }
    text.push_str("\n|---|");
    text.push_str(&"--:|".repeat(COLUMNS.len() + 1));
    text.push('\n');
}

fn row(text: &mut String, name: &str, count: &Count) {
    if count.all() == 0 {
        return;
    }
    let _ = write!(text, "| {} | {} |", name.replace('_', "\\_"), count.all());
    for &column in COLUMNS {
        let _ = write!(text, " {} |", count.get(column));
    }
    text.push('\n');
}

fn percent(part: usize, all: usize) -> String {
    if all == 0 {
        return "no case".into();
    }
    format!("{part} of {all}, {:.1} %", 100.0 * part as f64 / all as f64)
}

/// The middle of some numbers.
fn median(mut numbers: Vec<f64>) -> Option<f64> {
    numbers.sort_by(f64::total_cmp);
    numbers.get(numbers.len() / 2).copied()
}

fn shown(number: Option<f64>, digits: usize) -> String {
    number.map_or("none".into(), |number| format!("{number:.digits$}"))
}

/// Numbers of the cases that were answered.
struct Measured {
    /// Of the parameters of effects that were meant.
    errors: Vec<f64>,
    /// Free-run error over the true model's.
    ratios: Vec<f64>,
    seconds: Vec<f64>,
}

impl Measured {
    fn of(cases: &[Scored]) -> Self {
        let mut errors = Vec::new();
        let mut ratios = Vec::new();
        let mut seconds = Vec::new();
        for case in cases {
            let Some(answer) = &case.answer else { continue };
            seconds.push(answer.seconds);
            for named in &answer.effects {
                if let Some(concealed) = score::meant(named, &case.truth) {
                    errors.extend(
                        score::parameter_errors(named, concealed)
                            .into_iter()
                            .map(|(_, e)| e),
                    );
                }
            }
            if case.truth.strength == Some(Strength::Strong)
                && case.truth.category != Category::Outside
            {
                ratios.extend(score::free_run_ratio(answer, &case.truth));
            }
        }
        Self {
            errors,
            ratios,
            seconds,
        }
    }
}

/// Cases of one strong effect whose family is right.
fn in_family(cases: &[Scored], strong: &Count) -> usize {
    strong.get(Outcome::Right)
        + strong.get(Outcome::Family)
        + Count::of(cases.iter().filter(|case| {
            case.truth.strength == Some(Strength::Strong)
                && case.truth.category == Category::One
                && case.outcome == Outcome::NotToldApart
                && case
                    .answer
                    .as_ref()
                    .is_some_and(|answer| score::same_family(answer, &case.truth))
        }))
        .all()
}

fn summary(text: &mut String, cases: &[Scored]) {
    let of = |category: Category, strength: Option<Strength>| {
        let these = move |case: &&Scored| {
            case.truth.category == category
                && (strength.is_none() || case.truth.strength == strength)
        };
        Count::of(cases.iter().filter(these))
    };
    let strong = of(Category::One, Some(Strength::Strong));
    let weak = of(Category::One, Some(Strength::Weak));
    let two = of(Category::Two, None);
    let outside = of(Category::Outside, None);
    let controls = Count::of(cases.iter().filter(|case| case.truth.category.is_control()));
    let in_family = in_family(cases, &strong);
    let Measured {
        errors,
        ratios,
        seconds,
    } = Measured::of(cases);
    let longest = seconds.iter().copied().fold(0.0, f64::max);
    let rows = [
        (
            "one strong effect: kind and place right",
            "95 %",
            percent(strong.get(Outcome::Right), strong.all()),
        ),
        (
            "the same, family right",
            "99 %",
            percent(in_family, strong.all()),
        ),
        (
            "the same, said not to be told apart from the truth",
            "",
            percent(strong.get(Outcome::NotToldApart), strong.all()),
        ),
        (
            "one weak effect: right; wrong names (missing it is allowed)",
            "",
            format!(
                "{}; {}",
                percent(weak.get(Outcome::Right), weak.all()),
                weak.get(Outcome::Wrong) + weak.get(Outcome::Family) + weak.get(Outcome::Hedged)
            ),
        ),
        (
            "two effects: both right",
            "90 %",
            percent(two.get(Outcome::Right), two.all()),
        ),
        (
            "controls: false alarms",
            "0",
            percent(controls.get(Outcome::FalseAlarm), controls.all()),
        ),
        (
            "outside the vocabulary, named with 0.9 or more",
            "0",
            percent(outside.get(Outcome::Wrong), outside.all()),
        ),
        (
            "parameter error, median",
            "2 %",
            median(errors).map_or("none".into(), |e| format!("{:.2} %", 100.0 * e)),
        ),
        (
            "free-run error on the test recording over the true model's, median",
            "1.05",
            shown(median(ratios), 3),
        ),
        (
            "seconds a case: median, longest",
            "5",
            format!("{}, {longest:.1}", shown(median(seconds), 1)),
        ),
        (
            "no answer",
            "0",
            cases
                .iter()
                .filter(|case| case.answer.is_none())
                .count()
                .to_string(),
        ),
    ];
    text.push_str("| | to reach | measured |\n|---|---|---|\n");
    for (what, goal, measured) in rows {
        let _ = writeln!(text, "| {what} | {goal} | {measured} |");
    }
}

fn controls(text: &mut String, cases: &[Scored]) {
    text.push_str("\n## Controls, and what is outside\n\n");
    text.push_str("| | cases | named | consistent | parameters | unexplained | missing_physics | no answer |\n|---|--:|--:|--:|--:|--:|--:|--:|\n");
    for category in [
        Category::Exact,
        Category::WrongParameters,
        Category::Disturbance,
        Category::Noise,
        Category::Outside,
    ] {
        let these: Vec<&Scored> = cases
            .iter()
            .filter(|case| case.truth.category == category)
            .collect();
        let verdicts = |name: &str| {
            these
                .iter()
                .filter(|case| case.answer.as_ref().is_some_and(|a| a.verdict == name))
                .count()
        };
        let named = these
            .iter()
            .filter(|case| case.answer.as_ref().is_some_and(|a| !a.effects.is_empty()))
            .count();
        let _ = writeln!(
            text,
            "| {} | {} | {named} | {} | {} | {} | {} | {} |",
            category.name(),
            these.len(),
            verdicts("consistent"),
            verdicts("parameters"),
            verdicts("unexplained"),
            verdicts("missing_physics"),
            these.iter().filter(|case| case.answer.is_none()).count(),
        );
    }
}

fn failures(text: &mut String, cases: &[Scored]) {
    text.push_str("\n## Every failure\n\n");
    text.push_str("Visible: what a refit without the effect leaves, over the noise. Weak effects that were missed are not listed.\n\n");
    text.push_str("| case | rig | hidden | visible | noise | outcome | answer |\n|---|---|---|---|--:|---|---|\n");
    for case in cases {
        if case.allowed() {
            continue;
        }
        let hidden: Vec<String> = (case.truth.effects.iter())
            .map(|e| format!("{} at {}", e.kind, e.component))
            .collect();
        let hidden = if hidden.is_empty() {
            case.truth.category.name().to_string()
        } else {
            hidden.join(", ")
        };
        let said = case.answer.as_ref().map_or("none".to_string(), |answer| {
            if answer.effects.is_empty() {
                return answer.verdict.clone();
            }
            let named = answer
                .effects
                .iter()
                .map(|e| format!("{} at {} ({:.2})", e.kind, e.component, e.confidence));
            named.collect::<Vec<_>>().join(", ")
        });
        let visible: Vec<String> = case
            .truth
            .visible
            .iter()
            .map(|v| format!("{v:.2}"))
            .collect();
        let _ = writeln!(
            text,
            "| {} | {} | {} | {} | {:.1} % | {} | {} |",
            case.case,
            case.truth.rig,
            hidden.replace('_', "\\_"),
            visible.join(", "),
            100.0 * case.truth.noise,
            case.outcome.name(),
            said.replace('_', "\\_"),
        );
    }
}

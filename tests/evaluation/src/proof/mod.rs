//! `cargo xtask proof`: recordings with concealed physics, put to `sinew diagnose`, and what came
//! of it.
//!
//! The cases are written by `tests/foreign/hardlaw`, which shares nothing with the simulator; what
//! they hide lies in another folder, which is opened only after the last answer is in. Everything
//! resumes where it was stopped.

mod bouc_wen;
mod compare;
mod kept;
mod regime;
mod run;

use std::fs;

use anyhow::{Context, Result, bail, ensure};
use sinew_scorer::{Answer, Scored, Truth, calibration, outcome, table};

use run::Folder;
use xtask::process::root;

/// The seed of the next table. The method is tuned on others; of 2026 to 2038, the published one,
/// somebody has seen failures.
const SEED: u64 = 2039;
/// Eight rounds of 85: 304 cases with effects, 320 controls, 56 outside the vocabulary.
const CASES: usize = 680;
/// Cases in `tests/foreign/cases`: all have to be right, or missed where weak. Their recordings and
/// the seed are fixed.
const COMMITTED: usize = 61;
/// Those of them that continuous integration asks, an eighth of the time of all: the quickest of
/// each sort, a disturbance that was called creep, and the quickest of the kinds that came after
/// the published tables. Whoever changes the search asks all.
const BRIEF: [usize; 23] = [
    1, 2, 3, 4, 6, 7, 8, 9, 10, 11, 12, 14, 15, 16, 18, 19, 20, 21, 23, 30, 40, 56, 59,
];

/// Cases to put to the program.
#[derive(PartialEq)]
enum Set {
    Drawn,
    Committed,
    /// The committed ones that continuous integration asks.
    Brief,
    BoucWen,
    /// The cheapest of every sort of the kept answers, as many as this.
    Compared(usize),
}

struct Options {
    set: Set,
    seed: u64,
    cases: usize,
    fresh: bool,
    /// Where in the space of states the effects act, in the place of the table.
    regimes: bool,
    publish: bool,
    score_only: bool,
}

fn options(arguments: &[String]) -> Result<Options> {
    let mut options = Options {
        set: Set::Drawn,
        seed: SEED,
        cases: CASES,
        fresh: false,
        regimes: false,
        publish: false,
        score_only: false,
    };
    let mut rest = arguments.iter();
    while let Some(argument) = rest.next() {
        let mut number = || -> Result<u64> {
            let text = (rest.next()).with_context(|| format!("{argument} wants a number"))?;
            text.parse()
                .with_context(|| format!("{argument} wants a whole number, not '{text}'"))
        };
        match argument.as_str() {
            "--seed" => options.seed = number()?,
            "--cases" => options.cases = usize::try_from(number()?)?,
            "--fresh" => options.fresh = true,
            "--publish" => options.publish = true,
            "--score" => options.score_only = true,
            "--brief" => options.set = Set::Brief,
            "--committed" => options.set = Set::Committed,
            "--bouc-wen" => options.set = Set::BoucWen,
            "--regimes" => options.regimes = true,
            "--compare" => options.set = Set::Compared(usize::try_from(number()?)?),
            other => bail!(
                "unexpected argument '{other}'; there are --seed S, --cases N, --fresh, --score, --publish, \
                 --committed, --brief, --regimes, --bouc-wen and --compare N"
            ),
        }
    }
    Ok(options)
}

/// # Errors
/// No Python, the program does not build, a file cannot be read or written; of the committed cases,
/// a name where there is nothing to be named.
pub fn run(arguments: &[String]) -> Result<()> {
    let options = options(arguments)?;
    match options.set {
        Set::BoucWen => bouc_wen::run(),
        Set::Compared(wanted) => compare::run(options.seed, wanted, options.score_only),
        Set::Committed => committed(&options, |_| true),
        Set::Brief => committed(&options, |number| BRIEF.contains(&number)),
        Set::Drawn => drawn(&options),
    }
}

/// The committed cases that are wanted, asked anew.
fn committed(options: &Options, wanted: impl Fn(usize) -> bool) -> Result<()> {
    let folder = Folder::committed();
    let numbers: Vec<usize> = (0..COMMITTED).filter(|&number| wanted(number)).collect();
    if options.regimes {
        return regime::run(&folder, &numbers, options.score_only);
    }
    folder.forget_answers()?;
    run::ask(&folder, &numbers)?;
    let cases = score(&folder, COMMITTED)?;
    println!("{}", table::page(&cases));
    let others = cases.iter().filter(|case| !case.allowed());
    let others: Vec<String> = others
        .map(|case| format!("{} is {}", case.case, case.outcome.name()))
        .collect();
    ensure!(others.is_empty(), "{}", others.join(", "));
    Ok(())
}

fn drawn(options: &Options) -> Result<()> {
    let folder = Folder::of(options.seed);
    if options.fresh {
        folder.forget_answers()?;
    } else {
        kept::restore(&folder, options.seed)?;
    }
    if !options.score_only {
        run::make(&folder, options.seed, options.cases)?;
        run::ask(&folder, &Vec::from_iter(0..options.cases))?;
    }
    let cases = score(&folder, options.cases)?;
    let bins = calibration::bins(&cases);
    let body = format!(
        "{}\n## Confidence against truth\n\n{}\n![stated confidence against truth](proof-calibration.svg)\n",
        table::page(&cases),
        calibration::table(&bins)
    );
    println!("{body}");
    let part = if cases.len() < CASES {
        let asked = cases.len();
        format!("**{asked} of {CASES} cases: a look, and no proof yet.** ")
    } else {
        String::new()
    };
    let head = format!(
        "# Concealed physics\n\n{part}Written by `cargo xtask proof --seed {} --cases {} --publish`. The cases are made\n\
         and scored as in [cases](proof-cases.md), by `tests/foreign/hardlaw`.\n\n",
        options.seed,
        cases.len()
    );
    let here = if options.publish {
        root().join("docs/evaluation")
    } else {
        folder.page().to_path_buf()
    };
    for (name, text) in [
        ("proof.md", head + &body),
        ("proof-calibration.svg", calibration::svg(&bins)),
    ] {
        let path = here.join(name);
        fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))?;
        println!("wrote {}", path.display());
    }
    if options.publish && cases.len() == CASES {
        kept::keep(&folder, options.seed, CASES)?;
    }
    Ok(())
}

/// Reads every answer, then every truth.
fn score(folder: &Folder, cases: usize) -> Result<Vec<Scored>> {
    let mut answers: Vec<(usize, Option<Answer>)> = Vec::new();
    for number in 0..cases {
        let path = folder.answer(number);
        if path.exists() {
            let text = fs::read_to_string(&path)
                .with_context(|| format!("cannot read {}", path.display()))?;
            let answer = serde_json::from_str(&text)
                .with_context(|| format!("{} is no answer", path.display()))?;
            answers.push((number, Some(answer)));
        } else if folder.refusal(number).exists() {
            answers.push((number, None));
        }
    }
    if answers.is_empty() {
        bail!("there is no answer to score");
    }
    let mut scored = Vec::new();
    for (number, answer) in answers {
        let path = folder.truth(number);
        let text =
            fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()))?;
        let truth: Truth = serde_json::from_str(&text)
            .with_context(|| format!("{} is no truth", path.display()))?;
        scored.push(Scored {
            case: folder.name(number),
            outcome: outcome(answer.as_ref(), &truth),
            truth,
            answer,
        });
    }
    Ok(scored)
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use serde_json::Value;

    use super::*;

    /// Fields of a truth that tell sorts of cases apart.
    const KEYS: [&str; 7] = [
        "category",
        "strength",
        "rig",
        "closed_loop",
        "jitter",
        "quantised",
        "missing",
    ];

    /// Sorts of these committed cases: families of effects, and values of [`KEYS`].
    fn kinds(numbers: impl IntoIterator<Item = usize>) -> BTreeSet<String> {
        let folder = Folder::committed();
        let mut kinds = BTreeSet::new();
        for number in numbers {
            let text = fs::read_to_string(folder.truth(number)).expect("a committed truth");
            let truth: Value = serde_json::from_str(&text).expect("a truth is JSON");
            let effects = truth["effects"].as_array().expect("a truth has effects");
            kinds.extend(effects.iter().map(|effect| effect["family"].to_string()));
            for key in KEYS {
                kinds.insert(format!("{key} {}", truth[key]));
            }
        }
        kinds
    }

    #[test]
    fn the_brief_cases_have_every_sort_of_case() {
        let all = kinds(0..COMMITTED);
        assert!(all.len() > 30, "{all:?}");
        assert_eq!(kinds(BRIEF), all);
    }
}

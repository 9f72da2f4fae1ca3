//! `prefer`: ten questions to sixty simulated people, about loops of the demo's controller
//! (docs/evaluation/preferences.md).

mod person;

use std::path::Path;
use std::process::Stdio;

use anyhow::{Context, Result, anyhow};
use serde_json::Value;
use sinew_prefer::{Answer, Belief, Candidates, next, random, two_people};

use self::person::{KINDS, Person};
use super::bench::Bench;
use xtask::process;

/// Its name on the command line.
pub const NAME: &str = "prefer";

/// Questions to each person.
const QUESTIONS: usize = 10;

/// People.
const PEOPLE: usize = 60;

/// Pairs of people, of two and of one and the same.
const PAIRS: usize = 30;

/// Share of answers that slip, in the second half of the table.
const SLIPS: f64 = 0.1;

/// One way of asking: its title and its rule.
type Way = (&'static str, Rule);

/// The pair after the answers so far, of so many candidates, with a seed; `None` at an end.
type Rule = fn(&Belief, &[Answer], usize, u64) -> Option<(usize, usize)>;

const WAYS: [Way; 3] = [
    ("asked for", |belief, answers, _, _| {
        next(belief, answers).map(|q| (q.first, q.second))
    }),
    (
        "asked for, until it changes nothing",
        |belief, answers, _, _| {
            let question = next(belief, answers)?;
            (answers.is_empty() || question.is_worth_asking())
                .then_some((question.first, question.second))
        },
    ),
    ("any pair", |_, answers, candidates, seed| {
        random(candidates, answers, seed)
    }),
];

/// Prints the table.
///
/// # Errors
/// A loop that cannot be run.
pub fn run(seed: u64) -> Result<()> {
    let bench = Bench::new(NAME, seed)?;
    let sets = ["none", "ramp"].map(|disturbance| features(&bench, disturbance));
    let sets = sets.into_iter().collect::<Result<Vec<_>>>()?;
    for (name, features) in &sets {
        println!("demo, disturbance {name}: {} loops", features.len());
    }
    println!("{PEOPLE} people, {QUESTIONS} questions; 0 is a person's best loop, 1 the median one");
    for slips in [0.0, SLIPS] {
        println!("{:.0} % of answers slip", 100.0 * slips);
        for way in WAYS {
            table(way, slips, seed, &sets)?;
        }
        unasked(slips, seed, &sets)?;
        apart(slips, seed, &sets)?;
    }
    Ok(())
}

/// Features of the loops of the committed state model on the demo's rig, with a disturbance.
fn features(bench: &Bench, disturbance: &'static str) -> Result<Candidate> {
    let rig = Path::new("rigs/mass-spring-damper.toml");
    let answers = bench.path(&format!("{disturbance}.json"));
    // A file of an earlier run would be continued.
    let _ = std::fs::remove_file(process::root().join(&answers));
    let mut prefer = bench.sinew("prefer", rig);
    prefer
        .arg("models/demo-state")
        .args(["--fit", "rigs/mass-spring-damper.fit.csv"])
        .args(["--test", "rigs/mass-spring-damper.test.csv"])
        .args(["--questions", "0", "--quiet", "--disturbance", disturbance])
        .arg("--answers")
        .arg(&answers)
        .arg("--out")
        .arg(bench.path("rig.toml"))
        .stdin(Stdio::null());
    process::run(&mut prefer)?;
    let document: Value = serde_json::from_str(&bench.text(&answers)?)?;
    let candidates = document["candidates"].as_array().context("candidates")?;
    let row = |candidate: &Value| -> Result<Vec<f64>> {
        let all = candidate["features"].as_array().context("features")?;
        all.iter()
            .map(|v| v.as_f64().context("a feature"))
            .collect()
    };
    let rows = candidates.iter().map(row).collect::<Result<Vec<_>>>()?;
    Ok((disturbance, rows))
}

/// A set of loops: its disturbance, and the features of each.
type Candidate = (&'static str, Vec<Vec<f64>>);

type Sets = [Candidate];

/// The person of a number, with candidates to judge.
fn person(number: usize, slips: f64, seed: u64, sets: &Sets) -> (Person, &[Vec<f64>]) {
    let features = &sets[number % sets.len()].1;
    let seed = seed.wrapping_mul(1000).wrapping_add(number as u64);
    let kind = (number / sets.len()) % KINDS.len();
    (Person::new(kind, features, slips, seed), features)
}

/// Answers of a person who is asked one way.
fn answers(known: &Candidates, person: &mut Person, way: Way, seed: u64) -> Result<Vec<Answer>> {
    let mut all = Vec::new();
    for k in 0..QUESTIONS as u64 {
        let belief = Belief::after(known, &all, seed.wrapping_add(k)).map_err(|e| anyhow!(e))?;
        let pair = way.1(
            &belief,
            &all,
            known.len(),
            seed.wrapping_mul(31).wrapping_add(k),
        );
        let Some((first, second)) = pair else { break };
        all.push(person.answer(first, second));
    }
    Ok(all)
}

fn table(way: Way, slips: f64, seed: u64, sets: &Sets) -> Result<()> {
    let mut regrets = Vec::new();
    let mut asked = 0;
    for number in 0..PEOPLE {
        let (mut person, features) = person(number, slips, seed, sets);
        let known = Candidates::new(features)?;
        let given = answers(&known, &mut person, way, seed + number as u64)?;
        asked += given.len();
        let winner = Belief::after(&known, &given, seed)?.winner();
        regrets.push(person.regret(winner.index));
    }
    line(way.0, regrets, asked as f64 / PEOPLE as f64);
    Ok(())
}

/// The model's own weights for everybody, which is what a tuning for one objective gives.
fn unasked(slips: f64, seed: u64, sets: &Sets) -> Result<()> {
    let regrets = (0..PEOPLE).map(|number| person(number, slips, seed, sets).0.regret(0));
    line("not asked: the tuned weights", regrets.collect(), 0.0);
    Ok(())
}

fn line(title: &str, mut regrets: Vec<f64>, asked: f64) {
    regrets.sort_by(f64::total_cmp);
    let at = |share: f64| regrets[((regrets.len() - 1) as f64 * share).round() as usize];
    println!(
        "  {title:<36} median {:.3}, worst tenth {:.3}, worst {:.3}, {asked:.1} questions",
        at(0.5),
        at(0.9),
        at(1.0)
    );
}

/// Two people, and one person twice.
fn apart(slips: f64, seed: u64, sets: &Sets) -> Result<()> {
    let mut found = [0, 0];
    for pair in 0..PAIRS {
        for (same, found) in [false, true].into_iter().zip(&mut found) {
            let (mut one, features) = person(pair, slips, seed + 1, sets);
            let other = if same {
                pair
            } else {
                pair + 2 + 2 * (pair / 8)
            };
            let (mut other, _) = person(other, slips, seed + if same { 1 } else { 2 }, sets);
            let known = Candidates::new(features)?;
            let first = answers(&known, &mut one, WAYS[0], seed + pair as u64)?;
            // The same person is asked other questions.
            let second = answers(&known, &mut other, WAYS[0], seed + 7000 + pair as u64)?;
            *found += usize::from(two_people(&known, &first, &second, seed)?.apart());
        }
    }
    println!(
        "  told apart: {} of {PAIRS} pairs of people, {} of {PAIRS} people asked twice",
        found[0], found[1]
    );
    Ok(())
}

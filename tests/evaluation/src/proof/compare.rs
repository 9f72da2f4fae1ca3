//! Answers of today's program beside those that are kept of the published table, both scored
//! against the truth: what moves code and no number leaves them as they are, and what moves numbers
//! makes none of them worse.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use anyhow::{Context, Result, ensure};
use serde_json::Value;
use sinew_scorer::{Answer, Outcome, Truth, outcome};
use xtask::process::target_folder;

use super::kept::{self, KEPT};
use super::run::{self, Folder};

/// Part of a number by which an answer may differ and be the same.
const ROUNDING: f64 = 1e-9;

/// Asks the cheapest cases of every stratum once more, about `wanted` in all, and compares what is
/// kept of an answer, its time aside. With `score_only` it asks none, and compares the answers that
/// are there.
///
/// # Errors
/// No kept answers of the seed, no Python, or an answer that is worse than the kept one.
pub fn run(seed: u64, wanted: usize, score_only: bool) -> Result<()> {
    let kept: BTreeMap<usize, Value> = kept::answers(seed)?.into_iter().collect();
    let mut numbers = sample(&kept, wanted);
    let folder = Folder::under(&target_folder().join(format!("proof/{seed}-compared")));
    if score_only {
        numbers.retain(|&number| folder.answer(number).exists());
        ensure!(!numbers.is_empty(), "there is no answer to compare");
    } else {
        folder.forget_answers()?;
        for &number in &numbers {
            run::make_one(&folder, seed, number)?;
        }
        run::ask(&folder, &numbers)?;
    }
    let (mut same, mut moved, mut worse) = (0, Vec::new(), Vec::new());
    let mut right = (0, 0);
    for &number in &numbers {
        let truth = fs::read_to_string(folder.truth(number))?;
        let pair = Pair {
            kept: &kept[&number],
            new: answer(&folder.answer(number))?,
            truth: serde_json::from_str(&truth)?,
        };
        let (before, now) = pair.outcomes()?;
        right.0 += usize::from(before == Outcome::Right);
        right.1 += usize::from(now == Outcome::Right);
        let name = folder.name(number);
        match pair.difference() {
            Difference::None => same += 1,
            Difference::Numbers(largest) => moved.push(largest),
            Difference::Words(was, is) => println!(
                "{name}, {}: {was}, now {is}: {}, now {}",
                pair.truth.rig,
                before.name(),
                now.name()
            ),
        }
        if before < now {
            worse.push(name);
        }
    }
    moved.sort_by(f64::total_cmp);
    println!(
        "{} answers compared: {same} are the same, {} differ in numbers alone (a parameter by {:.1e} \
         of it in the middle, {:.1e} at most), {} in words",
        numbers.len(),
        moved.len(),
        moved.get(moved.len() / 2).unwrap_or(&0.0),
        moved.last().unwrap_or(&0.0),
        numbers.len() - same - moved.len()
    );
    println!("right: {} as kept, {} today", right.0, right.1);
    ensure!(worse.is_empty(), "worse than kept: {}", worse.join(", "));
    Ok(())
}

/// Two answers to a case; none of today: there is none.
struct Pair<'a> {
    kept: &'a Value,
    new: Option<Value>,
    truth: Truth,
}

/// Difference of two answers.
#[derive(Debug, PartialEq)]
enum Difference {
    None,
    /// The same verdict and names; the largest change of a parameter's value, as part of it.
    Numbers(f64),
    /// Verdict and names of each.
    Words(String, String),
}

impl Pair<'_> {
    fn outcomes(&self) -> Result<(Outcome, Outcome)> {
        let read = |value: &Value| serde_json::from_value::<Answer>(value.clone());
        let new = self.new.as_ref().map(read).transpose()?;
        let kept = read(self.kept)?;
        Ok((
            outcome(Some(&kept), &self.truth),
            outcome(new.as_ref(), &self.truth),
        ))
    }

    fn difference(&self) -> Difference {
        let none = Value::Null;
        let new = self.new.as_ref().unwrap_or(&none);
        let mut parts = KEPT.iter().filter(|part| **part != "seconds");
        if parts.all(|part| alike(&self.kept[part], &new[part])) {
            return Difference::None;
        }
        let (was, is) = (words(self.kept), words(new));
        if was != is {
            return Difference::Words(was, is);
        }
        let (before, after) = (values(self.kept), values(new));
        let change =
            |(a, b): (&f64, &f64)| (a - b).abs() / a.abs().max(b.abs()).max(f64::MIN_POSITIVE);
        Difference::Numbers(before.iter().zip(&after).map(change).fold(0.0, f64::max))
    }
}

/// An answer in its file; none where the program refused.
fn answer(file: &Path) -> Result<Option<Value>> {
    let Ok(text) = fs::read_to_string(file) else {
        return Ok(None);
    };
    let said = serde_json::from_str(&text);
    Ok(Some(said.with_context(|| {
        format!("{} is no answer", file.display())
    })?))
}

fn effects(answer: &Value) -> impl Iterator<Item = &Value> {
    answer["effects"].as_array().into_iter().flatten()
}

/// Verdict, and kind and place of what is named, in the order of the alphabet.
fn words(answer: &Value) -> String {
    let Some(verdict) = answer["verdict"].as_str() else {
        return "no answer".into();
    };
    let text = |value: &Value| value.as_str().unwrap_or_default().to_owned();
    let named = effects(answer).map(|it| text(&it["kind"]) + " at " + &text(&it["component"]));
    let mut named: Vec<String> = named.collect();
    named.sort_unstable();
    if named.is_empty() {
        return verdict.to_owned();
    }
    named.join(" and ")
}

/// Values of the parameters of what is named, in the order of [`words`].
fn values(answer: &Value) -> Vec<f64> {
    let mut sorted: Vec<&Value> = effects(answer).collect();
    sorted.sort_by_key(|it| (it["kind"].to_string(), it["component"].to_string()));
    let parameters = sorted.iter().filter_map(|it| it["parameters"].as_object());
    let values = parameters.flat_map(|parameters| parameters.values());
    values.filter_map(|it| it["value"].as_f64()).collect()
}

/// Numbers of the cheapest cases by turns of every stratum: verdict and first named kind.
fn sample(kept: &BTreeMap<usize, Value>, wanted: usize) -> Vec<usize> {
    let mut strata: BTreeMap<String, Vec<(f64, usize)>> = BTreeMap::new();
    for (&number, answer) in kept {
        let kind = &answer["effects"][0]["kind"];
        let stratum = format!("{} {kind}", answer["verdict"]);
        let seconds = answer["seconds"].as_f64().unwrap_or(f64::INFINITY);
        strata.entry(stratum).or_default().push((seconds, number));
    }
    for cases in strata.values_mut() {
        cases.sort_by(|a, b| a.0.total_cmp(&b.0));
    }
    let longest = strata.values().map(Vec::len).max().unwrap_or(0);
    let turns = (0..longest).flat_map(|rank| strata.values().filter_map(move |all| all.get(rank)));
    let mut numbers: Vec<usize> = turns.map(|(_, number)| *number).take(wanted).collect();
    numbers.sort_unstable();
    numbers
}

/// True if two answers say the same, numbers to within [`ROUNDING`]: another compiler or another
/// library of JSON may round the last digit otherwise.
fn alike(a: &Value, b: &Value) -> bool {
    match (a, b) {
        (Value::Number(a), Value::Number(b)) => {
            let (a, b) = (a.as_f64().unwrap_or(0.0), b.as_f64().unwrap_or(0.0));
            (a - b).abs() <= ROUNDING * a.abs().max(b.abs())
        }
        (Value::Array(a), Value::Array(b)) => {
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| alike(a, b))
        }
        (Value::Object(a), Value::Object(b)) => {
            let mut keys = a.iter();
            a.len() == b.len() && keys.all(|(key, a)| b.get(key).is_some_and(|b| alike(a, b)))
        }
        _ => a == b,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn every_stratum_has_its_turn_and_the_cheapest_come_first() {
        let answer = |verdict: &str, seconds: f64| json!({ "verdict": verdict, "effects": [], "seconds": seconds });
        let kept = [
            (0, answer("consistent", 3.0)),
            (1, answer("consistent", 1.0)),
            (2, answer("unexplained", 90.0)),
            (3, answer("consistent", 2.0)),
        ];
        let kept = kept.into_iter().collect();
        assert_eq!(sample(&kept, 2), [1, 2]);
        assert_eq!(sample(&kept, 3), [1, 2, 3]);
    }

    #[test]
    fn other_numbers_and_other_words_are_told_apart() {
        let answer = |kind: &str, level: f64| {
            let parameters = json!({ "level": { "value": level } });
            let effect = json!({ "kind": kind, "component": "mass", "parameters": parameters });
            json!({ "verdict": "missing_physics", "effects": [effect], "fit": {}, "seconds": level })
        };
        let truth = json!({
            "category": "exact", "rig": "stage", "strength": null, "noise": 0.01, "visible": [],
            "effects": [], "parameters": {}, "true_model_test_rms": {}
        });
        let kept = answer("backlash", 2.0);
        let difference = |new: Option<Value>| {
            let truth = serde_json::from_value(truth.clone()).expect("a truth");
            let kept = &kept;
            Pair { kept, new, truth }.difference()
        };
        let mut slower = kept.clone();
        slower["seconds"] = json!(9.0);
        assert_eq!(difference(Some(slower)), Difference::None);
        let moved = difference(Some(answer("backlash", 1.5)));
        assert_eq!(moved, Difference::Numbers(0.25));
        let was = || "backlash at mass".to_owned();
        let other = difference(Some(answer("hysteresis", 2.0)));
        let words = Difference::Words(was(), "hysteresis at mass".into());
        assert_eq!(other, words);
        let none = Difference::Words(was(), "no answer".into());
        assert_eq!(difference(None), none);
    }

    #[test]
    fn the_last_digit_of_a_number_is_no_difference_and_a_word_is() {
        let answer =
            |kind: &str, level: f64| json!({ "effects": [{ "kind": kind, "level": level }] });
        let one = answer("backlash", 1.340_261_748_761_096);
        assert!(alike(&one, &answer("backlash", 1.340_261_748_761_097)));
        assert!(!alike(&one, &answer("backlash", 1.340_262)));
        assert!(!alike(&one, &answer("hysteresis", 1.340_261_748_761_096)));
        assert!(!alike(&one, &json!({ "effects": [] })));
    }
}

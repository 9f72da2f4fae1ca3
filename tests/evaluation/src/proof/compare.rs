//! Answers of today's program beside those that are kept of the published table: what moves code
//! and no number leaves them as they are.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use anyhow::{Context, Result, ensure};
use serde_json::Value;
use xtask::process::target_folder;

use super::kept::{self, KEPT};
use super::run::{self, Folder};

/// Part of a number by which an answer may differ and be the same.
const ROUNDING: f64 = 1e-9;

/// Asks the cheapest cases of every stratum once more, about `wanted` in all, and compares what is
/// kept of an answer, its time aside.
///
/// # Errors
/// No kept answers of the seed, no Python, or an answer that differs.
pub fn run(seed: u64, wanted: usize) -> Result<()> {
    let kept: BTreeMap<usize, Value> = kept::answers(seed)?.into_iter().collect();
    let numbers = sample(&kept, wanted);
    let folder = Folder::under(&target_folder().join(format!("proof/{seed}-compared")));
    folder.forget_answers()?;
    for &number in &numbers {
        run::make_one(&folder, seed, number)?;
    }
    run::ask(&folder, &numbers)?;
    let mut others = Vec::new();
    for &number in &numbers {
        if !same(&kept[&number], &folder.answer(number))? {
            others.push(folder.name(number));
        }
    }
    println!(
        "{} answers compared, {} differ",
        numbers.len(),
        others.len()
    );
    ensure!(others.is_empty(), "{}", others.join(", "));
    Ok(())
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

/// True if what is kept of an answer is the same, its time aside; nothing was kept of a refusal.
fn same(kept: &Value, file: &Path) -> Result<bool> {
    let Ok(text) = fs::read_to_string(file) else {
        return Ok(false);
    };
    let new: Value =
        serde_json::from_str(&text).with_context(|| format!("{} is no answer", file.display()))?;
    let mut parts = KEPT.iter().filter(|part| **part != "seconds");
    Ok(parts.all(|part| alike(&kept[part], &new[part])))
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

//! The page of docs/evaluation/devices.md, from the answers.

use std::fmt::Write;
use std::path::Path;

use anyhow::{Context, Result};
use serde_json::Value;

use super::case::Case;
use crate::page::wrapped;

const HEAD: &str = "# Real devices\n\
\n\
Written by `cargo xtask recorded --publish`, which needs the recordings. Each plant model is the textbook\n\
model of the device (`rigs/recorded`) with free parameters. The error is the free-run error on recordings\n\
that estimated nothing: the test recordings or, with only two recordings, the check recordings (marked\n\
\u{2020}: they decided what is accepted). *Before* is the refitted model, *after* the corrected one. Where\n\
recordings were split, the first 60 % of the rows were fitted. An angle of the servo counts as missing\n\
while its torque was off. The *share explained* is that of the mismatch beside noise on the check\n\
recordings; *s* are seconds.\n\
\n\
| device | literature | found | sure | share explained | before | after | published | as the literature | s |\n\
|---|---|---|--:|--:|--:|--:|---|---|--:|\n";

/// The whole page; cases without an answer say so.
pub fn page(cases: &[Case], out: &Path) -> Result<String> {
    let mut text = HEAD.to_owned();
    let mut sentences = String::new();
    for case in cases {
        let path = out.join(format!("{}.json", case.name));
        if !path.is_file() {
            // Writing to a String cannot fail, here and below.
            let _ = writeln!(
                text,
                "| {} | {} | no answer | | | | | {} | **no** | |",
                case.device,
                literature(case),
                case.published
            );
            continue;
        }
        let answer = std::fs::read_to_string(&path)
            .with_context(|| format!("cannot read {}", path.display()))?;
        let answer: Value = serde_json::from_str(&answer)
            .with_context(|| format!("{} is no diagnosis", path.display()))?;
        row(&mut text, case, &answer);
        let sentence = answer["sentence"].as_str().unwrap_or_default();
        let _ = writeln!(sentences, "| {} | {sentence} |", case.device);
    }
    let _ = write!(text, "\n| device | what was said |\n|---|---|\n{sentences}");
    Ok(wrapped(&text))
}

fn literature(case: &Case) -> String {
    if case.known.is_empty() {
        "nothing is missing".into()
    } else {
        let slight = if case.slight {
            ", or nothing: it is slight"
        } else {
            ""
        };
        case.known.join(" or ") + slight
    }
}

fn row(text: &mut String, case: &Case, answer: &Value) {
    let effects: Vec<&Value> = answer["effects"].as_array().into_iter().flatten().collect();
    let kinds: Vec<&str> = effects.iter().filter_map(|e| e["kind"].as_str()).collect();
    let verdict = answer["verdict"].as_str().unwrap_or("?");
    let found = if kinds.is_empty() {
        verdict.to_owned()
    } else {
        kinds.join(" and ")
    };
    let sure: Vec<String> = effects
        .iter()
        .filter_map(|e| e["confidence"].as_f64())
        .map(|c| format!("{c:.2}"))
        .collect();
    let fit = &answer["fit"][case.signal];
    let (errors, mark) = match &fit["test"] {
        Value::Null => (&fit["check"], "\u{2020}"),
        test => (test, ""),
    };
    let unit = case.signal.rsplit('_').next().unwrap_or_default();
    let error = |key: &str| {
        errors[key]
            .as_f64()
            .map_or("?".into(), |e| quantity(e, unit))
    };
    let _ = writeln!(
        text,
        "| {} | {} | {found} | {} | {} | {}{mark} | {}{mark} | {} | {} | {:.0} |",
        case.device,
        literature(case),
        sure.join(", "),
        explained(answer),
        error("before_rms"),
        match errors["after_rms"].as_f64() {
            Some(_) => error("after_rms"),
            None => format!("{} over windows", error("judged_rms")),
        },
        case.published,
        agreement((case.known, case.slight), &kinds),
        answer["seconds"].as_f64().unwrap_or(f64::NAN)
    );
}

/// Part of the mismatch that what is named takes on the check recordings; nothing where nothing is.
fn explained(answer: &Value) -> String {
    let named = answer["effects"]
        .as_array()
        .is_some_and(|all| !all.is_empty());
    let left = answer["remainder"]["share"].as_f64().unwrap_or(0.0);
    if named {
        format!("{:.0} %", 100.0 * (1.0 - left))
    } else {
        String::new()
    }
}

/// Agreement of what was found with what is known, no less and no more.
fn agreement((known, slight): (&[&str], bool), found: &[&str]) -> &'static str {
    let right = found.iter().filter(|kind| known.contains(kind));
    match (known, found, right.count()) {
        ([], [], _) => "yes",
        (_, [], _) if slight => "yes",
        (_, [_, ..], right) if right == found.len() => "yes",
        (_, [_, _, ..], right) if right > 0 => "**in part**",
        _ => "**no**",
    }
}

/// Three digits, in thousandths where that reads better.
fn quantity(value: f64, unit: &str) -> String {
    let (value, unit) = if value.abs() < 0.1 && ["m", "V"].contains(&unit) {
        (1e3 * value, format!("m{unit}"))
    } else {
        (value, unit.to_owned())
    };
    let digits = if value == 0.0 {
        0
    } else {
        (2 - value.abs().log10().floor() as i32).clamp(0, 6)
    };
    format!("{value:.*} {unit}", digits as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_share_explained_is_what_the_remainder_leaves_and_empty_without_a_name() {
        let of = |effects: Value, remainder: Value| {
            explained(&serde_json::json!({ "effects": effects, "remainder": remainder }))
        };
        let named = serde_json::json!([{ "kind": "coulomb_friction" }]);
        let left = serde_json::json!({ "share": 0.17 });
        assert_eq!(of(named.clone(), left.clone()), "83 %");
        assert_eq!(of(named, Value::Null), "100 %");
        assert_eq!(of(serde_json::json!([]), left), "");
    }

    #[test]
    fn another_effect_beside_the_known_one_is_half_an_answer() {
        let drag: (&[&str], bool) = (&["quadratic_drag", "viscous_damping"], false);
        assert_eq!(agreement(drag, &["viscous_damping"]), "yes");
        assert_eq!(
            agreement(drag, &["viscous_damping", "gravity_load"]),
            "**in part**"
        );
        assert_eq!(agreement(drag, &["gravity_load"]), "**no**");
        assert_eq!(agreement(drag, &[]), "**no**");
        assert_eq!(agreement((drag.0, true), &[]), "yes");
        assert_eq!(agreement((drag.0, true), &["gravity_load"]), "**no**");
        assert_eq!(agreement((&[], false), &[]), "yes");
        assert_eq!(agreement((&[], false), &["gravity_load"]), "**no**");
    }
}

//! The answers of the published table, kept in `tests/foreign/answers`: from them everybody can
//! make it again.

use std::fs;
use std::path::PathBuf;

use anyhow::{Context, Result, bail, ensure};
use serde_json::{Value, json};

use super::run::Folder;
use xtask::process::root;

/// Keys of an answer that the table is made of; the rest of an answer is as long again.
pub const KEPT: [&str; 4] = ["verdict", "effects", "fit", "seconds"];

/// One line a case.
fn file(seed: u64) -> PathBuf {
    root().join(format!("tests/foreign/answers/{seed}.jsonl"))
}

/// Puts the answers of `tests/foreign/answers` where they are looked for: what was asked before is
/// not asked again.
///
/// # Errors
/// A line is neither an answer nor a refusal, or a file cannot be written.
pub fn restore(folder: &Folder, seed: u64) -> Result<()> {
    let kept = file(seed);
    if !kept.exists() {
        return Ok(());
    }
    let text =
        fs::read_to_string(&kept).with_context(|| format!("cannot read {}", kept.display()))?;
    folder.make_answers()?;
    for (line, text) in text.lines().enumerate() {
        let (number, said) = read(text).with_context(|| {
            let expected = "{\"case\": NUMBER, \"answer\": {...}} or {..., \"refusal\": TEXT}";
            format!("{}:{}: expected {expected}", kept.display(), line + 1)
        })?;
        let (file, said) = match said {
            Said::Answer(answer) => (folder.answer(number), answer.to_string()),
            Said::Refusal(refusal) => (folder.refusal(number), refusal),
        };
        if !file.exists() {
            fs::write(&file, said).with_context(|| format!("cannot write {}", file.display()))?;
        }
    }
    Ok(())
}

/// The answers that are kept of a seed; refusals are left out.
///
/// # Errors
/// There are none, or a line is neither an answer nor a refusal.
pub fn answers(seed: u64) -> Result<Vec<(usize, Value)>> {
    let kept = file(seed);
    let text =
        fs::read_to_string(&kept).with_context(|| format!("cannot read {}", kept.display()))?;
    let lines = text.lines().map(read);
    let answers = lines.filter_map(|line| match line {
        Ok((number, Said::Answer(answer))) => Some(Ok((number, answer))),
        Ok(_) => None,
        Err(error) => Some(Err(error)),
    });
    answers.collect()
}

/// Content of a line.
#[derive(Debug, PartialEq)]
enum Said {
    Answer(Value),
    Refusal(String),
}

/// A line: which case, and what was said about it.
fn read(line: &str) -> Result<(usize, Said)> {
    let given: Value = serde_json::from_str(line)?;
    let number = given["case"].as_u64().context("there is no case")?;
    let answer = given.get("answer").filter(|answer| answer.is_object());
    let refusal = given.get("refusal").and_then(|refusal| refusal.as_str());
    let said = match (answer, refusal) {
        (Some(answer), None) => Said::Answer(answer.clone()),
        (None, Some(refusal)) => Said::Refusal(refusal.to_owned()),
        _ => bail!("there is neither an answer nor a refusal, or both"),
    };
    Ok((usize::try_from(number)?, said))
}

/// Keeps the answers of all cases, what was refused among them. Those that were kept before are
/// what they were: they may have been restored from there.
///
/// # Errors
/// A case without either, or a file that cannot be read or written.
pub fn keep(folder: &Folder, seed: u64, cases: usize) -> Result<()> {
    let kept = file(seed);
    if kept.exists() {
        return Ok(());
    }
    let lines: Vec<String> = (0..cases)
        .map(|number| line(folder, number))
        .collect::<Result<_>>()?;
    fs::write(&kept, lines.join("\n") + "\n")
        .with_context(|| format!("cannot write {}", kept.display()))?;
    println!(
        "wrote {}; answers of other seeds are of no use any more",
        kept.display()
    );
    Ok(())
}

/// The line of a case.
fn line(folder: &Folder, number: usize) -> Result<String> {
    let text = |file: &PathBuf| {
        fs::read_to_string(file).with_context(|| format!("cannot read {}", file.display()))
    };
    let file = folder.answer(number);
    if !file.exists() {
        let refusal = text(&folder.refusal(number))?;
        return Ok(json!({ "case": number, "refusal": refusal }).to_string());
    }
    let given: Value =
        serde_json::from_str(&text(&file)?).with_context(|| format!("in {}", file.display()))?;
    let of = |name: &str| (name.to_owned(), given[name].clone());
    let answer: serde_json::Map<String, Value> = KEPT.into_iter().map(of).collect();
    ensure!(
        answer.values().all(|value| !value.is_null()),
        "{} is without one of {}",
        file.display(),
        KEPT.join(", ")
    );
    Ok(json!({ "case": number, "answer": answer }).to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_kept_of_an_answer_and_of_a_refusal_can_be_read_again() -> Result<()> {
        let top = std::env::temp_dir().join(format!("sinew-kept-{}", std::process::id()));
        let folder = Folder::under(&top);
        folder.make_answers()?;
        let answer = json!({ "verdict": "consistent", "effects": [], "fit": {}, "seconds": 0.25 });
        let mut more = answer.clone();
        more["sentence"] = json!("The rig explains the recordings.");
        fs::write(folder.answer(3), more.to_string())?;
        fs::write(folder.refusal(4), "status 2\nno \"rig\"")?;
        fs::write(folder.answer(5), r#"{"verdict": "consistent"}"#)?;
        assert_eq!(read(&line(&folder, 3)?)?, (3, Said::Answer(answer)));
        let refusal = Said::Refusal("status 2\nno \"rig\"".into());
        assert_eq!(read(&line(&folder, 4)?)?, (4, refusal));
        let cut = line(&folder, 5).expect_err("it has no effects");
        assert!(
            cut.to_string().contains("without one of verdict, effects"),
            "{cut}"
        );
        assert!(line(&folder, 6).is_err());
        fs::remove_dir_all(&top)?;
        Ok(())
    }

    #[test]
    fn a_line_that_is_neither_or_both_is_refused() {
        for line in [
            "x",
            r#"{"answer": {}}"#,
            r#"{"case": 0}"#,
            r#"{"case": 0, "answer": 3}"#,
            r#"{"case": 0, "answer": {}, "refusal": "status 1"}"#,
        ] {
            assert!(read(line).is_err(), "{line}");
        }
    }
}

//! `cargo xtask demo` and `emps`: the whole chain, through the `sinew` program.

use std::path::{Path, PathBuf};
use std::process::Command;

use anyhow::{Context, Result, bail};
use serde_json::Value;

use xtask::process::{self, root};
use xtask::setup::{self, Consent, Extent};

/// A recording pair and the rig that explains it.
struct Case {
    rig: &'static str,
    fit: PathBuf,
    test: PathBuf,
    out: &'static str,
    /// File beside the recordings that says which effects they have and the rig lacks, where that
    /// is known. Nothing reads it before the diagnosis is done.
    truth: Option<&'static str>,
}

/// The rig and the recording that ship with the project.
///
/// # Errors
/// Setup, or the exit status of `sinew`.
pub fn demo(flags: &[String]) -> Result<()> {
    build(
        &Case {
            rig: "rigs/demo.toml",
            fit: "rigs/mass-spring-damper.fit.csv".into(),
            test: "rigs/mass-spring-damper.test.csv".into(),
            out: "target/demo",
            truth: Some("rigs/mass-spring-damper.truth.json"),
        },
        flags,
    )
}

/// A real positioning axis: motor voltage in, position out.
///
/// # Errors
/// The recordings are not on this machine; setup; or the exit status of `sinew`.
pub fn emps(flags: &[String]) -> Result<()> {
    let Some(data) = data_folder() else {
        bail!(
            "the EMPS recordings are not here: set SINEW_DATA to the folder that holds emps/train.csv \
             and emps/test_pulses.csv"
        );
    };
    build(
        &Case {
            rig: "rigs/emps.toml",
            fit: data.join("emps/train.csv"),
            test: data.join("emps/test_pulses.csv"),
            out: "target/emps",
            truth: None,
        },
        flags,
    )
}

/// The folder of the recordings, if those of EMPS are there.
fn data_folder() -> Option<PathBuf> {
    let folder = process::data_folder();
    let complete = ["emps/train.csv", "emps/test_pulses.csv"]
        .iter()
        .all(|file| folder.join(file).is_file());
    complete.then_some(folder)
}

fn build(case: &Case, flags: &[String]) -> Result<()> {
    let (yes, flags): (Vec<&String>, Vec<&String>) = flags.iter().partition(|it| *it == "--yes");
    let consent = if yes.is_empty() {
        Consent::Asked
    } else {
        Consent::Given
    };
    let toolchain = setup::run_with(Extent::Build, consent)?;
    let mut command = Command::new(process::program("sinew")?);
    command.args(["build", case.rig]).current_dir(root());
    let file = |path: &Path| path.as_os_str().to_os_string();
    command.arg("--fit").arg(file(&case.fit));
    command.arg("--test").arg(file(&case.test));
    command.args(["--board", "qemu", "--out", case.out]);
    if case.truth.is_some() {
        command.arg("--diagnose");
    }
    // Shared with the tests' boards: embassy is compiled once.
    if std::env::var_os("SINEW_BUILD_DIR").is_none() {
        command.env("SINEW_BUILD_DIR", root().join("target/boards"));
    }
    command.args(&flags);
    process::run(toolchain.equip(&mut command))?;
    let asked_for_help = flags.iter().any(|flag| *flag == "-h" || *flag == "--help");
    if let Some(truth) = case.truth.filter(|_| !asked_for_help) {
        let summary = json(&root().join(case.out).join("summary.json"))?;
        println!(
            "{:<14}{}",
            "answer",
            answer(&json(&root().join(truth))?, &summary)?
        );
        println!("{:<14}{truth}", "");
    }
    Ok(())
}

fn json(path: &Path) -> Result<Value> {
    let text = std::fs::read_to_string(path).with_context(|| path.display().to_string())?;
    serde_json::from_str(&text).with_context(|| path.display().to_string())
}

/// The concealed effects of `truth` beside those that the run of `summary` found.
///
/// # Errors
/// A file without them.
fn answer(truth: &Value, summary: &Value) -> Result<String> {
    let effects = truth["effects"].as_array().context("no `effects`")?;
    let kinds = effects.iter().map(|effect| effect["kind"].as_str());
    let mut hidden = kinds.collect::<Option<Vec<_>>>().context("no `kind`")?;
    let found = summary["diagnosis"]["found"]
        .as_str()
        .context("no `found`")?;
    let mut named: Vec<_> = found.split('+').collect();
    hidden.sort_unstable();
    named.sort_unstable();
    let judged = if hidden == named {
        "is right"
    } else {
        "is wrong"
    };
    Ok(format!(
        "concealed was {}; the diagnosis {judged}",
        hidden.join("+")
    ))
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::answer;

    #[test]
    fn the_answer_compares_kinds_and_not_their_order() {
        let truth = json!({ "effects": [{ "kind": "b" }, { "kind": "a" }] });
        let found = |kinds: &str| answer(&truth, &json!({ "diagnosis": { "found": kinds } }));
        assert!(found("a+b").expect("sound files").ends_with("is right"));
        assert!(found("a").expect("sound files").ends_with("is wrong"));
        assert!(answer(&json!({}), &json!({ "diagnosis": { "found": "a" } })).is_err());
    }
}

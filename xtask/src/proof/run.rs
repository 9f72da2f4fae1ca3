//! Cases are made and put to `sinew diagnose`; what is there already is kept.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

use anyhow::{Context, Result, bail};

use crate::foreign::python;
use crate::process::{self, cargo, target_folder};

/// Where a proof keeps its files.
pub struct Folder {
    top: PathBuf,
}

impl Folder {
    /// The folder of a seed.
    pub fn of(seed: u64) -> Self {
        Self {
            top: target_folder().join("proof").join(seed.to_string()),
        }
    }

    /// One case: the rig and its recordings.
    pub fn case(&self, number: usize) -> PathBuf {
        self.top.join("cases").join(name(number))
    }

    /// What one case hides.
    pub fn truth(&self, number: usize) -> PathBuf {
        self.top.join("truth").join(name(number) + ".json")
    }

    /// What was said about one case.
    pub fn answer(&self, number: usize) -> PathBuf {
        self.top.join("answers").join(name(number) + ".json")
    }

    /// What stood on standard error where nothing was said.
    pub fn refusal(&self, number: usize) -> PathBuf {
        self.answer(number).with_extension("error")
    }

    /// A file beside these folders.
    pub fn file(&self, name: &str) -> PathBuf {
        self.top.join(name)
    }

    /// Forgets every answer.
    ///
    /// # Errors
    /// The folder cannot be removed.
    pub fn forget_answers(&self) -> Result<()> {
        let answers = self.top.join("answers");
        if answers.exists() {
            fs::remove_dir_all(&answers)
                .with_context(|| format!("cannot remove {}", answers.display()))?;
        }
        Ok(())
    }
}

/// A case's name: says nothing about what it hides.
pub fn name(number: usize) -> String {
    format!("case-{number:04}")
}

/// Writes the cases that are not there yet.
///
/// # Errors
/// There is no Python, or its program failed.
pub fn make(folder: &Folder, seed: u64, cases: usize) -> Result<()> {
    if (0..cases).all(|number| folder.truth(number).exists()) {
        return Ok(());
    }
    let python = python::environment()?;
    let (seed, cases) = (seed.to_string(), cases.to_string());
    let mut command = python.command(&["-m", "hardlaw.cases", "--seed", &seed, "--cases", &cases]);
    command.arg("--out").arg(folder.file("cases"));
    command.arg("--truth").arg(folder.file("truth"));
    process::run(&mut command)
}

/// Puts every case without an answer to the program.
///
/// # Errors
/// The program does not build or cannot be started; an answer cannot be written. A case on which it fails is no
/// error: it is counted.
pub fn ask(folder: &Folder, cases: usize) -> Result<()> {
    process::run(&mut cargo(&[
        "build",
        "--quiet",
        "--package",
        "sinew",
        "--bin",
        "sinew",
    ]))?;
    let sinew = target_folder().join("debug/sinew");
    let asked = |number: usize| folder.answer(number).exists() || folder.refusal(number).exists();
    let left: Vec<usize> = (0..cases).filter(|&number| !asked(number)).collect();
    if left.len() < cases {
        println!(
            "{} of {cases} cases have their answer; --fresh asks again",
            cases - left.len()
        );
    }
    fs::create_dir_all(folder.file("answers"))?;
    let begun = Instant::now();
    for (done, &number) in left.iter().enumerate() {
        ask_one(&sinew, folder, number)?;
        let each = begun.elapsed().as_secs_f64() / (done + 1) as f64;
        println!(
            "{}: {} left, about {:.0} s",
            name(number),
            left.len() - done - 1,
            each * (left.len() - done - 1) as f64
        );
    }
    Ok(())
}

/// The contract's command line. It runs in the case's folder and is told nothing else.
fn ask_one(sinew: &Path, folder: &Folder, number: usize) -> Result<()> {
    let answer = folder.answer(number);
    let part = answer.with_extension("part");
    let output = Command::new(sinew)
        .args([
            "diagnose",
            "rig.toml",
            "--fit",
            "fit-a.csv",
            "--fit",
            "fit-b.csv",
        ])
        .args([
            "--check",
            "check.csv",
            "--test",
            "test.csv",
            "--quiet",
            "--json",
        ])
        .arg(&part)
        .current_dir(folder.case(number))
        .stdin(Stdio::null())
        .output()
        .with_context(|| format!("cannot start {}", sinew.display()))?;
    match output.status.code() {
        Some(0) => fs::rename(&part, &answer)?,
        Some(code) => {
            let said = String::from_utf8_lossy(&output.stderr);
            fs::write(folder.refusal(number), format!("status {code}\n{said}"))?;
        }
        // A signal: somebody wants this to end, or the machine does. Not the case's fault.
        None => bail!("sinew diagnose was ended on {}", name(number)),
    }
    Ok(())
}

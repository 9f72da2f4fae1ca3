//! Cases are made and put to `sinew diagnose`; what is there already is kept.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;
use std::time::Instant;

use anyhow::{Context, Result, anyhow, bail};

use crate::foreign::python;
use xtask::process::{self, root, target_folder};

/// Folder of a proof's cases, their truths and the answers to them.
pub struct Folder {
    cases: PathBuf,
    truths: PathBuf,
    answers: PathBuf,
    digits: usize,
}

impl Folder {
    /// Everything under `target/proof/SEED`.
    pub fn of(seed: u64) -> Self {
        Self::under(&target_folder().join("proof").join(seed.to_string()))
    }

    /// Everything under this folder.
    pub fn under(top: &Path) -> Self {
        Self {
            cases: top.join("cases"),
            truths: top.join("truth"),
            answers: top.join("answers"),
            digits: 4,
        }
    }

    /// The committed cases; only the answers are under `target`.
    pub fn committed() -> Self {
        Self {
            cases: root().join("tests/foreign/cases"),
            truths: root().join("tests/foreign/truth"),
            answers: target_folder().join("proof/committed/answers"),
            digits: 2,
        }
    }

    /// A case's name: says nothing about what it hides.
    pub fn name(&self, number: usize) -> String {
        format!("case-{number:0digits$}", digits = self.digits)
    }

    /// Folder of one case: its rig and its recordings.
    pub fn case(&self, number: usize) -> PathBuf {
        self.cases.join(self.name(number))
    }

    /// Truth of one case.
    pub fn truth(&self, number: usize) -> PathBuf {
        self.truths.join(self.name(number) + ".json")
    }

    /// Answer to one case.
    pub fn answer(&self, number: usize) -> PathBuf {
        self.answers.join(self.name(number) + ".json")
    }

    /// Content of standard error where nothing was said.
    pub fn refusal(&self, number: usize) -> PathBuf {
        self.answer(number).with_extension("error")
    }

    /// Page that is not published.
    pub fn page(&self) -> &Path {
        self.answers.parent().unwrap_or(&self.answers)
    }

    /// Makes room for answers.
    ///
    /// # Errors
    /// The folder cannot be made.
    pub fn make_answers(&self) -> Result<()> {
        fs::create_dir_all(&self.answers)
            .with_context(|| format!("cannot make {}", self.answers.display()))
    }

    /// Forgets every answer.
    ///
    /// # Errors
    /// The folder cannot be removed.
    pub fn forget_answers(&self) -> Result<()> {
        if self.answers.exists() {
            fs::remove_dir_all(&self.answers)
                .with_context(|| format!("cannot remove {}", self.answers.display()))?;
        }
        Ok(())
    }
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
    let (seed, cases, step) = (seed.to_string(), cases.to_string(), workers().to_string());
    side_by_side(|worker| {
        let first = worker.to_string();
        let mut command = python.command(&["-m", "hardlaw.cases"]);
        command.args(["--seed", &seed, "--cases", &cases]);
        command.args(["--first", &first, "--step", &step]);
        command.arg("--out").arg(&folder.cases);
        command.arg("--truth").arg(&folder.truths);
        process::run(&mut command)
    })
}

/// Writes one case, unless it is there.
///
/// # Errors
/// As [`make`].
pub fn make_one(folder: &Folder, seed: u64, number: usize) -> Result<()> {
    if folder.truth(number).exists() {
        return Ok(());
    }
    let (seed, first, after) = (
        seed.to_string(),
        number.to_string(),
        (number + 1).to_string(),
    );
    let mut command = python::environment()?.command(&["-m", "hardlaw.cases"]);
    command.args(["--seed", &seed, "--cases", &after, "--first", &first]);
    command.arg("--out").arg(&folder.cases);
    command.arg("--truth").arg(&folder.truths);
    process::run(&mut command)
}

/// Number of workers: one a core.
fn workers() -> usize {
    thread::available_parallelism().map_or(1, usize::from)
}

/// The same done by all workers, each of which is told its number.
fn side_by_side(work: impl Fn(usize) -> Result<()> + Sync) -> Result<()> {
    let work = &work;
    thread::scope(|scope| {
        let workers: Vec<_> = (0..workers())
            .map(|worker| scope.spawn(move || work(worker)))
            .collect();
        let ended = workers.into_iter().map(|worker| {
            let failed = || anyhow!("a worker did not come to its end");
            worker.join().map_err(|_| failed())?
        });
        ended.collect()
    })
}

/// Puts every one of these cases that has no answer to the program.
///
/// # Errors
/// The program does not build or cannot be started; an answer cannot be written. A case on which it
/// fails is no error: it is counted.
pub fn ask(folder: &Folder, cases: &[usize]) -> Result<()> {
    let sinew = process::program("sinew")?;
    let asked = |number: usize| folder.answer(number).exists() || folder.refusal(number).exists();
    let left: Vec<usize> = (cases.iter().copied())
        .filter(|&number| !asked(number))
        .collect();
    if left.len() < cases.len() {
        let (done, all) = (cases.len() - left.len(), cases.len());
        println!("{done} of {all} cases have their answer; --fresh asks again");
    }
    folder.make_answers()?;
    // Cases side by side, each on one core: parts of a diagnosis wait for each other, cases do not.
    let begun = Instant::now();
    let (next, done) = (AtomicUsize::new(0), AtomicUsize::new(0));
    side_by_side(|_| {
        while let Some(&number) = left.get(next.fetch_add(1, Ordering::Relaxed)) {
            ask_one(&sinew, folder, number)?;
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            let rest = left.len() - done;
            let each = begun.elapsed().as_secs_f64() / done as f64;
            println!(
                "{}: {rest} left, about {:.0} s",
                folder.name(number),
                each * rest as f64
            );
        }
        Ok(())
    })
}

/// The contract's command line. It runs in the case's folder and is told nothing else.
fn ask_one(sinew: &Path, folder: &Folder, number: usize) -> Result<()> {
    let answer = folder.answer(number);
    let part = answer.with_extension("part");
    let output = Command::new(sinew)
        .args(["diagnose", "rig.toml"])
        .args(["--fit", "fit-a.csv", "--fit", "fit-b.csv"])
        .args(["--check", "check.csv", "--test", "test.csv"])
        .args(["--quiet", "--json"])
        .arg(&part)
        .current_dir(folder.cases.join(folder.name(number)))
        .env("RAYON_NUM_THREADS", "1")
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
        None => bail!("sinew diagnose was ended on {}", folder.name(number)),
    }
    Ok(())
}

//! `cargo xtask ci`: what guards the main branch.
//!
//! Cheap stages come first, so that a stray blank fails in seconds. No stage sets RUSTFLAGS or a
//! profile of its own: cargo would build the dependencies (burn: minutes) once more for each.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{Duration, Instant};

use anyhow::{Context, Result, ensure};

use crate::arguments::none;
use crate::{
    demo, deny, evaluation, modules, oldest, package, python, references, snapshots, test,
    tutorials,
};
use xtask::process::{self, cargo, root, target_folder};
use xtask::setup::{self, Extent, Toolchain};

/// Folders of `boards/` and `models/` that are crates. Each is a workspace of its own.
fn crates_in(folder: &str) -> Result<Vec<PathBuf>> {
    let folder = root().join(folder);
    let mut found = Vec::new();
    for entry in folder
        .read_dir()
        .with_context(|| format!("cannot read {}", folder.display()))?
    {
        let path = entry?.path();
        if path.join("Cargo.toml").is_file() {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}

/// `cargo clippy` on one generated crate, beside `boards/host`, which has the same dependencies.
fn model_clippy(model: &Path) -> Command {
    let mut command = cargo(&["clippy", "--release", "--manifest-path"]);
    command.arg(model.join("Cargo.toml"));
    command
        .arg("--target-dir")
        .arg(target_folder().join("boards"));
    command.args(["--", "-D", "warnings"]);
    command
}

/// One stage: a name to print and the work.
type Stage = (&'static str, fn(&Toolchain) -> Result<()>);

/// Before anything is compiled.
const FIRST: &[Stage] = &[
    ("format", |_| format()),
    ("references", |_| references::check(&[])),
    ("cycles", |_| modules::check()),
    ("dependencies", |_| deny::check()),
    ("foreign recordings up to date", |_| foreign()),
];

/// Beside the boards, which have target folders of their own: each alone leaves a core idle for a
/// while.
const COMPILED: &[Stage] = &[
    ("clippy, workspace", |_| clippy_workspace()),
    ("packages", |_| package::check()),
    ("oldest compilers", |_| oldest::check()),
    ("tests compile", test::compile),
];

const TESTS: &[Stage] = &[("tests", test::run)];

/// Beside the tests: a training, or a test that compiles an image, leaves a core idle.
const LATE: &[Stage] = &[
    ("concealed cases", |_| {
        evaluation::run("proof", &["--brief".into()])
    }),
    ("budgets", |_| snapshots::budget(&[])),
    ("documentation", |_| documentation()),
    ("tutorials", |toolchain| tutorials::run(toolchain, &[])),
    ("python", |_| python::run(&[])),
    ("demo", |_| demo::demo(&[])),
];

/// `cargo xtask ci [STAGES]`: everything, or these stages of [`LATE`] in their order.
///
/// # Errors
/// The first stage that fails; the times of those before it are printed all the same. An argument
/// that is none of those stages.
pub fn run(arguments: &[String]) -> Result<()> {
    let start = Instant::now();
    let mut times: Vec<(&str, Duration)> = Vec::new();
    let outcome = match arguments {
        [] => everything(&mut times),
        _ => stages(&chosen(arguments)?, &setup::run(Extent::Build)?, &mut times),
    };
    println!("\n=== times");
    for (name, time) in &times {
        println!("{:>7.1} s  {name}", time.as_secs_f64());
    }
    println!("{:>7.1} s  together", start.elapsed().as_secs_f64());
    outcome
}

fn everything(times: &mut Vec<(&'static str, Duration)>) -> Result<()> {
    let start = Instant::now();
    println!("\n=== setup");
    let toolchain = setup::run(Extent::Everything)?;
    times.push(("setup", start.elapsed()));
    stages(FIRST, &toolchain, times)?;

    let boards = Beside::begin("boards and models, beside the others", &["boards"])?;
    let compiled = stages(COMPILED, &toolchain, times);
    // Whatever came of the others: half an hour later nobody wants to hear of the next failure.
    boards.end(times).and(compiled)?;

    let names: Vec<&str> = LATE.iter().map(|(name, _)| *name).collect();
    let late = Beside::begin(
        "all others, beside the tests",
        &[&["ci"], &names[..]].concat(),
    )?;
    let tests = stages(TESTS, &toolchain, times);
    late.end(times).and(tests)
}

/// Stages of [`LATE`] by their names.
fn chosen(names: &[String]) -> Result<Vec<Stage>> {
    let known = || LATE.iter().map(|(name, _)| *name);
    for name in names {
        ensure!(
            known().any(|stage| stage == name),
            "no stage `{name}` that can be run alone; there are: {}",
            known().collect::<Vec<_>>().join(", ")
        );
    }
    let asked = |stage: &&Stage| names.iter().any(|name| name == stage.0);
    Ok(LATE.iter().filter(asked).copied().collect())
}

/// Runs stages up to the first that fails.
fn stages(
    stages: &[Stage],
    toolchain: &Toolchain,
    times: &mut Vec<(&'static str, Duration)>,
) -> Result<()> {
    for (name, work) in stages {
        println!("\n=== {name}");
        let begin = Instant::now();
        let outcome = work(toolchain).with_context(|| format!("stage '{name}'"));
        times.push((name, begin.elapsed()));
        outcome?;
    }
    Ok(())
}

/// A verb of this program as a process of its own, what it prints kept until it has ended.
struct Beside {
    name: &'static str,
    child: std::process::Child,
    log: PathBuf,
    begun: Instant,
}

impl Beside {
    fn begin(name: &'static str, arguments: &[&str]) -> Result<Self> {
        let log = target_folder().join(format!("ci-{}.log", arguments[0]));
        let file = File::create(&log).with_context(|| format!("cannot write {}", log.display()))?;
        let mut command = Command::new(std::env::current_exe()?);
        command.args(arguments).current_dir(root());
        command.stdout(file.try_clone()?).stderr(file);
        let child = command.spawn().context("cannot start xtask again")?;
        Ok(Self {
            name,
            child,
            log,
            begun: Instant::now(),
        })
    }

    fn end(mut self, times: &mut Vec<(&'static str, Duration)>) -> Result<()> {
        let status = self.child.wait()?;
        times.push((self.name, self.begun.elapsed()));
        println!("\n=== {}", self.name);
        print!("{}", std::fs::read_to_string(&self.log)?);
        ensure!(status.success(), "stage '{}'", self.name);
        Ok(())
    }
}

/// `cargo xtask boards`: lints boards and models, and links the images that no test builds.
///
/// # Errors
/// The first crate that does not pass.
pub fn boards(arguments: &[String]) -> Result<()> {
    none(arguments)?;
    let toolchain = setup::run(Extent::Build)?;
    clippy_boards_and_models(&toolchain)?;
    link_boards(&toolchain)?;
    probe()
}

fn format() -> Result<()> {
    process::run(&mut cargo(&["fmt", "--all", "--check"]))?;
    for folder in crates_in("boards")?.into_iter().chain(crates_in("models")?) {
        process::run(&mut format_one(&folder))?;
    }
    Ok(())
}

/// Without `--all`: cargo fmt would follow the path dependencies and format them too.
fn format_one(folder: &Path) -> Command {
    let mut command = cargo(&["fmt", "--check", "--manifest-path"]);
    command.arg(folder.join("Cargo.toml"));
    command
}

/// Boards whose images and tests are compiled here, and linted with that.
const LINKED: &[&str] = &["stm32f446", "nrf52840"];

fn clippy_boards_and_models(toolchain: &Toolchain) -> Result<()> {
    for board in crates_in("boards")? {
        // `probe` is no board. As those of LINKED, it is linted where it is compiled.
        if (LINKED.iter().chain(&["probe"])).any(|name| board.ends_with(name)) {
            continue;
        }
        // Without --all-targets: there is no test harness on a microcontroller.
        let arguments = ["--", "-D", "warnings"];
        process::run(&mut toolchain.board_cargo(&board, "clippy", &arguments))?;
    }
    for model in crates_in("models")? {
        oldest::lock(&model)?;
        process::run(&mut model_clippy(&model))?;
    }
    Ok(())
}

/// Boards that nothing here can run: their images fit the chips' memories, or do not link.
fn link_boards(toolchain: &Toolchain) -> Result<()> {
    for board in LINKED {
        let folder = root().join("boards").join(board);
        for (verb, arguments) in [("build", &[][..]), ("test", &["--no-run"])] {
            let mut command = toolchain.board_cargo(&folder, verb, arguments);
            process::run(process::linted(&mut command))?;
        }
    }
    Ok(())
}

/// Checks of flashing without a board: chips, memories and images, as probe-rs sees
/// them.
fn probe() -> Result<()> {
    let images = target_folder().join("boards/thumbv7em-none-eabihf/release");
    let mut command = cargo(&["test", "--manifest-path", "boards/probe/Cargo.toml"]);
    command
        .arg("--target-dir")
        .arg(target_folder().join("boards"));
    process::run(process::linted(&mut command).env("SINEW_BOARD_IMAGES", images))
}

/// The recordings that judge the simulator are what their own program writes today.
fn foreign() -> Result<()> {
    if !process::succeeds(Command::new("python3").arg("--version")) {
        println!("SKIPPED: no python3: the recordings of tests/foreign are taken as they are");
        return Ok(());
    }
    for program in [
        "mass_spring_damper.py",
        "damper_stand.py",
        "payload.py",
        "finger.py",
        "foam.py",
        "pad.py",
        "servo_log.py",
    ] {
        let mut command = Command::new("python3");
        command.args([&format!("tests/foreign/{program}"), "--check"]);
        process::run(command.current_dir(root()))?;
    }
    Ok(())
}

fn clippy_workspace() -> Result<()> {
    process::run(&mut cargo(&[
        "clippy",
        "--workspace",
        "--all-targets",
        "--",
        "-D",
        "warnings",
    ]))
}

fn documentation() -> Result<()> {
    let mut command = cargo(&["doc", "--workspace", "--no-deps"]);
    // Reaches rustdoc alone, so nothing is compiled again for it.
    process::run(command.env("RUSTDOCFLAGS", "-D warnings"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_beside_the_tests_can_be_run_by_name_in_their_order_and_no_others() {
        let names =
            |names: &[&str]| -> Vec<String> { names.iter().map(|it| (*it).into()).collect() };
        let found = chosen(&names(&["demo", "concealed cases"])).expect("two stages");
        let found: Vec<&str> = found.iter().map(|(name, _)| *name).collect();
        assert_eq!(found, ["concealed cases", "demo"]);
        let refused = chosen(&names(&["demo", "tests"])).map(|_| ());
        let words = refused.expect_err("not beside the tests").to_string();
        assert!(
            words.contains("`tests`") && words.contains("tutorials"),
            "{words}"
        );
    }
}

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
const BESIDE: &[Stage] = &[
    ("clippy, workspace", |_| clippy_workspace()),
    ("packages", |_| package::check()),
    ("oldest compilers", |_| oldest::check()),
    ("tests compile", test::compile),
];

const LAST: &[Stage] = &[
    ("tests", test::run),
    ("concealed cases", |_| {
        evaluation::run("proof", &["--brief".into()])
    }),
    ("budgets", |_| snapshots::budget(&[])),
    ("documentation", |_| documentation()),
    ("tutorials", |toolchain| tutorials::run(toolchain, &[])),
    ("python", |_| python::run(&[])),
    ("demo", |_| demo::demo(&[])),
];

/// # Errors
/// The first stage that fails; the times of those before it are printed all the same.
pub fn run(arguments: &[String]) -> Result<()> {
    none(arguments)?;
    let start = Instant::now();
    let mut times: Vec<(&str, Duration)> = Vec::new();

    println!("\n=== setup");
    let toolchain = setup::run(Extent::Everything)?;
    times.push(("setup", start.elapsed()));

    let outcome = stages(FIRST, &toolchain, &mut times)
        .and_then(|()| {
            let boards = Boards::begin()?;
            let beside = stages(BESIDE, &toolchain, &mut times);
            // Whatever came of the others: half an hour later nobody wants to hear of the next
            // failure.
            boards.end(&mut times).and(beside)
        })
        .and_then(|()| stages(LAST, &toolchain, &mut times));

    println!("\n=== times");
    for (name, time) in &times {
        println!("{:>7.1} s  {name}", time.as_secs_f64());
    }
    println!("{:>7.1} s  together", start.elapsed().as_secs_f64());
    outcome
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

/// `cargo xtask boards` as a process of its own, what it prints kept until it has ended.
struct Boards {
    child: std::process::Child,
    log: PathBuf,
    begun: Instant,
}

const BOARDS: &str = "boards and models, beside the others";

impl Boards {
    fn begin() -> Result<Self> {
        let log = target_folder().join("ci-boards.log");
        let file = File::create(&log).with_context(|| format!("cannot write {}", log.display()))?;
        let mut command = Command::new(std::env::current_exe()?);
        command.arg("boards").current_dir(root());
        command.stdout(file.try_clone()?).stderr(file);
        let child = command.spawn().context("cannot start xtask again")?;
        Ok(Self {
            child,
            log,
            begun: Instant::now(),
        })
    }

    fn end(mut self, times: &mut Vec<(&'static str, Duration)>) -> Result<()> {
        let status = self.child.wait()?;
        times.push((BOARDS, self.begun.elapsed()));
        println!("\n=== {BOARDS}");
        print!("{}", std::fs::read_to_string(&self.log)?);
        ensure!(status.success(), "stage '{BOARDS}'");
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

fn clippy_boards_and_models(toolchain: &Toolchain) -> Result<()> {
    for board in crates_in("boards")? {
        // `probe` is no board, and is linted as its tests are compiled: macros and what they are
        // made of serve both.
        if board.ends_with("probe") {
            process::run(probe_cargo("clippy").args(["--", "-D", "warnings"]))?;
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
    for board in ["stm32f446", "nrf52840"] {
        test::build_board(toolchain, board)?;
        let folder = root().join("boards").join(board);
        process::run(&mut toolchain.board_cargo(&folder, "test", &["--no-run"]))?;
    }
    Ok(())
}

/// Checks of flashing without a board: chips, memories and images, as probe-rs sees
/// them.
fn probe() -> Result<()> {
    let images = target_folder().join("boards/thumbv7em-none-eabihf/release");
    process::run(probe_cargo("test").env("SINEW_BOARD_IMAGES", images))
}

fn probe_cargo(verb: &str) -> Command {
    let mut command = cargo(&[verb, "--manifest-path", "boards/probe/Cargo.toml"]);
    command
        .arg("--target-dir")
        .arg(target_folder().join("boards"));
    command
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

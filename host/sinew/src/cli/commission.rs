//! `sinew commission`: the first power-up of a rig, step by step.

use std::io::{BufRead, IsTerminal};
use std::path::{Path, PathBuf};

use clap::{Args, FromArgMatches};
use sinew_sim::Plant;

use super::{Program, open_line};
use crate::commission::bench::Bench;
use crate::commission::journal::FILE;
use crate::commission::setup::{Range, Setup};
use crate::commission::step::Step;
use crate::commission::{BARE, Commissioning, RECORDINGS, RIG, Settings, rehearsal};
use crate::live::Names;
use crate::project::Board;
use crate::rig_file;
use sinew_ident::cli::overwrite;
use sinew_ident::cli::said::{Said, stand_aside};
use sinew_ident::error::{Error, Kind, Result};

/// Arguments of `sinew commission`. Ctrl-C sends the emergency stop at any time.
#[derive(Args)]
#[command(after_long_help = "Examples:\n  \
    sinew commission rig.toml --out first                        # writes the model to flash\n  \
    sinew commission rig.toml --out first --port /dev/ttyACM0    # and again after each fault\n  \
    sinew commission rig.toml --out trial --rehearse             # in QEMU, with a simulated rig")]
pub struct Arguments {
    /// The rig file (TOML), as declared; its actuators' limits are kept.
    rig: PathBuf,
    /// Folder of everything that is found; a later run goes on from there.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// The board's serial port, or the socket of one in QEMU.
    #[arg(long, value_name = "PORT", conflicts_with_all = ["probe", "rehearse"])]
    port: Option<PathBuf>,
    /// Through the debug probe of this board instead: no serial port is needed.
    #[arg(long, value_name = "BOARD", value_enum, conflicts_with = "rehearse")]
    probe: Option<Board>,
    /// The probe with this serial number.
    #[arg(long, value_name = "SERIAL", requires = "probe")]
    select: Option<String>,
    /// Rehearse: the firmware in QEMU, with a simulated rig.
    #[arg(long)]
    rehearse: bool,
    /// The rig file of the simulated rig; otherwise RIG.
    #[arg(long, value_name = "RIG", requires = "rehearse")]
    plant: Option<PathBuf>,
    /// Range in which an input may be commanded, in its column's unit; may be repeated.
    ///
    /// Without it, the `limit` of the rig.
    #[arg(long, value_name = "NAME=LOWER:UPPER", allow_hyphen_values = true)]
    range: Vec<String>,
    /// Largest part of the way from the safe command to a limit in the step `move`.
    #[arg(long, value_name = "PART", default_value_t = 0.2)]
    amplitude: f64,
    /// Factor by which a motion may differ from the predicted one.
    #[arg(long, value_name = "FACTOR", default_value_t = 2.0)]
    tolerance: f64,
    /// Duration of the way to one end position, s.
    #[arg(long, value_name = "S", default_value_t = 10.0)]
    sweep_seconds: f64,
    /// Duration of each of the two experiments, s.
    #[arg(long, value_name = "S", default_value_t = 30.0)]
    seconds: f64,
    /// Take this step only; those before it have to be finished.
    #[arg(long, value_name = "STEP", value_parser = step)]
    step: Option<Step>,
    /// End after this step.
    #[arg(long, value_name = "STEP", value_parser = step, conflicts_with = "step")]
    until: Option<Step>,
    /// Take this step and those after it again.
    #[arg(long, value_name = "STEP", value_parser = step, conflicts_with = "step")]
    again: Option<Step>,
    /// Move without asking first.
    #[arg(long)]
    yes: bool,
    /// Folder of cargo's build outputs, if they are to be shared; otherwise in DIR.
    #[arg(long, value_name = "DIR", env = "SINEW_BUILD_DIR")]
    build_dir: Option<PathBuf>,
    /// File for what is known so far as JSON (sinew-commission/1); `-` is standard output.
    ///
    /// The `commission.json` of DIR, as it is when the command ends, after a fault too.
    #[arg(long, value_name = "JSON")]
    json: Option<PathBuf>,
    /// Seed of everything that is drawn.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Print warnings and errors alone.
    #[arg(long)]
    quiet: bool,
}

/// A step by its name.
fn step(text: &str) -> std::result::Result<Step, String> {
    Step::named(text).ok_or_else(|| {
        let names = Step::ALL.map(Step::name).join(", ");
        match sinew_sim::suggest::nearest(text, Step::ALL.iter().map(|step| step.name())) {
            Some(near) => format!("did you mean `{near}`? The steps: {names}"),
            None => format!("the steps: {names}"),
        }
    })
}

/// `NAME=LOWER:UPPER`.
fn range(text: &str) -> Result<Range> {
    let parsed = text.split_once('=').and_then(|(name, ends)| {
        let (low, high) = ends.split_once(':')?;
        let number = |text: &str| text.trim().parse::<f64>().ok().filter(|x| x.is_finite());
        Some((name.trim().to_string(), number(low)?, number(high)?))
    });
    parsed.ok_or_else(|| {
        Error::must_be("--range", "NAME=LOWER:UPPER", text).help("for example --range u_V=-3:3")
    })
}

/// # Errors
/// A bad file or argument; a fault of the rig or its wiring; a board that is gone.
pub fn run(arguments: &Arguments) -> Result<()> {
    let said = Said::beside([arguments.json.as_deref()], arguments.quiet);
    if said.is_aside() {
        // The verbs of the last steps have lines of their own.
        stand_aside();
    }
    let begun = &mut false;
    let result = commission(arguments, said, begun);
    if *begun && let Some(path) = &arguments.json {
        let journal = arguments.out.join(FILE);
        let text = std::fs::read(&journal).map_err(|error| Error::read(&journal, error))?;
        sinew_files::write(path, text)?;
    }
    match result {
        // The status of a Ctrl-C is the program's.
        Err(error) if matches!(error.kind(), Kind::Interrupted) => {
            said.line("stopped; the same command goes on where it was");
            Ok(())
        }
        result => result,
    }
}

/// Takes the steps; `begun` is set once the folder has its journal.
fn commission(arguments: &Arguments, said: Said, begun: &mut bool) -> Result<()> {
    let out = arguments.out.as_path();
    if out.is_file() {
        return Err(Error::must_be(
            "--out",
            "a folder",
            format!("the file {}", out.display()),
        ));
    }
    let plant = arguments
        .plant
        .iter()
        .map(|path| ("--plant", path.as_path()));
    let written = [RIG, FILE, FITTED, CORRECTED].map(|name| out.join(name));
    overwrite::refuse(
        std::iter::once(("RIG", arguments.rig.as_path())).chain(plant),
        (written.iter().map(|path| ("--out", Some(path.as_path()))))
            .chain([("--json", arguments.json.as_deref())]),
    )?;
    let ranges = arguments.range.iter().map(|text| range(text));
    let ranges = ranges.collect::<Result<Vec<_>>>()?;
    let settings = Settings {
        amplitude: arguments.amplitude,
        tolerance: arguments.tolerance,
        sweep_s: arguments.sweep_seconds,
        excite_s: arguments.seconds,
        seed: arguments.seed,
        ..Settings::default()
    };
    settings.check()?;
    let setup = Setup::new(rig_file::load(&arguments.rig)?, &ranges)?;
    let simulated = match &arguments.plant {
        Some(path) => Plant::new(&rig_file::load(path)?)?,
        None => setup.plant.clone(),
    };
    let mut work = Commissioning::open(setup, out, arguments.rehearse, settings)?;
    if arguments.json.is_some() {
        work.journal.save(out)?;
        *begun = true;
    }
    if let Some(step) = arguments.again {
        if let Some(missing) = before(&work, step) {
            return Err(not_yet(step, missing));
        }
        work.forget(step)?;
    }
    let mut steps = steps(&work, arguments.step)?;
    steps.retain(|step| arguments.until.is_none_or(|last| *step <= last));
    if steps.is_empty() {
        said.line("nothing is left to do; --again STEP takes a step again, and those after it");
        return Ok(());
    }
    unread_lines(&work.setup, said);
    let on_board: Vec<Step> = steps.iter().copied().filter(|s| s.is_on_board()).collect();
    if !on_board.is_empty() {
        let is_there = arguments.rehearse || arguments.port.is_some() || arguments.probe.is_some();
        if !is_there {
            first_lines(arguments, said);
            return Ok(());
        }
        if on_board.iter().any(|step| step.moves()) && !arguments.rehearse {
            consent(arguments)?;
        }
        let device = if arguments.rehearse {
            let cache = arguments.build_dir.as_deref();
            let folder = out.join("rehearsal");
            rehearsal::start(&work.bare, &simulated, &folder, cache, arguments.quiet)?
        } else {
            open_line(
                arguments.port.as_deref(),
                arguments.probe,
                arguments.select.as_deref(),
            )?
        };
        let mut bench = Bench::new(device, Names::of(&work.bare))?;
        // On every new connection, before anything moves.
        if !on_board.contains(&Step::Stop) {
            say(said, Step::Stop, &work.on_board(Step::Stop, &mut bench)?);
        }
        for step in on_board {
            if let Some(first) = before(&work, step) {
                return Err(not_yet(step, first));
            }
            say(said, step, &work.on_board(step, &mut bench)?);
        }
    }
    for step in steps.into_iter().filter(|step| !step.is_on_board()) {
        offline(step, arguments, &work, said)?;
        work.finish(step)?;
    }
    match work.next() {
        Some(step) => said.next(format!("{} (the same command goes on there)", step.name())),
        None => {
            let controller = out.join(CONTROLLER);
            said.line(format!(
                "every step is finished; the controller is in {}",
                controller.display()
            ));
            said.next(format!(
                "sinew flash --board BOARD --model {}",
                controller.join("model").display()
            ));
        }
    }
    Ok(())
}

/// The fitted rig.
const FITTED: &str = "fitted.toml";
/// The corrected rig of the diagnosis.
const CORRECTED: &str = "corrected.toml";
/// Folder of the controller.
const CONTROLLER: &str = "controller";

/// Steps to take now.
fn steps(work: &Commissioning, only: Option<Step>) -> Result<Vec<Step>> {
    if let Some(step) = only {
        if let Some(first) = before(work, step) {
            return Err(not_yet(step, first));
        }
        return Ok(if work.has(step) { vec![] } else { vec![step] });
    }
    let Some(first) = work.next() else {
        return Ok(vec![]);
    };
    Ok(Step::ALL
        .into_iter()
        .filter(|step| *step >= first)
        .collect())
}

/// The first step before this one that is not finished.
fn before(work: &Commissioning, step: Step) -> Option<Step> {
    Step::ALL
        .into_iter()
        .find(|earlier| *earlier < step && !work.has(*earlier))
}

fn not_yet(step: Step, first: Step) -> Error {
    Error::arguments(format!(
        "`{}` comes after `{}`, which is not finished",
        step.name(),
        first.name()
    ))
    .help("without --step and --again the command goes on where it is")
}

fn say(said: Said, step: Step, lines: &[String]) {
    said.line(step.name());
    lines.iter().for_each(|line| said.line(format!("  {line}")));
}

/// Warnings of sensors that the board does not read.
fn unread_lines(setup: &Setup, said: Said) {
    if !setup.unread.is_empty() {
        said.warning(format!(
            "not read by the board, and left out of {RIG}: {}; `outputs` of [control] and \
             `channels` of [network] name what it reads",
            setup.unread.join(", ")
        ));
    }
    if !setup.sensed.is_empty() {
        said.warning(format!(
            "said by a soft sensor, so `check` and what follows need a camera: {}",
            setup.sensed.join(", ")
        ));
    }
}

/// Lines of a first run, which needs no board.
fn first_lines(arguments: &Arguments, said: Said) {
    let (rig, out) = (arguments.rig.display(), arguments.out.display());
    said.line(format!(
        "{}: the model that the board carries meanwhile",
        arguments.out.join(BARE).display()
    ));
    said.next(format!(
        "sinew wire {rig} --board BOARD, and fill in the scales\n      \
         sinew flash --board BOARD --model {out}/{BARE} --wiring TOML\n      \
         sinew commission {rig} --out {out} --port PORT\n\
         or:   sinew commission {rig} --out TRIAL --rehearse"
    ));
}

/// Asks a person before anything moves.
fn consent(arguments: &Arguments) -> Result<()> {
    if arguments.yes {
        return Ok(());
    }
    let refused = || {
        Error::arguments("nothing may move without consent")
            .expected("`yes` on the terminal, or --yes")
    };
    if !std::io::stdin().is_terminal() {
        return Err(refused());
    }
    // Not on standard output, which may be a document.
    eprint!(
        "The rig is going to move: each actuator alone, then all. Keep away from it, and a hand on \
         the switch of its supply. Ctrl-C is the emergency stop. Go on? (yes) "
    );
    let mut answer = String::new();
    let read = std::io::stdin().lock().read_line(&mut answer);
    match (read, answer.trim()) {
        (Ok(_), "yes") => Ok(()),
        _ => Err(refused()),
    }
}

/// Takes a step that needs no board, by the verb of its name.
fn offline(step: Step, arguments: &Arguments, work: &Commissioning, said: Said) -> Result<()> {
    if let Some(column) = work.setup.sensed.first() {
        return Err(Error::file(
            &work.setup.rig.file,
            format!("a soft sensor says `{column}`, so the recordings have no such column"),
        )
        .expected("recordings with the outputs, from a camera beside the board")
        .help("put both on one base of times (sinew convert), then sinew check, fit and build"));
    }
    let at = |name: &str| arguments.out.join(name).display().to_string();
    let [fit, test] = RECORDINGS.map(at);
    let mut words: Vec<String> = vec!["sinew".into(), step.name().into()];
    let mut add = |more: &[&str]| words.extend(more.iter().map(|word| (*word).to_string()));
    let pair = ["--fit", &fit, "--test", &test];
    match step {
        Step::Check => add(&[&fit, &test, "--rig", &at(RIG), "--json", &at("check.json")]),
        Step::Fit => {
            add(&[&at(RIG), "--out", &at(FITTED), "--json", &at("fit.json")]);
            add(&pair);
        }
        Step::Diagnose => {
            add(&[
                &at(RIG),
                "--rig-out",
                &at(CORRECTED),
                "--json",
                &at("diagnosis.json"),
            ]);
            add(&["--report", &at("diagnosis.html")]);
            add(&pair);
        }
        Step::Build => {
            let corrected = at(CORRECTED);
            let rig = if Path::new(&corrected).exists() {
                corrected
            } else {
                at(FITTED)
            };
            add(&[&rig, "--out", &at(CONTROLLER)]);
            add(&pair);
            if let Some(cache) = &arguments.build_dir {
                add(&["--build-dir", &cache.display().to_string()]);
            }
        }
        Step::Stop | Step::Rest | Step::Move | Step::Ends | Step::Excite => {
            return Err(Error::failed(format!("`{}` needs the board", step.name())));
        }
    }
    if !matches!(step, Step::Check) && arguments.quiet {
        add(&["--quiet"]);
    }
    said.line(words.join(" "));
    let parsed = super::help::command().try_get_matches_from(&words);
    let program = parsed.and_then(|matches| Program::from_arg_matches(&matches));
    let program = program.map_err(|error| Error::failed(error.to_string()))?;
    super::run(program.verb).map(|_| ())
}

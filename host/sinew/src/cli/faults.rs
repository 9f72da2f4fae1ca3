//! `sinew faults`: every channel of a soft sensor broken in every way, one after another, in the
//! loop.

use std::path::{Path, PathBuf};

use clap::Args;
use clap::builder::RangedU64ValueParser;
use rayon::prelude::*;
use serde_json::json;
use sinew_model::fingerprint;
use sinew_model::spec::ModelSpec;

use super::LoopArguments;
use super::conditions::Conditions;
use crate::closed_loop::channel_fault::{ChannelFault, FaultKind, Pair, WithFault};
use crate::closed_loop::model_loop::ModelLoop;
use crate::closed_loop::mpc::MpcController;
use crate::closed_loop::scenario::{Run, Scenario};
use crate::closed_loop::setup::{Setup, same_bits};
use crate::project::{self, Board, Built};
use sinew_device::protocol::Health;
use sinew_ident::cli::overwrite;
use sinew_ident::cli::progress::Stage;
use sinew_ident::cli::said::Said;
use sinew_ident::error::{Error, Result};
use sinew_ident::report::{count, quantity};

/// Time within which a fault should be found, seconds.
const SOON_S: f64 = 2.0;

/// Arguments of `sinew faults`.
#[derive(Args)]
#[command(after_long_help = "Example:\n  \
    sinew faults rig.toml model --fit camera.csv --out firmware-faults")]
pub struct Arguments {
    #[command(flatten)]
    of_loop: LoopArguments,
    /// Folder of a model with a soft sensor: model.toml and weights.safetensors.
    model: PathBuf,
    /// The rig file of the plant in the loop, taken as written.
    ///
    /// Without it, RIG with every free parameter moved.
    #[arg(long, value_name = "RIG")]
    plant: Option<PathBuf>,
    /// Plants, each with the same reference; the pairs take them in turn.
    ///
    /// Every free parameter of --plant, or of RIG, is drawn within --spread.
    #[arg(long, value_name = "N", value_parser = RangedU64ValueParser::<usize>::new().range(1..=1000))]
    draws: Option<usize>,
    /// Largest relative deviation of a drawn parameter.
    #[arg(
        long,
        value_name = "FRACTION",
        requires = "draws",
        default_value_t = 0.2
    )]
    spread: f64,
    #[command(flatten)]
    conditions: Conditions,
    /// Judge errors until this time only, seconds.
    #[arg(long, value_name = "SECONDS")]
    until: Option<f64>,
    /// Time of the fault, seconds; otherwise a third of the reference.
    #[arg(long, value_name = "SECONDS")]
    at: Option<f64>,
    /// Least error that a fault has to add to matter, in the unit of the outputs.
    #[arg(long, value_name = "ERROR", default_value_t = 1e-4)]
    matters: f64,
    /// Board on which the cost of the watch is measured, in one loop without a fault.
    ///
    /// Its commands must have the bits of this computer's.
    #[arg(long, value_enum)]
    board: Option<Board>,
    /// File for every pair as JSON (sinew-faults/1); `-` is standard output.
    #[arg(long, value_name = "JSON")]
    json: Option<PathBuf>,
}

/// # Errors
/// A bad file, a model whose channels are not watched, or firmware that does not build or run.
pub fn run(arguments: &Arguments) -> Result<()> {
    let of_loop = &arguments.of_loop;
    let recordings = &of_loop.recordings;
    let recordings = recordings.fit.iter().chain(&recordings.test);
    arguments.conditions.refuse()?;
    if !(0.0..1.0).contains(&arguments.spread) {
        let expectation = "a fraction of a parameter in [0, 1)";
        return Err(Error::must_be("--spread", expectation, arguments.spread)
            .help("for example --spread 0.2: from 20 % below to 20 % above"));
    }
    if !(arguments.matters.is_finite() && arguments.matters >= 0.0) {
        return Err(
            Error::must_be("--matters", "a number, 0 or more", arguments.matters)
                .help("for example --matters 0.0001: a tenth of a millimetre"),
        );
    }
    let read = std::iter::once(("RIG", of_loop.rig.as_path()))
        .chain(arguments.plant.iter().map(|p| ("--plant", p.as_path())))
        .chain((arguments.conditions.reference.iter()).map(|p| ("--reference", p.as_path())))
        .chain(recordings.map(|p| ("a recording", p.as_path())));
    overwrite::refuse(read, [("--json", arguments.json.as_deref())])?;
    let mut ready = of_loop.load(arguments.plant.as_deref())?;
    arguments
        .conditions
        .apply(&mut ready, of_loop.common.quiet)?;
    if let Some(count) = arguments.draws {
        ready.draw(arguments.spread, count);
    }
    let spec = ready.model(&arguments.model)?;
    let unwatched = unwatched(&spec, arguments)?;
    if ready.task.outputs.len() > 1 && !ready.task.one_unit {
        return Err(
            Error::arguments("the outputs have several units, so no one error")
                .expected("outputs of one unit"),
        );
    }
    let duration = ready.task.duration_s();
    let until = arguments.until.unwrap_or(duration);
    let at = arguments.at.unwrap_or(until.min(duration) / 3.0);
    if !(0.0 < at && at < until && until <= duration) {
        let expectation = format!("0 < --at < --until <= {duration:.1} s, where the path ends");
        return Err(Error::must_be("--at", expectation, at));
    }
    let scenarios = match ready.drawn.as_slice() {
        [] => vec![ready.bench().scenario(&ready.values)?],
        drawn => ready.bench().scenarios_of(drawn)?,
    };
    let judge = Judge {
        ready: &ready,
        watched: Firmware::build(of_loop, &spec, "watched")?,
        unwatched: Firmware::build(of_loop, &unwatched, "unwatched")?,
        window: [at, until],
    };
    let pairs_count = FaultKind::ALL.len() * spec.channels.len();
    let title = format!("run {} sound and broken", count(scenarios.len(), "plant"));
    let stage = Stage::begin(title, of_loop.common.quiet);
    let sound: Vec<(f64, Vec<Health>)> = scenarios
        .par_iter()
        .map(|scenario| judge.run(&judge.watched, scenario, None))
        .collect::<Result<_>>()?;
    let places: Vec<(usize, FaultKind, usize)> = (0..spec.channels.len())
        .flat_map(|channel| FaultKind::ALL.map(|kind| (channel, kind)))
        .enumerate()
        .map(|(k, (channel, kind))| (channel, kind, k % scenarios.len()))
        .collect();
    let pairs: Vec<Pair> = places
        .par_iter()
        .map(|(channel, kind, plant)| {
            let fault = judge.fault(&spec, *channel, *kind);
            let scenario = &scenarios[*plant];
            let (rms, seen) = judge.run(&judge.watched, scenario, Some(fault))?;
            let (without, _) = judge.run(&judge.unwatched, scenario, Some(fault))?;
            let name = &spec.channels[*channel].name;
            Ok(Pair::of(
                name,
                &fault,
                &seen,
                [sound[*plant].0, rms, without],
            ))
        })
        .collect::<Result<_>>()?;
    stage.end(count(pairs_count, "pair"));
    let alarms = sound
        .iter()
        .filter(|(_, seen)| seen.iter().any(|h| h.times > 0));
    let alarms = alarms.count();
    let said = Said::beside([arguments.json.as_deref()], of_loop.common.quiet);
    let unit = ready.units().next().unwrap_or("1").to_string();
    said.line(table(&pairs, arguments.matters, &unit));
    said.line(format!(
        "without a fault: {} in {}; error {} RMS in the median loop",
        count(alarms, "false alarm"),
        count(sound.len(), "loop"),
        quantity(median(sound.iter().map(|(rms, _)| *rms)), &unit)
    ));
    let costs = match (arguments.board, scenarios.get(..1)) {
        (Some(board), Some(one)) => {
            let specs = [&judge.watched.on(board), &judge.unwatched.on(board)];
            let costs = [(&spec, specs[0]), (&unwatched, specs[1])]
                .map(|(spec, folder)| Cost::measure(&ready, of_loop, spec, folder, board, one));
            let [watched, unwatched] = costs;
            let [watched, unwatched] = [watched?, unwatched?];
            said.line(watched.beside(&unwatched, board));
            json!({ "watched": watched.value(), "unwatched": unwatched.value() })
        }
        _ => serde_json::Value::Null,
    };
    if let Some(path) = &arguments.json {
        let document = json!({
            "format": "sinew-faults/1",
            "model": spec.name,
            "at_s": at,
            "matters": arguments.matters,
            "unit": unit,
            "sound_rms": sound.iter().map(|(rms, _)| *rms).collect::<Vec<_>>(),
            "false_alarms": alarms,
            "cost": costs,
            "pairs": pairs.iter().map(Pair::value).collect::<Vec<_>>(),
        });
        sinew_files::write(path, format!("{document:#}\n"))?;
        said.wrote(path);
    }
    said.next(format!(
        "sinew emit {} --out firmware",
        arguments.model.display()
    ));
    Ok(())
}

/// The model without its watch.
fn unwatched(spec: &ModelSpec, arguments: &Arguments) -> Result<ModelSpec> {
    let mut unwatched = spec.clone();
    let watch = unwatched.soft_sensor.as_mut().and_then(|s| s.watch.take());
    if watch.is_some() {
        return Ok(unwatched);
    }
    let path = arguments.model.join(sinew_model::store::MODEL_FILE);
    Err(Error::file(path, "the model watches no channels")
        .expected("[soft_sensor] with `watched = true`: four or more channels in `sensed_by`")
        .help("a model gets it by `sinew calibrate --watch`"))
}

/// A controller built for this computer.
struct Firmware {
    folder: PathBuf,
    built: Built,
    hash: u32,
    watched: bool,
}

impl Firmware {
    /// Folder of its sources for a board.
    fn on(&self, board: Board) -> PathBuf {
        let name = self.folder.file_name().unwrap_or_default();
        self.folder
            .with_file_name(format!("{}-{}", name.to_string_lossy(), board.name()))
    }

    fn build(of_loop: &LoopArguments, spec: &ModelSpec, name: &str) -> Result<Self> {
        let folder = of_loop.out.join(name);
        eprint!(
            "{}",
            project::kept(&project::write(&folder, spec, of_loop.optimise)?)
        );
        let cache = of_loop.build_dir.as_deref();
        let built = project::build_shown(&folder, Board::Host, cache, of_loop.common.quiet)?;
        Ok(Self {
            folder,
            built,
            hash: fingerprint(spec),
            watched: spec.soft_sensor.as_ref().is_some_and(|s| s.watch.is_some()),
        })
    }
}

/// Cost of a controller on a board.
struct Cost {
    /// Ticks of a step: mean and largest.
    ticks: (f64, u32),
    /// Bytes of flash and RAM, where the board has an image.
    bytes: Option<(u64, u64)>,
}

impl Cost {
    /// Runs one loop on the board and on this computer.
    ///
    /// # Errors
    /// It does not build or run, or the bits differ.
    fn measure(
        ready: &ModelLoop,
        of_loop: &LoopArguments,
        spec: &ModelSpec,
        folder: &Path,
        board: Board,
        scenario: &[Scenario],
    ) -> Result<Self> {
        let run = |board| of_loop.run(ready, spec, folder, board, scenario);
        let (on_board, here) = (run(board)?, run(Board::Host)?);
        let pairs = on_board.runs.iter().zip(&here.runs);
        for (board, here) in pairs {
            if !same_bits(&board.answers, &here.answers) {
                return Err(Error::failed(
                    "the board and this computer give different commands",
                ));
            }
        }
        let ticks = on_board.runs.iter().flat_map(|run| &run.answers);
        let ticks: Vec<u32> = ticks.map(|answer| answer.ticks).collect();
        let sum: f64 = ticks.iter().map(|t| f64::from(*t)).sum();
        Ok(Self {
            ticks: (
                sum / ticks.len().max(1) as f64,
                ticks.iter().copied().max().unwrap_or(0),
            ),
            bytes: on_board
                .image
                .map(|sizes| (sizes.flash_bytes, sizes.ram_bytes)),
        })
    }

    /// One line that says what the watch costs.
    fn beside(&self, unwatched: &Self, board: Board) -> String {
        let bytes = match (self.bytes, unwatched.bytes) {
            (Some(with), Some(without)) => format!(
                ", {} B of flash ({}), {} B of RAM ({})",
                with.0, without.0, with.1, without.1
            ),
            _ => String::new(),
        };
        format!(
            "a step on {} with the watch (without): {:.0} ticks in the mean ({:.0}), {} at most ({}){bytes}; \
             the same bits on this computer",
            board.name(),
            self.ticks.0,
            unwatched.ticks.0,
            self.ticks.1,
            unwatched.ticks.1
        )
    }

    fn value(&self) -> serde_json::Value {
        json!({
            "ticks_mean": self.ticks.0,
            "ticks_max": self.ticks.1,
            "flash_bytes": self.bytes.map(|(flash, _)| flash),
            "ram_bytes": self.bytes.map(|(_, ram)| ram),
        })
    }
}

/// Loops with faults and without.
struct Judge<'a> {
    ready: &'a ModelLoop,
    watched: Firmware,
    unwatched: Firmware,
    /// Times from the fault to the end of what is judged, seconds.
    window: [f64; 2],
}

impl Judge<'_> {
    fn fault(&self, spec: &ModelSpec, channel: usize, kind: FaultKind) -> ChannelFault {
        let task = &self.ready.task;
        ChannelFault {
            kind,
            channel,
            from: (self.window[0] / task.period_s).ceil() as usize,
            period_s: task.period_s,
            range: 2.0 * spec.channels[channel].span,
            noise: task.channel_noise[channel],
        }
    }

    /// Error over the window, and what the controller said after every step. A plant that diverges
    /// has none.
    fn run(
        &self,
        firmware: &Firmware,
        scenario: &Scenario,
        fault: Option<ChannelFault>,
    ) -> Result<(f64, Vec<Health>)> {
        let mut device = Setup::start(&firmware.folder, Board::Host, &firmware.built)?;
        let controller = MpcController::new(&mut device, firmware.hash)?;
        let mut controller = controller.sensed(true);
        let seed = scenario.seed.wrapping_add(7000);
        let mut broken = WithFault::new(&mut controller, fault, firmware.watched, seed);
        let run = scenario.run(&mut broken)?;
        let seen = std::mem::take(&mut broken.seen);
        device.finish()?;
        Ok((self.error(&run), seen))
    }

    fn error(&self, run: &Run) -> f64 {
        run.between(self.window[0], self.window[1]).distance().rms
    }
}

/// Table by kinds of fault, and the pairs that were missed.
fn table(pairs: &[Pair], least: f64, unit: &str) -> String {
    let mut text = format!(
        "{:<10}{:>8}{:>10}{:>10}{:>12}{:>12}{:>12}{:>12}\n",
        "fault", "matter", "found", "latest", "another", "ratio", "worst", "unwatched"
    );
    for kind in FaultKind::ALL {
        let of: Vec<&Pair> = pairs.iter().filter(|p| p.kind == kind).collect();
        let matter: Vec<&&Pair> = of.iter().filter(|p| p.matters(least)).collect();
        let soon = matter.iter().filter(|p| soon(p)).count();
        let latest = matter.iter().filter_map(|p| p.found_s).fold(0.0, f64::max);
        let another = of.iter().filter(|p| p.blamed_another).count();
        let ratios = || matter.iter().map(|p| p.ratio());
        let unwatched = matter.iter().map(|p| p.rms[2]);
        text += &format!(
            "{:<10}{:>8}{:>10}{:>10}{:>12}{:>12}{:>12}{:>12}\n",
            kind.name(),
            matter.len(),
            soon,
            format!("{latest:.2} s"),
            another,
            format!("{:.2}", median(ratios())),
            format!("{:.2}", ratios().fold(0.0, f64::max)),
            quantity(median(unwatched), unit)
        );
    }
    for pair in pairs.iter().filter(|p| p.matters(least) && !soon(p)) {
        text += &format!(
            "not within {SOON_S} s: {} {}, {} instead of {}\n",
            pair.channel,
            pair.kind.name(),
            quantity(pair.rms[1], unit),
            quantity(pair.rms[0], unit)
        );
    }
    let matter = pairs.iter().filter(|p| p.matters(least));
    let all = matter.clone().count();
    let found = matter.filter(|p| soon(p)).count();
    text += &format!("found within {SOON_S} s: {found} of the {all} that matter");
    text
}

fn soon(pair: &Pair) -> bool {
    pair.found_s.is_some_and(|s| s <= SOON_S)
}

/// The median; NaN of nothing.
fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

//! The command line: one file a verb; the exit status is decided here and nowhere else.

mod adopt;
mod build;
mod calibrate;
mod commission;
mod compare;
mod completions;
mod conditions;
mod emit;
mod explain;
mod faults;
mod flash;
mod help;
mod imitate;
mod import;
mod monitor;
mod new;
mod pil;
mod plan;
mod prefer;
mod record;
mod result;
mod settle;
mod share;
mod simulate;
mod size;
mod train;
mod tune;
mod values;
mod verify;
mod wire;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{Args, FromArgMatches, Parser, Subcommand};

use crate::closed_loop::model_loop::{BoardRuns, ModelLoop};
use crate::closed_loop::scenario::Scenario;
use crate::device::Device;
use crate::flash as probes;
use crate::live::Names;
use crate::project::{Board, Optimise};
use crate::rig_file::{self, ControlTable};
use sinew_device::protocol::Identity;
pub use sinew_ident::cli::{Common, Recordings};
use sinew_ident::cli::{
    check, colour, convert, diagnose, excite, failing, fit, fleet, interrupt, learn, mjcf,
};
use sinew_ident::error::{Error, Result};
use sinew_model::spec::ModelSpec;

/// From a recording and a rig to a controlled Cortex-M4F.
#[derive(Parser)]
#[command(name = "sinew", version, about, arg_required_else_help = true)]
struct Program {
    #[command(flatten)]
    colour: colour::Colour,
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Subcommand)]
enum Verb {
    /// Fit, train, tune, emit, build, run on a board, compare with a PID, report.
    Build(build::Arguments),
    /// Write a first rig file from the columns of a recording, or from MJCF or URDF.
    New(new::Arguments),
    /// Find faults of recordings before any fit.
    Check(check::Arguments),
    /// Make a recording of a log in MATLAB, HDF5, MCAP or JSON.
    Convert(convert::Arguments),
    /// Simulate a rig with the inputs of a recording.
    Simulate(simulate::Arguments),
    /// Find where a rig rests under constant inputs.
    Settle(settle::Arguments),
    /// Design an experiment within the limits of a rig.
    Excite(excite::Arguments),
    /// Plan commands that reach goals, through friction, slack and stops.
    Plan(plan::Arguments),
    /// Make a small policy of one demonstrated motion, and the commands of that motion.
    Imitate(imitate::Arguments),
    /// Fit the parameters of a rig to recordings.
    Fit(fit::Arguments),
    /// Learn the law of a spring or a damper for this rig and others.
    Learn(learn::Arguments),
    /// Estimate the distribution of a fleet from recordings of its devices.
    Fleet(fleet::Arguments),
    /// Make recordings of a fleet that may be published, under a privacy budget.
    Share(share::Arguments),
    /// Find the physics that a rig lacks.
    Diagnose(diagnose::Arguments),
    /// Explain an effect, verdict, fault or status by its name.
    Explain(explain::Arguments),
    /// Write a rig for MuJoCo.
    Mjcf(mjcf::Arguments),
    /// Train a network on a rig and write the model.
    Train(train::Arguments),
    /// Calibrate the soft sensor of a model for one device.
    Calibrate(calibrate::Arguments),
    /// Read a network of another tool and show its layers.
    Import(import::Arguments),
    /// Wire a rig's sensors and actuators to the pins of a board.
    Wire(wire::Arguments),
    /// Write the sources of a model's firmware, or of a network alone.
    Emit(emit::Arguments),
    /// Compare a network with the framework that wrote it, by your own Python.
    Verify(verify::Arguments),
    /// Show the flash, RAM, stack and time of a network on a board.
    Size(size::Arguments),
    /// Tune the MPC, PID and RISE for an objective.
    Tune(tune::Arguments),
    /// Find the weights that a person prefers by asking which of two loops is better.
    Prefer(prefer::Arguments),
    /// Compare MPCs with a tuned PID and a tuned RISE on one plant.
    Compare(compare::Arguments),
    /// Break each channel of a soft sensor in the loop and show what the controller finds.
    Faults(faults::Arguments),
    /// Run the firmware on a board against the simulated plant (processor in the loop).
    Pil(pil::Arguments),
    /// Build the firmware for a board and write it into its flash.
    Flash(flash::Arguments),
    /// Play an excitation on the hardware of a board and write a recording.
    Record(record::Arguments),
    /// Watch and steer the hardware of a board, live.
    Monitor(monitor::Arguments),
    /// Power up a rig for the first time: emergency stop, signs, scales, limits, a recording.
    Commission(commission::Arguments),
    /// Take what a device has learned while it ran back into its rig.
    Adopt(adopt::Arguments),
    /// Print the completion script of a shell.
    Completions(completions::Arguments),
    /// Write the man pages.
    #[command(hide = true)]
    ManPages(completions::ManArguments),
    /// Print the help of every verb as Markdown.
    #[command(hide = true)]
    CliReference,
}

/// Refuses what an image is made for where no image is made.
///
/// # Errors
/// It was asked for.
fn speed_alone(optimise: Optimise) -> Result<()> {
    if optimise.is_speed() {
        return Ok(());
    }
    Err(
        Error::arguments("--optimise is for a controller, not for a network alone")
            .expected("a model of `sinew train`")
            .help("name one, or leave --optimise out"),
    )
}

/// The recordings as they would be typed again, each flag after a space.
fn recording_flags(recordings: &Recordings) -> String {
    let Recordings { fit, test } = recordings;
    let fit = fit.iter().map(|path| format!(" --fit {}", path.display()));
    let test = test
        .iter()
        .map(|path| format!(" --test {}", path.display()));
    fit.chain(test).collect()
}

/// A rig, its recordings and where its loop is built: what `compare` and `pil` take.
#[derive(Args, Clone, Debug)]
pub struct LoopArguments {
    /// The rig file (TOML), fitted.
    rig: PathBuf,
    #[command(flatten)]
    recordings: Recordings,
    /// Folder of the firmware's sources and images.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Folder of cargo's build outputs, if they are to be shared; otherwise DIR/target.
    #[arg(long, value_name = "DIR", env = "SINEW_BUILD_DIR")]
    build_dir: Option<PathBuf>,
    /// Optimisation goal of an image; this computer's program is the same either way.
    #[arg(long, value_enum, default_value = "speed")]
    optimise: Optimise,
    #[command(flatten)]
    common: Common,
}

impl LoopArguments {
    /// Reads the files.
    ///
    /// # Errors
    /// As [`ModelLoop::load`].
    fn load(&self, plant: Option<&Path>) -> Result<ModelLoop> {
        ModelLoop::load(
            &self.rig,
            plant,
            &self.recordings.fit,
            &self.recordings.test,
            self.common.seed,
            self.common.quiet,
        )
    }

    /// Runs loops of a model on a board.
    ///
    /// # Errors
    /// As [`ModelLoop::run`].
    fn run(
        &self,
        ready: &ModelLoop,
        spec: &ModelSpec,
        folder: &Path,
        board: Board,
        scenarios: &[Scenario],
    ) -> Result<BoardRuns> {
        ready.run(
            spec,
            folder,
            (board, self.optimise),
            self.build_dir.as_deref(),
            self.common.quiet,
            scenarios,
        )
    }
}

/// A board that runs, and the model that it carries: what `record` and `monitor` take.
#[derive(Args, Clone, Debug)]
pub struct LiveArguments {
    /// The board's serial port, or the socket of one in QEMU.
    #[arg(
        long,
        value_name = "PORT",
        required_unless_present = "probe",
        conflicts_with = "probe"
    )]
    port: Option<PathBuf>,
    /// Through the debug probe of this board instead: no serial port is needed.
    #[arg(long, value_name = "BOARD", value_enum)]
    probe: Option<Board>,
    /// The probe with this serial number.
    #[arg(long, value_name = "SERIAL", requires = "probe")]
    select: Option<String>,
    /// Folder of the model that the board carries: model.toml and weights.safetensors.
    #[arg(long, value_name = "DIR")]
    model: PathBuf,
    /// The rig of the model, where a column of its files is not in SI (`unit = "deg"`).
    #[arg(long, value_name = "RIG")]
    rig: Option<PathBuf>,
}

impl LiveArguments {
    /// Names and units of the signals. `writes`: columns of a file are read or written, so their
    /// units matter.
    ///
    /// # Errors
    /// A bad model; columns in a unit that nothing says.
    fn names(&self, writes: bool) -> Result<Names> {
        let names = Names::load(&self.model)?;
        if writes {
            names.in_units_of(self.rig.as_deref())
        } else {
            Ok(names)
        }
    }

    /// Opens the port and makes sure of who is there.
    ///
    /// # Errors
    /// No port, the wrong board.
    fn connect(&self, names: &Names) -> Result<(Device, Identity)> {
        let mut device = open_line(self.port.as_deref(), self.probe, self.select.as_deref())?;
        let identity = names.greet(&mut device)?;
        Ok((device, identity))
    }
}

/// Opens the line to a board: its serial port, or its debug probe.
///
/// # Errors
/// No port, no probe, or neither is named.
fn open_line(port: Option<&Path>, probe: Option<Board>, select: Option<&str>) -> Result<Device> {
    match (port, probe) {
        (Some(port), _) => Device::port(port),
        (None, Some(board)) => {
            let options = probes::Options {
                select: select.map(str::to_string),
                ..probes::Options::default()
            };
            probes::connect(probes::chip(board)?, &options)
        }
        (None, None) => Err(Error::arguments("no board").help("name one with --port or --probe")),
    }
}

/// Runs the program: 0 when it did what was asked, 2 for bad arguments or bad files, 130 after
/// Ctrl-C, 141 where nobody reads on, 1 for anything else; with `--exit-code` 3 or 4 by the result.
pub fn main() -> ExitCode {
    // A handler that cannot be installed costs only the tidying up; the system still ends the
    // process.
    let _ = ctrlc::set_handler(|| {
        if interrupt::is_taken() {
            return;
        }
        // Held until the process is gone: nothing starts a child, makes a file, or takes a killed
        // child for a failure of its own any more.
        let _children = crate::device::kill_all();
        let _files = sinew_files::remove_unfinished();
        eprintln!("\nstopped; no file was left half written");
        std::process::exit(interrupt::STATUS.into());
    });
    failing::end_with_standard_output(|| {
        (crate::device::kill_all(), sinew_files::remove_unfinished())
    });
    let choice = colour::asked(std::env::args_os());
    colour::choose(choice);
    let parsed = help::command().color(choice).try_get_matches();
    let program = match parsed.and_then(|matches| Program::from_arg_matches(&matches)) {
        Ok(program) => program,
        Err(error) => {
            // clap's own words, on the stream that fits: help is no error.
            let _ = error.print();
            return ExitCode::from(if error.use_stderr() { 2 } else { 0 });
        }
    };
    match run(program.verb) {
        Ok(code) => interrupt::status(code),
        Err(error) => failing::status(&error),
    }
}

/// Control rate of a rig, where its `[control]` table has one.
///
/// # Errors
/// A bad rig.
fn control_rate_hz(rig: &Path) -> Result<Option<f64>> {
    let rig = rig_file::load(rig)?;
    Ok(ControlTable::read(&rig)?.and_then(|control| control.rate_hz))
}

/// Runs a verb and returns the exit status.
fn run(verb: Verb) -> Result<u8> {
    let done = match verb {
        Verb::Build(arguments) => build::run(&arguments),
        Verb::New(arguments) => new::run(arguments),
        Verb::Check(arguments) => return check::run(&arguments),
        Verb::Convert(arguments) => convert::run(&arguments),
        Verb::Simulate(arguments) => simulate::run(&arguments),
        Verb::Settle(arguments) => settle::run(&arguments),
        Verb::Calibrate(arguments) => calibrate::run(&arguments),
        Verb::Excite(arguments) => excite::run(&arguments, control_rate_hz(&arguments.rig)?),
        Verb::Plan(arguments) => plan::run(&arguments),
        Verb::Imitate(arguments) => imitate::run(&arguments),
        Verb::Fit(arguments) => {
            rig_file::check(&arguments.rig)?;
            return fit::run(&arguments);
        }
        Verb::Learn(arguments) => {
            rig_file::check(&arguments.rig)?;
            learn::run(&arguments)
        }
        Verb::Fleet(arguments) => {
            rig_file::check(&arguments.rig)?;
            fleet::run(&arguments)
        }
        Verb::Share(arguments) => share::run(&arguments),
        Verb::Diagnose(arguments) => {
            rig_file::check(&arguments.rig)?;
            return diagnose::run(&arguments);
        }
        Verb::Explain(arguments) => explain::run(&arguments),
        Verb::Mjcf(arguments) => {
            rig_file::check(&arguments.rig)?;
            mjcf::run(&arguments)
        }
        Verb::Train(arguments) => train::run(&arguments),
        Verb::Tune(arguments) => tune::run(&arguments),
        Verb::Prefer(arguments) => prefer::run(&arguments),
        Verb::Emit(arguments) => emit::run(&arguments),
        Verb::Import(arguments) => import::run(&arguments),
        Verb::Verify(arguments) => verify::run(&arguments),
        Verb::Wire(arguments) => wire::run(&arguments),
        Verb::Size(arguments) => size::run(&arguments),
        Verb::Compare(arguments) => return compare::run(&arguments),
        Verb::Faults(arguments) => faults::run(&arguments),
        Verb::Pil(arguments) => pil::run(&arguments),
        Verb::Flash(arguments) => flash::run(&arguments),
        Verb::Record(arguments) => record::run(&arguments),
        Verb::Monitor(arguments) => monitor::run(&arguments),
        Verb::Commission(arguments) => commission::run(&arguments),
        Verb::Adopt(arguments) => adopt::run(&arguments),
        Verb::Completions(arguments) => {
            completions::run(&arguments);
            Ok(())
        }
        Verb::ManPages(arguments) => completions::man_pages(&arguments),
        Verb::CliReference => {
            print!("{}", help::reference());
            Ok(())
        }
    };
    done.map(|()| 0)
}

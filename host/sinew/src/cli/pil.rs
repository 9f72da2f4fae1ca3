//! `sinew pil`: processor in the loop.

use std::path::PathBuf;

use clap::Args;
use serde_json::{Value, json};

use super::LoopArguments;
use crate::adopt::{Columns, recorded};
use crate::closed_loop::setup::{DeviceRun, same_bits};
use crate::device::Device;
use crate::project::Board;
use crate::report::{LoopPage, loop_page};
use crate::rig_file;
use sinew_ident::cli::overwrite;
use sinew_ident::cli::said::Said;
use sinew_ident::error::{Error, Result};
use sinew_ident::report::{Provenance, quantity};

/// Arguments of `sinew pil`.
#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    of_loop: LoopArguments,
    /// Folder of the model: model.toml and weights.safetensors.
    model: PathBuf,
    /// The rig file of the plant in the loop, taken as written.
    ///
    /// Without it, RIG with every free parameter moved.
    #[arg(long, value_name = "RIG")]
    plant: Option<PathBuf>,
    /// Board of the controller.
    #[arg(long, value_enum, default_value = "qemu")]
    board: Board,
    /// Serial port of a board that is flashed already and paces itself.
    ///
    /// Or the socket of one in QEMU.
    #[arg(long, value_name = "PORT", conflicts_with = "board")]
    port: Option<PathBuf>,
    /// File for the loop as a recording: commands, measurements, what the controller learned.
    #[arg(long, value_name = "CSV")]
    recording: Option<PathBuf>,
    /// File for the scores as JSON (sinew-pil/1); `-` is standard output.
    #[arg(long, value_name = "JSON")]
    json: Option<PathBuf>,
    /// File for a page: reference, plant and commands over time, counts of the device.
    #[arg(long, value_name = "HTML")]
    report: Option<PathBuf>,
}

/// # Errors
/// A bad file, a model that does not fit the rig, firmware that does not build or run.
pub fn run(arguments: &Arguments) -> Result<()> {
    let of_loop = &arguments.of_loop;
    let rig = ("RIG", of_loop.rig.as_path());
    let recordings = of_loop
        .recordings
        .fit
        .iter()
        .chain(&of_loop.recordings.test);
    overwrite::refuse(
        recordings
            .map(|path| ("a recording", path.as_path()))
            .chain(std::iter::once(rig)),
        [
            ("--json", arguments.json.as_deref()),
            ("--report", arguments.report.as_deref()),
            ("--recording", arguments.recording.as_deref()),
        ],
    )?;
    let said = Said::beside(
        [arguments.json.as_deref(), arguments.report.as_deref()],
        of_loop.common.quiet,
    );
    let ready = of_loop.load(arguments.plant.as_deref())?;
    let spec = ready.model(&arguments.model)?;
    let rig_name = rig_file::load(&of_loop.rig)?.name;
    let bench = ready.bench();
    let scenario = [bench.scenario(&ready.values)?];
    let run = |board: Board| -> Result<DeviceRun> {
        let runs = of_loop.run(&ready, &spec, &of_loop.out, board, &scenario)?;
        let run = runs.runs.into_iter().next();
        run.ok_or_else(|| Error::failed("no loop was run"))
    };
    let device = match &arguments.port {
        None => run(arguments.board)?,
        Some(port) => bench.loop_with(Device::port(port)?, &spec, &scenario[0])?.0,
    };
    let outputs: Vec<(&str, &str)> = (ready.units().zip(&ready.task.outputs))
        .map(|(unit, sensor)| (ready.plant.sensors()[*sensor].column.as_str(), unit))
        .collect();
    for (i, (signal, unit)) in outputs.iter().enumerate() {
        said.line(format!(
            "{signal}: {} RMS, {} at most, over {} steps",
            quantity(device.score.rms[i], unit),
            quantity(device.score.max[i], unit),
            device.summary.steps
        ));
    }
    said.line(format!(
        "{} late, {} samples missed, {} frames rejected, {} B of stack",
        device.summary.deadline_misses,
        device.summary.missed_samples,
        device.summary.frames_rejected,
        device.summary.stack_high_water_bytes
    ));
    let mut equal = None;
    if arguments.port.is_some() {
        // In real time some samples come too late, and what stands in for them is no other run's.
        said.line(format!("{} ticks without a sample in time", device.late));
    } else if arguments.board != Board::Host {
        if !same_bits(&device.answers, &run(Board::Host)?.answers) {
            return Err(Error::failed(
                "the board and this computer give different commands",
            ));
        }
        equal = Some(true);
        said.line("the same bits on this computer");
    }
    if !device.log.is_empty() {
        said.line(device.log.trim_end());
    }
    if let Some(path) = &arguments.recording {
        let inputs = ready.plant.inputs().iter().map(|it| it.column.as_str());
        let signals = (inputs.collect(), outputs.iter().map(|it| it.0).collect());
        let text = recorded(
            path,
            &Columns::of(&spec),
            &device.run,
            &device.learned,
            signals,
        )?;
        sinew_files::write(path, text)?;
        said.wrote(path);
    }
    let next = format!("sinew emit {} --out firmware", arguments.model.display());
    if let Some(path) = &arguments.report {
        let inputs: Vec<(&str, &str)> = (ready.plant.inputs().iter())
            .map(|input| (input.column.as_str(), input.unit()))
            .collect();
        let port = arguments.port.as_ref();
        let board = port.map_or(arguments.board.name().into(), |it| it.display().to_string());
        let page = LoopPage {
            rig: &rig_name,
            board: &board,
            next: &next,
            reference: &ready.task.reference_source,
            outputs: &outputs,
            inputs: &inputs,
            same_bits: equal,
            late: port.map(|_| device.late),
        };
        let made = Provenance::typed().seed(of_loop.common.seed);
        loop_page(&page, &device, &made).write(path)?;
        said.wrote(path);
    }
    if let Some(path) = &arguments.json {
        let text = format!("{:#}\n", document(&device, &outputs, equal));
        sinew_files::write(path, text)?;
        said.wrote(path);
    }
    said.next(next);
    Ok(())
}

/// The loop as JSON, SI. `outputs` are signals with their units; `equal` tells whether every
/// command has the bits of this computer's build, none where that was not compared.
fn document(device: &DeviceRun, outputs: &[(&str, &str)], equal: Option<bool>) -> Value {
    let (score, summary) = (&device.score, &device.summary);
    let output = |(i, (signal, unit)): (usize, &(&str, &str))| json!({ "signal": signal, "unit": unit, "rms": score.rms[i], "max": score.max[i] });
    json!({
        "format": "sinew-pil/1",
        "steps": summary.steps,
        "outputs": outputs.iter().enumerate().map(output).collect::<Vec<_>>(),
        "outside_limits": score.outside_limits,
        "deadline_misses": summary.deadline_misses,
        "missed_samples": summary.missed_samples,
        "frames_rejected": summary.frames_rejected,
        "stack_bytes": summary.stack_high_water_bytes,
        "host_equals_device": equal,
    })
}

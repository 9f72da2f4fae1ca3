//! `sinew import`: a network of another tool.

use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::{Value, json};
use sinew_model::{import, store};
use sinew_nn::{Network, commands};
use sinew_sim::Plant;

use super::{Recordings, recording_flags, result};
use crate::closed_loop::control_problem::ControlProblem;
use crate::pipeline::import::{adopt, judged};
use crate::pipeline::learn::save;
use crate::pipeline::soft_sensor::{attach, sensor_line};
use crate::rig_file;
use sinew_ident::cli::overwrite::{self, identity};
use sinew_ident::cli::repair::read_recordings;
use sinew_ident::cli::said::Said;
use sinew_ident::error::{Error, Result};
use sinew_ident::report::quantity;

/// Arguments of `sinew import`.
#[derive(Args)]
pub struct Arguments {
    /// The network: .onnx, .keras, .h5, .tflite, or a folder with network.toml or model.toml.
    network: PathBuf,
    /// Folder to write it to, as network.toml and weights.safetensors; with --rig as a model.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Make it the predictor of this rig's controller: a model for tune, compare, emit and flash.
    #[arg(long, value_name = "RIG", requires_all = ["fit", "out"])]
    rig: Option<PathBuf>,
    /// A recording (CSV) that says how far signals go; may be repeated.
    #[arg(long, value_name = "CSV", requires = "rig")]
    fit: Vec<PathBuf>,
    /// A recording that the model is judged on; may be repeated.
    #[arg(long, value_name = "CSV", requires = "rig")]
    test: Vec<PathBuf>,
    /// File for the layers as JSON (sinew-import/1); `-` is standard output.
    #[arg(long, value_name = "JSON")]
    json: Option<PathBuf>,
    /// Print warnings and errors alone.
    #[arg(long)]
    quiet: bool,
}

/// # Errors
/// A file that is no network, or one with a layer that cannot be emitted; a network that does not
/// fit the rig.
pub fn run(arguments: &Arguments) -> Result<()> {
    if let Some(out) = &arguments.out {
        refuse_own_folder(&arguments.network, out)?;
    }
    let json = arguments.json.as_deref();
    let recordings = arguments
        .fit
        .iter()
        .chain(&arguments.test)
        .chain(&arguments.rig);
    overwrite::refuse(
        std::iter::once(&arguments.network)
            .chain(recordings)
            .map(|path| ("an input", path.as_path())),
        [("--json", json)],
    )?;
    let said = Said::beside([json], arguments.quiet);
    match (&arguments.rig, &arguments.out) {
        (Some(rig), Some(out)) => model(arguments, rig, out, said),
        (_, out) => {
            let network = import::read(&arguments.network).map_err(Error::refused)?;
            let text = commands::import(&network, out.as_deref()).map_err(Error::refused)?;
            let rounded = rounding(&network, &arguments.network)?;
            said.line(format!("{text}{rounded}").trim_end());
            let own = out.as_deref().unwrap_or(&arguments.network);
            said.next(format!("sinew size {}", own.display()));
            result::write(json, || document(&network, &arguments.network, Value::Null))
        }
    }
}

/// `sinew-import/1`: the layers for programs.
fn document(network: &Network, file: &Path, model: Value) -> Value {
    let layers = network.nodes.iter().map(|node| {
        let from = node
            .from
            .iter()
            .map(|&from| network.nodes[from].name.as_str());
        json!({
            "name": node.name,
            "kind": node.op.kind(),
            "from": from.collect::<Vec<_>>(),
            "shape": node.shape,
            "parameters": node.op.parameters(),
        })
    });
    let rounding = sinew_nn::import::rounding(file).ok().flatten();
    json!({
        "format": "sinew-import/1",
        "name": network.name,
        "inputs": network.inputs(),
        "outputs": network.outputs(),
        "state": network.state(),
        "parameters": network.parameters(),
        "layers": layers.collect::<Vec<_>>(),
        "rounding": rounding.map(|rounding| json!({
            "bits": rounding.bits,
            "input": rounding.input,
            "loss": rounding.drawn_loss(network),
        })),
        "model": model,
    })
}

/// The lines about values that a quantised file's framework rounds.
pub(super) fn rounding(network: &Network, file: &Path) -> Result<String> {
    commands::rounding(network, file).map_err(Error::refused)
}

/// The network's own folder holds the weights that the result would replace.
fn refuse_own_folder(network: &Path, out: &Path) -> Result<()> {
    if !network.is_dir() || identity(out) != identity(network) {
        return Ok(());
    }
    Err(Error::arguments(format!(
        "--out {} is the network's own folder, whose weights it would replace",
        out.display()
    ))
    .help("name another"))
}

fn model(arguments: &Arguments, rig_path: &Path, out: &Path, said: Said) -> Result<()> {
    let network = import::read(&arguments.network).map_err(Error::refused)?;
    let text = commands::import(&network, None).map_err(Error::refused)?;
    let rig = rig_file::load(rig_path)?;
    let plant = Plant::new(&rig)?;
    let read = |paths: &[PathBuf]| read_recordings(paths, arguments.quiet);
    let (fit, test) = (read(&arguments.fit)?, read(&arguments.test)?);
    let task = ControlProblem::new(&rig, &plant, &fit, test.first().unwrap_or(&fit[0]))?;
    let mut spec = adopt(&rig, &plant, &task, &fit, (&network, &arguments.network))?;
    let errors = judged(
        &rig,
        &plant,
        &task,
        &spec,
        if test.is_empty() { &fit } else { &test },
    );
    let sensor = attach(&mut spec, &task, &plant, &fit, false)?;
    save(out, &spec)?;
    said.line(text.trim_end());
    if let Some(sensor) = &sensor {
        said.line(sensor_line(&spec, sensor));
    }
    match &errors {
        Some((next, last)) => {
            for (i, unit) in task.units(&plant).enumerate() {
                said.line(format!(
                    "{}: {} off after one step, {} after {}, on recordings with their noise",
                    spec.outputs[i].name,
                    quantity(next[i], unit),
                    quantity(last[i], unit),
                    task.rollout()
                ));
            }
        }
        None => {
            said.line(
                "not judged: the recordings have gaps, another rate than the controller, or too few rows",
            );
        }
    }
    said.line(out.join(store::MODEL_FILE).display());
    let recordings = Recordings {
        fit: arguments.fit.clone(),
        test: arguments.test.clone(),
    };
    said.next(format!(
        "sinew tune {} {}{} --out tuned.toml --model-out tuned",
        rig_path.display(),
        out.display(),
        recording_flags(&recordings)
    ));
    let outputs: Vec<&str> = spec.outputs.iter().map(|o| o.name.as_str()).collect();
    let judged = errors.map(|(next, last)| {
        json!({ "one_step_rms": next, "horizon_rms": last, "horizon": task.rollout() })
    });
    let model = json!({ "folder": out, "outputs": outputs, "judged": judged });
    result::write(arguments.json.as_deref(), || {
        document(&network, &arguments.network, model)
    })
}

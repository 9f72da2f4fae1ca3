//! `sinew import`: a network of another tool.

use std::path::{Path, PathBuf};

use clap::Args;
use sinew_model::{import, store};
use sinew_nn::{Network, commands};
use sinew_sim::Plant;

use crate::closed_loop::control_problem::ControlProblem;
use crate::pipeline::import::{adopt, judged};
use crate::pipeline::learn::save;
use crate::pipeline::soft_sensor::{attach, sensor_line};
use crate::rig_file;
use sinew_ident::cli::overwrite::identity;
use sinew_ident::cli::repair::read_recording;
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
}

/// # Errors
/// A file that is no network, or one with a layer that cannot be emitted; a network that does not
/// fit the rig.
pub fn run(arguments: &Arguments) -> Result<()> {
    if let Some(out) = &arguments.out {
        refuse_own_folder(&arguments.network, out)?;
    }
    match (&arguments.rig, &arguments.out) {
        (Some(rig), Some(out)) => model(arguments, rig, out),
        (_, out) => {
            let network = import::read(&arguments.network).map_err(Error::refused)?;
            let text = commands::import(&network, out.as_deref());
            print!("{}", text.map_err(Error::refused)?);
            print!("{}", rounding(&network, &arguments.network)?);
            Ok(())
        }
    }
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

fn model(arguments: &Arguments, rig: &Path, out: &Path) -> Result<()> {
    let network = import::read(&arguments.network).map_err(Error::refused)?;
    let text = commands::import(&network, None).map_err(Error::refused)?;
    let rig = rig_file::load(rig)?;
    let plant = Plant::new(&rig)?;
    let read = |paths: &[PathBuf]| paths.iter().map(read_recording).collect::<Result<Vec<_>>>();
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
    print!("{text}");
    if let Some(sensor) = &sensor {
        println!("{}", sensor_line(&spec, sensor));
    }
    match errors {
        Some((next, last)) => {
            for (i, unit) in task.units(&plant).enumerate() {
                println!(
                    "{}: {} off after one step, {} after {}, on recordings with their noise",
                    spec.outputs[i].name,
                    quantity(next[i], unit),
                    quantity(last[i], unit),
                    task.rollout()
                );
            }
        }
        None => {
            println!(
                "not judged: the recordings have gaps, another rate than the controller, or too few rows"
            )
        }
    }
    println!("{}", out.join(store::MODEL_FILE).display());
    Ok(())
}

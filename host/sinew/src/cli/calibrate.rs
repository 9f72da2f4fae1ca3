//! `sinew calibrate`: the soft sensor of a model, for one device.

use std::path::PathBuf;

use clap::Args;
use serde_json::json;
use sinew_model::store;
use sinew_sim::Plant;

use super::result;
use crate::closed_loop::control_problem::ControlProblem;
use crate::pipeline::learn::save;
use crate::pipeline::soft_sensor::{attach, sensor_line};
use crate::rig_file;
use sinew_ident::cli::overwrite;
use sinew_ident::cli::repair::read_recordings;
use sinew_ident::cli::said::Said;
use sinew_ident::error::{Error, Result};

/// Arguments of `sinew calibrate`.
#[derive(Args)]
#[command(after_long_help = "Examples:\n  \
    sinew calibrate rig.toml model --fit camera.csv --out model-7\n  \
    sinew emit model-7 --out firmware-7")]
pub struct Arguments {
    /// The rig file (TOML) with `sensed_by` in its [control] table.
    rig: PathBuf,
    /// Folder of the model: model.toml and weights.safetensors.
    model: PathBuf,
    /// A recording of this device that has the channels and the outputs; may be repeated.
    #[arg(long, value_name = "CSV", required = true)]
    fit: Vec<PathBuf>,
    /// Folder for the model with this device's soft sensor.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Let the channels watch one another: one that dies, freezes or drifts is left out.
    ///
    /// For four channels or more. Try it with `sinew faults` first: where a motion goes beyond the
    /// calibration, sound channels contradict one another too.
    #[arg(long)]
    watch: bool,
    /// File for the errors as JSON (sinew-calibration/1); `-` is standard output.
    #[arg(long, value_name = "JSON")]
    json: Option<PathBuf>,
    /// Print warnings and errors alone.
    #[arg(long)]
    quiet: bool,
}

/// # Errors
/// A bad file, a rig or model without a soft sensor, or recordings that do not determine it.
pub fn run(arguments: &Arguments) -> Result<()> {
    let recordings = arguments.fit.iter();
    overwrite::refuse(
        [
            ("RIG", arguments.rig.as_path()),
            ("MODEL", arguments.model.join(store::MODEL_FILE).as_path()),
        ]
        .into_iter()
        .chain(recordings.map(|path| ("a recording", path.as_path()))),
        [
            (
                "--out",
                Some(arguments.out.join(store::MODEL_FILE).as_path()),
            ),
            ("--json", arguments.json.as_deref()),
        ],
    )?;
    let rig = rig_file::load(&arguments.rig)?;
    let plant = Plant::new(&rig)?;
    let recordings = read_recordings(&arguments.fit, arguments.quiet)?;
    let task = ControlProblem::new(&rig, &plant, &recordings, &recordings[0])?;
    if !task.sensed {
        return Err(
            Error::file(&rig.file, "the rig has no soft sensor").expected(
                "`sensed_by` in [control]: the sensors that say the outputs while the device runs",
            ),
        );
    }
    let mut spec = store::load(&arguments.model).map_err(Error::refused)?;
    let columns = |sensors: &[usize]| -> Vec<&str> {
        let each = sensors.iter();
        each.map(|s| plant.sensors()[*s].column.as_str()).collect()
    };
    let outputs: Vec<&str> = spec.outputs.iter().map(|s| s.name.as_str()).collect();
    if outputs != columns(&task.outputs) || spec.soft_sensor.is_none() {
        let path = arguments.model.join(store::MODEL_FILE);
        let message = "the model is not one of this rig with a soft sensor";
        return Err(Error::file(path, message)
            .expected(format!(
                "[soft_sensor], and the outputs {}",
                columns(&task.outputs).join(", ")
            ))
            .help("train one: sinew train"));
    }
    let Some(found) = attach(&mut spec, &task, &plant, &recordings, arguments.watch)? else {
        unreachable!("a task with a soft sensor has one to attach");
    };
    save(&arguments.out, &spec)?;
    let said = Said::beside([arguments.json.as_deref()], arguments.quiet);
    said.line(sensor_line(&spec, &found));
    said.line(arguments.out.join(store::MODEL_FILE).display());
    said.next(format!(
        "sinew emit {} --out firmware",
        arguments.out.display()
    ));
    let outputs = spec.outputs.iter().zip(&found.spec.error);
    let outputs = outputs
        .map(|(signal, error)| json!({ "signal": signal.name, "unit": signal.unit, "rms": error }));
    let watch = found.spec.watch.as_ref();
    let channels = spec.channels.iter().enumerate().map(|(k, channel)| {
        // A spread is of half the range.
        let spread = watch.and_then(|watch| watch.spread.get(k));
        json!({ "signal": channel.name, "spread_part": spread.map(|s| 0.5 * f64::from(*s)) })
    });
    result::write(arguments.json.as_deref(), || {
        json!({
            "format": "sinew-calibration/1",
            "model": spec.name,
            "rows": found.rows,
            "outputs": outputs.collect::<Vec<_>>(),
            "channels": channels.collect::<Vec<_>>(),
            "watched": watch.is_some(),
        })
    })
}

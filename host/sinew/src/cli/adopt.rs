//! `sinew adopt`: what a device has learned, taken back into its rig.

use std::path::PathBuf;

use clap::Args;
use serde_json::{Value, json};
use sinew_model::store;

use super::result;
use crate::adopt::{Learned, Source, adopt};
use crate::rig_file;
use sinew_ident::cli::overwrite;
use sinew_ident::cli::said::Said;
use sinew_ident::error::{Error, Result};
use sinew_ident::recording::Recording;
use sinew_ident::report::quantity;

/// Arguments of `sinew adopt`.
#[derive(Args)]
#[command(after_long_help = "Examples:\n  \
    sinew monitor --port /dev/ttyACM0 --model out/model --out run.csv\n  \
    sinew adopt rig.toml out/model run.csv --out adopted.toml\n  \
    sinew adopt rig.toml out/model run.csv --only mass.inertia --out adopted.toml")]
pub struct Arguments {
    /// The rig file (TOML).
    rig: PathBuf,
    /// Folder of the model that the device carried: model.toml and weights.safetensors.
    model: PathBuf,
    /// The recording of `sinew record`, `sinew monitor` or `sinew pil`.
    recording: PathBuf,
    /// File for the rig with what the device learned; its comments are kept.
    #[arg(long, value_name = "TOML")]
    out: PathBuf,
    /// Take this parameter and leave the others as they are; may be repeated.
    #[arg(long, value_name = "NAME")]
    only: Vec<String>,
    /// File for what was learned as JSON (sinew-adopt/1); `-` is standard output.
    #[arg(long, value_name = "JSON")]
    json: Option<PathBuf>,
    /// Print warnings and errors alone.
    #[arg(long)]
    quiet: bool,
}

/// # Errors
/// A bad file, a recording of another model, a parameter that the device has not learned.
pub fn run(arguments: &Arguments) -> Result<()> {
    overwrite::refuse(
        [
            ("the rig", arguments.rig.as_path()),
            ("the recording", arguments.recording.as_path()),
        ],
        [
            ("--out", Some(arguments.out.as_path())),
            ("--json", arguments.json.as_deref()),
        ],
    )?;
    let rig = rig_file::load(&arguments.rig)?;
    let spec = store::load(&arguments.model).map_err(Error::refused)?;
    let path = &arguments.recording;
    let bytes = std::fs::read(path).map_err(|error| Error::read(path, error))?;
    let source = Source {
        recording: &Recording::parse(&bytes, path)?,
        text: &String::from_utf8_lossy(&bytes),
        model: &arguments.model,
    };
    let (adopted, learned) = adopt(&rig, &spec, &source, &arguments.only)?;
    sinew_files::write(&arguments.out, adopted.to_toml())?;
    let json = arguments.json.as_deref();
    result::write(json, || document(arguments, &rig.name, &learned))?;
    let said = Said::beside([Some(arguments.out.as_path()), json], arguments.quiet);
    for it in &learned {
        let [low, high] = it.interval.map(|end| quantity(end, &it.unit));
        said.line(format!(
            "{:<32} {:>14} → {:>14}   ({low} to {high})",
            it.name,
            quantity(it.before, &it.unit),
            quantity(it.value, &it.unit)
        ));
    }
    said.wrote(&arguments.out);
    if !sinew_files::is_output(&arguments.out) {
        said.next(format!(
            "sinew train {} --fit FILE.csv --out MODEL",
            arguments.out.display()
        ));
    }
    Ok(())
}

/// `sinew-adopt/1`: the parameters before and after, SI.
fn document(arguments: &Arguments, rig: &str, learned: &[Learned]) -> Value {
    let parameters = learned.iter().map(|it| {
        json!({
            "name": it.name,
            "unit": it.unit,
            "before": it.before,
            "value": it.value,
            "ci95": it.interval,
        })
    });
    json!({
        "format": "sinew-adopt/1",
        "rig": rig,
        "model": arguments.model,
        "recording": arguments.recording,
        "adopted": arguments.out,
        "parameters": parameters.collect::<Vec<_>>(),
    })
}

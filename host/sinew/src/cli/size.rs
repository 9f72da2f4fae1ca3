//! `sinew size`: what a network, and the controller around it, takes on a board, before anything is
//! flashed.

use std::path::PathBuf;

use clap::Args;
use serde_json::{Value, json};
use sinew_model::{import, store};
use sinew_nn::commands;
use sinew_nn::emit::{Accuracy, Options, Weights};
use sinew_nn::footprint::{BOARDS, CYCLES_PER_INSTRUCTION, Cost, Fit};

use super::{result, speed_alone};
use crate::pipeline::footprint::{self, REMARK, measure, table};
use crate::project::{Board, Optimise};
use sinew_ident::cli::overwrite;
use sinew_ident::cli::progress::Stage;
use sinew_ident::cli::said::Said;
use sinew_ident::error::{Error, Result};
use sinew_ident::report::count;

/// Arguments of `sinew size`.
#[derive(Args)]
pub struct Arguments {
    /// The network: a file or folder that `sinew import` reads, or a model of `sinew train`.
    network: PathBuf,
    /// stm32f446, nrf52840 or qemu; without it every board.
    #[arg(long)]
    board: Option<String>,
    /// Largest error of tanh: the cheapest function within it is taken.
    #[arg(long, value_name = "T", default_value = "2e-6")]
    tanh_tolerance: Accuracy,
    /// float32, or int8: a quarter of the flash for weights; the loss of accuracy is printed.
    #[arg(long, value_name = "KIND", default_value = "float32")]
    weights: Weights,
    /// Optimisation goal of a controller's image.
    #[arg(long, value_enum, default_value = "speed")]
    optimise: Optimise,
    /// Folder that keeps what is compiled, for the next time.
    #[arg(
        long,
        value_name = "DIR",
        env = "SINEW_BUILD_DIR",
        default_value = "target/size"
    )]
    build_dir: PathBuf,
    /// File for the figures as JSON (sinew-size/1); `-` is standard output.
    #[arg(long, value_name = "JSON")]
    json: Option<PathBuf>,
    /// Print warnings and errors alone.
    #[arg(long)]
    quiet: bool,
}

/// # Errors
/// A network that cannot be emitted, a board that is not there, or no compiler for the target.
pub fn run(arguments: &Arguments) -> Result<()> {
    let (network, folder) = (&arguments.network, &arguments.build_dir);
    // A model of `sinew train` has a controller around its network.
    let spec = if network.join(store::MODEL_FILE).is_file() {
        store::load(network).ok()
    } else {
        None
    };
    if spec.is_none() {
        speed_alone(arguments.optimise)?;
    }
    let json = arguments.json.as_deref();
    overwrite::refuse([("NETWORK", network.as_path())], [("--json", json)])?;
    let said = Said::beside([json], arguments.quiet);
    let mut document = json!({
        "format": "sinew-size/1",
        "name": null,
        "weights": if arguments.weights == Weights::Int8 { "int8" } else { "float32" },
        "network": null,
        "controller": null,
    });
    // Without a board that is named, of a model the controller alone.
    if arguments.board.is_some() || spec.is_none() {
        bare(arguments, said, &mut document)?;
    }
    let is_model = spec.is_some();
    if let Some(spec) = spec {
        let asked = |board: &Board| {
            let named = arguments.board.as_deref();
            named.is_none_or(|name| name == board.folder())
        };
        let boards: Vec<Board> = Board::ALL.into_iter().filter(asked).collect();
        let (steps, rows) = measure(&spec, &boards, arguments.optimise, folder, arguments.quiet)?;
        said.line("");
        said.line(format!(
            "{}\n{}\n{}\n{}",
            table(&spec, &steps, &rows).text(),
            footprint::verdicts(&spec, &steps, &rows),
            footprint::parts(&spec, &steps).text(),
            REMARK.trim_end()
        ));
        document["name"] = json!(spec.name);
        document["controller"] = footprint::json(&spec, &steps, &rows);
    }
    let path = arguments.network.display();
    let is_too_large = (document["network"]["boards"]
        .as_array()
        .into_iter()
        .flatten())
    .any(|board| board["predict_fits"] == false);
    said.next(if is_model {
        format!("sinew emit {path} --out firmware")
    } else if is_too_large && arguments.weights == Weights::Float32 {
        format!("sinew size {path} --weights int8")
    } else {
        format!("sinew emit {path} --out crate")
    });
    result::write(json, || document)
}

/// The network alone.
fn bare(arguments: &Arguments, said: Said, document: &mut Value) -> Result<()> {
    let named = arguments.board.as_deref();
    let on = named.map(commands::board).transpose();
    let on = on.map_err(|e| Error::arguments(e.to_string()))?;
    let options = Options {
        accuracy: arguments.tanh_tolerance,
        weights: arguments.weights,
        ..Options::default()
    };
    let network = import::read(&arguments.network).map_err(Error::refused)?;
    let stage = Stage::begin("link it and count in QEMU", arguments.quiet);
    let sized = commands::size(&network, named, &options, &arguments.build_dir);
    let (text, found, layers) = sized.map_err(|e| Error::failed(e.to_string()))?;
    stage.end(count(layers.len(), "layer"));
    said.line(text.trim_end());
    let chip = on.and_then(|board| board.chip);
    let cost = |cost: &Cost| {
        let time_s = chip.zip(cost.instructions).map(|(chip, instructions)| {
            instructions as f64 * CYCLES_PER_INSTRUCTION / f64::from(chip.clock_hz)
        });
        json!({
            "flash_bytes": cost.flash_bytes,
            "ram_bytes": cost.ram_bytes,
            "stack_bytes": cost.stack_bytes,
            "instructions": cost.instructions,
            "time_s": time_s,
        })
    };
    let layers = layers.iter().map(|layer| {
        json!({
            "name": layer.name,
            "kind": layer.kind,
            "shape": layer.shape,
            "weight_bytes": layer.weight_bytes,
            "code_bytes": layer.code_bytes,
            "ram_bytes": layer.ram_bytes,
            "stack_bytes": layer.stack_bytes,
            "instructions": layer.instructions,
        })
    });
    let boards = BOARDS.iter().filter(|it| on.is_none_or(|one| one == *it));
    let boards = boards.map(|board| {
        json!({
            "board": board.name,
            "flash_bytes": board.flash_bytes,
            "ram_bytes": board.ram_bytes,
            "predict_fits": Fit::of(&found.predict, board).fits(),
            "jacobian_fits": Fit::of(&found.jacobian, board).fits(),
        })
    });
    document["name"] = json!(network.name);
    document["network"] = json!({
        "board": named,
        "parameters": network.parameters(),
        "weight_bytes": found.weight_bytes,
        "predict": cost(&found.predict),
        "jacobian": cost(&found.jacobian),
        "layers": layers.collect::<Vec<_>>(),
        "boards": boards.collect::<Vec<_>>(),
    });
    Ok(())
}

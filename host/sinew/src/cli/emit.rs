//! `sinew emit`: the firmware of a model, or a network as a crate and as a library for C.

use std::path::PathBuf;

use clap::Args;
use serde_json::{Value, json};
use sinew_model::policy::load;
use sinew_model::spec::ModelSpec;
use sinew_model::{import, store};
use sinew_nn::emit::{Accuracy, Options, Weights};
use sinew_nn::store::NETWORK_FILE;
use sinew_nn::{Network, commands, quantise};

use super::imitate::is_policy;
use super::import::rounding;
use super::{result, speed_alone};
use crate::project::{self, Optimise, c_library};
use sinew_ident::cli::overwrite;
use sinew_ident::cli::progress::Stage;
use sinew_ident::cli::said::Said;
use sinew_ident::error::{Error, Result};

/// Folder of a controller for C in that of its network.
const CONTROLLER: &str = "controller";

/// Arguments of `sinew emit`.
#[derive(Args)]
pub struct Arguments {
    /// A model of `sinew train`, a policy of `sinew imitate`, or a network.
    ///
    /// A model is a folder with model.toml and weights.safetensors; a policy is one with
    /// policy.toml.
    model: PathBuf,
    /// Folder of the sources.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Static libraries with headers for C: of a network, and of a controller in controller/.
    ///
    /// The network of a controller has the model's scaling inside. One with form = "state" has no
    /// library of its own.
    #[arg(long)]
    c_abi: bool,
    /// Largest error of tanh, in a network alone: the cheapest function within it is printed.
    #[arg(long, value_name = "T", default_value = "2e-6")]
    tanh_tolerance: Accuracy,
    /// float32, or int8: a quarter of the flash for weights; the loss of accuracy is printed.
    #[arg(long, value_name = "KIND", default_value = "float32")]
    weights: Weights,
    /// Optimisation goal of a controller's image.
    #[arg(long, value_enum, default_value = "speed")]
    optimise: Optimise,
    /// Wiring of a controller's board, as `sinew wire` writes it.
    #[arg(long, value_name = "TOML", conflicts_with = "c_abi")]
    wiring: Option<PathBuf>,
    /// File for what was written as JSON (sinew-emit/1); `-` is standard output.
    #[arg(long, value_name = "JSON")]
    json: Option<PathBuf>,
    /// Print warnings and errors alone.
    #[arg(long)]
    quiet: bool,
}

/// # Errors
/// A bad model, a file that cannot be written, or a library that does not build.
pub fn run(arguments: &Arguments) -> Result<()> {
    if arguments.out.is_file() {
        let out = arguments.out.display();
        return Err(Error::must_be(
            "--out",
            "a folder",
            format!("the file {out}"),
        ));
    }
    let json = arguments.json.as_deref();
    overwrite::refuse([("MODEL", arguments.model.as_path())], [("--json", json)])?;
    let said = Said::beside([json], arguments.quiet);
    let folder = arguments.model.join(NETWORK_FILE);
    let is_network = arguments.model.is_file() || folder.is_file();
    if is_network && arguments.wiring.is_some() {
        return Err(Error::arguments(
            "--wiring is for a controller, not for a network alone",
        ));
    }
    let size = format!("sinew size {}", arguments.model.display());
    if is_policy(&arguments.model) {
        speed_alone(arguments.optimise)?;
        let network = policy(arguments, said)?;
        said.next(size);
        return result::write(json, || document(arguments, Some(&network), None));
    }
    if is_network {
        speed_alone(arguments.optimise)?;
        let network = network(arguments, said)?;
        said.next(if arguments.model.is_file() {
            format!(
                "sinew verify {} {}",
                arguments.model.display(),
                arguments.out.display()
            )
        } else {
            size
        });
        return result::write(json, || document(arguments, Some(&network), None));
    }
    let plain =
        arguments.tanh_tolerance == Accuracy::default() && arguments.weights == Weights::default();
    if !plain {
        return Err(Error::arguments(
            "--tanh-tolerance and --weights are for a network alone, not for a controller",
        ));
    }
    let spec = store::load(&arguments.model).map_err(Error::refused)?;
    if arguments.c_abi {
        let network = for_c(arguments, &spec, said)?;
        said.next(size);
        return result::write(json, || document(arguments, network.as_ref(), Some(&spec)));
    }
    let wired = project::wired::wired(arguments.wiring.as_deref(), &spec, None, arguments.quiet)?;
    let kept = project::write_wired(&arguments.out, &spec, arguments.optimise, &wired)?;
    eprint!("{}", project::kept(&kept));
    said.line(format!(
        "{}: the model, as Rust",
        arguments.out.join("model").display()
    ));
    let board = match &arguments.wiring {
        Some(file) => project::wired::read(file)?.1.name,
        None => "qemu",
    };
    said.line(format!(
        "{}: `cargo build --release` makes its image",
        arguments.out.join("boards").join(board).display()
    ));
    said.next(size);
    result::write(json, || document(arguments, None, Some(&spec)))
}

/// Files that were left as they are, a line each.
/// `sinew-emit/1`: what was written, for programs.
fn document(
    arguments: &Arguments,
    network: Option<&Network>,
    controller: Option<&ModelSpec>,
) -> Value {
    let int8 = arguments.weights == Weights::Int8;
    let network = network.map(|network| {
        let loss = int8.then(|| quantise::loss(network));
        json!({
            "name": network.name,
            "inputs": network.inputs(),
            "outputs": network.outputs(),
            "state": network.state(),
            "parameters": network.parameters(),
            "weights": if int8 { "int8" } else { "float32" },
            "loss": loss.map(|loss| json!({ "max": loss.largest, "rms": loss.rms })),
        })
    });
    json!({
        "format": "sinew-emit/1",
        "folder": arguments.out,
        "c_abi": arguments.c_abi,
        "network": network,
        "controller": controller.map(|spec| json!({
            "name": spec.name,
            "period_s": spec.period_s,
            "outputs": spec.outputs.iter().map(|o| o.name.as_str()).collect::<Vec<_>>(),
        })),
    })
}

/// Prints a policy as crates: its network, and what is around it.
fn policy(arguments: &Arguments, said: Said) -> Result<Network> {
    if arguments.c_abi {
        return Err(Error::arguments("--c-abi is for a network or a controller")
            .expected("a policy is printed as Rust"));
    }
    let options = Options {
        accuracy: arguments.tanh_tolerance,
        weights: arguments.weights,
        c_abi: false,
    };
    let spec = load(&arguments.model).map_err(Error::refused)?;
    let kept = project::policy::write(&arguments.out, &spec, &options)?;
    eprint!("{}", project::kept(&kept));
    said.line(format!(
        "{}: the policy as a crate; `cargo test` compares it with double precision",
        arguments.out.join("policy").display()
    ));
    Ok(spec.network)
}

/// Prints a network as a crate.
fn network(arguments: &Arguments, said: Said) -> Result<Network> {
    let options = Options {
        accuracy: arguments.tanh_tolerance,
        weights: arguments.weights,
        c_abi: arguments.c_abi,
    };
    let network = import::read(&arguments.model).map_err(Error::refused)?;
    let text = commands::emit(&network, &arguments.out, &options);
    let mut text = text.map_err(Error::refused)?;
    if arguments.model.is_file() {
        text += &rounding(&network, &arguments.model)?;
    }
    said.line(text.trim_end());
    Ok(network)
}

/// Prints a controller, and its network where it is one alone, as libraries for C.
fn for_c(arguments: &Arguments, spec: &ModelSpec, said: Said) -> Result<Option<Network>> {
    project::ready(project::Board::Stm32f446)?;
    let folder = arguments.out.join(CONTROLLER);
    let kept = c_library::write(&folder, spec, arguments.optimise)?;
    let network = match spec.state {
        None => Some(network(arguments, said)?),
        Some(_) => None,
    };
    eprint!("{}", project::kept(&kept));
    let stage = Stage::begin("build the controller's libraries", arguments.quiet);
    let built = c_library::build(&folder, &arguments.out.join("target"))?;
    stage.end("for a Cortex-M4F and for this computer");
    for library in &built {
        said.line(format!("controller library {}", library.display()));
    }
    for header in ["sinew_mpc.h", "sinew_model.h"] {
        said.line(format!(
            "controller header {}",
            folder.join("src").join(header).display()
        ));
    }
    said.line(format!(
        "{}: how a program takes it",
        folder.join("README.md").display()
    ));
    Ok(network)
}

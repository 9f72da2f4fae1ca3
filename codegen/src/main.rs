//! Models on the command line, without the rest of the project: print a model's crate, check that
//! committed ones are up to date, import the reference problem.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use sinew_codegen::emit::EmitOptions;
use sinew_codegen::network::commands;
use sinew_codegen::network::emit::{Accuracy, Options, Weights};
use sinew_codegen::{reference, regenerate, store};

const USAGE: &str = "\
usage: sinew-codegen emit MODEL --out DIR [--firmware PATH]
       sinew-codegen write MODELS
       sinew-codegen check MODELS
       sinew-codegen import-reference NETWORK.json PROBLEM.json --out DIR
                       [--horizon N] [--blocks L,L,...]
       sinew-codegen import NETWORK [--out DIR]
       sinew-codegen network NETWORK --out DIR [--tanh-tolerance T] [--weights int8] [--c-abi]
       sinew-codegen size NETWORK --board BOARD --build-dir DIR [--tanh-tolerance T] [--weights int8]

emit    prints the crate of the model directory MODEL into DIR
write   prints the crate of every model in the directory MODELS in its place
check   names the files in MODELS that differ from what their model prints, and fails if there are any
import-reference   writes the model of a reference network into DIR: horizon 10 unless said, its commands
        in blocks of equal moves of these lengths, one step each unless said
import  reads .onnx, .keras, .h5, .tflite or a folder, shows its layers, and writes it as a folder
network prints a network as a crate that depends on nothing; --c-abi builds a library for C; its tanh is the
        cheapest within T, 2e-6 unless said
size    prints flash, RAM, stack and time on stm32f446, nrf52840 or qemu";

/// Horizon of imported reference models: the longer of the problem's two.
const REFERENCE_HORIZON: usize = 10;

/// What ended the program early, and so its exit status.
enum Failure {
    /// The arguments make no sense: 2.
    Usage(String),
    /// Something is stale or cannot be done: 1.
    Run(String),
}

fn main() -> ExitCode {
    match run(std::env::args().skip(1).collect()) {
        Ok(report) => {
            print!("{report}");
            ExitCode::SUCCESS
        }
        Err(Failure::Usage(message)) => {
            eprintln!("{message}\n\n{USAGE}");
            ExitCode::from(2)
        }
        Err(Failure::Run(message)) => {
            eprintln!("{message}");
            ExitCode::FAILURE
        }
    }
}

fn run(mut arguments: Vec<String>) -> Result<String, Failure> {
    let out = option(&mut arguments, "--out")?;
    let firmware = option(&mut arguments, "--firmware")?;
    let horizon = option(&mut arguments, "--horizon")?;
    let blocks = option(&mut arguments, "--blocks")?;
    let board = option(&mut arguments, "--board")?;
    let build = option(&mut arguments, "--build-dir")?;
    let accuracy = match option(&mut arguments, "--tanh-tolerance")? {
        None => Accuracy::default(),
        Some(text) => text.parse().map_err(Failure::Usage)?,
    };
    let weights = match option(&mut arguments, "--weights")? {
        None => Weights::default(),
        Some(text) => text.parse().map_err(Failure::Usage)?,
    };
    let flags = arguments.len();
    arguments.retain(|argument| argument != "--c-abi");
    let options = Options {
        accuracy,
        weights,
        c_abi: arguments.len() < flags,
    };
    if let [verb, network] = arguments.as_slice() {
        let (network, out) = (Path::new(network), out.as_deref().map(Path::new));
        match (verb.as_str(), out, board, build) {
            ("import", out, None, None) => return commands::import(network, out).map_err(failed),
            ("network", Some(out), None, None) => {
                return commands::emit(network, out, &options).map_err(failed);
            }
            ("size", None, Some(board), Some(build)) => {
                let size = commands::size(network, &board, &options, Path::new(&build));
                return size.map_err(failed);
            }
            _ => {}
        }
    }
    let words: Vec<&str> = arguments.iter().map(String::as_str).collect();
    match (words.as_slice(), out, firmware) {
        (["emit", model], Some(out), firmware) => {
            let mut options = EmitOptions::default();
            options.firmware = firmware.unwrap_or(options.firmware);
            let written = regenerate::write(Path::new(model), Path::new(&out), &options);
            written.map(|files| list("wrote", &files)).map_err(failed)
        }
        (["write", models], None, None) => {
            let written = regenerate::write_all(Path::new(models));
            written.map(|files| list("wrote", &files)).map_err(failed)
        }
        (["check", models], None, None) => {
            let stale = regenerate::check_all(Path::new(models)).map_err(failed)?;
            if stale.is_empty() {
                return Ok(String::new());
            }
            let again = format!("print them again: sinew-codegen write {models}");
            Err(Failure::Run(list("stale", &stale) + &again))
        }
        (["import-reference", network, problem], Some(out), None) => {
            let (network, problem) = (read(network)?, read(problem)?);
            let horizon = match horizon {
                Some(text) => count("--horizon", &text)?,
                None => REFERENCE_HORIZON,
            };
            let blocks = blocks.iter().flat_map(|text| text.split(','));
            let blocks: Vec<usize> = blocks
                .map(|text| count("--blocks", text))
                .collect::<Result<_, _>>()?;
            let spec = reference::import(&network, &problem, horizon, &blocks).map_err(failed)?;
            store::save(Path::new(&out), &spec).map_err(failed)?;
            Ok(format!("wrote {out}\n"))
        }
        ([], None, None) => Err(Failure::Usage("nothing to do".into())),
        _ => Err(Failure::Usage(format!("cannot do: {}", words.join(" ")))),
    }
}

/// Takes `--name VALUE` out of the arguments.
fn option(arguments: &mut Vec<String>, name: &str) -> Result<Option<String>, Failure> {
    let Some(place) = arguments.iter().position(|argument| argument == name) else {
        return Ok(None);
    };
    arguments.remove(place);
    if place == arguments.len() {
        return Err(Failure::Usage(format!("{name} needs a value")));
    }
    Ok(Some(arguments.remove(place)))
}

fn count(option: &str, text: &str) -> Result<usize, Failure> {
    let number = text.trim().parse();
    number.map_err(|_| Failure::Usage(format!("{option}: '{text}' is not a count")))
}

fn read(path: &str) -> Result<String, Failure> {
    std::fs::read_to_string(path).map_err(|error| Failure::Run(format!("{path}: {error}")))
}

fn list(what: &str, files: &[PathBuf]) -> String {
    let line = |file: &PathBuf| format!("{what} {}\n", file.display());
    files.iter().map(line).collect()
}

fn failed(error: impl std::fmt::Display) -> Failure {
    Failure::Run(error.to_string())
}

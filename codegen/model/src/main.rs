//! Models on the command line, without the rest of the project: print a model's crate, check that
//! committed ones are up to date, import the reference problem.
//!
//! A tool of the repository's tasks; users have `sinew emit`. Its six flags are read by hand, since
//! a parser of the library's own package would be compiled by all that depend on the library.

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use sinew_model::emit::EmitOptions;
use sinew_model::{reference, regenerate, store};

const USAGE: &str = "\
usage: sinew-model emit MODEL --out DIR [--firmware PATH]
       sinew-model write MODELS
       sinew-model check MODELS
       sinew-model import-reference NETWORK.json PROBLEM.json --out DIR
                       [--horizon N] [--blocks L,L,...]

emit    prints the crate of the model directory MODEL into DIR
write   prints the crate of every model in the directory MODELS in its place
check   names the files in MODELS that differ from what their model prints, and fails if there are any
import-reference   writes the model of a reference network into DIR: horizon 10 unless said, its commands
        in blocks of equal moves of these lengths, one step each unless said";

/// Horizon of imported reference models: the longer of the problem's two.
const REFERENCE_HORIZON: usize = 10;

/// Failure of the program, which decides its exit status.
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
            let again = format!("print them again: sinew-model write {models}");
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

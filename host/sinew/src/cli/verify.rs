//! `sinew verify`: a network against the framework that wrote it, called by the user's own Python,
//! and the emitted crate against its golden vectors.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use clap::Args;
use sinew_ident::error::{Error, Result};
use sinew_model::import;
use sinew_nn::{Network, evaluate};

/// Calls the framework; reads inputs and writes outputs as JSON.
const SCRIPT: &str = include_str!("verify.py");
/// Input vectors.
const VECTORS: usize = 16;
/// Bytes of the framework's own words that an error quotes.
const QUOTED: usize = 400;

/// Arguments of `sinew verify`.
#[derive(Args)]
pub struct Arguments {
    /// The network: .onnx, .keras, .h5 or .tflite.
    network: PathBuf,
    /// The crate that `sinew emit` printed: its tests run too.
    crate_folder: Option<PathBuf>,
    /// Python with onnxruntime, keras, or ai-edge-litert.
    #[arg(long, value_name = "PROGRAM", default_value = "python3")]
    python: PathBuf,
    /// Largest difference that passes, as a part of the range of the outputs.
    #[arg(long, value_name = "PART", default_value_t = 2e-5)]
    tolerance: f64,
}

/// # Errors
/// A network that cannot be read, no framework, a difference above the tolerance, or a crate whose
/// tests fail.
pub fn run(arguments: &Arguments) -> Result<()> {
    let network = import::read(&arguments.network).map_err(Error::refused)?;
    let inputs = inputs(&network);
    let expected = framework(arguments, &inputs)?;
    let worst = difference(&network, &inputs, &expected)?;
    println!(
        "{}: {} inputs, largest difference from its framework {worst:.1e} of the range",
        arguments.network.display(),
        inputs.len()
    );
    if worst.is_nan() || worst > arguments.tolerance {
        return Err(Error::arguments(format!(
            "{} differs from its framework by {worst:.1e} of the range: expected at most {:.1e}",
            arguments.network.display(),
            arguments.tolerance
        )));
    }
    arguments.crate_folder.as_deref().map_or(Ok(()), test)
}

/// Inputs between -2 and 2 from a fixed seed.
fn inputs(network: &Network) -> Vec<Vec<f64>> {
    let mut state = 0x2545_f491_4f6c_dd1d_u64;
    let mut next = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        // Exact in f32, which frameworks read.
        f64::from((state >> 40) as f32 / (1 << 22) as f32 - 2.0)
    };
    (0..VECTORS)
        .map(|_| (0..network.inputs()).map(|_| next()).collect())
        .collect()
}

/// Outputs of the framework.
fn framework(arguments: &Arguments, inputs: &[Vec<f64>]) -> Result<Vec<Vec<f64>>> {
    let python = &arguments.python;
    let unusable = |message: String| {
        Error::arguments(message)
            .expected("a Python with onnxruntime (.onnx), keras (.keras, .h5) or ai-edge-litert (.tflite)")
            .help("name it with --python")
    };
    let mut child = Command::new(python)
        .args(["-c", SCRIPT])
        .arg(&arguments.network)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .map_err(|error| unusable(format!("{}: {error}", python.display())))?;
    let text = format!("{inputs:?}");
    let written = child
        .stdin
        .take()
        .map(|mut stdin| stdin.write_all(text.as_bytes()));
    let output = child
        .wait_with_output()
        .map_err(|error| unusable(format!("{}: {error}", python.display())))?;
    let said = String::from_utf8_lossy(&output.stderr);
    if !output.status.success() || written.is_none_or(|written| written.is_err()) {
        let last: String = said
            .trim()
            .lines()
            .last()
            .unwrap_or("no word")
            .chars()
            .take(QUOTED)
            .collect();
        return Err(unusable(format!("{}: {last}", python.display())));
    }
    let text = String::from_utf8_lossy(&output.stdout);
    // Frameworks print words of their own before the numbers.
    let rows = text.lines().last().unwrap_or("");
    serde_json::from_str(rows).map_err(|error| {
        unusable(format!(
            "{}: its outputs cannot be read: {error}",
            python.display()
        ))
    })
}

/// Largest difference, as a part of the range of the framework's outputs.
fn difference(network: &Network, inputs: &[Vec<f64>], expected: &[Vec<f64>]) -> Result<f64> {
    if expected.len() != inputs.len() {
        return Err(Error::arguments(format!(
            "the framework answered {} of {} inputs",
            expected.len(),
            inputs.len()
        )));
    }
    let all = || expected.iter().flatten().copied();
    let (low, high) = all().fold((f64::MAX, f64::MIN), |(low, high), y| {
        (low.min(y), high.max(y))
    });
    let size = all().fold(0.0_f64, |size, y| size.max(y.abs()));
    let range = (high - low).max(0.1 * size).max(1e-6);
    let mut worst = 0.0_f64;
    for (x, y) in inputs.iter().zip(expected) {
        let found = evaluate::run(network, x);
        if found.len() != y.len() {
            return Err(Error::arguments(format!(
                "the framework gives {} outputs, the network {}",
                y.len(),
                found.len()
            )));
        }
        for (a, b) in found.iter().zip(y) {
            let error = (a - b).abs() / range;
            worst = if error.is_nan() {
                f64::NAN
            } else {
                worst.max(error)
            };
        }
    }
    Ok(worst)
}

/// The panic of the first failing test, or the compiler's first error.
fn cause(said: &str) -> String {
    let lines: Vec<&str> = said.lines().map(str::trim).collect();
    let panic = lines.iter().position(|line| line.contains("panicked at"));
    let message = panic.and_then(|at| lines.get(at + 1));
    let error = lines.iter().find(|line| line.starts_with("error"));
    let cause = message.or(error).or(lines.last());
    cause.unwrap_or(&"no word").chars().take(QUOTED).collect()
}

/// Runs the tests of an emitted crate, its golden vectors among them.
fn test(folder: &Path) -> Result<()> {
    let output = Command::new("cargo")
        .args(["test", "--quiet"])
        .current_dir(folder)
        .output()
        .map_err(|error| Error::arguments(format!("cargo: {error}")))?;
    if !output.status.success() {
        let said =
            [output.stdout, output.stderr].map(|of| String::from_utf8_lossy(&of).into_owned());
        return Err(Error::arguments(format!(
            "{}: its tests fail: {}",
            folder.display(),
            cause(&said.concat())
        )));
    }
    // A crate of int8 weights or of a coarser tanh has none: it is not meant to give the network's
    // own outputs.
    let golden = if folder.join("tests/golden.rs").is_file() {
        "its golden vectors among them"
    } else {
        "it has no golden vectors"
    };
    println!("{}: its tests pass, {golden}", folder.display());
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cause_is_the_first_panic_or_the_compilers_first_error() {
        let failing = "running 1 test\n---- golden stdout ----\n\nthread 'golden' (7) panicked at \
                       tests/golden.rs:9:5:\n  output 0: 1.0, expected 2.0\nnote: run with\n";
        assert_eq!(cause(failing), "output 0: 1.0, expected 2.0");
        let broken = "   Compiling x\nerror[E0308]: mismatched types\nerror: could not compile\n";
        assert_eq!(cause(broken), "error[E0308]: mismatched types");
        assert_eq!(cause(""), "no word");
    }
}

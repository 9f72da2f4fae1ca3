//! `sinew verify`: a network against the framework that wrote it, called by the user's own Python,
//! and the emitted crate against its golden vectors.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use clap::Args;
use serde_json::json;
use sinew_ident::cli::overwrite;
use sinew_ident::cli::said::Said;
use sinew_ident::error::{Error, Result};
use sinew_model::import;
use sinew_nn::{Network, evaluate};

use super::result;

/// Calls the framework; reads inputs and writes outputs as JSON.
const SCRIPT: &str = include_str!("verify.py");
/// Input vectors.
const VECTORS: usize = 16;
/// Largest input, where the file says none.
const REACH: f64 = 2.0;
/// Sizes at which an input is tried where integers of a fixed scale may cut values off.
const SCALES: usize = 8;
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
    ///
    /// Without it 2e-5, and for a quantised file three times what rounding changes.
    #[arg(long, value_name = "PART")]
    tolerance: Option<f64>,
    /// File for the comparison as JSON (sinew-verify/1); `-` is standard output.
    #[arg(long, value_name = "JSON")]
    json: Option<PathBuf>,
    /// Print warnings and errors alone.
    #[arg(long)]
    quiet: bool,
}

/// Largest difference that arithmetic in f32 explains, as a part of the range.
const EXACT: f64 = 2e-5;
/// Times what rounding of every value changes, within which a quantised file is right: it is tried
/// on the same inputs, and the framework rounds at other places.
const ROUNDED: f64 = 3.0;

/// # Errors
/// A network that cannot be read, no framework, a difference above the tolerance, a NaN on one side
/// alone, or a crate whose tests fail.
pub fn run(arguments: &Arguments) -> Result<()> {
    let json = arguments.json.as_deref();
    overwrite::refuse(
        [("NETWORK", arguments.network.as_path())],
        [("--json", json)],
    )?;
    let said = Said::beside([json], arguments.quiet);
    let network = import::read(&arguments.network).map_err(Error::refused)?;
    let rounding = sinew_nn::import::rounding(&arguments.network).map_err(Error::refused)?;
    let reach = rounding.and_then(|rounding| rounding.input);
    let inputs = inputs(&network, reach.unwrap_or([-REACH, REACH]));
    let place = arguments.network.display().to_string();
    let wrong = |message: String| Error::failed(format!("{place}: {message}"));
    let count = inputs.len();
    let inputs = if reach.is_some() {
        scaled(&inputs)
    } else {
        inputs
    };
    let answers = framework(arguments, &inputs)?;
    let Held {
        inputs,
        outputs: expected,
        cut_off,
    } = held(count, inputs, answers).map_err(wrong)?;
    if inputs.is_empty() {
        return Err(wrong(
            "its integers cut off every input that was tried".into(),
        ));
    }
    let tolerance = arguments.tolerance.unwrap_or(match rounding {
        Some(rounding) => (ROUNDED * rounding.loss(&network, &inputs)).max(EXACT),
        None => EXACT,
    });
    let found: Vec<Vec<f64>> = inputs.iter().map(|x| evaluate::run(&network, x)).collect();
    let judged = judge(&found, &expected).map_err(wrong)?;
    if let Some(rounding) = rounding {
        said.line(format!("{place}: {rounding}"));
    }
    said.line(format!(
        "{place}: {} inputs, largest difference from its framework {:.1e} of the range",
        inputs.len(),
        judged.worst
    ));
    if cut_off > 0 {
        said.line(format!(
            "{place}: {cut_off} of {count} inputs drive values beyond what its framework's integers \
             hold: they are cut off there and not here, so they were compared at a smaller size"
        ));
    }
    if judged.alike > 0 {
        said.line(format!(
            "{place}: {} outputs are the same NaN or infinity in both",
            judged.alike
        ));
    }
    let agrees = judged.worst <= tolerance;
    let tested = match &arguments.crate_folder {
        Some(folder) if agrees => Some((folder, test(folder)?)),
        _ => None,
    };
    if let Some((folder, (None, golden))) = &tested {
        let golden = if *golden {
            "its golden vectors among them"
        } else {
            "it has no golden vectors"
        };
        said.line(format!("{}: its tests pass, {golden}", folder.display()));
    }
    result::write(json, || {
        json!({
            "format": "sinew-verify/1",
            "network": network.name,
            "inputs": inputs.len(),
            "difference": judged.worst,
            "tolerance": tolerance,
            "agrees": agrees,
            "alike": judged.alike,
            "cut_off": cut_off,
            "rounding": rounding.map(|rounding| json!({
                "bits": rounding.bits, "input": rounding.input,
            })),
            "crate": tested.as_ref().map(|(folder, (failure, golden))| json!({
                "folder": folder, "failure": failure, "golden": golden,
            })),
        })
    })?;
    if !agrees {
        return Err(Error::failed(format!(
            "{place} differs from its framework by {:.1e} of the range: expected at most \
             {tolerance:.1e}",
            judged.worst,
        )));
    }
    match tested {
        Some((folder, (Some(failure), _))) => Err(Error::failed(format!(
            "{}: its tests fail: {failure}",
            folder.display()
        ))),
        _ => {
            said.line(format!("{place} agrees with its framework"));
            said.next(match &arguments.crate_folder {
                Some(_) => format!("sinew size {place}"),
                None => format!("sinew emit {place} --out crate"),
            });
            Ok(())
        }
    }
}

/// Inputs between the ends of `reach`, from a fixed seed.
fn inputs(network: &Network, [low, high]: [f64; 2]) -> Vec<Vec<f64>> {
    let mut state = 0x2545_f491_4f6c_dd1d_u64;
    let mut next = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        // Exact in f32, which frameworks read.
        let share = f64::from((state >> 40) as f32 / (1 << 24) as f32);
        f64::from((low + (high - low) * share) as f32)
    };
    (0..VECTORS)
        .map(|_| (0..network.inputs()).map(|_| next()).collect())
        .collect()
}

/// Outputs of the framework.
fn framework(arguments: &Arguments, inputs: &[Vec<f64>]) -> Result<Vec<Answer>> {
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
    numbers(rows).map_err(|error| {
        unusable(format!(
            "{}: its outputs cannot be read: {error}",
            python.display()
        ))
    })
}

/// Outputs of a framework for an input; none where its integers cut a value off.
type Answer = Option<Vec<f64>>;

/// Rows of outputs: numbers, and words for what JSON has no number for.
fn numbers(rows: &str) -> serde_json::Result<Vec<Answer>> {
    let rows: Vec<Option<Vec<serde_json::Value>>> = serde_json::from_str(rows)?;
    let number = |output: serde_json::Value| {
        let word = output.as_str().and_then(|word| word.parse().ok());
        output.as_f64().or(word).unwrap_or(f64::NAN)
    };
    let row = |row: Vec<serde_json::Value>| row.into_iter().map(number).collect();
    Ok(rows.into_iter().map(|values| values.map(row)).collect())
}

/// The inputs, then all of them at half the size, and so on.
fn scaled(inputs: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let scales = (0..SCALES as i32).map(|k| 0.5_f64.powi(k));
    let scale = |scale: f64| {
        inputs
            .iter()
            .map(move |x| x.iter().map(|v| scale * v).collect())
    };
    scales.flat_map(scale).collect()
}

/// Inputs that the framework's integers hold, with its outputs.
struct Held {
    inputs: Vec<Vec<f64>>,
    outputs: Vec<Vec<f64>>,
    /// Inputs that were cut off at their full size.
    cut_off: usize,
}

/// The largest of each of `count` inputs that the integers hold, of answers to [`scaled`].
///
/// # Errors
/// Another number of answers than of inputs.
fn held(
    count: usize,
    inputs: Vec<Vec<f64>>,
    answers: Vec<Answer>,
) -> std::result::Result<Held, String> {
    if answers.len() != inputs.len() {
        let (expected, found) = (answers.len(), inputs.len());
        return Err(format!(
            "its framework answered {expected} of {found} inputs"
        ));
    }
    let mut held = Held {
        inputs: Vec::new(),
        outputs: Vec::new(),
        cut_off: answers
            .iter()
            .take(count)
            .filter(|row| row.is_none())
            .count(),
    };
    for first in 0..count {
        let sizes = (first..answers.len()).step_by(count);
        if let Some((k, outputs)) = sizes.filter_map(|k| Some((k, answers[k].clone()?))).next() {
            held.inputs.push(inputs[k].clone());
            held.outputs.push(outputs);
        }
    }
    Ok(held)
}

/// Comparison of a network with its framework.
#[derive(Debug, PartialEq)]
struct Judged {
    /// Largest difference, as a part of the range of the framework's finite outputs.
    worst: f64,
    /// Outputs that are the same infinity, or NaN, on both sides.
    alike: usize,
}

/// # Errors
/// Other numbers of outputs, or an output that is finite on one side alone: the side is named.
fn judge(found: &[Vec<f64>], expected: &[Vec<f64>]) -> std::result::Result<Judged, String> {
    if expected.len() != found.len() {
        let (expected, found) = (expected.len(), found.len());
        return Err(format!(
            "its framework answered {expected} of {found} inputs"
        ));
    }
    let all = || expected.iter().flatten().copied().filter(|y| y.is_finite());
    let (least, most) = all().fold((f64::MAX, f64::MIN), |(least, most), y| {
        (least.min(y), most.max(y))
    });
    let size = all().fold(0.0_f64, |size, y| size.max(y.abs()));
    let range = (most - least).max(0.1 * size).max(1e-6);
    let mut judged = Judged {
        worst: 0.0,
        alike: 0,
    };
    for (input, (x, y)) in found.iter().zip(expected).enumerate() {
        if x.len() != y.len() {
            let (x, y) = (x.len(), y.len());
            return Err(format!("its framework gives {y} outputs, the network {x}"));
        }
        for (output, (&here, &there)) in x.iter().zip(y).enumerate() {
            if here.is_finite() && there.is_finite() {
                judged.worst = judged.worst.max((here - there).abs() / range);
            } else if here == there || (here.is_nan() && there.is_nan()) {
                judged.alike += 1;
            } else {
                return Err(format!(
                    "output {output} at input {input} of {} is {there} in its framework and \
                     {here} here",
                    found.len()
                ));
            }
        }
    }
    Ok(judged)
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

/// Runs the tests of an emitted crate: the first failure, and whether golden vectors are among
/// them. A crate of int8 weights or of a coarser tanh has none: it is not meant to give the
/// network's own outputs.
fn test(folder: &Path) -> Result<(Option<String>, bool)> {
    let output = Command::new("cargo")
        .args(["test", "--quiet"])
        .current_dir(folder)
        .output()
        .map_err(|error| Error::arguments(format!("cargo: {error}")))?;
    let golden = folder.join("tests/golden.rs").is_file();
    let said = [output.stdout, output.stderr].map(|of| String::from_utf8_lossy(&of).into_owned());
    let failure = (!output.status.success()).then(|| cause(&said.concat()));
    Ok((failure, golden))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_nan_names_its_side_and_its_input() {
        let rows = |y: f64| vec![vec![0.5, 1.0], vec![0.5, y]];
        let there = judge(&rows(0.25), &rows(f64::NAN)).expect_err("a NaN there");
        assert_eq!(
            there,
            "output 1 at input 1 of 2 is NaN in its framework and 0.25 here"
        );
        let here = judge(&rows(f64::NAN), &rows(0.25)).expect_err("a NaN here");
        assert!(
            here.ends_with("is 0.25 in its framework and NaN here"),
            "{here}"
        );
        let both = judge(&rows(f64::NAN), &rows(f64::NAN)).expect("the same on both sides");
        assert_eq!(
            both,
            Judged {
                worst: 0.0,
                alike: 1
            }
        );
        let (up, down) = (f64::INFINITY, f64::NEG_INFINITY);
        assert!(judge(&rows(up), &rows(down)).is_err());
        assert_eq!(
            judge(&rows(down), &rows(down)).map(|judged| judged.alike),
            Ok(1)
        );
        assert!(judge(&rows(1.0), &[vec![0.5, 1.0], vec![0.5]]).is_err());
    }

    #[test]
    fn an_input_that_integers_cut_off_is_taken_smaller() {
        let inputs = vec![vec![1.0, -2.0], vec![0.5, 0.5], vec![8.0, 8.0]];
        let scaled = scaled(&inputs);
        assert_eq!(scaled.len(), 3 * SCALES);
        assert_eq!(
            (&scaled[3], &scaled[4]),
            (&vec![0.5, -1.0], &vec![0.25, 0.25])
        );
        // The first is cut off at its full size, the last at every size.
        let answers = (0..3 * SCALES).map(|k| (k != 0 && k % 3 != 2).then(|| vec![k as f64]));
        let held = held(3, scaled, answers.collect()).expect("as many answers as inputs");
        assert_eq!(held.inputs, [vec![0.5, -1.0], vec![0.5, 0.5]]);
        assert_eq!(held.outputs, [[3.0], [1.0]]);
        assert_eq!(held.cut_off, 2);
    }

    #[test]
    fn words_of_a_framework_are_nan_and_infinity() {
        let rows = numbers("[[0.5, \"nan\"], [\"inf\", \"-inf\"], null]").expect("rows of outputs");
        let row = |k: usize| rows[k].clone().unwrap_or_default();
        assert!(row(0)[0] == 0.5 && row(0)[1].is_nan());
        assert_eq!(row(1), [f64::INFINITY, f64::NEG_INFINITY]);
        assert_eq!(rows[2], None);
        assert!(numbers("[[NaN]]").is_err() && numbers("no rows").is_err());
    }

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

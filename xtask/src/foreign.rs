//! Random networks of the frameworks, compared with the frameworks' own outputs: the stage of
//! `cargo xtask survive` that needs Python.

use std::fs;
use std::process::Command;

use anyhow::{Context, Result, bail};

use crate::python;
use xtask::process::{self, cargo, root, target_folder};

/// Networks of each framework.
const NETWORKS: usize = 10_000;
/// Seed of the generators.
const SEED: usize = 7;
/// Packages of requirements.txt that the generators use; the others are for the matrix.
const USED: &[&str] = &[
    "ai-edge-litert",
    "keras",
    "numpy",
    "onnx",
    "onnxruntime",
    "tensorflow-cpu",
];
/// Generators, and what the folders of their networks are called.
const GENERATORS: &[(&str, &str)] = &[("fuzz.py", "onnx"), ("fuzz_keras.py", "keras")];

/// Numbers after `survive networks`: networks of each framework, and the seed.
///
/// # Errors
/// One of them is no number, or there are more.
pub fn numbers(arguments: &[String]) -> Result<[usize; 2]> {
    let mut numbers = [NETWORKS, SEED];
    if arguments.len() > numbers.len() {
        bail!("unexpected argument '{}'", arguments[numbers.len()]);
    }
    for (number, argument) in numbers.iter_mut().zip(arguments) {
        *number = argument
            .parse()
            .with_context(|| format!("'{argument}' is no number"))?;
    }
    Ok(numbers)
}

/// Draws the networks and compares them. Without Python or its packages it says so in capitals and
/// counts as done.
///
/// # Errors
/// A generator fails, or a network is read wrongly.
pub fn run([count, seed]: [usize; 2]) -> Result<()> {
    let scripts = root().join("codegen/nn/tests/foreign");
    let list = scripts.join("requirements.txt");
    let text =
        fs::read_to_string(&list).with_context(|| format!("cannot read {}", list.display()))?;
    let packages = used(&text);
    let Some(environment) = python::environment("foreign-environment", &packages)? else {
        println!("SKIPPED: networks of the frameworks are not drawn");
        return Ok(());
    };
    for (script, name) in GENERATORS {
        let out = target_folder().join("foreign-networks").join(name);
        if out.exists() {
            fs::remove_dir_all(&out).with_context(|| format!("cannot remove {}", out.display()))?;
        }
        let mut draw = Command::new(environment.join("bin/python"));
        draw.arg(scripts.join(script)).arg(&out);
        process::run(draw.args([count, seed].map(|number| number.to_string())))?;
        let mut compare = cargo(&["test", "--package", "sinew-nn", "--test", "cases"]);
        compare.args(["--", "foreign", "--nocapture"]);
        process::run(compare.env("SINEW_CASES", &out))?;
    }
    Ok(())
}

/// Lines of requirements.txt that name a package of [`USED`].
fn used(requirements: &str) -> Vec<&str> {
    let name = |line: &str| line.split("==").next().unwrap_or("").trim().to_owned();
    let lines = requirements.lines().map(str::trim);
    lines
        .filter(|line| USED.contains(&name(line).as_str()))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_generators_packages_are_in_the_list_with_their_versions() {
        let text = include_str!("../../codegen/nn/tests/foreign/requirements.txt");
        let packages = used(text);
        assert_eq!(packages.len(), USED.len(), "{packages:?}");
        assert!(
            packages
                .iter()
                .any(|package| package.starts_with("keras==3."))
        );
        assert!(!packages.iter().any(|package| package.starts_with("torch")));
    }

    #[test]
    fn a_count_and_a_seed_are_numbers() {
        let words = |list: &[&str]| list.iter().map(ToString::to_string).collect::<Vec<_>>();
        let read = |list: &[&str]| numbers(&words(list)).map_err(|error| error.to_string());
        assert_eq!(read(&[]), Ok([NETWORKS, SEED]));
        assert_eq!(read(&["40", "3"]), Ok([40, 3]));
        assert!(read(&["many"]).is_err() && read(&["1", "2", "3"]).is_err());
    }
}

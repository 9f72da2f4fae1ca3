//! Builds printed networks into one program for the host and one image for QEMU, runs both, and
//! reads what they say.
//!
//! A compiler a network, twice over, took minutes. So every printed crate is checked as it stands,
//! but what runs are their `network.rs` and `weights.rs` in one crate over the kernels that they
//! are copies of; networks whose kernels differ run as the crates that they are.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use sinew_nn::Network;
use sinew_nn::emit::{Accuracy, File, Options, emit};
use sinew_nn::footprint::probe;

use super::program::{CASES, HOST, WORKSPACE, call};

/// One network, and the inputs that it is tried with.
pub struct Case {
    /// As printed.
    pub network: Network,
    /// Options of the printed crate.
    pub options: Options,
    /// Calls in turn from rest, flattened.
    pub inputs: Vec<Vec<f32>>,
    /// True if second derivatives are taken too.
    pub curvature: bool,
    /// True if it runs in QEMU as well as on the host.
    pub in_qemu: bool,
}

/// Output of a program about one network.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Said {
    /// For each input: the output after the last call.
    pub y: Vec<Vec<f32>>,
    /// For each input: derivatives of the last call, variable by variable.
    pub jacobian: Vec<Vec<f32>>,
    /// For the first input: second derivatives of the results, weighed with [`weight`].
    pub curvature: Vec<f32>,
    /// Instructions and bytes of stack of a call, by its name.
    pub cost: BTreeMap<String, (u64, u64)>,
}

/// The weight of result `r` in what is differentiated twice.
pub fn weight(r: usize) -> f32 {
    1.0 - 0.5 * (r % 4) as f32
}

/// The workspace: stays between runs, so that the second run compiles only what changed.
pub struct Workspace {
    pub folder: PathBuf,
}

/// Before what only the host's program has.
const ON_HOST: &str = "#[cfg(feature = \"every\")]\n";

const PACKAGE: &str = "[package]\nedition = \"2024\"\nversion = \"0.0.0\"\n";

impl Workspace {
    pub fn new(name: &str, cases: &[Case]) -> Self {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
        forget_others(&folder.join("networks"), cases);
        let (mut all, mut own) = (String::new(), String::new());
        let (mut modules, mut uses, mut calls) = (String::new(), String::new(), String::new());
        for case in cases {
            let name = &case.network.name;
            let files =
                emit(&case.network, &case.options).unwrap_or_else(|e| panic!("{name}: {e}"));
            let only = if case.in_qemu { "" } else { ON_HOST };
            let dependency = format!("{name} = {{ path = \"../networks/{name}\" }}\n");
            if case.options.accuracy == Accuracy::Quick {
                let library = name.replace('-', "_");
                writeln!(modules, "{only}pub mod {library};").unwrap();
                writeln!(uses, "{only}use joined::{library};").unwrap();
                join(&folder.join("joined/src").join(library), &files);
            } else {
                assert!(case.in_qemu, "{name}: a crate of its own runs everywhere");
                own.push_str(&dependency);
            }
            all.push_str(&dependency);
            for file in files {
                write(
                    &folder.join("networks").join(name).join(file.path),
                    &file.text,
                );
            }
            write!(calls, "{only}{{\n{}}}\n", call(case)).unwrap();
        }
        probe::write(&folder).unwrap_or_else(|error| panic!("{error}"));
        let package = |name: &str, dependencies: &str, path: &str, text: &str| {
            let manifest = format!("{PACKAGE}name = \"{name}\"\n\n[dependencies]\n{dependencies}");
            write(&folder.join(name).join("Cargo.toml"), &manifest);
            write(&folder.join(name).join(path), text);
        };
        let checked = "//! Every network under test, as printed.\n#![no_std]\n";
        package("checked", &all, "src/lib.rs", checked);
        let kernels = concat!(env!("CARGO_MANIFEST_DIR"), "/kernels/lib.rs");
        write(
            &folder.join("kernels/Cargo.toml"),
            &format!("{PACKAGE}name = \"kernels\"\n\n[lib]\npath = {kernels:?}\n"),
        );
        package(
            "joined",
            "kernels = { path = \"../kernels\" }\n\n[features]\nevery = []\n",
            "src/lib.rs",
            &format!(
                "//! Networks under test.\n#![no_std]\n#![allow(clippy::approx_constant)]\n\n{modules}"
            ),
        );
        package(
            "cases",
            &format!(
                "joined = {{ path = \"../joined\" }}\n{own}\n[features]\nevery = [\"joined/every\"]\n"
            ),
            "src/lib.rs",
            &CASES
                .replace("{uses}", &uses)
                .replace("{calls}", &calls)
                .replace("{bench}", probe::BENCH),
        );
        package(
            "host",
            "cases = { path = \"../cases\", features = [\"every\"] }\n",
            "src/main.rs",
            HOST,
        );
        write(&folder.join("Cargo.toml"), WORKSPACE);
        let lock = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../boards/qemu/Cargo.lock");
        if !folder.join("Cargo.lock").exists() {
            // The versions that the project is tested with.
            write(
                &folder.join("Cargo.lock"),
                &fs::read_to_string(lock).unwrap(),
            );
        }
        Self { folder }
    }

    pub fn cargo(&self, program: &str) -> Command {
        let mut cargo = Command::new(program);
        cargo
            .current_dir(&self.folder)
            .env("CARGO_TARGET_DIR", self.folder.join("target"));
        cargo
    }

    /// Every printed crate compiles, by itself and without a warning; and what the host says.
    pub fn host(&self) -> BTreeMap<String, Said> {
        let quick = |verb: &str, package: &str| {
            let mut cargo = self.cargo(env!("CARGO"));
            finished(cargo.args([verb, "--quiet", "--profile", "quick", "--package", package]))
        };
        quick("check", "checked");
        read(&quick("run", "host"))
    }

    /// Output of QEMU; the image is built first.
    pub fn qemu(&self) -> BTreeMap<String, Said> {
        let said = probe::build(&self.folder).and_then(|image| probe::run(&image));
        read(&said.unwrap_or_else(|error| panic!("{error}")))
    }
}

/// Removes crates of networks that are no longer among the cases.
fn forget_others(networks: &Path, cases: &[Case]) {
    for entry in fs::read_dir(networks).into_iter().flatten().flatten() {
        let name = entry.file_name();
        if !cases.iter().any(|case| name == case.network.name.as_str()) {
            fs::remove_dir_all(entry.path()).expect("the folder belongs to this test");
        }
    }
}

/// The network of a printed crate as a module over the common kernels.
fn join(folder: &Path, files: &[File]) {
    let text = |path: &str| files.iter().find(|file| file.path == path);
    let joined = |text: &str| {
        text.replace("crate::weights", "super::weights")
            .replace("use crate::", "use kernels::")
    };
    let library = &text("src/lib.rs").expect("every crate has one").text;
    let start = library
        .find("pub use network::")
        .expect("the library re-exports its network");
    let mut module = format!("//! One network.\n\nmod network;\n{}", &library[start..]);
    for name in ["network", "weights"] {
        if let Some(file) = text(&format!("src/{name}.rs")) {
            write(&folder.join(format!("{name}.rs")), &joined(&file.text));
            if name == "weights" {
                module.push_str("mod weights;\n");
            }
        }
    }
    write(&folder.join("mod.rs"), &module);
}

/// Standard output of a command that succeeds and complains of nothing.
pub fn finished(command: &mut Command) -> String {
    let output = command
        .output()
        .unwrap_or_else(|error| panic!("{command:?}: {error}"));
    let complaints = String::from_utf8_lossy(&output.stderr);
    assert!(
        output.status.success(),
        "{command:?}: {}\n{complaints}",
        output.status
    );
    // Warnings of path dependencies are shown, and printed code has none.
    assert_eq!(complaints, "", "printed code compiles without a warning");
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn read(text: &str) -> BTreeMap<String, Said> {
    let mut found: BTreeMap<String, Said> = BTreeMap::new();
    let mut current = String::new();
    for line in text.lines() {
        let mut words = line.split(' ');
        let what = words.next().unwrap_or("");
        let said = found.entry(current.clone()).or_default();
        match what {
            "network" => current = words.next().unwrap_or("").into(),
            "cost" => {
                let name = words.next().unwrap_or("").into();
                let mut number = || {
                    words
                        .next()
                        .and_then(|word| word.parse().ok())
                        .unwrap_or(u64::MAX)
                };
                said.cost.insert(name, (number(), number()));
            }
            _ => {
                let bits = words
                    .map(|word| u32::from_str_radix(word, 16).unwrap_or_else(|_| panic!("{line}")));
                let values: Vec<f32> = bits.map(f32::from_bits).collect();
                match what {
                    "y" => said.y.push(values),
                    "jacobian" => said.jacobian.push(values),
                    "curvature" => said.curvature = values,
                    other => panic!("{other}"),
                }
            }
        }
    }
    found.remove("");
    found
}

pub fn write(path: &Path, text: &str) {
    if fs::read_to_string(path).is_ok_and(|old| old == text) {
        return; // the same file again would make cargo compile again
    }
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(path, text).unwrap();
}

//! The control step as a C library (contract section 6): what it needs, what it cannot reach, and a
//! C program that calls it.

use std::collections::BTreeSet;
use std::path::PathBuf;
use std::process::Command;

use sinew::device::Workplace;
use sinew::project::{Machine, run_cargo};
use sinew_tests::callgraph::CallGraph;
use sinew_tests::{image, skip};

const ARCHIVE: [&str; 6] = [
    "rustc",
    "--lib",
    "--features",
    "archive",
    "--crate-type",
    "staticlib",
];

/// The C interface.
const INTERFACE: [&str; 10] = [
    "sinew_mpc_step",
    "sinew_mpc_open_loop",
    "sinew_mpc_emergency_stop",
    "sinew_mpc_last_status",
    "sinew_mpc_telemetry",
    "sinew_mpc_estimate",
    "sinew_mpc_disturbance",
    "sinew_mpc_left_out",
    "sinew_mpc_times_left_out",
    "sinew_reset",
];

fn built(machine: Machine, arguments: &[&str]) -> PathBuf {
    let folder = image::root().join("boards/step");
    let folder = run_cargo(&folder, machine, &image::cache(), arguments);
    folder.unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn the_archive_for_a_microcontroller_needs_nothing_and_has_no_heap() {
    if let Some(reason) = image::cannot_run() {
        return skip(reason);
    }
    let folder = built(Machine::Microcontroller, &ARCHIVE);
    let found = image::symbols(&folder.join("libsinew_step.a"));
    for name in INTERFACE {
        assert!(found.global.contains(name), "{name}");
    }
    let missing: Vec<&String> = found.wanted.difference(&found.global).collect();
    assert!(
        missing.is_empty(),
        "a program would have to bring {missing:?}"
    );
    let heap = found.global.iter().chain(&found.wanted);
    let heap: Vec<&String> = heap
        .filter(|name| name.contains("__rust_alloc") || *name == "malloc")
        .collect();
    assert!(heap.is_empty(), "{heap:?}");
}

#[test]
fn the_c_interface_has_no_way_to_a_panic() {
    if let Some(reason) = image::cannot_run() {
        return skip(reason);
    }
    // Linked: in an archive's objects no branch has a target yet.
    let folder = built(Machine::Microcontroller, &["build", "--bin", "count"]);
    let data = std::fs::read(folder.join("count")).expect("just built");
    let graph = CallGraph::read(&data).unwrap_or_else(|error| panic!("{error}"));
    let reached = |name: &str| {
        let starts = graph.named(&[name]);
        assert!(!starts.is_empty(), "{name} in the image");
        starts.into_iter().map(|start| graph.reach(start)).fold(
            (BTreeSet::new(), BTreeSet::new()),
            |mut all, reach| {
                all.0.extend(reach.functions);
                all.1.extend(reach.indirect);
                all
            },
        )
    };
    // The step is the one whose code is not a few instructions; it reaches the optimisation.
    let (functions, indirect) = reached("sinew_mpc_step");
    assert!(functions.len() > 3, "{functions:?}: calls are not followed");
    assert!(
        indirect.is_empty(),
        "calls through registers in {indirect:?}"
    );
    let panics: Vec<&String> = functions
        .iter()
        .filter(|name| image::is_panic(name))
        .collect();
    assert!(panics.is_empty(), "{panics:?}");
}

#[test]
fn a_c_program_controls_by_the_archive() {
    if Command::new("cc").arg("--version").output().is_err() {
        return skip("no C compiler");
    }
    let target = format!("{}-unknown-linux-gnu", std::env::consts::ARCH);
    let mut arguments = ARCHIVE.to_vec();
    // Said, since the folder's settings name the microcontroller.
    arguments.extend(["--target", &target]);
    let folder = built(Machine::ThisOne, &arguments);
    let archive = image::cache().join(&target).join("release/libsinew_step.a");
    assert!(
        archive.exists(),
        "{} in {}",
        archive.display(),
        folder.display()
    );
    let workplace = Workplace::new().expect("a temporary folder");
    let program = workplace.path().join("step");
    let root = image::root();
    let compiled = Command::new("cc")
        .args(["-std=c99", "-Wall", "-Wextra", "-Werror", "-I"])
        .arg(root.join("boards/step/include"))
        .arg(root.join("tests/c/step.c"))
        .arg(&archive)
        .args(["-lm", "-o"])
        .arg(&program)
        .output()
        .expect("cc was there a moment ago");
    let said = String::from_utf8_lossy(&compiled.stderr);
    assert!(compiled.status.success(), "{said}");
    let ran = Command::new(&program).output().expect("just compiled");
    let said = String::from_utf8_lossy(&ran.stdout);
    assert!(ran.status.success() && said == "ok\n", "{said}");
}

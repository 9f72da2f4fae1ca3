//! Instructions, flash, RAM, stack and command bits of two controllers in QEMU, against their
//! snapshots and against their budgets. `cargo xtask measure`, `bless` and `budget` are this file,
//! by the variable SINEW_SNAPSHOTS.

use std::fs;
use std::sync::OnceLock;

use sinew_ident::error::Result;
use sinew_tests::snapshot::{self, Measured};
use sinew_tests::{image, skip, state_demo};

/// Loop that is measured, by the name of its snapshot and its budget.
struct Case {
    name: &'static str,
    measure: fn() -> Result<Measured>,
    run: OnceLock<Measured>,
}

/// Model S of the reference problem, horizon 10.
static REFERENCE: Case = Case {
    name: "reference_s_n10",
    measure: snapshot::measure,
    run: OnceLock::new(),
};

/// State network of the demo behind its filter, horizon 12.
static STATE: Case = Case {
    name: "demo_state_n12",
    measure: state_demo::measure,
    run: OnceLock::new(),
};

/// Bytes of flash by which two checkouts may differ: panic messages of dependencies hold the path
/// of cargo's registry, six times.
const PATHS: u64 = 200;

/// One in so many instructions by which two checkouts may differ: cargo names the crates of a board
/// by their folder, the compiler sorts by those names, and what it does with the network's longest
/// function then comes out in one of two ways (of fourteen folders, seven had 36,397 instructions
/// in the mean, seven 36,408).
const ORDER: u64 = 500;

impl Case {
    /// One run serves both tests. `None`: this machine cannot run images, and it has been said.
    fn measured(&'static self) -> Option<&'static Measured> {
        if let Some(reason) = image::cannot_run() {
            skip(reason);
            return None;
        }
        let run = || (self.measure)().unwrap_or_else(|error| panic!("{error}"));
        Some(self.run.get_or_init(run))
    }
}

fn mode() -> String {
    std::env::var("SINEW_SNAPSHOTS").unwrap_or_default()
}

#[test]
fn the_reference_run_matches_its_snapshot() {
    matches_its_snapshot(&REFERENCE);
}

#[test]
fn the_state_run_matches_its_snapshot() {
    matches_its_snapshot(&STATE);
}

fn matches_its_snapshot(case: &'static Case) {
    let Some(measured) = case.measured() else {
        return;
    };
    let name = case.name;
    let path = snapshot::expected(name);
    let text = measured.to_text().unwrap_or_else(|error| panic!("{error}"));
    match mode().as_str() {
        "measure" => return println!("\n{name}\n{text}"),
        "bless" => {
            if fs::read_to_string(&path).is_ok_and(|old| old == text) {
                return println!("\n{}: nothing has changed", path.display());
            }
            fs::write(&path, text).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
            return println!("\n{}: rewritten", path.display());
        }
        _ => {}
    }
    let expected = Measured::load(&path)
        .unwrap_or_else(|error| panic!("{error}"))
        .unwrap_or_else(|| panic!("{}: no snapshot yet (cargo xtask bless)", path.display()));
    assert_eq!(
        measured.commands, expected.commands,
        "the commands differ in their bits. No compiler may do that; after a change of the controller: \
         cargo xtask bless"
    );
    if measured.compiler != expected.compiler {
        return skip(&format!(
            "instructions and sizes of {name} were measured with {}, and this is {}: only the budget holds",
            expected.compiler, measured.compiler
        ));
    }
    let mut measured = measured.clone();
    for (figure, snapshot, apart) in [
        (&mut measured.flash_bytes, expected.flash_bytes, PATHS),
        (
            &mut measured.instructions_mean,
            expected.instructions_mean,
            expected.instructions_mean / ORDER,
        ),
        (
            &mut measured.instructions_max,
            expected.instructions_max,
            expected.instructions_max / ORDER,
        ),
    ] {
        if figure.abs_diff(snapshot) <= apart {
            *figure = snapshot;
        }
    }
    assert_eq!(
        measured, expected,
        "{name} has changed: look at the figures, then cargo xtask bless"
    );
}

#[test]
fn the_reference_run_is_within_its_budget() {
    is_within_its_budget(&REFERENCE);
}

#[test]
fn the_state_run_is_within_its_budget() {
    is_within_its_budget(&STATE);
}

fn is_within_its_budget(case: &'static Case) {
    let Some(measured) = case.measured() else {
        return;
    };
    let name = case.name;
    let budget = snapshot::budget(name).unwrap_or_else(|error| panic!("{error}"));
    if !mode().is_empty() {
        println!("\n{:>20}  {:>10}  {:>10}", name, "measured", "budget");
        for (name, measured, most) in measured.beside(&budget) {
            println!("{name:>20}  {measured:>10}  {most:>10}");
        }
    }
    let over = measured.over(&budget);
    assert!(over.is_empty(), "over budget (tests/budgets.toml):\n{over}");
}

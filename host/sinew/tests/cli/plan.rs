//! Planned commands: the file is a recording that simulates as planned, and what cannot be reached
//! is an error without a file.

use std::process::Output;

use crate::desk::{Desk, columns};
use crate::schema::{schema, violations};

const RIG: &str = "mass-spring-damper.toml";
const FRICTION: &str =
    "\n[[effect]]\nkind = \"coulomb_friction\"\ncomponent = \"mass\"\nlevel = 3.0\n";

/// A desk with a rig that rubs.
fn desk() -> Desk {
    let desk = Desk::new();
    desk.bring(&format!("rigs/{RIG}"));
    let rubbing = desk.read(RIG) + FRICTION;
    desk.write(RIG, &rubbing);
    desk
}

/// `sinew plan` with goals, which have blanks.
fn plan(desk: &Desk, goals: &[&str], more: &str) -> Output {
    let mut command = desk.command(&format!("plan {RIG} --out plan.csv {more}"));
    for goal in goals {
        command.args(["--goal", goal]);
    }
    command.output().expect("the program starts")
}

fn errors(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

#[test]
fn a_plan_simulates_as_planned_and_its_document_keeps_the_schema() {
    let desk = desk();
    let goals = ["encoder = 0.1 at 0.6 s", "mass.velocity = 0 at 0.6 s"];
    let output = plan(
        &desk,
        &goals,
        "--json plan.json --report plan.html --simulations 200",
    );
    assert_eq!(output.status.code(), Some(0), "{}", errors(&output));
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(
        said.contains("encoder = 0.1 at 0.6 s: missed by "),
        "{said}"
    );
    desk.succeed(&format!(
        "simulate {RIG} --input plan.csv --out again.csv --with-inputs --quiet"
    ));
    assert_eq!(
        columns(&desk.read("plan.csv")),
        columns(&desk.read("again.csv"))
    );
    let document = serde_json::from_str(&desk.read("plan.json")).expect("the plan is JSON");
    assert_eq!(violations(&schema("plan"), &document), [""; 0]);
    assert!(document["simulations"]["equivalent"].as_u64() <= Some(200));
    assert!(desk.read("plan.html").contains("<title>u_N</title>"));
}

#[test]
fn the_same_seed_plans_the_same() {
    let desk = desk();
    let of = |seed: u64| {
        let more = format!("--quiet --simulations 60 --tolerance 1 --seed {seed}");
        let output = plan(&desk, &["encoder = 0.05 at 0.4 s"], &more);
        assert_eq!(output.status.code(), Some(0), "{}", errors(&output));
        desk.read("plan.csv")
    };
    assert_eq!(of(3), of(3));
    assert_ne!(of(3), of(4));
}

#[test]
fn what_cannot_be_planned_is_refused_and_nothing_is_written() {
    let desk = desk();
    let refused = |goal: &str, more: &str, status: i32, words: &str| {
        let output = plan(&desk, &[goal], &format!("--quiet {more}"));
        let text = errors(&output);
        assert_eq!(output.status.code(), Some(status), "{text}");
        assert!(text.contains(words), "{text}");
        assert!(!desk.path("plan.csv").exists(), "a refusal writes nothing");
    };
    let named = "did you mean `encoder`?";
    refused("encodr = 0.1 at 0.6 s", "", 2, named);
    refused(
        "encoder = 0.1 at 0.6 s",
        "--seconds 0.5",
        2,
        "a time up to the horizon, 0.5 s",
    );
    refused("encoder is 0.1", "", 2, "`NAME = VALUE at TIME s`");
    refused(
        "encoder = 0.1 at 0.6 s",
        "--effort 0",
        2,
        "`--effort` must be more than 0",
    );
    refused(
        "encoder = 2 at 0.2 s",
        "--simulations 60",
        1,
        "is missed by 1.",
    );
}

/// Each said before any work, with numbers that can be read.
#[test]
fn odd_goals_and_options_are_refused_in_one_line() {
    let desk = desk();
    let refused = |goals: &[&str], more: &str, words: &str| {
        let output = plan(&desk, goals, &format!("--quiet {more}"));
        let text = errors(&output);
        assert_eq!(output.status.code(), Some(2), "{text}");
        assert!(text.contains(words), "{words} is not in {text}");
        assert!(text.lines().all(|line| line.len() < 200), "{text}");
        assert!(!desk.path("plan.csv").exists(), "a refusal writes nothing");
    };
    refused(
        &["encoder = 0.1 at 1 s", "encoder = 0.2 at 1 s"],
        "",
        "the goal `encoder = 0.2 at 1 s` contradicts `encoder = 0.1 at 1 s`",
    );
    refused(&["encoder = 0.1 at 1e300 s"], "", "got 1e300");
    refused(&["encoder = 0.1 at 1 s"], "--rate 1e300", "at 1e300 Hz");
    for (option, value) in [
        ("--rate", "-1"),
        ("--seconds", "-1e300"),
        ("--effort", "-1"),
        ("--tolerance", "-0.5"),
    ] {
        refused(
            &["encoder = 0.1 at 1 s"],
            &format!("{option} {value}"),
            &format!("`{option}` must be more than 0; got {value}"),
        );
    }
    // The column is known, and none of its rows is a number.
    desk.write("path.csv", "t,encoder\n0,nan\n1,nan\n");
    refused(
        &[],
        "--through path.csv",
        "`encoder` has no value at a row of the plan",
    );
}

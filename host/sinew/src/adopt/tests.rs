use std::path::PathBuf;

use sinew_model::store;
use sinew_sim::Rig;

use super::*;
use crate::adopt::columns::{deviation, estimate};

/// The demo's rig with dry friction, which its model was trained for.
const FRICTION: &str = "\n[[effect]]\nkind = \"coulomb_friction\"\ncomponent = \"mass\"\n\
                        # as the diagnosis found it\nlevel = { value = 0.58, min = 0.0 }\n";

fn checkout() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn rig() -> Rig {
    let text = std::fs::read_to_string(checkout().join("rigs/demo.toml")).expect("a shipped rig");
    Rig::parse(&(text + FRICTION), "demo.toml").expect("the text is a rig")
}

fn spec(model: &str) -> ModelSpec {
    store::load(&checkout().join("models").join(model)).expect("a committed model")
}

/// Estimates that a test gives a device: theta and its deviation, a parameter each.
type Known = [(f64, f64); 4];

const SURE: Known = [(1.0, 0.1), (-0.5, 0.2), (0.0, 0.6), (2.0, 0.3)];

/// A file as `sinew monitor` writes it: two estimates, the first of nothing learned.
fn file(spec: &ModelSpec, known: &Known) -> String {
    let columns = Columns::of(spec);
    let names: Vec<String> = columns.names().collect();
    let row = |known: &Known| -> String {
        let of = columns.parameters().iter().zip(known);
        let values = of.map(|(it, (theta, deviation))| {
            let unit = it.value * it.spread;
            format!(",{},{}", it.value + unit * theta, unit * deviation)
        });
        values.collect()
    };
    format!(
        "# status: 0 Converged\n{}\nt,u_N,{}\n0,1{}\n0.1,1{}\n0.2,1{}\n",
        columns.model_line(),
        names.join(","),
        row(&[(0.0, 1.0); 4]),
        row(known),
        ",".repeat(names.len())
    )
}

fn adopted(rig: &Rig, spec: &ModelSpec, text: &str, only: &[&str]) -> Result<(Rig, Vec<Learned>)> {
    let source = Source {
        recording: &Recording::parse(text.as_bytes(), "run.csv")?,
        text,
        model: Path::new("out/model"),
    };
    let only: Vec<String> = only.iter().map(|name| (*name).into()).collect();
    adopt(rig, spec, &source, &only)
}

#[test]
fn the_last_estimate_is_in_the_rig_with_its_interval_and_origin() {
    let (spec, rig) = (spec("demo-state"), rig());
    let text = file(&spec, &SURE);
    let (adopted, learned) =
        adopted(&rig, &spec, &text, &["mass.inertia", "coil.stiffness"]).expect("it is learned");
    let mass = 1.146_942_642_578_322_5;
    assert_eq!(learned.len(), 2);
    assert!((learned[0].value - 1.15 * mass).abs() < 1e-9);
    assert_eq!(learned[0].before, 1.0);
    let half = 1.96 * 0.1 * 0.15 * mass;
    assert!((learned[0].interval[1] - learned[0].interval[0] - 2.0 * half).abs() < 1e-9);
    let plant = Plant::new(&adopted).expect("the rig is one");
    let value = |name: &str| plant.values()[plant.slot(name).expect("a parameter")];
    assert!((value("mass.inertia") - 1.15 * mass).abs() < 1e-9);
    assert_eq!(value("mass.coulomb_friction.level"), 0.58);
    let before: Vec<&str> = rig.to_toml().lines().collect();
    let new: Vec<&str> = adopted.to_toml().lines().collect();
    let lines = new.iter().filter(|line| !before.contains(*line));
    insta::assert_snapshot!(lines.copied().collect::<Vec<_>>().join("\n"));
    // A file may be called anything.
    let line_break = provenance(&learned[0], "run\n[x].csv", "# model 1");
    assert!(
        line_break.contains("by run?[x].csv, model 1;"),
        "{line_break}"
    );
    // Adopted once more: the comment is replaced, and nothing else changes.
    let again = super::tests::adopted(&adopted, &spec, &text, &["mass.inertia"]);
    let again = again.expect("it is learned").0;
    assert_eq!(again.to_toml().lines().count(), new.len());
    assert!(again.to_toml().contains("kg, on a kitchen scale"));
}

#[test]
fn what_was_not_learned_is_refused_by_name() {
    let (state, rig) = (spec("demo-state"), rig());
    let refuse = |rig: &Rig, spec: &ModelSpec, text: &str, only: &[&str]| {
        let refused = adopted(rig, spec, text, only);
        refused.expect_err("it is not to be adopted").to_string()
    };
    let sure = file(&state, &SURE);
    let mut known = SURE;
    known[2] = (0.3, 0.9);
    let unexcited = file(&state, &known);
    known[3] = (2.5, 0.1);
    let at_bound = file(&state, &known);
    let bare = Rig::parse(
        &rig.to_toml()
            .replace("{ value = 1.0, min = 0.1, max = 10.0 }", "1.0"),
        "demo.toml",
    )
    .expect("the text is a rig");
    let narrow = Rig::parse(
        &rig.to_toml().replace("max = 10.0", "max = 1.1"),
        "demo.toml",
    );
    let narrow = narrow.expect("the text is a rig");
    let other = sure.replace(&Columns::of(&state).model_line(), "# model 01234567");
    let nameless = sure.replace("# model", "# a model");
    let without = sure.replace(&estimate("coil.stiffness"), "other");
    let undeviated = sure.replace(&deviation("coil.stiffness"), "other");
    let header = sure.lines().take(3).collect::<Vec<_>>().join("\n");
    let silent = format!("{header}\n0,1{}\n", ",".repeat(8));
    let plain = Rig::load(checkout().join("rigs/demo.toml")).expect("a shipped rig");
    let report = [
        refuse(&rig, &state, &unexcited, &[]),
        refuse(&rig, &state, &at_bound, &[]),
        refuse(&rig, &state, &at_bound, &["dashpot.damping"]),
        refuse(&bare, &state, &sure, &[]),
        refuse(&narrow, &state, &sure, &[]),
        refuse(&rig, &state, &other, &[]),
        refuse(&rig, &state, &nameless, &[]),
        refuse(&rig, &state, &without, &[]),
        refuse(&rig, &state, &undeviated, &[]),
        refuse(&rig, &state, &silent, &[]),
        refuse(&rig, &state, &sure, &["mass.inerta"]),
        refuse(&rig, &spec("reference-s"), &sure, &[]),
        refuse(&plain, &state, &sure, &["mass.coulomb_friction.level"])
            .replace(&checkout().display().to_string(), ""),
    ];
    insta::assert_snapshot!(report.join("\n\n"));
}

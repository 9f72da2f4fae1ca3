//! `sinew new`, `fit` and `diagnose`: from a recording to a rig that has what was missing.

use crate::desk::{Desk, checkout};
use crate::schema::{schema, violations};
use sinew_sim::Rig;

#[test]
fn fit_writes_a_rig_that_keeps_its_comments() {
    let desk = Desk::new();
    desk.bring("rigs/mass-spring-damper.toml")
        .bring("rigs/mass-spring-damper.fit.csv");
    let said = desk
        .succeed("fit mass-spring-damper.toml --fit mass-spring-damper.fit.csv --out fitted.toml");
    assert!(said.contains("coil.stiffness"), "{said}");
    let (before, after) = (
        desk.read("mass-spring-damper.toml"),
        desk.read("fitted.toml"),
    );
    let comments = |text: &str| -> Vec<String> {
        text.lines()
            .filter_map(|line| line.split_once('#'))
            .map(|(_, c)| c.to_string())
            .collect()
    };
    assert_eq!(comments(&before), comments(&after));
    assert_ne!(before, after, "nothing was fitted");
    let rig = Rig::load(desk.path("fitted.toml")).expect("what fit writes can be read");
    // 43.6 is true; without dry friction in the rig the fit leans a little.
    let plant = sinew_sim::Plant::new(&rig).expect("and simulated");
    let at = plant
        .parameters()
        .iter()
        .position(|p| p.name == "coil.stiffness");
    let stiffness = plant.values()[at.expect("the spring is still there")];
    assert!((stiffness / 43.6 - 1.0).abs() < 0.1, "{stiffness}");
}

#[test]
fn diagnose_names_the_friction_that_the_demos_recording_hides_by_status_3_on_demand() {
    let desk = Desk::new();
    desk.bring("rigs/mass-spring-damper.toml")
        .bring("rigs/mass-spring-damper.fit.csv")
        .bring("rigs/mass-spring-damper.test.csv");
    let line = "diagnose mass-spring-damper.toml --fit mass-spring-damper.fit.csv \
                --test mass-spring-damper.test.csv --quiet";
    let silent = desk.succeed(&format!(
        "{line} --json a.json --report a.html --rig-out mended.toml --mjcf mended.xml"
    ));
    assert_eq!(silent, "", "--quiet with --json says nothing");
    let found: serde_json::Value =
        serde_json::from_str(&desk.read("a.json")).expect("the text is JSON");
    assert_eq!(violations(&schema("diagnosis"), &found), [""; 0]);
    assert_eq!(found["verdict"], "missing_physics");
    let effect = &found["effects"][0];
    assert_eq!(effect["kind"], "coulomb_friction");
    assert_eq!(effect["component"], "mass");
    let truth =
        std::fs::read_to_string(checkout().join("tests/foreign/mass_spring_damper.truth.json"));
    let truth: serde_json::Value =
        serde_json::from_str(&truth.expect("the file is committed")).expect("the text is JSON");
    let number = |value: &serde_json::Value| value.as_f64().expect("the value is a number");
    let (level, hidden) = (
        number(&effect["parameters"]["level"]["value"]),
        number(&truth["coulomb_friction_N"]),
    );
    assert!(
        (level / hidden - 1.0).abs() < 0.02,
        "{level} N of {hidden} N"
    );
    let test = &found["fit"]["q_m"]["test"];
    assert!(
        number(&test["after_rms"]) < 0.1 * number(&test["before_rms"]),
        "{test}"
    );

    // What it leaves is what other verbs take.
    let rig = Rig::load(desk.path("mended.toml")).expect("every verb reads it");
    assert_eq!(rig.effects.len(), 1);
    assert!(desk.read("mended.xml").contains("frictionloss="));
    assert!(desk.read("a.html").contains("coulomb_friction at mass"));

    // The same input and seed: the same bytes, seconds aside; and a person gets words, and whoever
    // asks for it a status.
    let again = desk.sinew(&format!("{line} --json b.json --exit-code"));
    assert_eq!(again.status.code(), Some(3));
    let without_seconds = |name: &str| -> String {
        let text = desk.read(name);
        text.lines()
            .filter(|line| !line.contains("\"seconds\""))
            .collect()
    };
    assert_eq!(without_seconds("a.json"), without_seconds("b.json"));

    // The corrected rig lacks nothing.
    let mended = line.replace("mass-spring-damper.toml", "mended.toml");
    desk.succeed(&format!("{mended} --json c.json --exit-code"));
    let consistent: serde_json::Value =
        serde_json::from_str(&desk.read("c.json")).expect("the text is JSON");
    assert_eq!(consistent["effects"], serde_json::json!([]));
}

#[test]
fn new_writes_a_rig_that_fit_accepts() {
    let desk = Desk::new();
    desk.bring("rigs/mass-spring-damper.fit.csv");
    desk.succeed("new mass-spring-damper.fit.csv --yes --spring yes --inertia 1.1 --out rig.toml");
    let said = desk.succeed("fit rig.toml --fit mass-spring-damper.fit.csv --out fitted.toml");
    assert!(said.contains("free-run error"), "{said}");
    Rig::load(desk.path("fitted.toml")).expect("what fit writes can be read");
    let again = desk.sinew("new mass-spring-damper.fit.csv --yes --out rig.toml");
    assert_eq!(
        again.status.code(),
        Some(2),
        "it does not overwrite what somebody may have edited"
    );
}

/// A desk with the beginning of a shipped recording, `ms.csv`, whose times are in milliseconds.
fn milliseconds() -> Desk {
    let desk = Desk::new();
    desk.bring("rigs/mass-spring-damper.fit.csv");
    let sound = desk.read("mass-spring-damper.fit.csv");
    let mut lines = sound.lines().skip_while(|line| !line.starts_with("t,"));
    let header = lines.next().expect("a header").to_owned() + "\n";
    let rows = lines.take(1500).enumerate().map(|(row, line)| {
        let (_, fields) = line.split_once(',').expect("a row has fields");
        format!("{},{fields}\n", 8 * row)
    });
    desk.write("ms.csv", &(header + &rows.collect::<String>()));
    desk
}

#[test]
fn a_build_refuses_recordings_that_are_certainly_wrong_before_it_fits() {
    let desk = milliseconds();
    desk.bring("rigs/mass-spring-damper.toml");
    let line = "build mass-spring-damper.toml --fit ms.csv --board host --out out";
    let said = desk.refusal(line);
    assert!(said.contains("time_in_milliseconds"), "{said}");
    assert!(said.contains("--time-unit ms"), "{said}");
    assert!(!desk.path("out/rig.toml").exists(), "{said}");
}

/// The unit that a person states is not refused on numbers that `sinew new` guessed.
#[test]
fn a_stated_unit_of_time_passes_from_new_to_fit() {
    let desk = milliseconds();
    let said = desk.succeed("new ms.csv --yes --spring no --time-unit ms --inertia 1e-3");
    let next = said.lines().last().expect("the verb names the next step");
    assert!(next.ends_with("--fit ms.csv --time-unit ms"), "{said}");
    desk.succeed(&format!(
        "{} --quiet",
        next.trim_start_matches("next: sinew ")
    ));
}

//! Fleets: the file and the JSON that `sinew fleet` leaves, the verbs that take the file, and
//! refusals.

use serde_json::Value;

use crate::desk::Desk;
use crate::schema::{schema, violations};

/// Commands that change every tenth of a second.
fn commands(seed: u32, rows: usize) -> String {
    let mut text = String::from("t,u_N\n");
    let mut state = 17 + seed;
    let mut level = 0.0;
    for row in 0..rows {
        if row % 12 == 0 {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            level = f64::from(state >> 16) / 4096.0 - 8.0;
        }
        text += &format!("{:.6},{level:.3}\n", row as f64 / 120.0);
    }
    text
}

/// A rig, recordings of four devices of 1.5 s, and one of a fifth of 1 s.
fn desk() -> Desk {
    let desk = Desk::new();
    desk.bring("rigs/mass-spring-damper.toml");
    let rig = desk.read("mass-spring-damper.toml");
    let devices = [
        ("a", "1.1", "38.0", "1.5"),
        ("b", "1.2", "30.0", "1.2"),
        ("c", "1.3", "42.0", "1.9"),
        ("d", "1.0", "35.0", "1.6"),
        ("new", "1.15", "33.0", "1.4"),
    ];
    for (seed, (name, mass, stiffness, damping)) in (1..).zip(devices) {
        let own = rig
            .replacen("value = 1.0,", &format!("value = {mass},"), 1)
            .replacen("value = 40.0,", &format!("value = {stiffness},"), 1)
            .replacen("value = 1.2,", &format!("value = {damping},"), 1);
        desk.write("own.toml", &own);
        desk.write(
            "inputs.csv",
            &commands(seed, if name == "new" { 120 } else { 180 }),
        );
        desk.succeed(&format!(
            "simulate own.toml --input inputs.csv --out {name}.csv --with-inputs --noise 0.01 \
             --seed {seed} --quiet"
        ));
    }
    desk
}

const FLEET: &str = "fleet mass-spring-damper.toml --fit a.csv --fit b.csv --device c=c.csv \
                     --device d=d.csv --out fleet.toml";

#[test]
fn four_devices_give_a_file_that_a_fit_takes() {
    let desk = desk();
    let said = desk.succeed(&format!("{FLEET} --json fleet.json --report fleet.html"));
    let page = desk.read("fleet.html");
    for expected in [
        "mass.inertia",
        "1 s and the fleet",
        "light dark",
        "<td>c</td>",
    ] {
        assert!(page.contains(expected), "{expected} is not on the page");
    }
    assert!(said.contains("4 devices say little"), "{said}");
    assert!(said.contains("next: sinew fit"), "{said}");
    let document: Value = serde_json::from_str(&desk.read("fleet.json")).expect("JSON");
    assert_eq!(violations(&schema("fleet"), &document), [""; 0]);
    let mass = &document["parameters"]["mass.inertia"];
    assert!(
        mass["mean"]
            .as_f64()
            .is_some_and(|mean| (1.05..1.25).contains(&mean)),
        "{mass}"
    );
    assert_eq!(document["devices"][2]["name"], "c");

    let line = "fit mass-spring-damper.toml --fit new.csv --json - --quiet";
    let fit = |flags: &str| -> Value {
        let output = desk.sinew(&format!("{line} {flags}"));
        serde_json::from_slice(&output.stdout).expect("JSON alone")
    };
    let (alone, with) = (fit(""), fit("--fleet fleet.toml"));
    assert_eq!(violations(&schema("fit"), &with), [""; 0]);
    let width = |found: &Value, name: &str| {
        let interval = &found["parameters"][name]["ci95"];
        let ends = [0, 1].map(|end| interval[end].as_f64().expect("an interval"));
        ends[1] - ends[0]
    };
    for name in ["mass.inertia", "coil.stiffness", "dashpot.damping"] {
        assert!(width(&with, name) > 0.0);
    }
    let damping = |found: &Value| found["parameters"]["dashpot.damping"]["value"].as_f64();
    assert_ne!(damping(&alone), damping(&with));
}

#[test]
fn refusals_of_fleets() {
    let desk = desk();
    desk.succeed(FLEET);
    let rig = desk.read("mass-spring-damper.toml");
    desk.write(
        "fewer.toml",
        &rig.replace(
            "damping = { value = 1.2, min = 0.0, max = 20.0 }",
            "damping = 1.2",
        ),
    );
    desk.write(
        "held.toml",
        &rig.replace("{ value = 1.0, min = 0.1, max = 10.0 }", "1.0")
            .replace("{ value = 40.0, min = 1.0, max = 400.0 }", "40.0")
            .replace("{ value = 1.2, min = 0.0, max = 20.0 }", "1.2"),
    );
    let fleet = desk.read("fleet.toml");
    desk.write(
        "later.toml",
        &fleet.replace("sinew-fleet/1", "sinew-fleet/2"),
    );
    desk.write("cut.toml", &fleet.replacen("freedom = ", "# freedom = ", 1));
    let rig = "mass-spring-damper.toml";
    let all = "--fit a.csv --fit b.csv --fit c.csv";
    let lines = [
        format!("fleet {rig} --out f.toml"),
        format!("fleet {rig} --fit a.csv --fit b.csv --out f.toml"),
        format!("fleet {rig} --device a --out f.toml"),
        format!("fleet {rig} --device a=a.csv, --out f.toml"),
        format!("fleet {rig} {all} --fit a.csv --out f.toml"),
        format!("fleet {rig} {all} --device a=d.csv --out f.toml"),
        format!("fleet {rig} {all} --out a.csv"),
        format!("fleet {rig} {all} --fit none.csv --out f.toml"),
        format!("fleet held.toml {all} --out f.toml"),
        format!("fit {rig} --fit new.csv --fleet none.toml"),
        format!("fit {rig} --fit new.csv --fleet later.toml"),
        format!("fit {rig} --fit new.csv --fleet cut.toml"),
        format!("fit {rig} --fit new.csv --fleet {rig}"),
        "fit fewer.toml --fit new.csv --fleet fleet.toml".into(),
        format!("fit {rig} --fit new.csv --fleet fleet.toml --static"),
        format!("fit {rig} --fit new.csv --fleet fleet.toml --out fleet.toml"),
        "train fewer.toml --fit a.csv --fleet fleet.toml --out m".into(),
        "tune fewer.toml m --fit a.csv --fleet fleet.toml --out t.toml".into(),
        "build fewer.toml --fit a.csv --fleet fleet.toml --board host --out out".into(),
        format!("build {rig} --fit a.csv --fleet fleet.toml --diagnose --board host --out out"),
        format!("build {rig} --fit a.csv --fleet a.csv --board host --out out"),
        format!("fleet {rig} {all} --out f.toml --report ./f.toml"),
        format!("fleet {rig} {all} --out f.toml --report a.csv"),
        "compare fewer.toml m --fit a.csv --fleet fleet.toml --out out".into(),
        format!("compare {rig} m --fit a.csv --fleet fleet.toml --draws 2 --spread 0.1 --out out"),
        format!("compare {rig} m --fit a.csv --fleet fleet.toml --plant {rig} --out out"),
    ];
    let report: String = lines.iter().map(|line| desk.refusal(line)).collect();
    insta::assert_snapshot!(report);
}

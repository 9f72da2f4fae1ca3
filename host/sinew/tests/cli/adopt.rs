//! `sinew pil --recording` and `sinew adopt`: what the firmware learned in a loop, back in the rig.

use crate::desk::{Desk, checkout, images};
use crate::schema::{schema, violations};

const FRICTION: &str =
    "\n[[effect]]\nkind = \"coulomb_friction\"\ncomponent = \"mass\"\nlevel = { value = 0.58 }\n";

/// The demo's rig, one that is a third heavier, and a recording that says what to follow.
fn desk() -> Desk {
    let desk = Desk::new();
    desk.bring("rigs/demo.toml")
        .bring("rigs/mass-spring-damper.fit.csv");
    let rig = desk.read("demo.toml") + FRICTION;
    desk.write("rig.toml", &rig);
    desk.write(
        "heavier.toml",
        &rig.replace("value = 1.0,", "value = 1.35,"),
    );
    desk
}

#[test]
fn a_loop_is_recorded_and_what_it_learned_is_adopted() {
    let desk = desk();
    let model = checkout().join("models/demo-state");
    let model = model.display();
    let line = format!(
        "pil rig.toml {model} --fit mass-spring-damper.fit.csv --plant heavier.toml --board host \
         --out loop --recording run.csv"
    );
    let output = desk
        .command(&line)
        .env("SINEW_BUILD_DIR", images())
        .output();
    let output = output.expect("the program starts");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{errors}");
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(said.contains("run.csv\n"), "{said}");

    let text = desk.read("run.csv");
    let lines: Vec<&str> = text.lines().collect();
    assert!(lines[0].starts_with("# model "), "{}", lines[0]);
    assert!(lines[1].starts_with("t,u_N,q_m,learned_mass.inertia,deviation_mass.inertia,"));
    let told = lines[2..].iter().filter(|line| !line.ends_with(",,,,,,,,"));
    let seconds = (lines.len() - 2) as f64 / 120.0;
    assert!(
        (told.count() as f64 / seconds - 4.0).abs() < 0.3,
        "four times a second"
    );

    let said = desk.succeed(&format!(
        "adopt rig.toml {model} run.csv --only mass.inertia --out adopted.toml"
    ));
    assert!(said.contains("1.00 kg →"), "{said}");
    assert!(said.ends_with("next: sinew train adopted.toml --fit FILE.csv --out MODEL\n"));
    let line = format!(
        "adopt rig.toml {model} run.csv --only mass.inertia --out adopted.toml --quiet --json -"
    );
    let document = desk.succeed(&line);
    let document: serde_json::Value = serde_json::from_str(&document).expect("a document alone");
    assert_eq!(violations(&schema("adopt"), &document), [""; 0]);
    let parameter = &document["parameters"][0];
    assert_eq!(
        (&parameter["name"], &parameter["before"]),
        (&"mass.inertia".into(), &1.0.into())
    );
    let ci95 = [0, 1].map(|end| parameter["ci95"][end].as_f64());
    let value = parameter["value"].as_f64();
    assert!(ci95[0] < value && value < ci95[1], "{document}");
    let adopted = desk.read("adopted.toml");
    let line = adopted.lines().find(|line| line.starts_with("inertia = "));
    let number = line.and_then(|line| line.split(['=', ',']).nth(2));
    let mass: f64 = number
        .and_then(|it| it.trim().parse().ok())
        .expect("a number");
    assert!((mass - 1.35).abs() < 0.1, "{mass}");
    assert!(adopted.contains("# mass.inertia as the device learned it: 95 % from "));
    // It is a recording like any other: the columns are passed over.
    desk.succeed("check run.csv --rig rig.toml");
    desk.succeed("fit adopted.toml --fit run.csv --quiet");

    let refused = desk.refusal(&format!(
        "adopt rig.toml {model} mass-spring-damper.fit.csv --out a.toml"
    ));
    assert!(refused.contains("does not say which model"), "{refused}");
    let refused = desk.refusal(&format!("adopt rig.toml {model} run.csv --out run.csv"));
    assert!(refused.contains("would overwrite"), "{refused}");
    assert!(!desk.path("a.toml").exists());
}

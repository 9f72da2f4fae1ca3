//! A policy from one motion: files, its loop beside a controller's, its crate, and refusals.

use serde_json::Value;

use crate::desk::Desk;
use crate::schema::{schema, violations};

/// A rig and a motion of it, positions alone: 80 mm in 0.8 s, minimum jerk, then rest.
fn desk() -> Desk {
    let desk = Desk::new();
    desk.bring("rigs/mass-spring-damper.toml");
    let rows = (0..150).map(|k| {
        let t = f64::from(k) / 120.0;
        let s = (t / 0.8).min(1.0);
        let q = 0.08 * s * s * s * (10.0 - 15.0 * s + 6.0 * s * s);
        format!("{t},{q}\n")
    });
    desk.write("demo.csv", &format!("t,q_m\n{}", rows.collect::<String>()));
    desk
}

const IMITATE: &str = "imitate mass-spring-damper.toml --demo demo.csv --steps 100 --quiet";

#[test]
fn positions_alone_give_a_policy_and_commands_and_a_crate() {
    let desk = desk();
    desk.succeed(&format!("{IMITATE} --out policy --json policy.json"));
    let document: Value = serde_json::from_str(&desk.read("policy.json")).expect("JSON");
    assert_eq!(violations(&schema("imitation"), &document), [""; 0]);
    // 533, and the zero bias of the linear path.
    assert_eq!(document["weights"], 534);
    assert_eq!(document["cloning"], Value::Null);
    assert_eq!(document["policy"]["rms"].as_array().map(Vec::len), Some(10));
    // The commands make the rig as written go that way.
    assert!(
        document["commands_rms"]
            .as_f64()
            .is_some_and(|rms| rms < 1e-3)
    );
    assert!(desk.read("policy/commands.csv").starts_with("t,u_N,q_m\n"));
    desk.succeed("emit policy --out firmware --quiet");
    let library = desk.read("firmware/policy/src/lib.rs");
    assert!(
        library.contains("pub const AHEAD: usize = 12;"),
        "{library}"
    );
    assert!(
        desk.read("firmware/firmware/mpc/src/feedback/policy.rs")
            .contains("Policy")
    );
    // The same seed gives the same policy.
    desk.succeed(&format!("{IMITATE} --out again"));
    let weights = |folder: &str| {
        std::fs::read(desk.path(&format!("{folder}/weights.safetensors"))).expect("weights")
    };
    assert_eq!(weights("policy"), weights("again"));
}

#[test]
fn recorded_commands_are_cloned_beside_the_policy() {
    let desk = desk();
    desk.succeed(&format!("{IMITATE} --out policy"));
    // The motion with the commands that make it.
    let said = desk.succeed(
        "imitate mass-spring-damper.toml --demo policy/commands.csv --steps 20 --out other \
         --json other.json",
    );
    assert!(said.contains("cloning"), "{said}");
    let document: Value = serde_json::from_str(&desk.read("other.json")).expect("JSON");
    assert_eq!(
        document["cloning"]["rms"].as_array().map(Vec::len),
        Some(10)
    );
}

#[test]
fn what_cannot_be_taught_is_refused_before_anything_is_written() {
    let desk = desk();
    let rig = desk.read("mass-spring-damper.toml");
    let delay = "\n[[effect]]\nkind = \"input_delay\"\ncomponent = \"push\"\ndelay = 0.01\n";
    desk.write("slow.toml", &format!("{rig}{delay}"));
    let refused = desk.refusal("imitate slow.toml --demo demo.csv --out policy --quiet");
    assert!(refused.contains("remembers earlier commands"), "{refused}");
    let refused = desk.refusal(&format!("{IMITATE} --out policy --spread 1.5"));
    assert!(refused.contains("`--spread` must be"), "{refused}");
    let refused = desk.refusal(&format!("{IMITATE} --out policy --load -1"));
    assert!(refused.contains("--load"), "{refused}");
    assert!(!desk.path("policy/policy.toml").exists());
}

//! Copies of a rig that each break one thing, and the refusals that they meet.
//!
//! Every crate that reads a table of rig files includes this file in its tests.

use std::fmt::Display;

/// A rig that is sound; each case breaks one thing in it.
pub const SOUND: &str = r#"format = "sinew-rig/1"
name = "two-mass drive"

[[body]]
name = "motor"
motion = "hinge"
inertia = { value = 0.02 }

[[body]]
name = "load"
motion = "hinge"
inertia = { value = 0.10, min = 0.01, max = 1.0 }

[[body]]
name = "carriage"
motion = "slide"
inertia = 2.0

[[spring]]
name = "shaft"
from = "motor"
to = "load"
stiffness = { value = 30.0 }

[[damper]]
name = "bearing"
from = "ground"
to = "load"
damping = { value = 0.05 }

[[gravity]]
name = "weight"
body = "load"
amplitude = { value = 0.8 }

[[tendon]]
name = "flexor"
path = [{ body = "motor", arm = 0.010 }, { body = "load", arm = 0.008 }]
stiffness = { value = 2000.0 }

[[actuator]]
name = "drive"
drives = "motor"
input = "u_V"
gain = { value = 0.4 }
limit = [-10.0, 10.0]

[[sensor]]
name = "encoder"
reads = "load.position"
signal = "q_rad"

[[effect]]
kind = "coulomb_friction"
component = "load"
level = { value = 0.1 }

[control]
rate_hz = 120.0
outputs = ["encoder"]
horizon = 10
control_horizon = 3

[network]
hidden = [16]
form = "increment"
"#;

/// Refusals of broken copies of a rig, word for word: each case replaces the first place of its
/// first text by its second.
///
/// Each must name the file.
pub fn refusals<T, E: Display>(
    sound: &str,
    cases: &[(&str, &str)],
    parse: impl Fn(&str, &str) -> Result<T, E>,
) -> String {
    if let Err(error) = parse(sound, "rig.toml") {
        panic!("the rig is sound: {error}");
    }
    let mut report = String::new();
    for (from, to) in cases {
        assert!(sound.contains(from), "nothing to break: {from}");
        let refused = match parse(&sound.replacen(from, to, 1), "rig.toml") {
            Ok(_) => "ACCEPTED".to_owned(),
            Err(error) => error.to_string(),
        };
        assert!(
            refused.starts_with("rig.toml:"),
            "{from} -> {to}: {refused}"
        );
        let (from, to) = (from.escape_debug(), to.escape_debug());
        report += &format!("--- {from} -> {to}\n{refused}\n");
    }
    report
}

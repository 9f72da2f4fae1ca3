//! Every refusal of `[control]` and `[network]`, word for word.

/// A rig that is sound; each case breaks one thing in it.
const SOUND: &str = r#"format = "sinew-rig/1"
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

/// (what is replaced, by what): the first place only.
const CASES: &[(&str, &str)] = &[
    ("rate_hz = 120.0", "rate_hz = 0.0"),
    ("rate_hz = 120.0", "rate = 120.0"),
    ("rate_hz = 120.0", "reference = [\"a\", \"b\"]"),
    ("rate_hz = 120.0", "move_suppression = [0.1, 0.1]"),
    ("rate_hz = 120.0", "command_weight = -0.1"),
    ("hidden = [16]", "observer_gain = 0.0"),
    ("hidden = [16]", "observer_gain = 1.5"),
    ("hidden = [16]", "observer_gain = 1e-50"),
    ("hidden = [16]", "derivative_weight = -1.0"),
    ("hidden = [16]", "derivative_weight = 1e300"),
    ("outputs = [\"encoder\"]", "outputs = [\"encodr\"]"),
    (
        "outputs = [\"encoder\"]",
        "outputs = [\"encoder\", \"encoder\"]",
    ),
    ("horizon = 10", "horizon = 2"),
    ("horizon = 10", "horizon = 1.5"),
    ("hidden = [16]", "hidden = [16.5]"),
    ("hidden = [16]", "first_layer = \"gpu\""),
    ("hidden = [16]", "hidden = []\nfirst_layer = \"gru\""),
    ("form = \"increment\"", "form = \"incremental\""),
    ("hidden = [16]", "channels = [\"encodr\"]"),
    ("hidden = [16]", "channels = [\"encoder\"]"),
    ("[network]", "[[network]]"),
    ("[network]", "µ = 1\n[network]"),
];

#[test]
fn every_refusal_names_its_place() {
    assert!(super::parse(SOUND, "rig.toml").is_ok());
    let mut report = String::new();
    for (from, to) in CASES {
        assert!(SOUND.contains(from), "nothing to break: {from}");
        let text = SOUND.replacen(from, to, 1);
        let refused = match super::parse(&text, "rig.toml") {
            Ok(_) => "ACCEPTED".to_owned(),
            Err(error) => error.to_string(),
        };
        assert!(
            refused.starts_with("rig.toml:"),
            "{from} -> {to}: {refused}"
        );
        report += &format!(
            "--- {} -> {}\n{refused}\n",
            from.escape_debug(),
            to.escape_debug()
        );
    }
    insta::assert_snapshot!(report);
}

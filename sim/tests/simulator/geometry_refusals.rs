//! Every refusal of a chain, a plate and what reads them, word for word.

use super::broken_rigs::refusals;
use sinew_sim::{InputTrajectory, Plant, Rig};

const SOUND: &str = r#"format = "sinew-rig/1"
name = "platform"

[[chain]]
name = "spine"
segments = 2
length = 0.1
inertia = 7e-5
stiffness = 0.2
damping = 0.004
segment = [{ inertia = 9e-5 }, {}]

[[plate]]
name = "plate"
mass = 0.05
inertia = 2e-5

[[tendon]]
name = "east"
path = [{ chain = "spine", radius = 0.01, segments = 1 }]
stiffness = 5000.0

[[tendon]]
name = "stay"
path = [{ plate = "plate", x = 0.02 }]
stiffness = 100.0

[[waveguide]]
name = "fibre"
chain = "spine"
radius = 0.009
span = [0.0, 0.5]
loss = 4.0

[[magnet]]
name = "north"
plate = "plate"
at = [0.02, 0.0, 0.0]
moment = 0.1

[[magnetometer]]
name = "hall"
at = [0.02, 0.0, -0.02]

[[sensor]]
name = "tip"
reads = "spine.tip.x"
signal = "x_m"

[[sensor]]
name = "bend"
reads = "spine.x1.position"
signal = "bend_rad"

[[effect]]
kind = "coulomb_friction"
component = "spine.y2"
level = 0.001
"#;

const CASES: &[(&str, &str)] = &[
    ("segments = 2\n", ""),
    ("segments = 2\n", "segments = 0\n"),
    ("segments = 2\n", "segments = 3\n"),
    ("segments = 2\n", "segments = 2.5\n"),
    ("length = 0.1", "length = 0.0"),
    ("length = 0.1\n", ""),
    ("inertia = 7e-5\n", ""),
    ("{ inertia = 9e-5 }", "{ inertia = -9e-5 }"),
    ("{ inertia = 9e-5 }", "{ mass = 9e-5 }"),
    ("mass = 0.05\n", ""),
    ("inertia = 2e-5", "inertia = 0"),
    ("name = \"plate\"", "name = \"spine\""),
    ("name = \"plate\"", "name = \"spine.x1\""),
    ("chain = \"spine\", radius", "chain = \"spin\", radius"),
    ("chain = \"spine\", radius", "chain = \"plate\", radius"),
    ("radius = 0.01,", "radius = -0.01,"),
    ("radius = 0.01,", "arm = 0.01,"),
    ("segments = 1 }", "segments = 3 }"),
    (
        "segments = 1 }]",
        "segments = 1 }, { chain = \"spine\", radius = 0.02 }]",
    ),
    ("{ plate = \"plate\", x", "{ plate = \"spine\", x"),
    ("chain = \"spine\"\nradius", "chain = \"fibre\"\nradius"),
    ("span = [0.0, 0.5]", "span = [0.5, 0.0]"),
    ("span = [0.0, 0.5]", "span = [0.0, 1.5]"),
    ("loss = 4.0", "loss = 0.0"),
    ("at = [0.02, 0.0, 0.0]", "at = [0.02, 0.0]"),
    ("at = [0.02, 0.0, 0.0]\n", ""),
    ("moment = 0.1", "moment = 0.1\naxis = [0.0, 0.0, 0.0]"),
    ("reads = \"spine.tip.x\"", "reads = \"spine.tip.w\""),
    ("reads = \"spine.tip.x\"", "reads = \"spine.position\""),
    ("reads = \"spine.tip.x\"", "reads = \"fibre.tip.x\""),
    ("reads = \"spine.tip.x\"", "reads = \"hall.tip.x\""),
    (
        "reads = \"spine.x1.position\"",
        "reads = \"spine.x3.position\"",
    ),
    (
        "reads = \"spine.x1.position\"",
        "reads = \"spine.x1.light\"",
    ),
    ("component = \"spine.y2\"", "component = \"spine\""),
    ("component = \"spine.y2\"", "component = \"spine.z2\""),
];

#[test]
fn every_refusal_names_its_place() {
    insta::assert_snapshot!(refusals(SOUND, CASES, Rig::parse));
}

/// Sound to read, impossible to simulate: the line of the inertia where the fastest motion sits.
#[test]
fn shapes_too_stiff_for_their_inertia_name_their_line() {
    let mut report = String::new();
    for (from, to) in [
        ("{ inertia = 9e-5 }", "{ inertia = 1e-30 }"),
        ("mass = 0.05", "mass = 1e-30"),
        ("stiffness = 100.0", "stiffness = 1e18"),
    ] {
        assert!(SOUND.contains(from), "nothing to break: {from}");
        let rig = Rig::parse(&SOUND.replacen(from, to, 1), "rig.toml");
        let plant = Plant::new(&rig.unwrap_or_else(|error| panic!("{error}")));
        let plant = plant.unwrap_or_else(|error| panic!("{error}"));
        let times = [0.0, 0.01, 0.02];
        let drive = InputTrajectory::new(&plant, times.len(), &[]).expect("the plant has no input");
        let start = vec![0.0; plant.state_len()];
        let refused = plant.simulate(&plant.values(), &start, &drive, &times);
        let refused = refused.map_or_else(|error| error.to_string(), |_| "RUNS".to_owned());
        report += &format!("--- {from} -> {to}\n{refused}\n");
    }
    insta::assert_snapshot!(report);
}

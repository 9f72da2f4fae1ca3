//! Every refusal of `[control]` and `[network]`, word for word.

#[path = "../../../../sim/tests/simulator/broken_rigs.rs"]
mod broken_rigs;

use broken_rigs::{SOUND, refusals};

/// (what is replaced, by what): the first place only.
const CASES: &[(&str, &str)] = &[
    ("rate_hz = 120.0", "rate_hz = 0.0"),
    ("rate_hz = 120.0", "rate = 120.0"),
    ("rate_hz = 120.0", "reference = [\"a\", \"b\"]"),
    ("rate_hz = 120.0", "move_suppression = [0.1, 0.1]"),
    ("rate_hz = 120.0", "command_weight = -0.1"),
    ("rate_hz = 120.0", "budget = 0"),
    ("rate_hz = 120.0", "budget = \"200 us\""),
    ("rate_hz = 120.0", "terminal = \"valu\""),
    ("rate_hz = 120.0", "value_rows = 2"),
    ("rate_hz = 120.0", "terminal = \"value\"\nvalue_rows = 4"),
    ("rate_hz = 120.0", "terminal = \"value\"\nvalue_ahead = -1"),
    ("rate_hz = 120.0", "terminal = \"value\"\nvalue_points = 10"),
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
    insta::assert_snapshot!(refusals(SOUND, CASES, super::parse));
}

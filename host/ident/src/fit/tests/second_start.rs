//! Values that are wrong by orders of magnitude.

use super::*;

/// A slide of 1 kg that is pulled by a spring of its drive: `u` moves the other end.
fn slide(gain: f64, stiffness: f64, damping: f64) -> Rig {
    let text = oscillator(1.0, stiffness, damping, "");
    let text = text.replace("inertia = { value = 1.0 }", "inertia = 1.0");
    parse(&text.replace("gain = 1.0", &format!("gain = {{ value = {gain:?} }}")))
}

/// `sinew new` cannot know a gain and writes 1. Stretches of a third of a second ended at a gain of
/// -2 and ten times the error of the rig as written.
#[test]
fn a_gain_of_one_where_thousands_are_right_is_found() {
    let truth = slide(2500.0, 3150.0, 15.0);
    let recordings: Vec<Recording> = (1..=2)
        .map(|seed| recorded(&truth, 4000, 0.005, 0.03, 0.02, seed))
        .collect();
    let fitted = run(&slide(1.0, 1.1, 0.041), &recordings);
    for (name, wanted) in [
        ("push.gain", 2500.0),
        ("coil.stiffness", 3150.0),
        ("dashpot.damping", 15.0),
    ] {
        let value = parameter(&fitted, name).value;
        assert!(
            (value / wanted - 1.0).abs() < 0.01,
            "{name}: {value}, not {wanted}"
        );
    }
}

//! Bounds of parameters.

use super::*;

/// A recording of a mass of 1 kg on 40 N/m with 1 N s/m.
fn recording() -> Recording {
    let truth = parse(&oscillator(1.0, 40.0, 1.0, ""));
    recorded(&truth, 1000, 0.01, 10.0, 1e-3, 5)
}

/// The fit of a rig whose stiffness and damping are written like this.
fn fitted(stiffness: &str, damping: &str) -> Fit {
    let text = oscillator(1.0, 50.0, 1.5, "");
    let text = text.replace("{ value = 50.0 }", &format!("{{ {stiffness} }}"));
    let text = text.replace("{ value = 1.5 }", &format!("{{ {damping} }}"));
    run(&parse(&text), &[recording()])
}

#[test]
fn a_bound_is_kept_and_the_better_value_beyond_is_said() {
    let fit = fitted("value = 50.0, min = 45.0, max = 60.0", "value = 1.5");
    let stiffness = parameter(&fit, "coil.stiffness");
    assert_eq!(
        (stiffness.value, stiffness.at_bound, stiffness.ci95),
        (45.0, true, None)
    );
    let beyond = fit.beyond.expect("40 N/m explain more");
    let [only] = &beyond.parameters[..] else {
        panic!("{beyond:?}")
    };
    assert_eq!((only.name.as_str(), only.bound), ("coil.stiffness", 45.0));
    assert!((only.value / 40.0 - 1.0).abs() < 0.01, "{only:?}");
    assert!(beyond.sensors[0].rms < 0.2 * fit.sensors[0].rms);
}

#[test]
fn a_bound_that_costs_nothing_is_no_matter() {
    let within = fitted("value = 50.0, min = 30.0", "value = 1.5");
    assert_eq!(within.beyond, None);
    // At rest at 39.99 N/m, a thousandth from the truth.
    let near = fitted("value = 35.0, max = 39.99", "value = 1.5");
    assert!(parameter(&near, "coil.stiffness").at_bound);
    assert_eq!(near.beyond, None, "{:?}", near.sensors);
}

/// A value of next to nothing had a scale of next to nothing, and a prior as narrow.
#[test]
fn a_parameter_that_starts_at_next_to_nothing_moves() {
    for damping in [
        "value = 0.0",
        "value = 1e-12",
        "value = 1e-8, min = 1e-8",
        "value = 1e-5, min = 1e-5, max = 10.0",
        "value = 1e-3",
        "value = 10.0, max = 10.0",
    ] {
        let fit = fitted("value = 50.0", damping);
        let found = parameter(&fit, "dashpot.damping");
        assert!(!found.at_bound, "{damping}");
        assert!((found.value - 1.0).abs() < 0.02, "{damping}: {found:?}");
    }
}

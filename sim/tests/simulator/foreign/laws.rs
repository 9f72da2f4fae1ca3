//! Every law of the vocabulary against a hard-law integrator that shares nothing with the
//! simulator: `tests/foreign/hardlaw/exact.py` drew a rig for each kind, concealed it there, and
//! wrote the motion.

use sinew_sim::effects::Kind;

use super::recording::error;

/// Largest difference allowed, as a part of the range of the motion.
const TOLERANCE: f64 = 1e-5;
/// Kinds with another law at another sort of component.
const ELSEWHERE: &[&str] = &[
    "load_dependent_friction.body",
    "load_dependent_friction.tendon",
    "backlash.actuator",
    "backlash.spring",
    "backlash.tendon",
    "warm_up_friction",
];

#[test]
fn every_kind_moves_as_the_foreign_integrator_says() {
    let kinds = Kind::ALL.iter().map(|kind| kind.description().kind);
    let mut failures = Vec::new();
    let mut seen = 0;
    for name in kinds.chain(ELSEWHERE.iter().copied()) {
        let error = error("laws", name, None);
        println!("{name}: {error:.1e} of the range");
        if error > TOLERANCE || error.is_nan() {
            failures.push(format!("{name}: {error:.1e}"));
        }
        seen += 1;
    }
    assert_eq!(seen, 33);
    assert!(failures.is_empty(), "of the range: {failures:#?}");
}

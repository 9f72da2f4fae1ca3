//! Laws that are said to look the same do.

use crate::diagnose::{DiagnoseOptions, Recordings, Verdict, diagnose};
use crate::noise::gaussian;
use crate::recording::Recording;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use sinew_sim::Rig;

use super::pushed;

const RIG: &str = r#"
format = "sinew-rig/1"
name = "hardening"

[[body]]
name = "mass"
motion = "slide"
inertia = 1.0

[[spring]]
name = "coil"
from = "ground"
to = "mass"
stiffness = { value = 30.0, min = 1.0 }

[[damper]]
name = "oil"
from = "ground"
to = "mass"
damping = { value = 1.0, min = 0.0 }

[[actuator]]
name = "push"
drives = "mass"
input = "u_N"
gain = 1.0

[[sensor]]
name = "camera"
reads = "mass.position"
signal = "q_m"
"#;

/// 6 s of a mass of 1 kg at 40 N/m with a cubic part of 3000 N/m^3, both ways alike; fourth-order
/// Runge-Kutta in steps of 1 ms under a held force.
fn hardening(seed: u64) -> Recording {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let (mut q, mut v) = (0.0_f64, 0.0_f64);
    let (mut inputs, mut seen) = (Vec::new(), Vec::new());
    for k in 0..600 {
        let t = 0.01 * f64::from(k);
        let u = 5.0 * (3.1 * t).sin() + 3.0 * ((7.3 + seed as f64) * t).sin();
        inputs.push(u);
        seen.push(q + 2e-4 * gaussian(&mut random));
        let pull = |q: f64, v: f64| u - 40.0 * q - 3000.0 * q.powi(3) - 1.2 * v;
        for _ in 0..10 {
            let h = 1e-3;
            let (q1, v1) = (v, pull(q, v));
            let (q2, v2) = (v + 0.5 * h * v1, pull(q + 0.5 * h * q1, v + 0.5 * h * v1));
            let (q3, v3) = (v + 0.5 * h * v2, pull(q + 0.5 * h * q2, v + 0.5 * h * v2));
            let (q4, v4) = (v + h * v3, pull(q + h * q3, v + h * v3));
            q += h / 6.0 * (q1 + 2.0 * q2 + 2.0 * q3 + q4);
            v += h / 6.0 * (v1 + 2.0 * v2 + 2.0 * v3 + v4);
        }
    }
    pushed([inputs, seen])
}

#[test]
fn a_law_that_leaves_the_mismatch_looks_like_no_law_that_takes_it() {
    let rig = Rig::parse(RIG, "hardening.toml").expect("the text is a rig");
    let recordings = Recordings {
        fit: vec![hardening(1)],
        check: vec![hardening(2)],
        test: vec![],
    };
    let found = diagnose(
        &rig,
        &recordings,
        &DiagnoseOptions::default(),
        &|_, _, _| {},
    );
    let found = found.expect("the rig can be diagnosed");
    assert_eq!(found.verdict, Verdict::MissingPhysics, "{}", found.sentence);
    let [cubic] = &found.effects[..] else {
        panic!("{}", found.sentence);
    };
    assert_eq!(cubic.kind, "cubic_stiffness");
    let candidate = |name: &str| found.candidates.iter().find(|one| one.name == name);
    let quadratic =
        candidate("quadratic_stiffness at coil").expect("quadratic stiffness was tried");
    assert!(quadratic.remainder > 0.5, "{quadratic:?}");
    for twin in &cubic.indistinguishable_from {
        let name = format!("{} at {}", twin.kind, twin.component);
        let left = candidate(&name).map(|one| one.remainder);
        assert!(left < Some(0.1), "{name} leaves {left:?}");
    }
}

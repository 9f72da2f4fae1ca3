//! A mode counts as there only where it is known how heavy it is.

use crate::diagnose::acceptance::is_determined;
use crate::diagnose::candidate::Candidate;
use crate::diagnose::case::Case;
use crate::diagnose::data::Data;
use crate::diagnose::search::refit::refit;
use crate::diagnose::search::start::begin;
use crate::diagnose::term::term;
use std::slice::from_ref;

use rand::SeedableRng;
use sinew_sim::Rig;

use super::finger::{case, subset};
use super::{compiled, pushed};
use crate::noise::gaussian;
use crate::recording::Recording;

const SWING: &str = r#"
format = "sinew-rig/1"
name = "swing"
[[body]]
name = "mass"
motion = "slide"
inertia = { value = 1.8 }
[[spring]]
name = "spring"
from = "ground"
to = "mass"
stiffness = { value = 90.0 }
[[damper]]
name = "dashpot"
from = "ground"
to = "mass"
damping = { value = 2.5 }
[[actuator]]
name = "motor"
drives = "mass"
input = "u_N"
gain = 1.0
[[sensor]]
name = "encoder"
reads = "mass.position"
signal = "q_m"
"#;

/// A mass of 2 kg on a spring of 80 N/m, which carries a mode of this many kilograms at 3 Hz: ten
/// seconds with noise of 2 mm, in small steps of symplectic Euler.
fn recorded(carried: f64, seed: u64) -> Recording {
    let parts = 16;
    let h = 0.01 / f64::from(parts);
    let (stiffness, damping) = (350.0 * carried, 2.0 * carried);
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    let (mut q, mut v, mut x, mut w) = (0.0, 0.0, 0.0, 0.0);
    let (mut inputs, mut seen) = (Vec::new(), Vec::new());
    for k in 0..1000 {
        let at = 0.01 * f64::from(k) + seed as f64;
        let u = 2.0 * ((2.0 * at).sin() + (7.0 * at).cos() + (17.0 * at).sin());
        inputs.push(u);
        seen.push(q + 2e-3 * gaussian(&mut random));
        for _ in 0..parts {
            let force = stiffness * (q - x) + damping * (v - w);
            v += h * (u - 80.0 * q - 3.0 * v - force) / 2.0;
            w += if carried > 0.0 {
                h * force / carried
            } else {
                0.0
            };
            q += h * v;
            x += h * w;
        }
    }
    pushed([inputs, seen])
}

/// The final of a mode that begins like this.
fn last(case: &Case, start: &[f64]) -> Candidate {
    let subset = subset(case);
    let values = compiled(case.written).values();
    let parent = subset
        .first(case.written, &values, 15)
        .expect("the rig is sound");
    let parent = parent.expect("the rig can be simulated");
    let begun = begin(
        &subset,
        &parent,
        &term(case.written, "hidden_mode", &["mass"]),
        start,
    );
    let begun = begun.expect("the component bears this effect");
    let trial = subset.improved(begun.terms, begun.model, begun.from, 10);
    let trial = trial.expect("the rig can be simulated");
    let last = refit(case, &subset, &trial, 12).expect("the rig is sound");
    last.expect("the fit stays finite")
}

/// Question asked of recordings with a mode of this many kilograms.
fn judged(carried: f64, ask: impl Fn(&Case)) {
    let own = Rig::parse(SWING, "swing.toml").expect("the text is a rig");
    let plant = compiled(&own);
    let data = |recordings: &[Recording]| {
        Data::new(&own, &plant, recordings).expect("the recordings have the columns of the rig")
    };
    let [first, second] = [recorded(carried, 1), recorded(carried, 2)];
    let (fit, check) = (data(from_ref(&first)), data(from_ref(&second)));
    let both = data(&[first, second]);
    ask(&case(&own, [&fit, &check, &both], fit.cut(1)));
}

/// A mass on a spring as good as rigid: what it weighs, the body may weigh.
const RIGID: [f64; 3] = [0.2, 2e4, 50.0];

#[test]
fn a_mode_that_swings_has_a_size_and_one_as_good_as_rigid_has_none() {
    for (carried, start, there) in [(0.4, [0.02, 7.0, 0.04], true), (0.0, RIGID, false)] {
        judged(carried, |case| {
            let mode = last(case, &start);
            assert_eq!(is_determined(case, &mode).expect("the rig is sound"), there);
        });
    }
}

//! Fits of rigs whose motion a recording imposes: the force is what is predicted.

use super::*;
use crate::fit::{FitOptions, fit, score};
use crate::recording::{Column, Recording};
use rand::SeedableRng as _;

const STAND: &str = "format = \"sinew-rig/1\"\nname = \"stand\"\n[[body]]\nname = \"rod\"\n\
    motion = \"slide\"\ninertia = { value = 1.0 }\nmotion_from = \"q_m\"\n[[spring]]\n\
    name = \"coil\"\nfrom = \"ground\"\nto = \"rod\"\nstiffness = { value = 10.0 }\n[[damper]]\n\
    name = \"oil\"\nfrom = \"ground\"\nto = \"rod\"\ndamping = { value = 1.0 }\n[[sensor]]\n\
    name = \"cell\"\nreads = \"rod.effort\"\nsignal = \"f_N\"\noffset = { value = 0.0 }\n\
    [[effect]]\nkind = \"coulomb_friction\"\ncomponent = \"rod\"\nlevel = { value = 0.1 }\n";

/// 3 kg, 40 N/m, 2 N s/m, 5 N of dry friction, a cell that reads 0.7 N too much, written down and
/// not simulated; the position carries noise of 20 um.
fn recording() -> Recording {
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(11);
    let t: Vec<f64> = (0..1500).map(|k| 0.004 * f64::from(k)).collect();
    let (mut q, mut f) = (Vec::new(), Vec::new());
    for t in &t {
        let (slow, fast) = ((2.0 * t).sin_cos(), (7.0 * t).sin_cos());
        let x = 0.2 * slow.0 + 0.05 * fast.0;
        let v = 0.4 * slow.1 + 0.35 * fast.1;
        let a = -0.8 * slow.0 - 2.45 * fast.0;
        let noise = crate::noise::gaussian;
        q.push(x + 2e-5 * noise(&mut random));
        f.push(3.0 * a + 40.0 * x + 2.0 * v + 5.0 * v.signum() + 0.7 + 0.02 * noise(&mut random));
    }
    let column = |name: &str, values| Column {
        name: name.into(),
        values,
    };
    Recording::new("stand.csv", t, vec![column("q_m", q), column("f_N", f)]).unwrap()
}

#[test]
fn an_imposed_motion_gives_mass_spring_damper_and_friction_from_the_force() {
    let rig = Rig::parse(STAND, "stand.toml").unwrap();
    let recordings = [recording()];
    let fitted = fit(&rig, &recordings, &FitOptions::default(), &mut |_| {}).unwrap();
    let truth = [
        ("rod.inertia", 3.0, 0.02),
        ("coil.stiffness", 40.0, 0.1),
        ("oil.damping", 2.0, 0.1),
        ("cell.offset", 0.7, 0.02),
        ("rod.coulomb_friction.level", 5.0, 0.05),
    ];
    for (name, value, tolerance) in truth {
        let found = fitted.parameters.iter().find(|p| p.name == name).unwrap();
        assert!(
            (found.value - value).abs() < tolerance,
            "{name}: {}",
            found.value
        );
    }
    // What is left is the cell's noise, but where the direction of a slow rod is uncertain.
    let error = &score(&fitted.rig, &recordings).unwrap()[0];
    assert!(error.rms < 0.4, "{}", error.rms);
    assert!(error.spread > 5.0);
}

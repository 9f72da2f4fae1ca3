//! Friction that follows a recorded column, in recordings of closed form.

use crate::diagnose::{DiagnoseOptions, Diagnosis, Recordings, diagnose};
use crate::noise::gaussian;
use crate::recording::{Column, Recording};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use sinew_sim::Rig;

const STAND: &str = r#"
format = "sinew-rig/1"
name = "stand"

[[body]]
name = "rod"
motion = "slide"
inertia = 0.0
motion_from = "x_m"

[[damper]]
name = "dashpot"
from = "ground"
to = "rod"
damping = { value = 100.0, min = 0.0 }

[[signal]]
name = "coil"
column = "u_V"

[[sensor]]
name = "cell"
reads = "rod.effort"
signal = "f_N"
"#;

/// Ten seconds of a rod that is moved by two sines, 200 times a second: a dashpot of 150 N s/m and
/// a dry friction of `level` and `slope` times a voltage between 0 and 4 V. 0.5 N of noise.
fn moved([level, slope]: [f64; 2], seed: u64) -> Recording {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let t: Vec<f64> = (0..2000).map(|k| 0.005 * f64::from(k)).collect();
    let phase = seed as f64;
    let (mut x, mut u, mut f) = (Vec::new(), Vec::new(), Vec::new());
    for t in &t {
        let (slow, fast) = (3.0 * t + phase, 7.3 * t);
        x.push(0.03 * slow.sin() + 0.01 * fast.sin());
        let v = 0.09 * slow.cos() + 0.073 * fast.cos();
        u.push(2.0 + 2.0 * (1.1 * t + 2.0 * phase).sin());
        let friction = (level + slope * u[u.len() - 1]) * v.signum();
        f.push(150.0 * v + friction + 0.5 * gaussian(&mut random));
    }
    let column = |name: &str, values: Vec<f64>| Column {
        name: name.into(),
        values,
    };
    let columns = vec![column("x_m", x), column("u_V", u), column("f_N", f)];
    Recording::new(format!("{seed}.csv"), t, columns).expect("the text is a recording")
}

fn found(law: [f64; 2]) -> Diagnosis {
    let rig = Rig::parse(STAND, "stand.toml").expect("the rig is sound");
    let recordings = Recordings {
        fit: vec![moved(law, 1), moved(law, 2)],
        check: vec![moved(law, 3)],
        test: Vec::new(),
    };
    let found = diagnose(
        &rig,
        &recordings,
        &DiagnoseOptions::default(),
        &|_, _, _| {},
    );
    found.expect("the rig can be diagnosed")
}

#[test]
fn friction_that_grows_with_a_voltage_is_named_with_it() {
    let found = found([4.0, 9.0]);
    let [effect] = &found.effects[..] else {
        panic!("{}", found.sentence);
    };
    let named = (effect.kind.as_str(), effect.component.as_str());
    assert_eq!(named, ("coulomb_friction", "rod"));
    assert_eq!(effect.with.as_deref(), Some("coil"), "{}", found.sentence);
    let value = |name: &str| effect.parameters[name].value;
    assert!(
        (value("level.slope") / 9.0 - 1.0).abs() < 0.02,
        "{}",
        value("level.slope")
    );
    assert!((value("level") - 4.0).abs() < 0.5, "{}", value("level"));
    assert!(effect.confidence > 0.8, "{}", effect.confidence);
    let text = found.mended.to_toml();
    assert!(
        text.contains("with = \"coil\", slope = { value = "),
        "{text}"
    );
}

/// A column that varies is no reason to follow it.
#[test]
fn friction_that_is_constant_is_named_without_the_voltage() {
    let found = found([22.0, 0.0]);
    let [effect] = &found.effects[..] else {
        panic!("{}", found.sentence);
    };
    assert_eq!(
        (effect.kind.as_str(), &effect.with),
        ("coulomb_friction", &None)
    );
    assert!((effect.parameters["level"].value / 22.0 - 1.0).abs() < 0.02);
    assert!(!effect.parameters.contains_key("level.slope"));
}

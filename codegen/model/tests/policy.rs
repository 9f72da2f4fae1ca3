//! A policy's files: the same again, what does not fit is refused, commands stay inside the limits.

use sinew_model::policy::{Input, Output, PolicySpec, Runner, emit, load, save};
use sinew_nn::{Dense, Network, Op};

/// Half of the distance to go.
fn policy() -> PolicySpec {
    let mut network = Network::new("half-network", "seen", vec![4]);
    let dense = Dense {
        weights: vec![-0.5, 0.0, 0.0, 0.5],
        bias: vec![0.0],
    };
    network
        .push("dense", Op::Dense(dense), vec![0])
        .expect("it fits");
    PolicySpec {
        name: "half".into(),
        period_s: 0.01,
        outputs: vec![Output {
            name: "q_m".into(),
            unit: "m".into(),
            low: 0.0,
            high: 1.0,
        }],
        inputs: vec![Input {
            name: "u_N".into(),
            unit: "N".into(),
            lower: -1.0,
            upper: 1.0,
            rate: 0.3,
            safe: 0.0,
        }],
        past_outputs: 2,
        past_inputs: 1,
        ahead: 1,
        network,
    }
}

#[test]
fn a_policy_is_the_same_again_and_one_without_a_rate_too() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut spec = policy();
    for rate in [0.3, f32::INFINITY] {
        spec.inputs[0].rate = rate;
        save(folder.path(), &spec).expect("it is valid");
        assert_eq!(load(folder.path()).expect("it was written"), spec);
    }
}

#[test]
fn sizes_that_do_not_fit_the_network_are_refused_with_the_file() {
    let folder = tempfile::tempdir().expect("a folder");
    save(folder.path(), &policy()).expect("it is valid");
    let path = folder.path().join("policy.toml");
    let text = std::fs::read_to_string(&path).expect("it was written");
    for (from, to, why) in [
        (
            "ahead = 1",
            "ahead = 2",
            "sees 5 numbers, and its network takes 4",
        ),
        ("upper = 1.0", "upper = -2.0", "lower <= safe <= upper"),
        ("sinew-policy/1", "sinew-policy/2", "this program reads"),
        ("ahead = 1", "aheed = 1", "aheed"),
    ] {
        std::fs::write(&path, text.replacen(from, to, 1)).expect("it can be written");
        let error = load(folder.path())
            .expect_err("it does not fit")
            .to_string();
        assert!(
            error.contains("policy.toml") && error.contains(why),
            "{error}"
        );
    }
}

#[test]
fn commands_stay_inside_the_limits_whatever_comes_in() {
    let spec = policy();
    let mut runner = Runner::new(&spec);
    let mut before = 0.0_f64;
    let mut moved = 0.0_f64;
    for k in 0..300 {
        let y = [f64::NAN, 1e30, -1e30, 0.2, 0.7][k % 5];
        let asked = [[0.9], [f64::INFINITY], [-3.0]][k % 3];
        let u = runner.step(&[y], |_| &asked)[0];
        assert!((-1.0..=1.0).contains(&u), "{u}");
        assert!((u - before).abs() <= f64::from(0.3_f32), "{before} to {u}");
        moved = moved.max((u - before).abs());
        before = u;
    }
    assert!(moved > 0.29, "{moved}: nothing reached the rate");
}

#[test]
fn the_printed_crate_has_the_limits_and_depends_on_the_firmware() {
    let files = emit(
        &policy(),
        &sinew_nn::emit::Options::default(),
        "../firmware/mpc",
    );
    let files = files.expect("it is valid");
    let text = |path: &str| {
        let file = files.iter().find(|file| file.path == path);
        &file.unwrap_or_else(|| panic!("no {path}")).text
    };
    assert!(text("policy/src/lib.rs").contains("rate: [0.3],"));
    assert!(text("policy/Cargo.toml").contains("sinew-mpc = { path = \"../firmware/mpc\" }"));
    assert!(text("network/src/network.rs").contains("pub fn predict("));
}

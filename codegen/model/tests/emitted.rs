//! Emitted crates, compiled: for the host, where they are run against double precision, and for the
//! microcontroller.

mod support;

use std::fmt::Write as _;
use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use sinew_model::emit::EmitOptions;
use sinew_model::spec::{Activation, ModelSpec, OutputForm, gru_cell, lstm_cell};
use sinew_model::{regenerate, store};

const TARGET: &str = "thumbv7em-none-eabihf";

/// The reference networks, and each way in which layers and forms can be put together.
fn specs() -> Vec<ModelSpec> {
    use Activation::{Linear, Relu, Tanh};
    use OutputForm::{Absolute, Increment};
    let network = support::network;
    vec![
        support::reference("S"),
        support::reference("L"),
        support::reference("P"),
        support::tiny(),
        support::with_shortcut(),
        support::with_value(),
        network("one-linear", Absolute, 0, &[(2, Linear)]),
        network("one-tanh", Increment, 1, &[(2, Tanh)]),
        network("one-relu", Increment, 0, &[(2, Relu)]),
        network("tanh-tanh", Increment, 0, &[(4, Tanh), (2, Tanh)]),
        network("linear-relu", Absolute, 2, &[(3, Linear), (2, Relu)]),
        network(
            "deep",
            Increment,
            1,
            &[(5, Tanh), (4, Linear), (6, Relu), (3, Tanh), (2, Linear)],
        ),
        support::sensed(
            "sensed",
            network("n", Increment, 0, &[(3, Tanh), (2, Linear)]),
        ),
        support::sensed("sensed-value", support::with_value()),
        support::watched(
            "watched",
            network("n", Increment, 0, &[(3, Tanh), (2, Linear)]),
        ),
        support::watched("watched-value", support::with_value()),
        support::recurrent("gru", gru_cell(), 5, 1, &[(2, Linear)]),
        support::recurrent("lstm", lstm_cell(), 4, 0, &[(3, Tanh), (2, Linear)]),
    ]
}

/// Largest errors of one model, as the checking program prints them.
struct Errors {
    name: String,
    /// Of an output, relative to that output's range over the golden vectors.
    output: f64,
    /// Of a derivative, relative to the largest of that output over the golden vectors.
    jacobian: f64,
}

/// One workspace for all models, so that the firmware is compiled once.
#[test]
fn emitted_crates_compute_what_double_precision_does() {
    let workspace = workspace("emitted-host");
    let specs = specs();
    emit(&workspace, &specs);
    let checks: String = specs.iter().map(check_call).collect();
    let program = CHECK.replace("{checks}", &checks);
    write(&workspace.join("check/src/main.rs"), &program);

    let output = Command::new(env!("CARGO"))
        .args(["run", "--quiet", "--release", "--package", "check"])
        .current_dir(&workspace)
        .env("CARGO_TARGET_DIR", outputs())
        .output()
        .expect("cargo runs this test");
    let report = String::from_utf8_lossy(&output.stdout);
    let complaints = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{report}\n{complaints}");
    println!("model, error of outputs, of derivatives:\n{report}");
    // Warnings of path dependencies are shown, and emitted code has none.
    assert_eq!(complaints, "", "emitted code compiles without a warning");

    let errors: Vec<Errors> = report.lines().map(parse_errors).collect();
    assert_eq!(errors.len(), specs.len(), "{report}");
    for Errors {
        name,
        output,
        jacobian,
    } in errors
    {
        assert!(
            output < 1e-5,
            "{name}: an output is off by {output:e} of its range"
        );
        assert!(
            jacobian < 1e-5,
            "{name}: a derivative is off by {jacobian:e} of the largest"
        );
    }
}

#[test]
fn emitted_crates_build_for_the_microcontroller() {
    let Some(mut cargo) = firmware_cargo() else {
        // Not eprintln!, which the test harness swallows.
        let skipped = format!(
            "\nSKIPPED: emitted crates were not built for {TARGET}, which is not installed\n"
        );
        std::io::stderr().write_all(skipped.as_bytes()).unwrap();
        return;
    };
    let workspace = workspace("emitted-target");
    let specs = specs();
    emit(&workspace, &specs);
    let mut program = String::from("//! All models, for the microcontroller.\n#![no_std]\n");
    for spec in &specs {
        let library = library(&spec.name);
        writeln!(program, "/// The session of one model: its state, and all that it calls.\npub static {}: fn() -> {library}::control::Session = {library}::session;", library.to_uppercase()).unwrap();
    }
    write(&workspace.join("check/src/lib.rs"), &program);

    let output = cargo
        .args([
            "build",
            "--quiet",
            "--release",
            "--package",
            "check",
            "--target",
            TARGET,
        ])
        .current_dir(&workspace)
        .env("CARGO_TARGET_DIR", outputs())
        .output()
        .expect("the firmware's cargo starts");
    let complaints = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{complaints}");
    assert_eq!(complaints, "", "emitted code compiles without a warning");
}

/// Build outputs of both tests: those of the boards, which have most crates in common.
fn outputs() -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).with_file_name("boards")
}

/// A directory that stays between runs, so that the second run compiles only what changed.
fn workspace(name: &str) -> PathBuf {
    let workspace = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(workspace.join("check"));
    let lock = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../Cargo.lock");
    // The versions that the project is tested with.
    write(
        &workspace.join("Cargo.lock"),
        &fs::read_to_string(lock).unwrap(),
    );
    workspace
}

/// Writes each model and its crate, and a workspace that depends on them by path, as boards do.
fn emit(workspace: &Path, specs: &[ModelSpec]) {
    let firmware = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../firmware");
    let options = EmitOptions {
        firmware: firmware.display().to_string(),
        ..EmitOptions::default()
    };
    let mut dependencies = format!("sinew-mpc = {{ path = {:?} }}\n", firmware.join("mpc"));
    for spec in specs {
        let model = workspace.join("models").join(&spec.name);
        store::save(&model, spec).unwrap();
        regenerate::write(&model, &model, &options).unwrap();
        let name = &spec.name;
        writeln!(
            dependencies,
            "sinew-model-{name} = {{ path = \"../models/{name}\" }}"
        )
        .unwrap();
    }
    write(
        &workspace.join("Cargo.toml"),
        "[workspace]\nresolver = \"3\"\nmembers = [\"check\"]\nexclude = [\"models\"]\n",
    );
    let manifest = "[package]\nname = \"check\"\nedition = \"2024\"\n\n[dependencies]\n";
    write(
        &workspace.join("check/Cargo.toml"),
        &format!("{manifest}{dependencies}"),
    );
}

fn library(name: &str) -> String {
    format!("sinew_model_{}", name.replace('-', "_"))
}

fn check_call(spec: &ModelSpec) -> String {
    let (name, library) = (&spec.name, library(&spec.name));
    let hidden = match spec.hidden_state_len() {
        0 => String::new(),
        _ => format!("    check_hidden_state!({library}, {name:?});\n"),
    };
    let sensor = match &spec.soft_sensor {
        None => String::new(),
        Some(sensor) if sensor.watch.is_some() => {
            format!("    check_watch!({library}, {name:?});\n")
        }
        Some(_) => format!("    check_soft_sensor!({library}, {name:?});\n"),
    };
    hidden + &sensor + &format!("    check!({library}, {name:?});\n")
}

/// Cargo for the target as the environment names it, if it can build for it.
fn firmware_cargo() -> Option<Command> {
    let set = |name| std::env::var_os(name).filter(|value| !value.is_empty());
    let mut cargo = Command::new(set("SINEW_FIRMWARE_CARGO").unwrap_or(env!("CARGO").into()));
    let rustc = set("SINEW_FIRMWARE_RUSTC");
    if let Some(rustc) = &rustc {
        cargo.env("RUSTC", rustc);
    }
    if set("SINEW_FIRMWARE_BUILD_STD").is_some_and(|value| value == "1") {
        cargo.env("RUSTC_BOOTSTRAP", "1").arg("-Zbuild-std=core");
        return Some(cargo);
    }
    let library = Command::new(rustc.unwrap_or("rustc".into()))
        .args(["--print", "target-libdir", "--target", TARGET])
        .output()
        .ok()?;
    let library = String::from_utf8(library.stdout).ok()?;
    Path::new(library.trim()).is_dir().then_some(cargo)
}

fn write(path: &Path, text: &str) {
    if fs::read_to_string(path).is_ok_and(|old| old == text) {
        return; // the same file again would make cargo compile again
    }
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(path, text).unwrap();
}

fn parse_errors(line: &str) -> Errors {
    let mut words = line.split(' ');
    let mut next = || words.next().unwrap_or_else(|| panic!("{line}"));
    Errors {
        name: next().into(),
        output: next().parse().unwrap(),
        jacobian: next().parse().unwrap(),
    }
}

/// The program that holds each model against its golden vectors: the bits of both predictions are
/// compared here, the errors are printed for the test to judge.
const CHECK: &str = r#"
use sinew_mpc::model::{ChannelJacobian, Jacobian, Model, Regressor};
use sinew_mpc::move_blocking::Interpolation;
use sinew_mpc::sensitivity::{self, Propagate, Sensitivities, Stage};
use sinew_mpc::network::unflatten;

/// Hidden state and its derivatives against double precision; derivatives along directions against
/// all of the Jacobian.
macro_rules! check_hidden_state {
    ($model:ident, $name:literal) => {{
        use $model::control::{MEASURED, NS, NU, NY, PAST_INPUTS, PAST_OUTPUTS};
        let (mut moved, mut steepest) = (0.0_f64, 0.0_f64);
        for (k, golden) in $model::golden::GOLDEN.iter().enumerate() {
            let x: Regressor<NU, NY, NS, PAST_INPUTS, PAST_OUTPUTS> = unflatten(&golden.x).expect("a point");
            let mut trace = $model::Network::TRACE;
            $model::Network.predict(&x, &mut trace);
            let channels = $model::Network.channels(&x, &trace);
            assert_eq!(channels[..MEASURED], x.s[..MEASURED], "measured channels hold");
            let (mut jacobian, mut of_channels) = (Jacobian::ZERO, ChannelJacobian::ZERO);
            $model::Network.jacobian(&trace, &mut jacobian);
            $model::Network.channel_jacobian(&trace, &mut of_channels);
            let lags = NU * PAST_INPUTS + NY * PAST_OUTPUTS;
            let near = |found: f32, expected: f64| {
                assert!((f64::from(found) - expected).abs() < 1e-5, "{}: {found} for {expected}", $name);
            };
            for r in 0..NY {
                for c in 0..NS {
                    near(of_channels.y_by_s[r][c], golden.jacobian[r][lags + c]);
                }
            }
            for (m, hidden) in golden.hidden_state.iter().enumerate() {
                near(channels[MEASURED + m], *hidden);
                moved = moved.max((*hidden - f64::from(x.s[MEASURED + m])).abs());
                let row = &golden.hidden_state_jacobian[m];
                steepest = row.iter().fold(steepest, |most, d| most.max(d.abs()));
                for (lag, block) in of_channels.u.iter().enumerate() {
                    (0..NU).for_each(|c| near(block[MEASURED + m][c], row[lag * NU + c]));
                }
                for (lag, block) in of_channels.y.iter().enumerate() {
                    (0..NY).for_each(|c| near(block[MEASURED + m][c], row[PAST_INPUTS * NU + lag * NY + c]));
                }
                (0..NS).for_each(|c| near(of_channels.s[MEASURED + m][c], row[lags + c]));
            }
            let place = |block, weight| Interpolation { block, weight };
            let inputs = [place(0, 1.0), place(1, 0.5), place(1, 1.0), place(2, 0.25)];
            let stage = Stage {
                active_before: 2,
                active: 3,
                inputs: &inputs,
                weighted: Some(&[0.7; NY]),
                tracking: &[1.5; NY],
            };
            let draw = |place: usize| ((7 * place + 5 * k + 3) % 11) as f32 / 6.0 - 0.8;
            let run = |all: bool| {
                let mut blocks = [[[[0.0; NU]; NY]; PAST_OUTPUTS]; 4];
                let mut channels = [[[0.0; NU]; NS]; 4];
                // Commands of block 2 have had no effect yet, and none has one on what is measured.
                for (i, d) in blocks[..2].as_flattened_mut().as_flattened_mut().as_flattened_mut().iter_mut().enumerate() {
                    *d = draw(i);
                }
                for (b, channel) in channels[..2].iter_mut().enumerate() {
                    for (i, d) in channel[MEASURED..].as_flattened_mut().iter_mut().enumerate() {
                        *d = draw(b + 3 * i);
                    }
                }
                let (mut gradient, mut pairs) = ([[0.0; NU]; 4], [[[0.0; NU]; NU]; 16]);
                let mut sensitivities = Sensitivities {
                    blocks: &mut blocks,
                    gradient: &mut gradient,
                    pairs: &mut pairs,
                };
                if all {
                    sensitivity::propagate_channels(&jacobian, &of_channels, &stage, &mut sensitivities, &mut channels);
                } else {
                    $model::Network.propagate_channels(&trace, &stage, &mut sensitivities, &mut channels);
                }
                let parts = [
                    blocks.as_flattened().as_flattened().as_flattened(),
                    channels.as_flattened().as_flattened(),
                    gradient.as_flattened(),
                    pairs.as_flattened().as_flattened(),
                ];
                parts.concat()
            };
            let (along, all) = (run(false), run(true));
            assert!(all.iter().filter(|d| d.abs() > 1e-3).count() > 20);
            for (along, all) in along.iter().zip(&all) {
                near(*along, f64::from(*all));
            }
        }
        assert!(moved > 1e-2 && steepest > 1e-2, "{}: the hidden state stands still", $name);
    }};
}

/// The soft sensor against double precision, and the controller behind it against one that measures
/// what the sensor says.
macro_rules! check_soft_sensor {
    ($model:ident, $name:literal) => {{
        use sinew_mpc::PredictiveLoop as _;
        use $model::control::{HORIZON, NU, NY};
        let mut largest = 0.0_f64;
        let (mut sensed, mut measured) = ($model::controller(), $model::controller());
        for golden in &$model::soft_sensor::GOLDEN {
            let y = $model::soft_sensor::SENSOR.outputs(&golden.channels);
            for (found, expected) in y.iter().zip(&golden.outputs) {
                largest = largest.max(expected.abs());
                let error = (f64::from(*found) - expected).abs();
                assert!(error < 1e-5, "{}: {found} for {expected}", $name);
            }
            // One output is measured and stays, the other is said.
            let (mut partly, mut known) = ([f32::NAN; NY], y);
            (partly[NY - 1], known[NY - 1]) = (0.25, 0.25);
            assert_eq!(sensed.outputs(&partly, &golden.channels), known, "{}", $name);
            let reference = [[0.1; NY]; HORIZON];
            let a = sensed.step(&[f32::NAN; NY], &golden.channels, &reference);
            let b = measured.step(&y, &[f32::NAN; 3], &reference);
            assert_eq!(a.u.map(f32::to_bits), b.u.map(f32::to_bits), "{}", $name);
            assert_eq!(a.u.len(), NU);
        }
        assert!(largest > 0.1, "{}: the sensor says nothing", $name);
    }};
}

/// A channel that dies is replaced at once, found, and left out.
macro_rules! check_watch {
    ($model:ident, $name:literal) => {{
        use sinew_mpc::PredictiveLoop as _;
        use $model::control::{HORIZON, NS, NY};
        let scaling = &$model::soft_sensor::SENSOR.channels;
        let well = scaling.to_physical(&[0.1; NS]);
        let mut dead = [0.1; NS];
        dead[2] = -0.9;
        let dead = scaling.to_physical(&dead);
        let wanted = $model::soft_sensor::SENSOR.outputs(&well);
        let mut controller = $model::controller();
        for k in 0..60 {
            let s = if k < 20 { well } else { dead };
            let y = controller.outputs(&[f32::NAN; NY], &s);
            for (y, wanted) in y.iter().zip(&wanted) {
                assert!((y - wanted).abs() < 0.03, "{} {k}: {y} for {wanted}", $name);
            }
            let step = controller.step(&y, &s, &[[0.1; NY]; HORIZON]);
            assert!(!step.predicted, "{}", $name);
            if k == 19 {
                assert_eq!(controller.left_out().times, 0, "{}", $name);
            }
        }
        let left_out = controller.left_out();
        assert_eq!((left_out.channels, left_out.times), (0b100, 1), "{}", $name);
    }};
}

macro_rules! check {
    ($model:ident, $name:literal) => {{
        use $model::control::{NU, NY, PAST_INPUTS, PAST_OUTPUTS};
        let (mut low, mut high) = ([f64::INFINITY; NY], [f64::NEG_INFINITY; NY]);
        let mut steepest = [0.0_f64; NY];
        for golden in &$model::golden::GOLDEN {
            for (i, y) in golden.y.iter().enumerate() {
                low[i] = low[i].min(*y);
                high[i] = high[i].max(*y);
                let row = golden.jacobian[i].iter();
                steepest[i] = row.fold(steepest[i], |m, d| m.max(d.abs()));
            }
        }
        let (mut output, mut derivative) = (0.0_f64, 0.0_f64);
        for golden in &$model::golden::GOLDEN {
            let x = unflatten(&golden.x).expect("a golden input is a regressor");
            let mut jacobian = Jacobian {
                u: [[[f32::NAN; NU]; NY]; PAST_INPUTS],
                y: [[[f32::NAN; NY]; NY]; PAST_OUTPUTS],
            };
            let mut trace = $model::Network::TRACE;
            let y = $model::Network.predict(&x, &mut trace);
            $model::Network.jacobian(&trace, &mut jacobian);
            for i in 0..NY {
                let range = high[i] - low[i];
                assert!(range > 1e-3, "{}: output {i} stands still", $name);
                output = worst(output, (f64::from(y[i]) - golden.y[i]) / range);
                let row = &golden.jacobian[i];
                let scale = steepest[i];
                assert!(scale > 1e-3, "{}: output {i} depends on nothing", $name);
                for lag in 0..PAST_INPUTS {
                    for c in 0..NU {
                        let found = f64::from(jacobian.u[lag][i][c]);
                        derivative = worst(derivative, (found - row[lag * NU + c]) / scale);
                    }
                }
                for lag in 0..PAST_OUTPUTS {
                    for c in 0..NY {
                        let found = f64::from(jacobian.y[lag][i][c]);
                        let place = PAST_INPUTS * NU + lag * NY + c;
                        derivative = worst(derivative, (found - row[place]) / scale);
                    }
                }
            }
        }
        println!("{} {output:e} {derivative:e}", $name);
    }};
}

/// The larger error; a NaN is the largest.
fn worst(before: f64, error: f64) -> f64 {
    if error.abs() <= before { before } else { error.abs() }
}

fn main() {
{checks}}
"#;

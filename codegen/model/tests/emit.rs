//! The text of emitted crates.

mod support;

use std::fs;
use std::process::Command;

use sinew_model::emit::{EmitOptions, GeneratedFile, emit};
use sinew_model::spec::{Activation, ModelSpec, OutputForm, gru_cell, lstm_cell};
use sinew_model::{fingerprint, regenerate, store};

fn files(spec: &ModelSpec) -> Vec<GeneratedFile> {
    let options = EmitOptions {
        golden_vectors: 2,
        ..EmitOptions::default()
    };
    emit(spec, &options).unwrap()
}

#[test]
fn a_tiny_model_reads_as_if_written() {
    for file in files(&support::tiny()) {
        insta::assert_snapshot!(format!("tiny {}", file.path), file.text);
    }
}

#[test]
fn every_shape_of_network_has_its_calls() {
    use Activation::{Linear, Relu, Tanh};
    for (name, form, layers) in [
        ("one linear layer", OutputForm::Absolute, vec![(2, Linear)]),
        ("one tanh layer", OutputForm::Increment, vec![(2, Tanh)]),
        (
            "relu to tanh",
            OutputForm::Absolute,
            vec![(3, Relu), (2, Tanh)],
        ),
        (
            "three layers",
            OutputForm::Increment,
            vec![(3, Tanh), (4, Linear), (2, Relu)],
        ),
    ] {
        let spec = support::network("shape", form, 1, &layers);
        let text = &files(&spec)[2].text;
        let code = text.split("/// Layer 1, one row").next().unwrap();
        insta::assert_snapshot!(name, code);
    }
}

#[test]
fn a_recurrent_network_predicts_its_hidden_state() {
    use Activation::Linear;
    for (name, cell) in [("gru", gru_cell()), ("lstm", lstm_cell())] {
        let spec = support::recurrent(name, cell, 2, 1, &[(2, Linear)]);
        let text = &files(&spec)[2].text;
        let code = text.split("/// Layer 1, 2 units").next().unwrap();
        insta::assert_snapshot!(name, code);
    }
}

#[test]
fn emitted_code_is_formatted() {
    use Activation::{Linear, Tanh};
    let many = support::network(
        "many-channels",
        OutputForm::Increment,
        32,
        &[(40, Tanh), (2, Linear)],
    );
    let deep = support::network("deep", OutputForm::Increment, 0, &[(2, Tanh); 12]);
    let budgeted = ModelSpec {
        control: sinew_model::spec::ControlSpec {
            command_weight: 0.002,
            budget: Some(30_000),
            ..many.control.clone()
        },
        ..many.clone()
    };
    let infinite = ModelSpec {
        control: sinew_model::spec::ControlSpec {
            lower: vec![f64::NEG_INFINITY; 2],
            upper: vec![f64::INFINITY; 2],
            ..many.control.clone()
        },
        ..many.clone()
    };
    let weighted = ModelSpec {
        control: sinew_model::spec::ControlSpec {
            command_weight: 0.002,
            observer_gain: 0.6,
            ..many.control.clone()
        },
        ..many.clone()
    };
    for spec in [
        weighted,
        budgeted,
        support::tiny(),
        support::with_shortcut(),
        support::with_value(),
        support::reference("S"),
        support::reference("L"),
        support::reference("P"),
        support::network("single", OutputForm::Absolute, 0, &[(2, Linear)]),
        many,
        deep,
        infinite,
        support::recurrent("gru", gru_cell(), 15, 1, &[(2, Linear)]),
        support::recurrent("lstm", lstm_cell(), 4, 0, &[(3, Tanh), (2, Linear)]),
    ] {
        let directory = tempfile::tempdir().unwrap();
        let folder = directory.path().join("src/layers/activation");
        fs::create_dir_all(folder).unwrap();
        for file in files(&spec) {
            // Kernels are copied as they stand.
            let copied = file.path.contains("layers") || file.path.ends_with("number.rs");
            assert!(
                copied || file.text.contains("do not edit."),
                "{}: no header",
                file.path
            );
            fs::write(directory.path().join(file.path), file.text).unwrap();
        }
        // The other files are modules of this one, and rustfmt follows them.
        let rustfmt = Command::new("rustfmt")
            .args(["--check", "--edition", "2024"])
            .arg(directory.path().join("src/lib.rs"))
            .output()
            .expect("rustfmt comes with the toolchain");
        let diff = String::from_utf8_lossy(&rustfmt.stdout);
        assert!(rustfmt.status.success(), "{}:\n{diff}", spec.name);
    }
}

#[test]
fn weight_and_observer_are_beside_the_settings_and_only_where_there_are_any() {
    let mut spec = support::tiny();
    let emitted = |spec: &ModelSpec| {
        let files = files(spec);
        let control = files.iter().find(|file| file.path.ends_with("control.rs"));
        control.expect("control.rs is always emitted").text.clone()
    };
    let plain = emitted(&spec);
    assert!(!plain.contains("COMMAND_WEIGHT") && !plain.contains("OBSERVER_GAIN"));
    assert!(!plain.contains("BUDGET"));
    spec.control.command_weight = 0.25;
    spec.control.observer_gain = 0.5;
    let text = emitted(&spec);
    for constant in ["COMMAND_WEIGHT: f32 = 0.25", "OBSERVER_GAIN: f32 = 0.5"] {
        assert!(text.contains(&format!("    const {constant};\n")), "{text}");
    }
}

#[test]
fn a_budget_is_printed_with_the_work_of_its_parts() {
    let mut spec = support::reference("S");
    spec.control.budget = Some(30_000);
    let files = files(&spec);
    let control = files.iter().find(|file| file.path.ends_with("control.rs"));
    let text = &control.expect("control.rs is always emitted").text;
    let parts = sinew_model::work::parts(&spec);
    for line in [
        "ticks: 30000,".to_string(),
        format!("rollout: {},", parts.rollout),
        format!("derivative: {},", parts.derivative),
        format!("factorisation: {},", parts.factorisation),
    ] {
        assert!(text.contains(&line), "{line}:\n{text}");
    }
}

#[test]
fn the_same_model_gives_the_same_bytes() {
    let spec = support::reference("S");
    let directory = tempfile::tempdir().unwrap();
    store::save(directory.path(), &spec).unwrap();
    let again = store::load(directory.path()).unwrap();
    assert_eq!(files(&spec), files(&again));
    let other = EmitOptions {
        golden_seed: 2,
        ..EmitOptions::default()
    };
    assert_ne!(emit(&spec, &other), emit(&spec, &EmitOptions::default()));
}

/// The number is what boards in the field report; a change here means that they are not recognised.
#[test]
fn a_fingerprint_stays_and_notices_every_change() {
    let spec = support::reference("S");
    assert_eq!(fingerprint(&spec), 0xb2e6_216c);

    let mut seen = vec![fingerprint(&spec)];
    let changes: [fn(&mut ModelSpec); 14] = [
        |spec| spec.name.push('x'),
        |spec| spec.period_s *= 2.0,
        |spec| spec.inputs[1].offset = 1.0,
        |spec| spec.outputs.swap(0, 1),
        |spec| spec.form = OutputForm::Increment,
        |spec| {
            if let sinew_model::spec::Layer::Dense(dense) = &mut spec.layers[1] {
                dense.bias[2] = dense.bias[2].next_up();
            }
        },
        |spec| spec.control.tracking_weight.swap(0, 2),
        |spec| spec.control.max_missing_samples += 1,
        |spec| spec.control.move_blocks.swap(1, 2),
        |spec| spec.control.first_step += 1,
        |spec| spec.control.command_weight = 0.002,
        |spec| spec.control.observer_gain = 0.002,
        |spec| spec.control.budget = Some(30_000),
        |spec| spec.control.budget = Some(30_001),
    ];
    for change in changes {
        let mut changed = spec.clone();
        change(&mut changed);
        seen.push(fingerprint(&changed));
    }
    seen.sort_unstable();
    seen.dedup();
    assert_eq!(seen.len(), 15, "two of the models share a fingerprint");

    let without_golden = ModelSpec {
        soft_sensor: None,
        golden: vec![],
        ..spec.clone()
    };
    assert_eq!(fingerprint(&without_golden), fingerprint(&spec));
}

#[test]
fn committed_models_are_up_to_date() {
    let stale = regenerate::check_all(&support::models()).unwrap();
    assert!(
        stale.is_empty(),
        "print them again with `cargo xtask generate`: {stale:?}"
    );
}

#[test]
fn the_committed_reference_model_is_the_imported_one() {
    let committed = store::load(&support::models().join("reference-s")).unwrap();
    assert_eq!(committed, support::reference("S"));
}

#[test]
fn a_stale_file_is_named_and_written_again() {
    let models = tempfile::tempdir().unwrap();
    let model = models.path().join("tiny");
    store::save(&model, &support::tiny()).unwrap();
    assert_eq!(regenerate::check_all(models.path()).unwrap().len(), 5);
    assert_eq!(regenerate::write_all(models.path()).unwrap().len(), 5);
    assert!(regenerate::check_all(models.path()).unwrap().is_empty());

    let control = model.join("src/control.rs");
    let text = fs::read_to_string(&control).unwrap();
    fs::write(
        &control,
        text.replace("HORIZON: usize = 10", "HORIZON: usize = 11"),
    )
    .unwrap();
    assert_eq!(
        regenerate::check_all(models.path()).unwrap(),
        vec![control.clone()]
    );
    assert_eq!(
        regenerate::write_all(models.path()).unwrap(),
        vec![control.clone()]
    );
    assert_eq!(fs::read_to_string(&control).unwrap(), text);
}

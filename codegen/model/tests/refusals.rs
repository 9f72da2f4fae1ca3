//! Refused models, in the words that a user reads.

mod support;

use std::fs;

use sinew_model::spec::limits::{MAX_LAYERS, MAX_PARAMETERS};
use sinew_model::spec::{Activation, Dense, Layer, ModelSpec, gru_cell, lstm_cell, unfilled};
use sinew_model::{reference, store};

fn first_layer(spec: &mut ModelSpec) -> &mut Dense {
    match &mut spec.layers[0] {
        Layer::Dense(dense) => dense,
        Layer::Recurrent(_) => unreachable!("the tiny model is dense"),
    }
}

#[test]
fn specifications() {
    let changes: &[fn(&mut ModelSpec)] = &[
        |spec| spec.name = "Två Massor".into(),
        |spec| spec.period_s = 0.0,
        |spec| spec.period_s = f64::NAN,
        |spec| spec.inputs.clear(),
        |spec| spec.outputs = vec![spec.outputs[0].clone(); 9],
        |spec| spec.inputs[0].name = "two\nlines".into(),
        |spec| spec.outputs[0].unit = String::new(),
        |spec| spec.channels[0].name = "u_V".into(),
        |spec| spec.outputs[0].span = 0.0,
        |spec| spec.outputs[0].span = 1e-60,
        |spec| spec.inputs[0].offset = f64::INFINITY,
        |spec| spec.past_inputs = 0,
        |spec| spec.past_outputs = usize::MAX,
        |spec| spec.past_outputs = 127,
        |spec| spec.past_inputs = 2,
        |spec| spec.layers.clear(),
        |spec| spec.layers = vec![spec.layers[0].clone(); MAX_LAYERS + 1],
        |spec| spec.layers[1] = support::dense(3, 1, Activation::Linear, 1.0),
        |spec| spec.layers[1] = support::dense(2, 2, Activation::Linear, 1.0),
        |spec| first_layer(spec).outputs = 0,
        |spec| first_layer(spec).outputs = usize::MAX,
        |spec| first_layer(spec).weights.truncate(5),
        |spec| first_layer(spec).bias.push(0.0),
        |spec| first_layer(spec).weights[4] = f32::NAN,
        |spec| first_layer(spec).bias[1] = f32::NEG_INFINITY,
        |spec| spec.skip = Some(vec![0.0; 4]),
        |spec| spec.skip = Some(vec![0.0, f32::NAN, 0.0]),
        |spec| {
            spec.skip = Some(vec![0.0; 3]);
            spec.layers[1] = support::dense(2, 1, Activation::Tanh, 1.0);
        },
        |spec| spec.layers[1] = Layer::Recurrent(unfilled(gru_cell(), 2)),
        |spec| {
            let remembering = support::recurrent("tiny", gru_cell(), 2, 0, &[]);
            spec.layers = remembering.layers;
            (spec.past_inputs, spec.past_outputs) = (3, 2);
        },
        |spec| {
            let remembering = support::recurrent("tiny", lstm_cell(), 2, 0, &[]);
            spec.layers[0] = remembering.layers[0].clone();
            (spec.past_inputs, spec.past_outputs) = (3, 2);
            if let Layer::Recurrent(layer) = &mut spec.layers[0] {
                layer.recurrent.pop();
            }
        },
        |spec| {
            spec.layers[0] = Layer::Recurrent(unfilled(gru_cell(), 130));
        },
        |spec| spec.control.horizon = 0,
        |spec| spec.control.horizon = 1000,
        |spec| spec.control.control_horizon = 11,
        |spec| spec.control.tracking_weight = vec![1.0, 1.0],
        |spec| spec.control.tracking_weight = vec![0.0],
        |spec| spec.control.move_suppression = vec![-0.1],
        |spec| spec.control.command_weight = -0.1,
        |spec| spec.control.budget = Some(999),
        |spec| spec.control.budget = Some(u32::MAX),
        |spec| spec.control.observer_gain = 0.0,
        |spec| spec.control.observer_gain = 1.5,
        |spec| spec.control.upper = vec![-10.0],
        |spec| spec.control.lower = vec![f64::NAN],
        |spec| spec.control.rate_limit = vec![0.0],
        |spec| spec.control.safe = vec![11.0],
        |spec| spec.control.disturbance_gain = 1.5,
        |spec| spec.control.iterations = 0,
        |spec| spec.golden = vec![support::golden(&[0.0; 2], &[0.0])],
        |spec| spec.golden = vec![support::golden(&[0.5; 3], &[9.0])],
        |spec| spec.golden = vec![support::golden(&[0.5; 3], &[f64::NAN])],
    ];
    assert_eq!(support::tiny().validate(), Ok(()));
    assert_eq!(support::with_shortcut().validate(), Ok(()));
    let mut messages = String::new();
    for change in changes {
        let mut spec = support::tiny();
        change(&mut spec);
        let error = spec.validate().expect_err("the change makes it invalid");
        let key = error.key().join(".");
        messages += &format!("[{key}] {error}\n");
    }
    insta::assert_snapshot!(messages);
}

/// Each network alone is small enough; together they are not.
#[test]
fn a_network_larger_than_flash() {
    let mut spec = support::tiny();
    let wide = |inputs| {
        Layer::Dense(Dense {
            inputs,
            outputs: 512,
            weights: vec![0.0; inputs * 512],
            bias: vec![0.0; 512],
            activation: Activation::Relu,
        })
    };
    spec.layers = vec![
        wide(3),
        wide(512),
        support::dense(512, 1, Activation::Linear, 1.0),
    ];
    assert!(spec.parameters() > MAX_PARAMETERS);
    let error = spec.validate().unwrap_err();
    insta::assert_snapshot!(error, @"the network has 265217 parameters: at most 262144 fit the flash of a board");
}

/// Both files of the tiny model.
fn files() -> (String, Vec<u8>) {
    let directory = tempfile::tempdir().unwrap();
    store::save(directory.path(), &support::tiny()).unwrap();
    (
        fs::read_to_string(directory.path().join(store::MODEL_FILE)).unwrap(),
        fs::read(directory.path().join(store::WEIGHTS_FILE)).unwrap(),
    )
}

#[test]
fn descriptions() {
    let (text, weights) = files();
    let mut messages = String::new();
    for (from, to) in [
        ("format = \"sinew-model/1\"\n", ""),
        ("sinew-model/1", "sinew-rig/1"),
        ("past_inputs = 1", "past_inputs = "),
        ("past_inputs = 1", "past_inputs = -1"),
        ("past_inputs = 1", "past_inputs = \"one\""),
        ("past_inputs = 1\n", ""),
        ("past_outputs", "past_output"),
        ("\"increment\"", "\"delta\""),
        ("span = 0.05", "span = 0.0"),
        ("span = 0.05", "span = nan"),
        ("kind = \"dense\"", "kind = \"gru\""),
        ("kind = \"dense\"", "kind = \"rnn\""),
        ("activation = \"tanh\"\n", ""),
        ("activation = \"tanh\"", "activation = \"sigmoid\""),
        ("outputs = 2", "outputs = 4000000000"),
        ("outputs = 2", "outputs = 3"),
        ("inputs = 3", "inputs = 4"),
        ("rate_limit = [inf]", "rate_limit = [inf, 1.0]"),
        ("safe = [0.0]", "safe = [-10.5]"),
        ("iterations = 2", "iterations = 300"),
        ("name = \"tension_N\"", "name = \"u_V\""),
        ("[control]", "[control"),
    ] {
        assert!(text.contains(from), "{from}");
        let error = store::parse(&text.replacen(from, to, 1), &weights).expect_err(to);
        messages += &format!("{from:?} -> {to:?}\n    {error}\n");
    }
    insta::assert_snapshot!(messages);
}

#[test]
fn weights() {
    let (text, weights) = files();
    let header = |json: &str, data: usize| {
        let mut bytes = (json.len() as u64).to_le_bytes().to_vec();
        bytes.extend_from_slice(json.as_bytes());
        bytes.resize(bytes.len() + data, 0);
        bytes
    };
    let huge_header = u64::MAX.to_le_bytes().to_vec();
    let huge_shape = r#"{"layer.0.weights":{"dtype":"F32","shape":[4294967296,4294967296],"data_offsets":[0,0]}}"#;
    let wrong_shape = r#"{"layer.0.weights":{"dtype":"F32","shape":[3,2],"data_offsets":[0,24]}}"#;
    let wrong_type = r#"{"layer.0.weights":{"dtype":"F16","shape":[2,3],"data_offsets":[0,12]}}"#;
    let mut foreign = weights.clone();
    let name = b"layer.1.bias";
    let place = foreign
        .windows(name.len())
        .position(|bytes| bytes == name)
        .unwrap();
    foreign[place + 6] = b'9';
    let mut not_a_number = weights.clone();
    let last = not_a_number.len() - 4;
    not_a_number[last..].copy_from_slice(&f32::NAN.to_le_bytes());
    let mut messages = String::new();
    for (what, bytes) in [
        ("empty", vec![]),
        ("cut short", weights[..weights.len() - 1].to_vec()),
        ("a header of 2^64 bytes", huge_header),
        ("a tensor of 2^64 values", header(huge_shape, 0)),
        ("no tensors", header("{}", 0)),
        ("a transposed tensor", header(wrong_shape, 24)),
        ("half precision", header(wrong_type, 12)),
        ("a tensor of another layer", foreign),
        ("a weight that is NaN", not_a_number),
    ] {
        let error = store::parse(&text, &bytes).expect_err(what);
        messages += &format!("{what}\n    {error}\n");
    }
    insta::assert_snapshot!(messages);
}

/// Too large to be a model: refused by size, before it is read whole.
#[test]
fn files_of_gigabytes() {
    let directory = tempfile::tempdir().unwrap();
    store::save(directory.path(), &support::tiny()).unwrap();
    let path = directory.path().join(store::WEIGHTS_FILE);
    // Sparse: it takes no space on the disk.
    fs::File::options()
        .write(true)
        .open(&path)
        .unwrap()
        .set_len(1 << 34)
        .unwrap();
    let error = store::load(directory.path()).unwrap_err().to_string();
    let message = error.strip_prefix(&path.display().to_string()).unwrap();
    insta::assert_snapshot!(message, @": larger than the 4194304 bytes that a model's file may have");
}

#[test]
fn a_file_in_the_place_of_a_models_folder() {
    let directory = tempfile::tempdir().unwrap();
    let rig = directory.path().join("rig.toml");
    fs::write(&rig, "format = \"sinew-rig/1\"\n").unwrap();
    let error = store::load(&rig).unwrap_err().to_string();
    let message = error.strip_prefix(&rig.display().to_string()).unwrap();
    insta::assert_snapshot!(message, @": a file; a model is a folder with model.toml and weights.safetensors, as `sinew train RIG --out FOLDER` writes it");
}

#[test]
fn a_directory_without_a_model() {
    let directory = tempfile::tempdir().unwrap();
    let error = store::load(directory.path()).unwrap_err().to_string();
    assert!(error.contains("model.toml: No such file"), "{error}");
}

#[test]
fn references() {
    let read =
        |file: &str| fs::read_to_string(support::models().join("reference").join(file)).unwrap();
    let (network, problem) = (read("S.json"), read("problem.json"));
    let mut messages = String::new();
    for (from, to) in [
        ("sinew-reference/1", "sinew-reference/2"),
        ("\"sizes\":[12,10,3]", "\"sizes\":[12,9,3]"),
        ("\"outputs_past\":2", "\"outputs_past\":3"),
        ("\"inputs_past\":3", "\"inputs_past\":0"),
        ("[0.19783379,", "["),
        ("tanh", "softmax"),
        ("0.19783379", "1.9783379"),
    ] {
        assert!(network.contains(from), "{from}");
        let error =
            reference::import(&network.replacen(from, to, 1), &problem, 10, &[]).expect_err(to);
        messages += &format!("{from:?} -> {to:?}\n    {error}\n");
    }
    let error = reference::import(&network, &problem, 7, &[]).unwrap_err();
    messages += &format!("horizon 7\n    {error}\n");
    insta::assert_snapshot!(messages);
}

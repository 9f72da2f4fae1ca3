//! Models on disk: what is written is what is read, and no file makes the reader panic.

mod support;

use std::fs;
use std::sync::LazyLock;

use proptest::prelude::*;
use safetensors::Dtype;
use safetensors::tensor::TensorView;
use sinew_model::spec::{
    Activation, Dense, Golden, Layer, ModelSpec, OutputForm, WatchSpec, gru_cell, lstm_cell,
};
use sinew_model::{evaluate, fingerprint, store};

proptest! {
    #[test]
    fn a_model_comes_back_to_the_bit(spec in model()) {
        let directory = tempfile::tempdir().unwrap();
        store::save(directory.path(), &spec).unwrap();
        let back = store::load(directory.path()).unwrap();
        prop_assert_eq!(bits(&back), bits(&spec));
        prop_assert_eq!(back, spec);
    }

    /// Every text gives a model or an error with a line, never a panic.
    #[test]
    fn a_damaged_description_is_refused_or_read(damage in damages()) {
        let (text, weights) = &*TINY;
        let mut bytes = text.clone().into_bytes();
        damage.iter().for_each(|damage| damage.apply(&mut bytes));
        let text = String::from_utf8_lossy(&bytes);
        if let Err(error) = store::parse(&text, weights) {
            let message = error.to_string();
            prop_assert!(
                message.starts_with("model.toml:") || message.starts_with("weights.safetensors:"),
                "{}", message
            );
        }
    }

    #[test]
    fn damaged_weights_are_refused_or_read(damage in damages()) {
        let (text, weights) = &*TINY;
        let mut weights = weights.clone();
        damage.iter().for_each(|damage| damage.apply(&mut weights));
        if let Err(error) = store::parse(text, &weights) {
            let message = error.to_string();
            prop_assert!(message.starts_with("weights.safetensors: "), "{}", message);
        }
    }
}

#[test]
fn a_model_with_a_state_comes_back_to_the_bit() {
    let spec = support::with_state();
    let directory = tempfile::tempdir().unwrap();
    store::save(directory.path(), &spec).unwrap();
    assert_eq!(store::load(directory.path()).unwrap(), spec);
    let text = fs::read_to_string(directory.path().join("model.toml")).unwrap();
    assert!(text.contains("form = \"state\""), "{text}");
    // Another noise is another model to a device.
    let mut other = spec.clone();
    other.state.as_mut().unwrap().states[0].noise = 2e-3;
    let fingerprint = sinew_model::fingerprint;
    assert_ne!(fingerprint(&spec), fingerprint(&other));
    let mut other = spec.clone();
    other.state.as_mut().unwrap().states[0].rest_deviation = 0.5;
    assert_ne!(fingerprint(&spec), fingerprint(&other));
}

#[test]
fn a_state_without_a_rest_begins_as_after_a_gap() {
    let directory = tempfile::tempdir().unwrap();
    store::save(directory.path(), &support::with_state()).unwrap();
    let path = directory.path().join("model.toml");
    let text = fs::read_to_string(&path).unwrap();
    let older = text.lines().filter(|line| !line.starts_with("rest"));
    let older: Vec<&str> = older.collect();
    assert_eq!(older.len(), text.lines().count() - 4);
    fs::write(&path, older.join("\n")).unwrap();
    let spec = store::load(directory.path()).unwrap();
    for state in spec.state.expect("the model has a state").states {
        assert_eq!((state.rest, state.rest_deviation), (0.0, state.deviation));
    }
}

#[test]
fn a_model_with_half_a_state_is_refused() {
    let refusal = |change: fn(&mut ModelSpec)| {
        let mut spec = support::with_state();
        change(&mut spec);
        spec.validate().expect_err("refused").to_string()
    };
    let message = refusal(|spec| spec.form = OutputForm::Increment);
    assert!(message.contains("form"), "{message}");
    let message = refusal(|spec| spec.past_inputs = 2);
    assert!(message.contains("past_inputs"), "{message}");
    let message = refusal(|spec| spec.skip = None);
    assert!(message.contains("layer"), "{message}");
    let message = refusal(|spec| spec.state.as_mut().unwrap().parameters[0].lower = 0.5);
    assert!(message.contains("parameter.0.lower"), "{message}");
    let message = refusal(|spec| spec.state.as_mut().unwrap().measurement_noise.truncate(1));
    assert!(message.contains("measurement_noise"), "{message}");
}

/// States without a filter would be read by nothing.
#[test]
fn tables_of_a_state_without_a_filter_are_refused() {
    let directory = tempfile::tempdir().unwrap();
    store::save(directory.path(), &support::with_state()).unwrap();
    let path = directory.path().join("model.toml");
    let text = fs::read_to_string(&path).unwrap();
    let (before, after) = text.split_once("[filter]").expect("the file has a filter");
    let rest = after.find("\n[").map_or("", |next| &after[next..]);
    fs::write(&path, format!("{before}{rest}")).unwrap();
    let message = store::load(directory.path())
        .expect_err("refused")
        .to_string();
    assert!(message.contains("need [filter]"), "{message}");
}

#[test]
fn a_network_that_remembers_comes_back_to_the_bit() {
    for (name, cell) in [("gru", gru_cell()), ("lstm", lstm_cell())] {
        let layers = [(3, Activation::Tanh), (2, Activation::Linear)];
        let mut spec = support::recurrent(name, cell, 4, 1, &layers);
        assert_eq!(spec.point_len(), 7 + 4 * cell.vectors());
        let x: Vec<f32> = (0..spec.point_len())
            .map(|i| 0.3 - 0.05 * i as f32)
            .collect();
        let wide: Vec<f64> = x.iter().copied().map(f64::from).collect();
        spec.golden = vec![support::golden(&x, &evaluate::predict(&spec, &wide))];
        let directory = tempfile::tempdir().unwrap();
        store::save(directory.path(), &spec).unwrap();
        let back = store::load(directory.path()).unwrap();
        assert_eq!(bits(&back), bits(&spec));
        assert_eq!(back, spec);
    }
}

/// The description in the manual is one that the program reads.
#[test]
fn the_documented_description_is_read() {
    let manual = include_str!("../../../docs/reference/model-files.md");
    let text = manual.split("```toml\n").nth(1).unwrap();
    let text = text.split("```").next().unwrap();
    let zeros = [0; 4 * 6 * 16];
    let shapes: [(_, &[usize]); 4] = [
        ("layer.0.weights", &[16, 6]),
        ("layer.0.bias", &[16]),
        ("layer.1.weights", &[1, 16]),
        ("layer.1.bias", &[1]),
    ];
    let tensors = shapes.map(|(name, shape)| {
        let bytes = &zeros[..4 * shape.iter().product::<usize>()];
        (
            name,
            TensorView::new(Dtype::F32, shape.to_vec(), bytes).unwrap(),
        )
    });
    let weights = safetensors::serialize(tensors, None).unwrap();
    let spec = store::parse(text, &weights).unwrap();
    assert_eq!((spec.regressor_len(), spec.parameters()), (6, 129));
}

/// A file of an earlier version means the same.
#[test]
fn the_older_name_of_the_missing_samples_is_read() {
    let (text, weights) = &*TINY;
    let older = text.replacen("max_missing_samples = ", "gap_limit = ", 1);
    assert_ne!(&older, text);
    let read = |text: &str| store::parse(text, weights).unwrap().control;
    assert_eq!(read(&older), read(text));
}

/// Both files of the tiny model with a golden vector.
static TINY: LazyLock<(String, Vec<u8>)> = LazyLock::new(|| {
    let mut spec = support::tiny();
    let x = [0.5, -0.25, 0.125];
    spec.golden = vec![support::golden(
        &x,
        &evaluate::predict(&spec, &x.map(f64::from)),
    )];
    let directory = tempfile::tempdir().unwrap();
    store::save(directory.path(), &spec).unwrap();
    let read = |file| fs::read(directory.path().join(file)).unwrap();
    let text = String::from_utf8(read(store::MODEL_FILE)).unwrap();
    (text, read(store::WEIGHTS_FILE))
});

/// One change to the bytes of a file; places are fractions of its length.
#[derive(Clone, Debug)]
enum Damage {
    Set(f64, u8),
    Insert(f64, Vec<u8>),
    Remove(f64, usize),
    Copy(f64, f64, usize),
    Truncate(f64),
}

impl Damage {
    fn apply(&self, bytes: &mut Vec<u8>) {
        let length = bytes.len();
        let place = |fraction: f64| (fraction * length as f64) as usize;
        match self {
            _ if length == 0 => {}
            Self::Set(at, byte) => bytes[place(*at)] = *byte,
            Self::Insert(at, new) => drop(bytes.splice(place(*at)..place(*at), new.clone())),
            Self::Remove(at, n) => drop(bytes.drain(place(*at)..length.min(place(*at) + n))),
            Self::Copy(from, to, n) => {
                let copy = bytes[place(*from)..length.min(place(*from) + n)].to_vec();
                bytes.splice(place(*to)..place(*to), copy);
            }
            Self::Truncate(at) => bytes.truncate(place(*at)),
        }
    }
}

fn damages() -> impl Strategy<Value = Vec<Damage>> {
    let place = || 0.0..1.0;
    // Digits and the marks of TOML and JSON get further into a reader than random bytes.
    let telling = prop::sample::select(b"0123456789-+.eE[]{}\"'=,:_\\\n #infa".to_vec());
    let byte = || prop_oneof![3 => telling.clone(), 1 => any::<u8>()];
    let damage = prop_oneof![
        4 => (place(), byte()).prop_map(|(at, byte)| Damage::Set(at, byte)),
        3 => (place(), prop::collection::vec(byte(), 1..12)).prop_map(|(at, new)| Damage::Insert(at, new)),
        2 => (place(), 1..40_usize).prop_map(|(at, n)| Damage::Remove(at, n)),
        2 => (place(), place(), 1..80_usize).prop_map(|(from, to, n)| Damage::Copy(from, to, n)),
        1 => place().prop_map(Damage::Truncate),
    ];
    prop::collection::vec(damage, 1..4)
}

/// Equality of floats would take -0 for 0.
fn bits(spec: &ModelSpec) -> Vec<u32> {
    let layers = spec.layers.iter().flat_map(|layer| {
        layer
            .tensors()
            .into_iter()
            .flat_map(|(_, _, values)| values)
    });
    layers.map(|weight| weight.to_bits()).collect()
}

/// Any valid model of a few signals, with names and numbers that a writer could get wrong.
fn model() -> impl Strategy<Value = ModelSpec> {
    let counts = (
        1..3_usize,
        1..3_usize,
        0..3_usize,
        1..4_usize,
        1..4_usize,
        0..3_usize,
    );
    let hidden = prop::collection::vec((1..6_usize, activation()), 0..3);
    let form = prop::sample::select(OutputForm::ALL[..2].to_vec());
    (counts, hidden, activation(), form).prop_flat_map(|(counts, hidden, last, form)| {
        let (n_u, n_y, n_s, past_inputs, past_outputs, n_golden) = counts;
        let n_x = past_inputs * n_u + past_outputs * n_y + n_s;
        let mut widths = hidden;
        widths.push((n_y, last));
        let inputs = std::iter::once(n_x).chain(widths.iter().map(|(n, _)| *n));
        let layers: Vec<_> = inputs
            .zip(&widths)
            .map(|(inputs, &(outputs, activation))| layer(inputs, outputs, activation))
            .collect();
        let texts = prop::collection::vec("[^\\p{Cc}]{1,12}", n_u + n_y + n_s);
        let scales = prop::collection::vec((1e-6..1e6_f64, -1e6..1e6_f64), n_u + n_y + n_s);
        let golden = prop::collection::vec(prop::collection::vec(-1.0..1.0_f32, n_x), n_golden);
        (layers, texts, scales, golden, 1e-4..10.0_f64).prop_map(
            move |(layers, texts, scales, golden, period_s)| {
                let signals: Vec<_> = texts
                    .iter()
                    .zip(&scales)
                    .enumerate()
                    // The index keeps names apart; the text may come twice.
                    .map(|(i, (text, (span, offset)))| {
                        support::signal(&format!("{text}{i}"), text, *span, *offset)
                    })
                    .collect();
                let mut spec = ModelSpec {
                    name: "any-model-2".into(),
                    period_s,
                    inputs: signals[..n_u].to_vec(),
                    outputs: signals[n_u..n_u + n_y].to_vec(),
                    channels: signals[n_u + n_y..].to_vec(),
                    past_inputs,
                    past_outputs,
                    form,
                    state: None,
                    skip: None,
                    layers,
                    control: sinew_model::spec::ControlSpec {
                        // Without one, and with one that no short decimal is.
                        command_weight: [0.0, period_s / 3.0][n_s % 2],
                        observer_gain: [1.0, 1.0 / 3.0][n_y % 2],
                        budget: [None, Some(30_000)][n_u % 2],
                        ..support::control(n_u, n_y)
                    },
                    soft_sensor: None,
                    golden: vec![],
                };
                // A linear path needs a linear end.
                if spec
                    .layers
                    .last()
                    .is_some_and(|l| l.activation() == Some(Activation::Linear))
                {
                    let weights = (0..spec.regressor_len() * n_y).map(|i| 1.0 / (i as f32 + 3.0));
                    spec.skip = Some(weights.collect());
                }
                spec.golden = golden
                    .into_iter()
                    .map(|x| {
                        let wide: Vec<f64> = x.iter().copied().map(f64::from).collect();
                        let y = evaluate::predict(&spec, &wide);
                        Golden { x, y }
                    })
                    .collect();
                spec
            },
        )
    })
}

fn activation() -> impl Strategy<Value = Activation> {
    prop::sample::select(Activation::ALL.to_vec())
}

/// Any bits that are a moderate number: subnormals and -0 included, and nothing that overflows.
fn layer(inputs: usize, outputs: usize, activation: Activation) -> impl Strategy<Value = Layer> {
    let number = || {
        any::<f32>().prop_map(|x| {
            if x.abs() < 1e6 {
                x
            } else {
                x.to_bits() as f32 * 1e-9
            }
        })
    };
    (
        prop::collection::vec(number(), inputs * outputs),
        prop::collection::vec(number(), outputs),
    )
        .prop_map(move |(weights, bias)| {
            Layer::Dense(Dense {
                inputs,
                outputs,
                weights,
                bias,
                activation,
            })
        })
}

#[test]
fn a_soft_sensor_comes_back_to_the_bit() {
    let spec = support::sensed("sensed", two_outputs());
    let directory = tempfile::tempdir().unwrap();
    store::save(directory.path(), &spec).unwrap();
    assert_eq!(store::load(directory.path()).unwrap(), spec);
    // Its weights are part of the identity, as those of the network.
    let mut other = spec.clone();
    other.soft_sensor.as_mut().unwrap().quadratic[2] += 0.125;
    assert_ne!(fingerprint(&other), fingerprint(&spec));
}

#[test]
fn the_watch_over_the_channels_comes_back_to_the_bit() {
    let spec = support::watched("watched", two_outputs());
    let directory = tempfile::tempdir().unwrap();
    store::save(directory.path(), &spec).unwrap();
    assert_eq!(store::load(directory.path()).unwrap(), spec);
    let watch = |spec: &mut ModelSpec| spec.soft_sensor.as_mut().unwrap().watch.take().unwrap();
    // It is part of the identity, and a model without it is another.
    let mut without = spec.clone();
    let mut other = watch(&mut without);
    assert_ne!(fingerprint(&without), fingerprint(&spec));
    other.spread[1] *= 2.0;
    without.soft_sensor.as_mut().unwrap().watch = Some(other);
    assert_ne!(fingerprint(&without), fingerprint(&spec));
}

#[test]
fn a_watch_that_does_not_fit_is_refused() {
    type Change = fn(&mut WatchSpec);
    let changes: [(Change, &str); 5] = [
        (|w| w.bias.clear(), "5 finite weights in `watch.bias`"),
        (
            |w| w.weights.truncate(24),
            "25 finite weights in `watch.weights`",
        ),
        (
            |w| w.weights[7] = f32::NAN,
            "25 finite weights in `watch.weights`",
        ),
        (
            |w| w.weights[12] = 0.5,
            "no channel says what it should read itself",
        ),
        (|w| w.spread[4] = 0.0, "normal positive numbers"),
    ];
    for (change, expected) in changes {
        let mut spec = support::watched("watched", two_outputs());
        change(spec.soft_sensor.as_mut().unwrap().watch.as_mut().unwrap());
        let error = spec.validate().unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
    let watch = support::watched("watched", two_outputs())
        .soft_sensor
        .unwrap()
        .watch;
    let mut few = support::sensed("few", two_outputs());
    few.soft_sensor.as_mut().unwrap().watch = watch;
    let error = few.validate().unwrap_err().to_string();
    assert!(error.contains("4 channels or more"), "{error}");
}

#[test]
fn a_soft_sensor_that_does_not_fit_is_refused() {
    type Change = fn(&mut ModelSpec);
    let changes: [(Change, &str); 6] = [
        (|spec| spec.channels.clear(), "channel is 0"),
        (
            |spec| spec.channels.truncate(2),
            "expected 4 finite weights in `linear`",
        ),
        (
            |spec| spec.soft_sensor.as_mut().unwrap().bias.clear(),
            "expected 2 finite weights in `bias`",
        ),
        (
            |spec| spec.soft_sensor.as_mut().unwrap().quadratic[0] = f32::NAN,
            "expected 12 finite weights in `quadratic`",
        ),
        (
            |spec| spec.soft_sensor.as_mut().unwrap().error[1] = -1.0,
            "soft_sensor.error",
        ),
        (
            |spec| {
                let remembers = support::recurrent("gru", gru_cell(), 4, 0, &[]);
                spec.layers[0] = remembers.layers[0].clone();
            },
            "with a recurrent layer",
        ),
    ];
    for (change, expected) in changes {
        let mut spec = support::sensed("sensed", two_outputs());
        change(&mut spec);
        let error = spec.validate().unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
}

fn two_outputs() -> ModelSpec {
    let layers = [(2, Activation::Tanh)];
    support::network("two", OutputForm::Increment, 0, &layers)
}

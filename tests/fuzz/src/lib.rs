//! Targets of fuzzing: any bytes give an error or a value, never a panic.

use serde::ser::{Serialize, SerializeTuple, Serializer};
use sinew_device::protocol::{self, MAX_FRAME, ToDevice, ToHost};
use sinew_model::store as models;
use sinew_nn::emit::{Options, Weights, emit as print};
use sinew_nn::{import as importers, store as networks};
use std::path::Path;

use sinew_ident::mechanism::{Format, import_text};
use sinew_ident::recording::Recording;

/// Its name, and what is done with bytes.
pub type Target = (&'static str, fn(&[u8]));

/// The targets.
pub const TARGETS: [Target; 10] = [
    ("import", import),
    ("emit", emit),
    ("network", network),
    ("model", model),
    ("rig", rig),
    ("frame", frame),
    ("recording", recording),
    ("wiring", wiring),
    ("log", log),
    ("mechanism", mechanism),
];

/// A wiring file that is accepted is checked, drawn and printed, whatever it wires.
pub fn wiring(data: &[u8]) {
    let text = String::from_utf8_lossy(data);
    let Ok(wiring) = sinew_wiring::Wiring::parse(&text) else {
        return;
    };
    let signal = |name: &str, range| sinew_wiring::Signal {
        name: name.into(),
        unit: "1".into(),
        range,
    };
    let signals = sinew_wiring::Signals {
        sensors: vec![signal("q_m", None)],
        actuators: vec![signal("u_N", Some([-20.0, 20.0]))],
        rate_hz: 120.0,
    };
    for board in ["stm32f446", "nrf52840"] {
        let Ok(board) = sinew_wiring::board(board) else {
            continue;
        };
        let _ = sinew_wiring::check(&wiring, &signals, board);
        let _ = sinew_wiring::table(&wiring, board);
        let _ = sinew_wiring::picture(&wiring, board);
        let _ = sinew_wiring::sources(&wiring, &signals, board);
    }
}

/// A file of another tool. The first byte chooses its name; HDF5, zip and TensorFlow Lite are known
/// by their own first bytes.
pub fn import(data: &[u8]) {
    let Some((first, data)) = data.split_first() else {
        return;
    };
    let name = ["a.onnx", "a.h5", "a.keras", "a.tflite"][usize::from(first % 4)];
    let _ = importers::parse(name, data);
}

/// Any network that is accepted is printed, either way.
pub fn emit(data: &[u8]) {
    let Some((_, bytes)) = data.split_first() else {
        return;
    };
    if let Ok(network) = importers::parse("a.onnx", bytes) {
        for weights in [Weights::Float32, Weights::Int8] {
            let options = Options {
                weights,
                ..Options::default()
            };
            print(&network, &options).expect("a valid network is printed");
        }
    }
}

/// `network.toml`, up to the first zero byte, and `weights.safetensors` after it.
pub fn network(data: &[u8]) {
    let (text, weights) = two(data);
    let _ = networks::parse(&text, weights);
}

/// `model.toml`, up to the first zero byte, and `weights.safetensors` after it.
pub fn model(data: &[u8]) {
    let (text, weights) = two(data);
    let _ = models::parse(&text, weights);
}

/// `rig.toml`.
pub fn rig(data: &[u8]) {
    let _ = sinew_sim::Rig::parse(&String::from_utf8_lossy(data), "rig.toml");
}

/// A frame of the protocol, as it is and as the contents of a sound frame, whose checksum would
/// stop the rest; either way round. What is read can be written.
pub fn frame(data: &[u8]) {
    let mut buffer = [0; MAX_FRAME];
    let sent = protocol::encode(&Raw(data), &mut buffer).and_then(|frame| frame.split_last());
    let sound = sent.map_or(&[][..], |(_, body)| body);
    for bytes in [data, sound] {
        let mut again = [0; MAX_FRAME];
        if let Ok(message) = protocol::decode::<ToDevice>(&mut bytes.to_vec()) {
            protocol::encode(&message, &mut again).expect("what was read fits");
        }
        if let Ok(message) = protocol::decode::<ToHost>(&mut bytes.to_vec()) {
            protocol::encode(&message, &mut again).expect("what was read fits");
        }
    }
}

/// A recording as CSV. What is read can be written, and reads back the same.
pub fn recording(data: &[u8]) {
    let text = match Recording::parse(data, "a.csv") {
        Ok(recording) => recording.to_csv(),
        Err(error) => return drop(error.to_string()),
    };
    let again = Recording::parse(text.as_bytes(), "a.csv").expect("what was written is read");
    assert_eq!(again.to_csv(), text);
}

/// A log of another program: MATLAB, HDF5 and MCAP by their first bytes, JSON else.
pub fn log(data: &[u8]) {
    let Some(format) = sinew_convert::format(data, "json") else {
        return;
    };
    if let Ok(contents) = sinew_convert::read(data, format) {
        let _ = sinew_convert::table(&contents, &sinew_convert::Wanted::default());
    }
}

/// A mechanism; an accepted one is a rig that is read back.
pub fn mechanism(data: &[u8]) {
    let text = String::from_utf8_lossy(data);
    let format = if text.contains("<robot") {
        Format::Urdf
    } else {
        Format::Mjcf
    };
    let _ = import_text(&text, Path::new("a.xml"), format, &[]);
}

/// Bytes that go into a frame as they are.
struct Raw<'a>(&'a [u8]);

impl Serialize for Raw<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut tuple = serializer.serialize_tuple(self.0.len())?;
        for byte in self.0 {
            tuple.serialize_element(byte)?;
        }
        tuple.end()
    }
}

fn two(data: &[u8]) -> (std::borrow::Cow<'_, str>, &[u8]) {
    let end = data.iter().position(|byte| *byte == 0);
    let (text, rest) = data.split_at(end.unwrap_or(data.len()));
    (String::from_utf8_lossy(text), rest.get(1..).unwrap_or(&[]))
}

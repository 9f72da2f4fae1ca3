//! A recurrent `.tflite` is refused by the operator's name, the layer's, and with what would work.
//! No tool here writes such a file: a dense one is told that its first operator is another.

use std::fs;
use std::path::Path;

use sinew_nn::import;

const OPERATORS: [(u8, &str); 7] = [
    (16, "LSTM"),
    (24, "RNN"),
    (35, "UNIDIRECTIONAL_SEQUENCE_RNN"),
    (44, "UNIDIRECTIONAL_SEQUENCE_LSTM"),
    (46, "BIDIRECTIONAL_SEQUENCE_RNN"),
    (52, "BIDIRECTIONAL_SEQUENCE_LSTM"),
    (119, "WHILE"),
];

fn dense() -> Vec<u8> {
    let path = "tests/frameworks/models/tflite-mlp.tflite";
    fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join(path)).expect("the file is committed")
}

fn word(bytes: &[u8], at: usize) -> usize {
    u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes")) as usize
}

/// Offset of field `id` of the table at `table`.
fn field(bytes: &[u8], table: usize, id: usize) -> usize {
    let slots = table - word(bytes, table);
    let slot = slots + 4 + 2 * id;
    table + usize::from(u16::from_le_bytes([bytes[slot], bytes[slot + 1]]))
}

/// Offset of the first table of the vector in field `id` of the root.
fn first(bytes: &[u8], id: usize) -> usize {
    let at = field(bytes, word(bytes, 0), id);
    let vector = at + word(bytes, at);
    assert!(word(bytes, vector) > 0);
    vector + 4 + word(bytes, vector + 4)
}

/// The dense file, its first operator code another.
fn with_operator(code: u8) -> Vec<u8> {
    let mut bytes = dense();
    let operator = first(&bytes, 1);
    let (old, new) = (field(&bytes, operator, 0), field(&bytes, operator, 3));
    let fully_connected = 9;
    assert_eq!(
        (bytes[old], word(&bytes, new)),
        (fully_connected, usize::from(fully_connected))
    );
    (bytes[old], bytes[new]) = (code, code);
    bytes
}

/// Two graphs: as a loop has one for its body. The first offset of what follows the file leads to
/// its copy, since offsets only lead forward.
fn with_two_graphs(bytes: &[u8]) -> Vec<u8> {
    let (graph, at) = (first(bytes, 2), field(bytes, word(bytes, 0), 2));
    let mut both = bytes.to_vec();
    let vector = both.len();
    both[at..at + 4].copy_from_slice(&((vector - at) as u32).to_le_bytes());
    let copy = vector + 12;
    both.extend(2_u32.to_le_bytes());
    for slot in [vector + 4, vector + 8] {
        both.extend(((copy + graph - slot) as u32).to_le_bytes());
    }
    both.extend(bytes);
    both
}

#[test]
fn recurrent_operators_are_refused_by_name() {
    let sound = import::parse("a.tflite", &dense()).expect("the file itself is read");
    let layer = &sound.nodes[1].name;
    for (code, name) in OPERATORS {
        for bytes in [with_operator(code), with_two_graphs(&with_operator(code))] {
            let error = import::parse("a.tflite", &bytes).expect_err(name);
            let error = error.to_string();
            assert!(
                error.starts_with(&format!("layer {layer:?}: ")),
                "{name}: {error}"
            );
            assert!(error.contains(&format!("operator {name} ")), "{error}");
            assert!(error.contains(".keras"), "{error}");
        }
    }
}

#[test]
fn two_graphs_without_a_loop_are_refused_as_such() {
    let error = import::parse("a.tflite", &with_two_graphs(&dense())).expect_err("two graphs");
    assert!(error.to_string().contains("2 graphs"), "{error}");
}

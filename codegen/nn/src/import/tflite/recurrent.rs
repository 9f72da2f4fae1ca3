//! Operators that remember. No tool here writes them, so none is read; they are refused before
//! anything else is looked at, since what a converter puts around them (SHAPE, FILL, a second
//! graph) says nothing to anybody.

use super::file::Model;
use crate::NetworkError;

/// Code and name. A GRU becomes a WHILE with a graph of its own; so do LSTM and RNN where they are
/// not fused.
const OPERATORS: &[(i32, &str)] = &[
    (16, "LSTM"),
    (24, "RNN"),
    (35, "UNIDIRECTIONAL_SEQUENCE_RNN"),
    (44, "UNIDIRECTIONAL_SEQUENCE_LSTM"),
    (46, "BIDIRECTIONAL_SEQUENCE_RNN"),
    (52, "BIDIRECTIONAL_SEQUENCE_LSTM"),
    (119, "WHILE"),
];

/// # Errors
/// One is there; the words name it, the value that it gives, and what would work.
pub(super) fn refuse(model: &Model<'_>) -> Result<(), NetworkError> {
    for operator in &model.operators {
        let found = OPERATORS.iter().find(|(code, _)| *code == operator.code);
        let Some((_, name)) = found else { continue };
        let output = operator.outputs.first().copied();
        let info = output
            .and_then(|index| usize::try_from(index).ok())
            .and_then(|index| model.tensors.get(index));
        return Err(NetworkError::unsupported(
            info.map_or("model", |info| super::last(&info.name)),
            format!("the recurrent operator {name} of TensorFlow Lite"),
            "import the .keras file that it was converted from, or ONNX",
        ));
    }
    Ok(())
}

//! Integers between the operators of a quantised file.

use super::flatbuffer::Table;
use crate::NetworkError;
use crate::rounding::Rounding;

const UINT8: u8 = 3;
const INT16: u8 = 7;
const INT8: u8 = 9;
/// Operators whose inputs are rounded where their weights alone are integers.
const HYBRID: [i32; 3] = [3, 4, 9];
const QUANTIZE: i32 = 114;

/// Smallest and largest integer, and the bits, of a type.
fn integers(kind: u8) -> Option<([f64; 2], u32)> {
    match kind {
        UINT8 => Some(([0.0, 255.0], 8)),
        INT8 => Some(([-128.0, 127.0], 8)),
        INT16 => Some(([-32768.0, 32767.0], 16)),
        _ => None,
    }
}

/// The rounding between operators of a file; none where all are floating point.
///
/// # Errors
/// The file is broken.
pub(in crate::import) fn of(bytes: &[u8]) -> Result<Option<Rounding>, NetworkError> {
    let root = Table::root(bytes)?;
    let (graphs, buffers, codes) = (root.tables(2)?, root.tables(4)?, root.tables(1)?);
    let Some(graph) = graphs.first() else {
        return Ok(None);
    };
    let tensors = graph.tables(0)?;
    let at = |index: i32| usize::try_from(index).ok().and_then(|i| tensors.get(i));
    let is_constant = |tensor: &Table<'_>| -> Result<bool, NetworkError> {
        let index = usize::try_from(tensor.int(2, 0)?).unwrap_or(usize::MAX);
        Ok(match buffers.get(index) {
            Some(buffer) => !buffer.bytes(0)?.is_empty(),
            None => false,
        })
    };
    let scales = |tensor: &Table<'_>| -> Result<Vec<f32>, NetworkError> {
        tensor
            .table(4)?
            .map_or(Ok(Vec::new()), |table| table.floats(2))
    };
    let mut bits = None;
    for tensor in &tensors {
        let found = integers(tensor.byte(1)?);
        let is_value = !is_constant(tensor)? && !scales(tensor)?.is_empty();
        if let (Some((_, own)), true) = (found, is_value) {
            bits = Some(bits.map_or(own, |bits: u32| bits.min(own)));
        }
    }
    let operators = graph.tables(3)?;
    let code = |operator: &Table<'_>| -> Result<i32, NetworkError> {
        let index = usize::try_from(operator.int(0, 0)?).unwrap_or(usize::MAX);
        match codes.get(index) {
            Some(code) => Ok(code.int(3, 0)?.max(i32::from(code.byte(0)?))),
            None => Ok(-1),
        }
    };
    if let Some(bits) = bits {
        let mut given = graph.ints(1)?.first().copied().unwrap_or(-1);
        for operator in &operators {
            if code(operator)? == QUANTIZE && operator.ints(1)?.first() == Some(&given) {
                given = operator.ints(2)?.first().copied().unwrap_or(given);
            }
        }
        let Some(tensor) = at(given) else {
            return Ok(Some(Rounding { bits, input: None }));
        };
        let zero = tensor.table(4)?.map_or(Ok(Vec::new()), |t| t.longs(3))?;
        let zero = zero.first().map_or(0.0, |&zero| zero as f64);
        let scale = scales(tensor)?.first().map(|&scale| f64::from(scale));
        let input = match (integers(tensor.byte(1)?), scale) {
            (Some((ends, _)), Some(scale)) => Some(ends.map(|end| scale * (end - zero))),
            _ => None,
        };
        return Ok(Some(Rounding { bits, input }));
    }
    for operator in &operators {
        let inputs = operator.ints(1)?;
        let weights = inputs.get(1).and_then(|&index| at(index));
        let kind = weights.map_or(Ok(0), |weights| weights.byte(1))?;
        if HYBRID.contains(&code(operator)?) && integers(kind).is_some() {
            let (bits, input) = (8, None);
            return Ok(Some(Rounding { bits, input }));
        }
    }
    Ok(None)
}

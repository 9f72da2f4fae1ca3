//! The tables of a TensorFlow Lite file (schema.fbs, version 3): fields are known by their numbers
//! there.

use super::flatbuffer::Table;
use crate::NetworkError;
use crate::import::half;
use crate::import::tensor::{self, Tensor};

/// One tensor: a constant, or a value between operators.
pub(super) struct TensorInfo {
    pub(super) name: String,
    pub(super) shape: Vec<usize>,
    /// Its values, dequantised, if it is a constant of numbers.
    pub(super) constant: Option<Tensor>,
    /// Its values, if it is a constant of integers without scale: a shape, or axes.
    pub(super) integers: Vec<i64>,
    /// True if the values between operators are numbers: floating point, or quantised.
    pub(super) is_number: bool,
    /// True if an axis after the batch is open.
    pub(super) open: bool,
}

/// One operator.
pub(super) struct Operator<'a> {
    pub(super) code: i32,
    /// Version of the operator.
    pub(super) version: i32,
    pub(super) inputs: Vec<i32>,
    pub(super) outputs: Vec<i32>,
    pub(super) options: Option<Table<'a>>,
}

/// A file.
pub(super) struct Model<'a> {
    pub(super) tensors: Vec<TensorInfo>,
    pub(super) operators: Vec<Operator<'a>>,
    pub(super) inputs: Vec<i32>,
    pub(super) outputs: Vec<i32>,
    /// Number of subgraphs; everything above is of the first.
    pub(super) graphs: usize,
}

impl<'a> Model<'a> {
    /// # Errors
    /// The file is broken.
    pub(super) fn new(bytes: &'a [u8]) -> Result<Self, NetworkError> {
        let root = Table::root(bytes)?;
        let codes = root.tables(1)?;
        let graphs = root.tables(2)?;
        let buffers = root.tables(4)?;
        let graph = graphs
            .first()
            .ok_or_else(|| NetworkError::malformed("TensorFlow Lite", "there is no graph"))?;
        let tensors = graph.tables(0)?;
        let tensors = tensors
            .iter()
            .map(|tensor| info(tensor, &buffers))
            .collect::<Result<_, _>>()?;
        let mut operators = Vec::new();
        for operator in graph.tables(3)? {
            let index = usize::try_from(operator.int(0, 0)?).unwrap_or(usize::MAX);
            let code = codes.get(index).ok_or_else(|| {
                NetworkError::malformed("TensorFlow Lite", "an operator of no known code")
            })?;
            let version = code.int(2, 1)?;
            // The old field holds what fits into a byte.
            let code = code.int(3, 0)?.max(i32::from(code.byte(0)?));
            operators.push(Operator {
                code,
                version,
                inputs: operator.ints(1)?,
                outputs: operator.ints(2)?,
                options: operator.table(4)?,
            });
        }
        Ok(Self {
            tensors,
            operators,
            inputs: graph.ints(1)?,
            outputs: graph.ints(2)?,
            graphs: graphs.len(),
        })
    }
}

fn info(tensor: &Table<'_>, buffers: &[Table<'_>]) -> Result<TensorInfo, NetworkError> {
    const FLOAT32: u8 = 0;
    const FLOAT16: u8 = 1;
    const INT32: u8 = 2;
    const UINT8: u8 = 3;
    const INT64: u8 = 4;
    const INT16: u8 = 7;
    const INT8: u8 = 9;
    let name = tensor.text(3)?;
    let shape: Vec<usize> = tensor
        .ints(0)?
        .iter()
        .map(|&n| usize::try_from(n).unwrap_or(0))
        .collect();
    let buffer = usize::try_from(tensor.int(2, 0)?)
        .ok()
        .and_then(|index| buffers.get(index));
    let data = buffer.map_or(Ok(&[][..]), |buffer| buffer.bytes(0))?;
    let kind = tensor.byte(1)?;
    let quantised = tensor.table(4)?;
    let scales = quantised.map_or(Ok(Vec::new()), |table| table.floats(2))?;
    let signature = tensor.ints(7)?;
    let mut found = TensorInfo {
        name,
        shape,
        constant: None,
        integers: Vec::new(),
        is_number: kind == FLOAT32 || kind == FLOAT16 || !scales.is_empty(),
        open: signature.iter().skip(1).any(|&n| n < 0),
    };
    if tensor.table(6)?.is_some() {
        return Err(NetworkError::unsupported(
            found.name,
            "sparse weights",
            "convert without sparsity",
        ));
    }
    if tensor.byte(5)? != 0 {
        return Err(NetworkError::unsupported(
            found.name,
            "a variable tensor, which remembers,",
            "import the .keras file that it was converted from, or ONNX",
        ));
    }
    if data.is_empty() {
        return Ok(found);
    }
    let numbers: Vec<f64> = match kind {
        FLOAT32 => data
            .as_chunks()
            .0
            .iter()
            .map(|b| f32::from_le_bytes(*b).into())
            .collect(),
        FLOAT16 => data
            .as_chunks()
            .0
            .iter()
            .map(|b| half(u16::from_le_bytes(*b)))
            .collect(),
        INT8 => data.iter().map(|&b| f64::from(b as i8)).collect(),
        INT32 => data
            .as_chunks()
            .0
            .iter()
            .map(|b| i32::from_le_bytes(*b).into())
            .collect(),
        UINT8 => data.iter().map(|&b| f64::from(b)).collect(),
        INT16 => data
            .as_chunks()
            .0
            .iter()
            .map(|b| i16::from_le_bytes(*b).into())
            .collect(),
        INT64 => data
            .as_chunks()
            .0
            .iter()
            .map(|b| i64::from_le_bytes(*b) as f64)
            .collect(),
        other => {
            return Err(NetworkError::unsupported(
                found.name,
                format!("weights of TensorFlow Lite type {other}"),
                "float32, float16, and 8, 16, 32 and 64-bit integers work",
            ));
        }
    };
    let is_float = kind == FLOAT32 || kind == FLOAT16;
    if !is_float && scales.is_empty() {
        found.integers = numbers.iter().map(|&n| n as i64).collect();
        return Ok(found);
    }
    let values = match quantised {
        Some(table) if !scales.is_empty() && !is_float => {
            dequantise(&found, &numbers, &scales, &table)?
        }
        _ => numbers.iter().map(|&n| n as f32).collect(),
    };
    let place = format!("tensor {:?}", found.name);
    found.constant = Some(Tensor::new(&place, found.shape.clone(), values)?);
    Ok(found)
}

/// `scale (q - zero)`, with a scale for the whole tensor or for each place along one axis.
fn dequantise(
    info: &TensorInfo,
    numbers: &[f64],
    scales: &[f32],
    table: &Table<'_>,
) -> Result<Vec<f32>, NetworkError> {
    let zeros = table.longs(3)?;
    let axis = usize::try_from(table.int(6, 0)?).unwrap_or(usize::MAX);
    let along = info.shape.get(axis).copied().unwrap_or(1);
    if scales.len() != 1 && scales.len() != along {
        let message = format!("{} scales along an axis of {along}", scales.len());
        return Err(NetworkError::malformed(&info.name, message));
    }
    tensor::count(&info.name, &info.shape)?;
    let inner: usize = info.shape.iter().skip(axis.saturating_add(1)).product();
    let place = |i: usize| {
        if scales.len() == 1 {
            0
        } else {
            i / inner.max(1) % along.max(1)
        }
    };
    let zero = |i: usize| {
        zeros
            .get(i)
            .or(zeros.first())
            .map_or(0.0, |&zero| zero as f64)
    };
    let real = |(i, n): (usize, &f64)| (f64::from(scales[place(i)]) * (n - zero(place(i)))) as f32;
    Ok(numbers.iter().enumerate().map(real).collect())
}

//! Constants of an ONNX file: floating-point weights, and integers or truth values that are shapes,
//! axes or conditions.

use super::proto::TensorProto;
use crate::NetworkError;
use crate::import::half;
use crate::import::tensor::{self, Tensor};

pub(super) const FLOAT: i32 = 1;
const UINT8: i32 = 2;
const INT8: i32 = 3;
const UINT16: i32 = 4;
const INT16: i32 = 5;
pub(super) const INT32: i32 = 6;
pub(super) const INT64: i32 = 7;
pub(super) const BOOL: i32 = 9;
pub(super) const FLOAT16: i32 = 10;
pub(super) const DOUBLE: i32 = 11;

/// Names of ONNX's element types, by their numbers.
const TYPES: [&str; 17] = [
    "undefined",
    "float32",
    "uint8",
    "int8",
    "uint16",
    "int16",
    "int32",
    "int64",
    "string",
    "bool",
    "float16",
    "float64",
    "uint32",
    "uint64",
    "complex64",
    "complex128",
    "bfloat16",
];

/// Name of an element type.
pub(super) fn type_name(number: i32) -> String {
    let name = usize::try_from(number)
        .ok()
        .and_then(|number| TYPES.get(number));
    name.map_or_else(|| format!("ONNX type {number}"), |name| (*name).into())
}

/// A constant.
#[derive(Clone, Debug)]
pub(super) enum Constant {
    Floats(Tensor),
    Integers(Integers),
}

/// Integers with a shape; truth values are 0 and 1.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Integers {
    pub(super) shape: Vec<usize>,
    pub(super) values: Vec<i64>,
}

impl Integers {
    /// A list.
    pub(super) fn list(values: Vec<i64>) -> Self {
        Self {
            shape: vec![values.len()],
            values,
        }
    }
}

impl Constant {
    /// # Errors
    /// A type that no weight has, or fewer values than the shape says.
    pub(super) fn new(proto: &TensorProto) -> Result<Self, NetworkError> {
        let place = format!("tensor {:?}", proto.name);
        if proto.data_location != 0 {
            return Err(NetworkError::unsupported(
                &proto.name,
                "weights in a file of their own",
                "save the model with its weights inside: `torch.onnx.export(..., external_data=False)`, \
                 or `onnx.save(onnx.load(file), file)`",
            ));
        }
        let shape: Vec<usize> = proto
            .dims
            .iter()
            .map(|&n| usize::try_from(n).unwrap_or(usize::MAX))
            .collect();
        let count = tensor::count(&place, &shape)?;
        let raw = &proto.raw_data;
        let narrow = || proto.int32_data.iter();
        let floats = match (proto.data_type, raw.is_empty()) {
            (FLOAT, true) => Some(proto.float_data.clone()),
            (FLOAT, false) => Some(chunks(raw, f32::from_le_bytes)),
            (DOUBLE, true) => Some(
                proto
                    .double_data
                    .iter()
                    .map(|&value| value as f32)
                    .collect(),
            ),
            (DOUBLE, false) => Some(chunks(raw, |b| f64::from_le_bytes(b) as f32)),
            (FLOAT16, true) => Some(narrow().map(|&bits| half(bits as u16) as f32).collect()),
            (FLOAT16, false) => Some(chunks(raw, |b| half(u16::from_le_bytes(b)) as f32)),
            _ => None,
        };
        if let Some(values) = floats {
            return Ok(Self::Floats(Tensor::new(&place, shape, values)?));
        }
        let values: Vec<i64> = match (proto.data_type, raw.is_empty()) {
            (INT64, true) => proto.int64_data.clone(),
            (INT64, false) => chunks(raw, i64::from_le_bytes),
            (INT32 | INT16 | INT8 | UINT16 | UINT8 | BOOL, true) => {
                narrow().map(|&n| n.into()).collect()
            }
            (INT32, false) => chunks(raw, |b| i32::from_le_bytes(b).into()),
            (INT16, false) => chunks(raw, |b| i16::from_le_bytes(b).into()),
            (UINT16, false) => chunks(raw, |b| u16::from_le_bytes(b).into()),
            (INT8, false) => raw.iter().map(|&b| i64::from(b as i8)).collect(),
            (UINT8 | BOOL, false) => raw.iter().map(|&b| i64::from(b)).collect(),
            (other, _) => {
                return Err(NetworkError::unsupported(
                    &proto.name,
                    format!("a tensor of {}", type_name(other)),
                    "save the weights as float32",
                ));
            }
        };
        if values.len() != count {
            let message = format!("{} values where {shape:?} asks for {count}", values.len());
            return Err(NetworkError::malformed(place, message));
        }
        Ok(Self::Integers(Integers { shape, values }))
    }

    pub(super) fn shape(&self) -> &[usize] {
        match self {
            Self::Floats(tensor) => &tensor.shape,
            Self::Integers(integers) => &integers.shape,
        }
    }

    pub(super) fn len(&self) -> usize {
        match self {
            Self::Floats(tensor) => tensor.values.len(),
            Self::Integers(integers) => integers.values.len(),
        }
    }

    /// The values as numbers.
    pub(super) fn numbers(&self) -> Vec<f64> {
        match self {
            Self::Floats(tensor) => tensor.values.iter().map(|&value| value.into()).collect(),
            Self::Integers(integers) => integers.values.iter().map(|&value| value as f64).collect(),
        }
    }

    /// The same kind of constant with the values at `places`.
    pub(super) fn taken(&self, shape: Vec<usize>, places: &[usize]) -> Self {
        match self {
            Self::Floats(tensor) => Self::Floats(Tensor {
                shape,
                values: places.iter().map(|&place| tensor.values[place]).collect(),
            }),
            Self::Integers(integers) => Self::Integers(Integers {
                shape,
                values: places.iter().map(|&place| integers.values[place]).collect(),
            }),
        }
    }
}

fn chunks<const N: usize, T>(raw: &[u8], value: impl Fn([u8; N]) -> T) -> Vec<T> {
    raw.as_chunks()
        .0
        .iter()
        .map(|bytes| value(*bytes))
        .collect()
}

//! Tensors of an ONNX file: floating-point weights, and integers that are shapes or axes.

use super::proto::TensorProto;
use crate::NetworkError;
use crate::import::tensor::{self, Tensor};

const FLOAT: i32 = 1;
const INT32: i32 = 6;
const INT64: i32 = 7;
const DOUBLE: i32 = 11;

/// A constant.
#[derive(Clone, Debug)]
pub(super) enum Constant {
    Floats(Tensor),
    Integers(Vec<i64>),
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
                "save the model with its weights inside",
            ));
        }
        let shape: Vec<usize> = proto
            .dims
            .iter()
            .map(|&n| usize::try_from(n).unwrap_or(usize::MAX))
            .collect();
        let count = tensor::count(&place, &shape)?;
        let raw = &proto.raw_data;
        Ok(match proto.data_type {
            FLOAT if raw.is_empty() => {
                Self::Floats(Tensor::new(&place, shape, proto.float_data.clone())?)
            }
            FLOAT => {
                let values = raw
                    .as_chunks()
                    .0
                    .iter()
                    .map(|b| f32::from_le_bytes(*b))
                    .collect();
                Self::Floats(Tensor::new(&place, shape, values)?)
            }
            DOUBLE => {
                let wide: Vec<f64> = if raw.is_empty() {
                    proto.double_data.clone()
                } else {
                    raw.as_chunks()
                        .0
                        .iter()
                        .map(|b| f64::from_le_bytes(*b))
                        .collect()
                };
                let values = wide.into_iter().map(|value| value as f32).collect();
                Self::Floats(Tensor::new(&place, shape, values)?)
            }
            INT64 | INT32 => {
                let values: Vec<i64> = match (proto.data_type, raw.is_empty()) {
                    (INT64, true) => proto.int64_data.clone(),
                    (INT64, false) => raw
                        .as_chunks()
                        .0
                        .iter()
                        .map(|b| i64::from_le_bytes(*b))
                        .collect(),
                    (_, true) => proto.int32_data.iter().map(|&n| n.into()).collect(),
                    _ => raw
                        .as_chunks()
                        .0
                        .iter()
                        .map(|b| i32::from_le_bytes(*b).into())
                        .collect(),
                };
                if values.len() != count {
                    let message =
                        format!("{} values where {shape:?} asks for {count}", values.len());
                    return Err(NetworkError::malformed(place, message));
                }
                Self::Integers(values)
            }
            other => {
                return Err(NetworkError::unsupported(
                    &proto.name,
                    format!("a tensor of ONNX type {other}"),
                    "save the weights as float32",
                ));
            }
        })
    }
}

//! Matrices and lists of values as tensors on the device, and back.

use burn::tensor::{Device, Tensor, TensorData};
use nalgebra::DMatrix;

/// The matrix of a two-dimensional tensor.
pub(crate) fn to_matrix(t: Tensor<2>) -> DMatrix<f64> {
    let [rows, columns] = t.dims();
    let values: Vec<f64> = t.into_data().iter::<f64>().collect();
    DMatrix::from_row_slice(rows, columns, &values)
}

/// Values on the device, row after row.
pub(crate) fn tensor(rows: usize, columns: usize, values: Vec<f32>, device: &Device) -> Tensor<2> {
    Tensor::from_data(TensorData::new(values, [rows, columns]), device)
}

/// A matrix on the device.
pub(super) fn matrix(m: &DMatrix<f64>, device: &Device) -> Tensor<2> {
    let values = m
        .row_iter()
        .flat_map(|r| r.iter().map(|v| *v as f32).collect::<Vec<_>>());
    tensor(m.nrows(), m.ncols(), values.collect(), device)
}

//! Tensors as matrices.

use burn::tensor::Tensor;
use nalgebra::DMatrix;

/// The matrix of a two-dimensional tensor.
pub(crate) fn to_matrix(t: Tensor<2>) -> DMatrix<f64> {
    let [rows, columns] = t.dims();
    let values: Vec<f64> = t.into_data().iter::<f64>().collect();
    DMatrix::from_row_slice(rows, columns, &values)
}

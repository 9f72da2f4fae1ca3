//! A tensor of a file: its shape and its values, as many as the shape says.

use super::shapes::transposed_places;
use crate::NetworkError;
use crate::limits::MAX_PARAMETERS;

/// Numbers with a shape.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Tensor {
    pub(super) shape: Vec<usize>,
    pub(super) values: Vec<f32>,
}

impl Tensor {
    /// # Errors
    /// The shape asks for another number of values, or for more than any network has.
    pub(super) fn new(
        place: &str,
        shape: Vec<usize>,
        values: Vec<f32>,
    ) -> Result<Self, NetworkError> {
        let count = count(place, &shape)?;
        if values.len() != count {
            let message = format!("{} values where {shape:?} asks for {count}", values.len());
            return Err(NetworkError::malformed(place, message));
        }
        Ok(Self { shape, values })
    }

    /// The tensor with its axes in another order: axis `i` of the result is axis `axes[i]` of this.
    pub(super) fn permuted(&self, axes: &[usize]) -> Self {
        let places = transposed_places(&self.shape, axes);
        Self {
            shape: axes.iter().map(|&axis| self.shape[axis]).collect(),
            values: places.into_iter().map(|place| self.values[place]).collect(),
        }
    }

    /// Rows become columns.
    ///
    /// # Errors
    /// It is no matrix.
    pub(super) fn transposed(&self, place: &str) -> Result<Self, NetworkError> {
        self.expect_axes(place, 2)?;
        Ok(self.permuted(&[1, 0]))
    }

    /// # Errors
    /// It has another number of axes.
    pub(super) fn expect_axes(&self, place: &str, axes: usize) -> Result<(), NetworkError> {
        if self.shape.len() == axes {
            return Ok(());
        }
        let message = format!("weights of shape {:?}: expected {axes} axes", self.shape);
        Err(NetworkError::malformed(place, message))
    }

    /// # Errors
    /// It has another shape.
    pub(super) fn expect_shape(&self, place: &str, shape: &[usize]) -> Result<(), NetworkError> {
        if self.shape == shape {
            return Ok(());
        }
        let message = format!("weights of shape {:?}: expected {shape:?}", self.shape);
        Err(NetworkError::malformed(place, message))
    }
}

/// Number of values of a shape.
///
/// # Errors
/// More than any network has.
pub(super) fn count(place: &str, shape: &[usize]) -> Result<usize, NetworkError> {
    // An empty axis does not hide that the others are too large.
    let bound = shape
        .iter()
        .try_fold(1_usize, |n, &axis| n.checked_mul(axis.max(1)));
    bound
        .filter(|&bound| bound <= MAX_PARAMETERS)
        .map(|bound| if shape.contains(&0) { 0 } else { bound })
        .ok_or_else(|| {
            let message = format!("{shape:?} are more than {MAX_PARAMETERS} values");
            NetworkError::too_large(place, message)
        })
}

//! Padding by its name.

use crate::limits::MAX_LENGTH;

/// Padding before and after one axis so that a window with this stride gives
/// `ceil(length / stride)` values (TensorFlow's "SAME": the odd one comes after).
pub(super) fn same(length: usize, size: usize, stride: usize, dilation: usize) -> (usize, usize) {
    let bounded = |n: usize| n.clamp(1, MAX_LENGTH);
    let (size, stride, dilation) = (bounded(size), bounded(stride), bounded(dilation));
    let outputs = length.min(MAX_LENGTH).div_ceil(stride);
    let reach = (size - 1) * dilation + 1;
    let total = (outputs.saturating_sub(1) * stride + reach).saturating_sub(length);
    (total / 2, total - total / 2)
}

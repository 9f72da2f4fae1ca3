//! Convolutions in groups, as TensorFlow and Keras write them.

use super::tensor::{self, Tensor};
use crate::NetworkError;

/// Most weights of a convolution in groups, with its zeros between groups.
pub(super) const MAX_UNGROUPED: usize = 65_536;

/// Weights `[filter, row, column, channel]` over all channels, with zeros between groups. Those of
/// the file have the channels of one group.
///
/// # Errors
/// `Malformed` where channels or filters do not divide into groups; `Unsupported` where the zeros
/// would be too many.
pub(super) fn ungrouped(
    name: &str,
    weights: Tensor,
    channels: usize,
) -> Result<Tensor, NetworkError> {
    let [filters, rows, columns, own] = weights.shape[..] else {
        let message = format!("weights of shape {:?}", weights.shape);
        return Err(NetworkError::malformed(name, message));
    };
    if own == channels {
        return Ok(weights);
    }
    let groups = channels.checked_div(own).unwrap_or(0);
    if groups == 0 || groups * own != channels || filters % groups != 0 || filters == 0 {
        let message = format!(
            "weights of shape {:?} for {channels} channels",
            weights.shape
        );
        return Err(NetworkError::malformed(name, message));
    }
    let shape = vec![filters, rows, columns, channels];
    let count = tensor::count(name, &shape)?;
    if count > MAX_UNGROUPED {
        let what = format!("a convolution in {groups} groups of {own} channels");
        return Err(NetworkError::unsupported(name, what, "use groups=1"));
    }
    let mut values = vec![0.0; count];
    for (place, from) in weights.values.chunks_exact(own).enumerate() {
        let filter = place / (rows * columns);
        let first = place * channels + filter / (filters / groups) * own;
        values[first..first + own].copy_from_slice(from);
    }
    Ok(Tensor { shape, values })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two groups of one channel, two filters in each, one place.
    #[test]
    fn zeros_stand_between_the_groups() -> Result<(), NetworkError> {
        let weights = |shape: Vec<usize>| Tensor {
            values: [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0][..shape.iter().product()].to_vec(),
            shape,
        };
        let found = ungrouped("conv", weights(vec![4, 1, 1, 1]), 2)?;
        assert_eq!(found.shape, [4, 1, 1, 2]);
        assert_eq!(found.values, [1.0, 0.0, 2.0, 0.0, 0.0, 3.0, 0.0, 4.0]);
        for (shape, channels) in [
            (vec![3, 1, 1, 1], 2),
            (vec![4, 1, 1, 2], 3),
            (vec![4, 1, 1, 2], 0),
        ] {
            assert!(ungrouped("conv", weights(shape), channels).is_err());
        }
        Ok(())
    }
}

//! A target shape with one axis left open.

use crate::NetworkError;

/// The shape that `target` asks of `length` values, where -1 stands for what is left.
///
/// # Errors
/// The numbers do not come out.
pub(super) fn open(layer: &str, target: &[i64], length: usize) -> Result<Vec<usize>, NetworkError> {
    let known = target
        .iter()
        .filter(|&&axis| axis != -1)
        .try_fold(1_usize, |n, &axis| {
            usize::try_from(axis)
                .ok()
                .and_then(|axis| n.checked_mul(axis))
        });
    let wrong = || {
        NetworkError::malformed(
            layer,
            format!("{length} values cannot take the shape {target:?}"),
        )
    };
    let known = known.filter(|&known| known > 0).ok_or_else(wrong)?;
    let open = target.iter().filter(|&&axis| axis == -1).count();
    if open > 1 || !length.is_multiple_of(known) || (open == 0 && known != length) {
        return Err(wrong());
    }
    let left = length / known;
    Ok(target
        .iter()
        .map(|&axis| usize::try_from(axis).unwrap_or(left))
        .collect())
}

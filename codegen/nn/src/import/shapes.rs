//! A target shape with one axis left open, and constants spread over a shape.

use crate::limits::MAX_LENGTH;
use crate::{NetworkError, Op, Selection};

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

/// For each value of a tensor of shape `to`, its place in one of shape `from`.
pub(in crate::import) fn spread_places(from: &[usize], to: &[usize]) -> Vec<usize> {
    let lead = to.len() - from.len();
    let mut places = vec![0];
    for (axis, &length) in to.iter().enumerate() {
        let own = axis.checked_sub(lead).map_or(1, |axis| from[axis]);
        let stride: usize = axis
            .checked_sub(lead)
            .map_or(0, |axis| from[axis + 1..].iter().product());
        let stride = if own == 1 { 0 } else { stride };
        places = places
            .iter()
            .flat_map(|&place| (0..length).map(move |i| place + i * stride))
            .collect();
    }
    places
}

/// A constant beside a value of shape `to`: one number for each place of the last axis where it
/// varies along that alone, else one for every value.
///
/// # Errors
/// It would make the value larger.
pub(super) fn spread(
    layer: &str,
    constant: &[usize],
    values: &[f32],
    to: &[usize],
) -> Result<Vec<f32>, NetworkError> {
    let ahead = constant.len().saturating_sub(to.len());
    let (front, own) = constant.split_at(ahead);
    let lead = to.len() - own.len();
    let fits = front.iter().all(|&n| n == 1)
        && own.iter().zip(&to[lead..]).all(|(&n, &m)| n == 1 || n == m);
    if !fits {
        return Err(NetworkError::unsupported(
            layer,
            format!("a constant of shape {constant:?} beside {to:?}"),
            "a constant that makes the value no larger works",
        ));
    }
    let last_alone = own.iter().rev().skip(1).all(|&n| n == 1);
    let over = if last_alone {
        &to[to.len().saturating_sub(1)..]
    } else {
        to
    };
    let own = if last_alone {
        &own[own.len().saturating_sub(1)..]
    } else {
        own
    };
    Ok(spread_places(own, over)
        .into_iter()
        .map(|place| values[place])
        .collect())
}

/// Places in a tensor of shape `dims` of the values at `indices` of `axis`, in order.
pub(in crate::import) fn places_along(
    dims: &[usize],
    axis: usize,
    indices: &[usize],
) -> Vec<usize> {
    let inner: usize = dims[axis + 1..].iter().product();
    let outer: usize = dims[..axis].iter().product();
    let mut places = Vec::new();
    for run in 0..outer {
        for &index in indices {
            let start = (run * dims[axis] + index) * inner;
            places.extend(start..start + inner);
        }
    }
    places
}

/// Places in a tensor of shape `dims` of its values with the axes in the given order.
pub(in crate::import) fn transposed_places(dims: &[usize], order: &[usize]) -> Vec<usize> {
    let mut places = vec![0];
    for &axis in order {
        let stride: usize = dims[axis + 1..].iter().product();
        places = places
            .iter()
            .flat_map(|&place| (0..dims[axis]).map(move |i| place + i * stride))
            .collect();
    }
    places
}

/// Indices that a slice takes of an axis.
pub(in crate::import) fn slice_indices(
    length: usize,
    start: i64,
    end: i64,
    step: i64,
) -> Vec<usize> {
    let n = length as i64;
    let from_end = |i: i64| if i < 0 { i.saturating_add(n) } else { i };
    let (mut at, end) = if step > 0 {
        (from_end(start).clamp(0, n), from_end(end).clamp(0, n))
    } else {
        (
            from_end(start).clamp(0, n - 1),
            from_end(end).clamp(-1, n - 1),
        )
    };
    let mut indices = Vec::new();
    while step != 0 && ((step > 0 && at < end) || (step < 0 && at > end)) {
        indices.push(at as usize);
        at = at.saturating_add(step);
    }
    indices
}

/// A layer that gives the values at `places` in the shape `shape`.
pub(super) fn selection(places: &[usize], shape: Vec<usize>) -> Op {
    let places = places.iter().copied().map(Some).collect();
    Op::Select(Selection { places, shape })
}

/// Places of a tensor of shape `dims` padded along each axis by `[before, after]` values; a
/// negative padding takes values away. None stands for a value of the padding.
///
/// # Errors
/// The result is empty, or larger than any network's values.
pub(super) fn padded(
    layer: &str,
    dims: &[usize],
    pads: &[[i64; 2]],
) -> Result<(Vec<usize>, Vec<Option<usize>>), NetworkError> {
    let mut shape = Vec::new();
    for (&length, [before, after]) in dims.iter().zip(pads) {
        let sum = (length as i64)
            .saturating_add(*before)
            .saturating_add(*after);
        let fits = usize::try_from(sum)
            .ok()
            .filter(|&n| (1..=MAX_LENGTH).contains(&n));
        let wrong = || {
            let message = format!("it pads {dims:?} by {before} and {after}");
            NetworkError::malformed(layer, message)
        };
        shape.push(fits.ok_or_else(wrong)?);
    }
    if shape
        .iter()
        .try_fold(1_usize, |n, &m| n.checked_mul(m))
        .is_none_or(|n| n > MAX_LENGTH)
    {
        let message = format!("{shape:?} are more than {MAX_LENGTH} values");
        return Err(NetworkError::too_large(layer, message));
    }
    let mut places = vec![Some(0)];
    for (axis, (&length, &padded)) in dims.iter().zip(&shape).enumerate() {
        let before = pads[axis][0];
        let inner = |i: usize| {
            usize::try_from(i as i64 - before)
                .ok()
                .filter(|&i| i < length)
        };
        let next = |place: &Option<usize>| {
            let place = *place;
            (0..padded)
                .map(move |i| Some(place? * length + inner(i)?))
                .collect::<Vec<_>>()
        };
        places = places.iter().flat_map(next).collect();
    }
    Ok((shape, places))
}

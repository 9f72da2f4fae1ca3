//! Axes and shapes that nodes name: negative ones from the end, broadcast, reshaped, permuted.

use super::Node;
use crate::NetworkError;

/// An axis of `axes`, negative ones from the end.
pub(super) fn axis_of(node: &Node<'_>, axis: i64, axes: usize) -> Result<usize, NetworkError> {
    let place = if axis < 0 { axis + axes as i64 } else { axis };
    let place = usize::try_from(place).ok().filter(|&place| place < axes);
    place.ok_or_else(|| node.malformed(format!("axis {axis} of {axes}")))
}

/// The shape of two operands together, as NumPy broadcasts.
pub(super) fn broadcast(
    node: &Node<'_>,
    a: &[usize],
    b: &[usize],
) -> Result<Vec<usize>, NetworkError> {
    let axes = a.len().max(b.len());
    let at = |shape: &[usize], axis: usize| {
        (axis + shape.len())
            .checked_sub(axes)
            .map_or(1, |place| shape[place])
    };
    (0..axes)
        .map(|axis| match (at(a, axis), at(b, axis)) {
            (n, m) if n == m || m == 1 => Ok(n),
            (1, m) => Ok(m),
            _ => Err(node.malformed(format!("the shapes {a:?} and {b:?} do not go together"))),
        })
        .collect()
}

/// Starts, ends, axes and steps of a Slice, as attributes (before opset 10) or as inputs.
pub(super) fn slices(
    node: &Node<'_>,
    lists: [Option<Vec<i64>>; 4],
    axes: usize,
) -> Result<Vec<(usize, [i64; 3])>, NetworkError> {
    let [starts, ends, over, steps] = lists;
    let (Some(starts), Some(ends)) = (starts, ends) else {
        return Err(node.unsupported("a slice whose bounds are computed", "use constant bounds"));
    };
    let over = over.unwrap_or_else(|| (0..starts.len() as i64).collect());
    let steps = steps.unwrap_or_else(|| vec![1; starts.len()]);
    if ends.len() != starts.len() || over.len() != starts.len() || steps.len() != starts.len() {
        return Err(node.malformed("starts, ends, axes and steps of different lengths"));
    }
    let one = |i: usize| {
        Ok((
            axis_of(node, over[i], axes)?,
            [starts[i], ends[i], steps[i]],
        ))
    };
    (0..starts.len()).map(one).collect()
}

/// A list as lengths of axes.
pub(super) fn lengths(node: &Node<'_>, list: &[i64]) -> Result<Vec<usize>, NetworkError> {
    let length =
        |&n: &i64| usize::try_from(n).map_err(|_| node.malformed(format!("the shape {list:?}")));
    list.iter().map(length).collect()
}

/// A shape to be, where 0 stands for the axis as it is and -1 for what is left.
pub(super) fn reshape_target(
    node: &Node<'_>,
    target: &[i64],
    dims: &[usize],
) -> Result<Vec<usize>, NetworkError> {
    let length: usize = dims.iter().product();
    let axis = |(axis, &n): (usize, &i64)| match n {
        0 => dims.get(axis).map_or(0, |&n| n as i64),
        n => n,
    };
    let target: Vec<i64> = target.iter().enumerate().map(axis).collect();
    crate::import::shapes::open(&node.name, &target, length)
}

/// The shape with axes of length 1 taken out, or put in.
pub(super) fn squeezed(
    node: &Node<'_>,
    dims: &[usize],
    axes: Option<Vec<i64>>,
) -> Result<Vec<usize>, NetworkError> {
    let out = node.proto.op_type == "Unsqueeze";
    let Some(axes) = axes else {
        if out || node.input(1).is_some() {
            return Err(node.unsupported("axes that are computed", "name the axes"));
        }
        return Ok(dims.iter().copied().filter(|&n| n != 1).collect());
    };
    let count = if out {
        dims.len() + axes.len()
    } else {
        dims.len()
    };
    let mut places = axes
        .iter()
        .map(|&axis| axis_of(node, axis, count))
        .collect::<Result<Vec<_>, _>>()?;
    places.sort_unstable();
    places.dedup();
    if places.len() != axes.len() {
        return Err(node.malformed(format!("an axis of {axes:?} stands twice")));
    }
    let mut shape = dims.to_vec();
    if out {
        places.iter().for_each(|&place| shape.insert(place, 1));
        return Ok(shape);
    }
    for place in places.into_iter().rev() {
        if shape.remove(place) != 1 {
            return Err(node.malformed(format!("it takes axis {place} out of {dims:?}")));
        }
    }
    Ok(shape)
}

/// The order of axes of a Transpose.
pub(super) fn transposition(node: &Node<'_>, axes: usize) -> Result<Vec<usize>, NetworkError> {
    let order: Vec<usize> = match node.ints("perm") {
        Some(order) => order
            .iter()
            .map(|&n| usize::try_from(n).unwrap_or(usize::MAX))
            .collect(),
        None => (0..axes).rev().collect(),
    };
    let mut sorted = order.clone();
    sorted.sort_unstable();
    if sorted != (0..axes).collect::<Vec<_>>() {
        return Err(node.malformed(format!("perm is {order:?}")));
    }
    Ok(order)
}

/// Indices of an axis, negative ones from the end.
pub(super) fn gathered(
    node: &Node<'_>,
    indices: &[i64],
    length: usize,
) -> Result<Vec<usize>, NetworkError> {
    indices
        .iter()
        .map(|&index| axis_of(node, index, length))
        .collect()
}

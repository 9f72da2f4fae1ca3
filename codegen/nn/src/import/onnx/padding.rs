//! Operators that repeat, reverse or surround values: Pad, ReverseSequence, Expand, Tile.

use super::axes::{axis_of, broadcast, lengths};
use super::{Constant, Import, Node, Value};
use crate::NetworkError;
use crate::import::shapes::{self, spread_places};
use crate::limits::MAX_LENGTH;

/// Index within an axis of `length` of place `at`, which may lie beside it.
fn beside(mode: &str, at: i64, length: i64) -> Option<usize> {
    let inside = match mode {
        "edge" => at.clamp(0, length - 1),
        "reflect" if at < 0 => -at,
        "reflect" if at >= length => 2 * (length - 1) - at,
        "wrap" => at.rem_euclid(length),
        _ => at,
    };
    usize::try_from(inside)
        .ok()
        .filter(|&inside| (inside as i64) < length)
}

impl Import<'_> {
    pub(super) fn pad(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let value = self.value(node, 0)?;
        let dims = value.dims();
        let mode = node.text("mode");
        let mode = if mode.is_empty() { "constant" } else { &mode };
        if !["constant", "edge", "reflect", "wrap"].contains(&mode) {
            return Err(node.unsupported(format!("the mode {mode:?} of Pad"), "use constant"));
        }
        let filled = if node.opset < 11 {
            node.float("value", 0.0)
        } else {
            match self.constants.get(node.input(2).unwrap_or("")) {
                Some(constant) => constant.numbers().first().copied().unwrap_or(0.0) as f32,
                None if node.input(2).is_none() => 0.0,
                None => return Err(node.unsupported("a Pad by a value", "pad by zeros")),
            }
        };
        if mode == "constant" && filled != 0.0 {
            return Err(node.unsupported(format!("a Pad by {filled}"), "pad by zeros"));
        }
        let Some(pads) = self.integers(node, 1, "pads") else {
            return Err(node.unsupported("pads that are computed", "use constant pads"));
        };
        let axes: Vec<usize> = match node.input(3) {
            None => (0..dims.len()).collect(),
            Some(_) => match self.integers(node, 3, "") {
                None => return Err(node.unsupported("axes that are computed", "name the axes")),
                Some(axes) => (axes.iter())
                    .map(|&axis| axis_of(node, axis, dims.len()))
                    .collect::<Result<_, _>>()?,
            },
        };
        if pads.len() != 2 * axes.len() {
            let message = format!("{} pads for {} axes", pads.len(), axes.len());
            return Err(node.malformed(message));
        }
        if mode == "wrap" && pads.iter().any(|&pad| pad < 0) {
            return Err(node.unsupported(
                "a Pad of the mode wrap that also cuts",
                "cut by a Slice, then wrap",
            ));
        }
        let mut all = vec![[0_i64; 2]; dims.len()];
        for (i, &axis) in axes.iter().enumerate() {
            all[axis] = [pads[i], pads[i + axes.len()]];
        }
        if value.batch.is_some_and(|batch| all[batch] != [0; 2]) {
            return Err(node.unsupported("a Pad of the batch", "pad the axes after it"));
        }
        for (axis, _) in all.iter().enumerate().filter(|(_, pad)| **pad != [0; 2]) {
            self.expect_no_steps(node, &value, axis)?;
        }
        let inner: Vec<[i64; 2]> = (0..dims.len())
            .filter(|&axis| Some(axis) != value.batch)
            .map(|axis| all[axis])
            .collect();
        if mode == "constant" && (1..=3).contains(&value.shape.len()) {
            // In the order in which the value is held, so that a convolution takes it in.
            let (held, pads) = if value.last && value.shape.len() > 1 {
                (
                    super::rotated(&value.shape),
                    [&inner[1..], &inner[..1]].concat(),
                )
            } else {
                (value.shape.clone(), inner.clone())
            };
            let place = self.held_as(node, value.place, held)?;
            let place = self.network.padded(&node.name, place, &pads)?;
            let shape = (value.shape.iter().zip(&inner))
                .map(|(&n, [before, after])| (n as i64 + before + after) as usize);
            let shape = shape.collect();
            return Ok(vec![Value {
                place,
                shape,
                ..value
            }]);
        }
        let mut value = self.flat(node, value)?;
        for (axis, [before, after]) in all.into_iter().enumerate() {
            let length = value.dims()[axis] as i64;
            if [before, after] == [0; 2] {
                continue;
            }
            let end = length.saturating_add(after);
            let fits = before.abs() <= MAX_LENGTH as i64 && end <= 2 * MAX_LENGTH as i64;
            let wrong = || node.malformed(format!("{before} and {after} beside {length}"));
            if !fits {
                return Err(wrong());
            }
            if mode == "constant" {
                return Err(node.unsupported(
                    format!("a Pad of {} axes", value.shape.len()),
                    "up to three axes beside the batch work",
                ));
            }
            let indices: Option<Vec<usize>> =
                (-before..end).map(|at| beside(mode, at, length)).collect();
            let indices = indices.ok_or_else(wrong)?;
            value = self.selected(node, value, axis, &indices, &[indices.len()])?;
        }
        Ok(vec![value])
    }

    /// A sequence from its end to its beginning, all of it.
    pub(super) fn reverse_sequence(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let value = self.value(node, 0)?;
        let dims = value.dims();
        let axes = (node.int("time_axis", 0), node.int("batch_axis", 1));
        let (time, batch) = (
            axis_of(node, axes.0, dims.len())?,
            axis_of(node, axes.1, dims.len())?,
        );
        let lengths = self.integers(node, 1, "");
        let whole = lengths.is_some_and(|list| list == [dims[time] as i64]);
        if !whole || dims[batch] != 1 || self.streaming {
            return Err(node.unsupported(
                "a ReverseSequence of part of a sequence",
                "reverse all of a fixed number of steps",
            ));
        }
        let indices: Vec<usize> = (0..dims[time]).rev().collect();
        Ok(vec![self.selected(
            node,
            value,
            time,
            &indices,
            &[indices.len()],
        )?])
    }

    /// Repeated along axes, to a shape or a number of times.
    pub(super) fn repeated(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let value = self.value(node, 0)?;
        let dims = value.dims();
        let name = node.input(1).unwrap_or("");
        let Some(Constant::Integers(list)) = self.constants.get(name) else {
            return Err(node.unsupported("a shape that is computed", "use a constant shape"));
        };
        let list = lengths(node, &list.values)?;
        let tile = node.proto.op_type == "Tile";
        let (shape, places) = if tile {
            if list.len() != dims.len() {
                return Err(node.malformed(format!("{} repeats of {dims:?}", list.len())));
            }
            let shape: Vec<usize> = (dims.iter().zip(&list))
                .map(|(&n, &times)| n.saturating_mul(times))
                .collect();
            self.expect_small(node, &shape)?;
            let mut places = vec![0];
            for (axis, &length) in shape.iter().enumerate() {
                let of = |place: &usize| {
                    let (place, own) = (*place, dims[axis]);
                    (0..length).map(move |i| place * own + i % own)
                };
                places = places.iter().flat_map(of).collect();
            }
            (shape, places)
        } else {
            let shape = broadcast(node, &dims, &list)?;
            self.expect_small(node, &shape)?;
            let places = spread_places(&dims, &shape);
            (shape, places)
        };
        let value = self.flat(node, value)?;
        if places.len() == value.len() {
            return Ok(vec![Value::of(value.place, shape, value.batch)]);
        }
        let op = shapes::selection(&places, vec![places.len()]);
        let place = self.push(node, op, value.place)?;
        Ok(vec![Value::of(place, shape, value.batch)])
    }

    fn expect_small(&self, node: &Node<'_>, shape: &[usize]) -> Result<(), NetworkError> {
        let count = shape
            .iter()
            .try_fold(1_usize, |n, &axis| n.checked_mul(axis));
        if count.is_none_or(|count| count > MAX_LENGTH) {
            let message = format!("{shape:?} are more than {MAX_LENGTH} values");
            return Err(NetworkError::too_large(&node.name, message));
        }
        if shape.contains(&0) {
            return Err(node.malformed("its result is empty"));
        }
        Ok(())
    }
}

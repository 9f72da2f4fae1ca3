//! Operators that move values or take some of them: joined, cut, reshaped, transposed.

use super::axes::{axis_of, gathered, reshape_target, slices, squeezed, transposition};
use super::constant::Constant;
use super::{Import, Node, Value};
use crate::import::shapes::slice_indices;
use crate::{NetworkError, Op};

impl Import<'_> {
    pub(super) fn concat(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let mut values = Vec::new();
        for input in 0..node.proto.input.len() {
            let value = self.value(node, input)?;
            values.push(value);
        }
        let Some(first) = values.first().cloned() else {
            return Err(node.malformed("it reads nothing"));
        };
        let dims = first.dims();
        let axis = axis_of(node, node.int("axis", 0), dims.len())?;
        if values.len() > 1 {
            self.expect_no_steps(node, &first, axis)?;
        }
        let all: Vec<Vec<usize>> = values.iter().map(Value::dims).collect();
        let mut shape = dims.clone();
        for other in &all[1..] {
            let alike = other.len() == dims.len()
                && (0..dims.len()).all(|i| i == axis || other[i] == dims[i]);
            if !alike {
                return Err(
                    node.malformed(format!("{dims:?} and {other:?} differ beside axis {axis}"))
                );
            }
            shape[axis] += other[axis];
        }
        let same = values.iter().all(|value| value.batch == first.batch);
        let plain =
            same && first.batch.is_some() && first.batch != Some(axis) && first.shape.len() <= 3;
        let last = plain && values.iter().any(|value| value.last);
        let mut parts = Vec::new();
        for value in values {
            let value = if last {
                self.channels_last(node, value)?
            } else {
                self.as_written(node, value)?
            };
            parts.push(value);
        }
        let name = self.free_name(&node.name);
        if !plain {
            // Runs of what stands after the axis, one beside the other.
            let outer: usize = dims[..axis].iter().product();
            let mut from = Vec::new();
            for part in &parts {
                let run = part.len() / outer.max(1);
                let held = if outer == 1 {
                    vec![run]
                } else {
                    vec![outer, run]
                };
                from.push(self.held_as(node, part.place, held)?);
            }
            let name = self.free_name(&name);
            let place = self
                .network
                .push(&name, Op::Concatenate(usize::from(outer != 1)), from)?;
            return Ok(vec![Value::of(place, shape, first.batch)]);
        }
        let batch = first.batch.unwrap_or(0);
        let inner = if axis > batch { axis - 1 } else { axis };
        let axes = first.shape.len();
        let held = if last && axes > 1 {
            (inner + axes - 1) % axes
        } else {
            inner
        };
        let from = parts.iter().map(|part| part.place).collect();
        let place = self.network.push(&name, Op::Concatenate(held), from)?;
        shape.remove(batch);
        let first = parts.swap_remove(0);
        Ok(vec![Value {
            place,
            shape,
            ..first
        }])
    }

    pub(super) fn flatten(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let value = self.value(node, 0)?;
        let value = self.as_written(node, value)?;
        let dims = value.dims();
        let axis = node.int("axis", 1);
        let axis = if axis == dims.len() as i64 {
            dims.len()
        } else {
            axis_of(node, axis, dims.len())?
        };
        let dims = vec![dims[..axis].iter().product(), dims[axis..].iter().product()];
        self.reheld(node, &value, dims)
    }

    /// The value in another shape, and its node too where a node can have it.
    fn reheld(
        &mut self,
        node: &Node<'_>,
        value: &Value,
        dims: Vec<usize>,
    ) -> Result<Vec<Value>, NetworkError> {
        let mut found = value.reshaped(dims, Some(0));
        if (1..=3).contains(&found.shape.len()) {
            found.place = self.push(node, Op::Reshape(found.shape.clone()), value.place)?;
        }
        Ok(vec![found])
    }

    pub(super) fn reshape(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let value = self.value(node, 0)?;
        let value = self.as_written(node, value)?;
        let target = self.integers(node, 1, "shape");
        let target = target
            .ok_or_else(|| node.unsupported("a shape that is computed", "use a constant shape"))?;
        if node.int("allowzero", 0) != 0 && target.contains(&0) {
            return Err(node.unsupported("allowzero = 1", "use allowzero = 0"));
        }
        let dims = reshape_target(node, &target, &value.dims())?;
        self.reheld(node, &value, dims)
    }

    pub(super) fn squeeze(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let value = self.value(node, 0)?;
        let value = self.flat(node, value)?;
        let axes = self.integers(node, 1, "axes");
        let dims = value.dims();
        let shape = squeezed(node, &dims, axes.clone())?;
        // The batch is where it was, but for the axes that came or went before it.
        let places: Vec<usize> = axes
            .unwrap_or_default()
            .iter()
            .map(|&axis| axis_of(node, axis, dims.len().max(shape.len())))
            .collect::<Result<_, _>>()?;
        let batch = value.batch.and_then(|batch| {
            if node.proto.op_type == "Unsqueeze" {
                return (0..shape.len())
                    .filter(|axis| !places.contains(axis))
                    .nth(batch);
            }
            let gone = places.iter().filter(|&&axis| axis < batch).count();
            (!places.contains(&batch) && !places.is_empty()).then(|| batch - gone)
        });
        Ok(vec![value.reshaped(shape, batch)])
    }

    pub(super) fn transpose(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let value = self.value(node, 0)?;
        let value = self.as_written(node, value)?;
        let order = transposition(node, value.dims().len())?;
        Ok(vec![self.transposed(node, value, &order)?])
    }

    /// One index, or several, of an axis.
    pub(super) fn gather(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let data = node.input(0).and_then(|name| self.constants.get(name));
        if data.is_some() {
            return Err(node.unsupported(
                "a Gather whose indices are values, an embedding,",
                "use MatMul on one-hot inputs",
            ));
        }
        let value = self.value(node, 0)?;
        let dims = value.dims();
        let axis = axis_of(node, node.int("axis", 0), dims.len())?;
        let name = node.input(1).unwrap_or("");
        let Some(Constant::Integers(indices)) = self.constants.get(name).cloned() else {
            return Err(node.unsupported(
                "a Gather whose indices are computed",
                "use constant indices",
            ));
        };
        if self.reads_steps && indices.values.iter().any(|&index| index >= 0) {
            self.expect_no_steps(node, &value, axis)?;
        }
        let list = gathered(node, &indices.values, dims[axis])?;
        Ok(vec![self.selected(
            node,
            value,
            axis,
            &list,
            &indices.shape,
        )?])
    }

    pub(super) fn slice(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let mut value = self.value(node, 0)?;
        let lists = [
            self.integers(node, 1, "starts"),
            self.integers(node, 2, "ends"),
            self.integers(node, 3, "axes"),
            self.integers(node, 4, "steps"),
        ];
        if node.input(3).is_some() && lists[2].is_none()
            || node.input(4).is_some() && lists[3].is_none()
        {
            return Err(node.unsupported("a slice whose axes are computed", "use constant axes"));
        }
        for (axis, [start, end, step]) in slices(node, lists, value.dims().len())? {
            let length = value.dims()[axis];
            // All steps, or the last, are there in each call; others are not.
            let last = [0, -1].contains(&start) && end >= i64::from(i32::MAX) && step == 1;
            if !last {
                self.expect_no_steps(node, &value, axis)?;
            }
            let indices = slice_indices(length, start, end, step);
            value = self.selected(node, value, axis, &indices, &[indices.len()])?;
        }
        Ok(vec![value])
    }

    pub(super) fn split(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let value = self.value(node, 0)?;
        let dims = value.dims();
        let axis = axis_of(node, node.int("axis", 0), dims.len())?;
        let outputs = node.proto.output.len().max(1);
        let parts = match self.integers(node, 1, "split") {
            Some(parts) => parts
                .iter()
                .map(|&n| usize::try_from(n).unwrap_or(usize::MAX))
                .collect(),
            None if node.input(1).is_some() => {
                return Err(node.unsupported("a split that is computed", "use constant lengths"));
            }
            None => {
                let count = usize::try_from(node.int("num_outputs", outputs as i64))
                    .unwrap_or(0)
                    .max(1);
                let each = dims[axis].div_ceil(count);
                let part = |i: usize| each.min(dims[axis].saturating_sub(i * each));
                (0..count).map(part).collect::<Vec<_>>()
            }
        };
        let total = parts.iter().fold(0_usize, |sum, &n| sum.saturating_add(n));
        if total != dims[axis] || parts.len() != outputs {
            return Err(node.malformed(format!("it splits {} into {parts:?}", dims[axis])));
        }
        let mut start = 0;
        let mut found = Vec::new();
        for (part, name) in parts.into_iter().zip(&node.proto.output) {
            let indices: Vec<usize> = (start..start + part).collect();
            start += part;
            // What nobody reads is not computed.
            found.push(if self.read.contains(name.as_str()) {
                self.selected(node, value.clone(), axis, &indices, &[part])?
            } else {
                value.clone()
            });
        }
        Ok(found)
    }
}

//! Operators over whole axes: softmax, and the mean, largest or sum.

use super::axes::axis_of;
use super::{Import, Node, Value};
use crate::{Activation, NetworkError, Op, Pool, PoolKind, Window};

impl Import<'_> {
    /// A softmax or its logarithm, `op`: up to opset 12 over all values from an axis on, by default
    /// all but the batch; from 13 on over one axis, by default the last.
    pub(super) fn softmax(&mut self, node: &Node<'_>, op: &Op) -> Result<Vec<Value>, NetworkError> {
        let value = self.value(node, 0)?;
        let dims = value.dims();
        let old = node.opset < 13;
        let axis = node.int("axis", if old { 1 } else { -1 });
        let axis = if old && axis == dims.len() as i64 {
            dims.len()
        } else {
            axis_of(node, axis, dims.len())?
        };
        self.expect_no_steps(node, &value, axis)?;
        let after = if old { axis } else { axis + 1 };
        let inner: usize = dims[after..].iter().product();
        let length = if old { inner } else { dims[axis] };
        if !old && inner != 1 {
            // The axis goes last and comes back.
            let order: Vec<usize> = (0..dims.len())
                .filter(|&a| a != axis)
                .chain([axis])
                .collect();
            let mut back: Vec<usize> = (0..dims.len() - 1).collect();
            back.insert(axis, dims.len() - 1);
            let batch = value.batch;
            let turned = self.transposed(node, value, &order)?;
            let place = self.rows(node, turned.place, turned.len(), length)?;
            let place = self.push(node, op.clone(), place)?;
            let turned = Value { place, ..turned };
            let found = self.transposed(node, turned, &back)?;
            return Ok(vec![found.reshaped(dims, batch)]);
        }
        let mut value = self.as_written(node, value)?;
        if value.shape.last().copied().unwrap_or(1) != length || value.shape.len() > 3 {
            value.place = self.rows(node, value.place, value.len(), length)?;
        }
        let place = self.push(node, op.clone(), value.place)?;
        Ok(vec![Value { place, ..value }])
    }

    /// The values of a node as rows of `length`.
    pub(super) fn rows(
        &mut self,
        node: &Node<'_>,
        place: usize,
        values: usize,
        length: usize,
    ) -> Result<usize, NetworkError> {
        let rows = values.checked_div(length).unwrap_or(0);
        let held = if rows == 1 {
            vec![length]
        } else {
            vec![rows, length]
        };
        self.held_as(node, place, held)
    }

    /// The mean, largest, smallest, sum or norm over axes, as a pool over all that they span.
    pub(super) fn reduce(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let value = self.value(node, 0)?;
        let (op, name) = (node.proto.op_type.as_str(), node.name.as_str());
        let dims = value.dims();
        let axes = self.integers(node, 1, "axes");
        if node.input(1).is_some() && axes.is_none() {
            return Err(node.unsupported("axes that are computed", "name the axes"));
        }
        let keep = node.int("keepdims", 1) != 0;
        let empty = axes.as_ref().is_none_or(Vec::is_empty);
        let idle = node.int("noop_with_empty_axes", 0) != 0;
        if empty && idle {
            // ONNX leaves the values of the others open.
            if op.starts_with("ReduceM") || op == "ReduceSum" {
                return Ok(vec![value]);
            }
            return Err(node.unsupported("noop_with_empty_axes without axes", "name the axes"));
        }
        let axes: Vec<usize> = match axes {
            Some(axes) if !axes.is_empty() => axes
                .iter()
                .map(|&axis| axis_of(node, axis, dims.len()))
                .collect::<Result<_, _>>()?,
            _ => (0..dims.len()).collect(),
        };
        for &axis in &axes {
            self.expect_no_steps(node, &value, axis)?;
        }
        let shape: Vec<usize> = (0..dims.len())
            .filter(|axis| keep || !axes.contains(axis))
            .map(|axis| if axes.contains(&axis) { 1 } else { dims[axis] })
            .collect();
        let batch = value.batch.and_then(|batch| {
            let gone = axes.iter().filter(|&&axis| axis < batch).count();
            if keep {
                Some(batch)
            } else {
                (!axes.contains(&batch)).then(|| batch - gone)
            }
        });
        let reduced: usize = axes.iter().map(|&axis| dims[axis]).product();
        let order: Vec<usize> = axes
            .iter()
            .copied()
            .chain((0..dims.len()).filter(|axis| !axes.contains(axis)))
            .collect();
        if order.len() != dims.len() {
            return Err(node.malformed(format!("an axis of {axes:?} stands twice")));
        }
        let turned = self.transposed(node, value, &order)?;
        let kept = turned.len() / reduced.max(1);
        let place = self.held_as(node, turned.place, vec![reduced, kept])?;
        let window = Window {
            size: [1, reduced],
            stride: [1; 2],
            dilation: [1; 2],
            before: [0; 2],
            after: [0; 2],
        };
        let network = &mut self.network;
        let place = match op {
            "ReduceMin" => network.scaled(name, place, -1.0, 0.0)?,
            "ReduceL1" => network.absolute(name, place)?,
            "ReduceL2" | "ReduceSumSquare" => network.power(name, place, 2.0)?,
            _ => place,
        };
        let kind = match op {
            "ReduceMax" | "ReduceMin" => PoolKind::Max,
            _ => PoolKind::Average,
        };
        let place = network.append(name, Op::Pool(Pool { window, kind }), &[place])?;
        let place = match op {
            "ReduceMax" | "ReduceMean" => place,
            "ReduceMin" => network.scaled(name, place, -1.0, 0.0)?,
            _ => network.scaled(name, place, reduced as f32, 0.0)?,
        };
        let place = match op {
            "ReduceL2" => network.append(name, Op::Activation(Activation::Root), &[place])?,
            _ => place,
        };
        Ok(vec![Value::of(place, shape, batch)])
    }
}

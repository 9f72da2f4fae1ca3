//! The layouts of a value: ONNX's own, the one that a node holds, and parts of it.

use super::{Import, Node, Value, rotated};
use crate::import::shapes::{self, places_along};
use crate::{NetworkError, Op, limits::MAX_AXES};

impl Value {
    /// The shape as ONNX has it, the batch of 1 with it.
    pub(super) fn dims(&self) -> Vec<usize> {
        let mut shape = self.shape.clone();
        if let Some(batch) = self.batch {
            shape.insert(batch.min(shape.len()), 1);
        }
        shape
    }

    /// A value in ONNX's order with the shape `dims`. The batch is axis `batch` where that is 1,
    /// else the first axis of 1.
    pub(super) fn of(place: usize, dims: Vec<usize>, batch: Option<usize>) -> Self {
        let given = batch.filter(|&axis| dims.get(axis) == Some(&1));
        let batch = given.or_else(|| dims.iter().position(|&n| n == 1));
        let mut shape = dims;
        if let Some(batch) = batch {
            shape.remove(batch);
        }
        Self {
            place,
            shape,
            batch,
            last: false,
            gelu: None,
        }
    }

    /// The same value in ONNX's order with another shape of as many values.
    pub(super) fn reshaped(&self, dims: Vec<usize>, batch: Option<usize>) -> Self {
        Self::of(self.place, dims, batch)
    }

    pub(super) fn len(&self) -> usize {
        self.shape.iter().product()
    }
}

impl Import<'_> {
    /// The node's shape made that of the value, as it is held.
    pub(super) fn shaped(&mut self, node: &Node<'_>, value: &Value) -> Result<usize, NetworkError> {
        let held = if value.last {
            rotated(&value.shape)
        } else {
            value.shape.clone()
        };
        self.held_as(node, value.place, held)
    }

    /// Node `place`, or its values in the shape `held`; a single value has one axis.
    pub(super) fn held_as(
        &mut self,
        node: &Node<'_>,
        place: usize,
        held: Vec<usize>,
    ) -> Result<usize, NetworkError> {
        let held = if held.is_empty() { vec![1] } else { held };
        if self.network.nodes[place].shape == held {
            return Ok(place);
        }
        self.push(node, Op::Reshape(held), place)
    }

    /// The value with ONNX's first axis last, as images are held here.
    pub(super) fn channels_last(
        &mut self,
        node: &Node<'_>,
        value: Value,
    ) -> Result<Value, NetworkError> {
        if value.last || value.shape.len() < 2 {
            let place = self.shaped(node, &value)?;
            return Ok(Value { place, ..value });
        }
        let axes = value.shape.len();
        let order: Vec<usize> = (1..axes).chain([0]).collect();
        let place = self.turned(node, value.place, &value.shape, order)?;
        Ok(Value {
            place,
            last: true,
            ..value
        })
    }

    /// The value with its axes in ONNX's order, and its node in its shape.
    pub(super) fn as_written(
        &mut self,
        node: &Node<'_>,
        value: Value,
    ) -> Result<Value, NetworkError> {
        let value = self.flat(node, value)?;
        if value.shape.len() > MAX_AXES {
            return Ok(value);
        }
        let place = self.shaped(node, &value)?;
        Ok(Value { place, ..value })
    }

    /// The value with its axes in ONNX's order; its node may have another shape of as many values.
    pub(super) fn flat(&mut self, node: &Node<'_>, value: Value) -> Result<Value, NetworkError> {
        let axes = value.shape.len();
        if !value.last || axes < 2 {
            return Ok(Value {
                last: false,
                ..value
            });
        }
        let held = rotated(&value.shape);
        let order: Vec<usize> = [axes - 1].into_iter().chain(0..axes - 1).collect();
        let place = self.turned(node, value.place, &held, order)?;
        Ok(Value {
            place,
            last: false,
            ..value
        })
    }

    /// Node `place`, which holds values of shape `held`, with its axes in another order. Two turns
    /// that undo each other are none.
    pub(super) fn turned(
        &mut self,
        node: &Node<'_>,
        place: usize,
        held: &[usize],
        order: Vec<usize>,
    ) -> Result<usize, NetworkError> {
        let place = self.held_as(node, place, held.to_vec())?;
        if let Op::Permute(before) = &self.network.nodes[place].op {
            let both: Vec<usize> = order.iter().map(|&axis| before[axis]).collect();
            if both.is_sorted() {
                return Ok(self.network.nodes[place].from[0]);
            }
        }
        self.push(node, Op::Permute(order), place)
    }

    /// The value with ONNX's axes in another order.
    pub(super) fn transposed(
        &mut self,
        node: &Node<'_>,
        value: Value,
        order: &[usize],
    ) -> Result<Value, NetworkError> {
        let value = self.flat(node, value)?;
        let dims = value.dims();
        let shape: Vec<usize> = order.iter().map(|&axis| dims[axis]).collect();
        let batch = value
            .batch
            .and_then(|batch| order.iter().position(|&axis| axis == batch));
        // Axes of length 1 move no value; without them more orders fit.
        let keep = |axis: usize| {
            if dims.len() <= MAX_AXES + usize::from(value.batch.is_some()) {
                Some(axis) != value.batch
            } else {
                dims[axis] != 1
            }
        };
        let kept: Vec<usize> = (0..dims.len()).filter(|&axis| keep(axis)).collect();
        let inner: Vec<usize> = (order.iter().filter(|&&axis| keep(axis)))
            .filter_map(|axis| kept.iter().position(|other| other == axis))
            .collect();
        let held: Vec<usize> = kept.iter().map(|&axis| dims[axis]).collect();
        let place = if inner.is_empty() {
            value.place
        } else {
            self.turned(node, value.place, &held, inner)?
        };
        Ok(Value::of(place, shape, batch))
    }

    /// That an axis is not that of the steps of an open sequence, of which a call sees one.
    ///
    /// # Errors
    /// It may be: it has one place, and is not the batch's.
    pub(super) fn expect_no_steps(
        &self,
        node: &Node<'_>,
        value: &Value,
        axis: usize,
    ) -> Result<(), NetworkError> {
        if self.streaming && value.dims().get(axis) == Some(&1) && value.batch != Some(axis) {
            return Err(node.unsupported(
                format!("{} over a sequence of open length", node.proto.op_type),
                "export with a fixed number of steps",
            ));
        }
        Ok(())
    }

    /// The values at `indices` of one axis of ONNX's shape, which takes the axes `instead`.
    pub(super) fn selected(
        &mut self,
        node: &Node<'_>,
        value: Value,
        axis: usize,
        indices: &[usize],
        instead: &[usize],
    ) -> Result<Value, NetworkError> {
        let value = self.flat(node, value)?;
        let dims = value.dims();
        let shape = [&dims[..axis], instead, &dims[axis + 1..]].concat();
        if indices.is_empty() {
            return Err(node.malformed(format!("it takes nothing of {dims:?}")));
        }
        // The batch moves with the axes before it.
        let batch = value.batch.and_then(|batch| match batch {
            b if b < axis => Some(b),
            b if b > axis => Some(b + instead.len() - 1),
            _ => None,
        });
        if indices.len() == dims[axis] && indices.iter().enumerate().all(|(i, &index)| i == index) {
            return Ok(Value::of(value.place, shape, batch));
        }
        let places = self.selection(node, value.place, &places_along(&dims, axis, indices))?;
        Ok(Value::of(places, shape, batch))
    }

    /// A layer that gives the values of node `from` at `places`.
    pub(super) fn selection(
        &mut self,
        node: &Node<'_>,
        from: usize,
        places: &[usize],
    ) -> Result<usize, NetworkError> {
        let op = shapes::selection(places, vec![places.len()]);
        self.push(node, op, from)
    }

    /// Recurrent layers of which only the state after the last step is read give nothing else.
    pub(super) fn last_steps(&mut self) {
        for place in 1..self.network.nodes.len() {
            let Op::Select(selection) = &self.network.nodes[place].op else {
                continue;
            };
            let units = selection.places.len();
            let length = self.network.nodes[self.network.nodes[place].from[0]].len();
            let last = (length.saturating_sub(units)..length).map(Some);
            if length <= units || !selection.places.iter().copied().eq(last) {
                continue;
            }
            // Past layers that leave every value where it is.
            let mut source = self.network.nodes[place].from[0];
            let mut single = self.readers(source) == 1;
            while single && self.network.is_no_move(source) {
                source = self.network.nodes[source].from[0];
                single = self.readers(source) == 1;
            }
            let from = self.network.nodes[source].from.clone();
            let Op::Recurrent(layer) = &self.network.nodes[source].op else {
                continue;
            };
            if !single || !layer.sequences || layer.units != units {
                continue;
            }
            let mut layer = layer.clone();
            layer.sequences = false;
            self.network.nodes[place].op = Op::Recurrent(layer);
            self.network.nodes[place].from = from;
            let name = std::mem::take(&mut self.network.nodes[source].name);
            self.network.nodes[source].name =
                std::mem::replace(&mut self.network.nodes[place].name, name);
        }
    }

    fn readers(&self, place: usize) -> usize {
        let from = self.network.nodes.iter().flat_map(|node| &node.from);
        from.filter(|&&from| from == place).count()
    }
}

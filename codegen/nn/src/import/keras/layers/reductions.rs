//! Operations over one axis: means, sums, extremes, parts and products with a constant matrix.

use serde_json::Value;

use super::Import;
use super::values::axis_of;
use crate::import::keras::config::{Layer, Operand};
use crate::{Convolution, Dense, NetworkError, Op, Pool, PoolKind, Window};

/// Operations over one axis.
pub(super) const REDUCTIONS: &[&str] = &["Mean", "Sum", "Max", "Amax", "Min", "Amin", "Average"];

/// The smallest window.
const SINGLE: Window = Window {
    size: [1; 2],
    stride: [1; 2],
    dilation: [1; 2],
    before: [0; 2],
    after: [0; 2],
};

impl Import<'_> {
    /// The axis of an operation, after the batch.
    fn one_axis(&self, layer: &Layer<'_>, x: usize) -> Result<usize, NetworkError> {
        let axis = &layer.config["axis"];
        let single = match axis.as_array().map(Vec::as_slice) {
            Some([one]) => one,
            _ => axis,
        };
        if single.as_i64().is_none() {
            let what = format!("{} over the axes {axis}", layer.class);
            return Err(NetworkError::unsupported(
                &layer.name,
                what,
                "one axis works",
            ));
        }
        let place = axis_of(&layer.name, single, self.network.nodes[x].shape.len())?;
        if place == 0 {
            self.refuse_sequence(layer, x)?;
        }
        Ok(place)
    }

    /// The mean, sum, largest or smallest along one axis.
    pub(super) fn reduced(&mut self, layer: &Layer<'_>, x: usize) -> Result<usize, NetworkError> {
        let name = layer.name.as_str();
        let axis = self.one_axis(layer, x)?;
        let keep = layer.config["keepdims"].as_bool() == Some(true);
        let smallest = ["Min", "Amin"].contains(&layer.class);
        let largest = ["Max", "Amax"].contains(&layer.class);
        let mut shape = self.network.nodes[x].shape.clone();
        let length = shape[axis];
        let order: Vec<usize> = [axis]
            .into_iter()
            .chain((0..shape.len()).filter(|&other| other != axis))
            .collect();
        let network = &mut self.network;
        let x = if smallest {
            network.scaled(name, x, -1.0, 0.0)?
        } else {
            x
        };
        let x = network.append(name, Op::Permute(order), &[x])?;
        let kept = network.nodes[x].len() / length;
        let x = network.reshaped(name, x, &[length, kept])?;
        let window = Window {
            size: [1, length],
            ..SINGLE
        };
        let kind = if smallest || largest {
            PoolKind::Max
        } else {
            PoolKind::Average
        };
        let x = network.append(name, Op::Pool(Pool { window, kind }), &[x])?;
        let x = match layer.class {
            "Sum" => network.scaled(name, x, length as f32, 0.0)?,
            _ if smallest => network.scaled(name, x, -1.0, 0.0)?,
            _ => x,
        };
        if keep {
            shape[axis] = 1;
        } else {
            shape.remove(axis);
        }
        let shape = if shape.is_empty() { vec![1] } else { shape };
        network.reshaped(name, x, &shape)
    }

    /// The parts of an axis, one after another.
    pub(super) fn split(
        &mut self,
        layer: &Layer<'_>,
        from: &[usize],
    ) -> Result<Vec<usize>, NetworkError> {
        let name = &layer.name;
        let x = from[0];
        let axis = self.one_axis(layer, x)?;
        let length = self.network.nodes[x].shape[axis];
        let parts = &layer.config["indices_or_sections"];
        let wrong = || {
            let message = format!("it splits an axis of {length} at {parts}");
            NetworkError::malformed(name, message)
        };
        let place = |value: &Value| {
            let place = value.as_u64().and_then(|n| usize::try_from(n).ok());
            place.filter(|&place| place <= length).ok_or_else(wrong)
        };
        let mut bounds: Vec<usize> = match parts {
            Value::Array(list) => list.iter().map(place).collect::<Result<_, _>>()?,
            one => {
                let count = place(one)?;
                if count == 0 || !length.is_multiple_of(count) {
                    return Err(wrong());
                }
                (1..count).map(|i| i * length / count).collect()
            }
        };
        bounds.push(length);
        let mut start = 0;
        let mut found = Vec::new();
        for end in bounds {
            if end <= start {
                return Err(wrong());
            }
            let indices: Vec<usize> = (start..end).collect();
            found.push(self.network.along(name, x, axis, &indices)?);
            start = end;
        }
        Ok(found)
    }

    /// `x W` over the last axis, with a constant matrix.
    pub(super) fn product(&mut self, layer: &Layer<'_>, x: usize) -> Result<usize, NetworkError> {
        let name = layer.name.as_str();
        let [Operand::Layer(_), Operand::Constant(shape, values)] = layer.operands.as_slice()
        else {
            let what = format!("{} of these operands", layer.class);
            let nearest = "a value and a constant matrix after it work; of two values the nearest \
                           is GRU";
            return Err(NetworkError::unsupported(name, what, nearest));
        };
        let inputs = self.network.nodes[x].shape.last().copied().unwrap_or(0);
        let &[rows, outputs] = shape.as_slice() else {
            let what = format!("{} with a constant of shape {shape:?}", layer.class);
            return Err(NetworkError::unsupported(name, what, "a matrix works"));
        };
        if rows != inputs {
            let message = format!("a matrix of {rows} rows for {inputs} features");
            return Err(NetworkError::malformed(name, message));
        }
        let weights: Vec<f32> = (0..outputs)
            .flat_map(|column| (0..rows).map(move |row| values[row * outputs + column]))
            .collect();
        let bias = vec![0.0; outputs];
        if self.network.nodes[x].shape.len() == 1 {
            let dense = Op::Dense(Dense { weights, bias });
            return self.network.append(name, dense, &[x]);
        }
        let op = Op::Convolution(Convolution {
            window: SINGLE,
            weights,
            bias,
        });
        self.network.append(name, op, &[x])
    }
}

//! Normalisation of runs and groups of values.

use super::axes::{axis_of, broadcast};
use super::{Import, Node, Value};
use crate::import::composite::Length;
use crate::import::shapes::spread_places;
use crate::import::tensor::Tensor;
use crate::{NetworkError, Op};

impl Import<'_> {
    /// Each run of values, from an axis to the last, by its own mean and variance or by its length;
    /// then a gain and an offset.
    pub(super) fn layer_norm(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        node.expect_int("stash_type", 1, "use stash_type = 1")?;
        let value = self.value(node, 0)?;
        let dims = value.dims();
        let axis = axis_of(node, node.int("axis", -1), dims.len())?;
        let epsilon = node.float("epsilon", 1e-5);
        let run: usize = dims[axis..].iter().product();
        let of_run = |input: usize| -> Result<Option<Vec<f32>>, NetworkError> {
            let Some(tensor) = self.weights(node, input)? else {
                return Ok(None);
            };
            let all = broadcast(node, &dims[axis..], &tensor.shape)?;
            if all != dims[axis..] {
                let what = format!("a scale of shape {:?} beside {dims:?}", tensor.shape);
                return Err(node.unsupported(what, "a number for each normalised value works"));
            }
            let places = spread_places(&tensor.shape, &dims[axis..]);
            Ok(Some(
                places
                    .into_iter()
                    .map(|place| tensor.values[place])
                    .collect(),
            ))
        };
        let by_length = node.proto.op_type == "RMSNormalization";
        let gain = of_run(1)?.unwrap_or_else(|| vec![1.0; run]);
        let offset = if by_length { None } else { of_run(2)? };
        let offset = offset.unwrap_or_else(|| vec![0.0; run]);
        let value = self.flat(node, value)?;
        let place = self.rows(node, value.place, value.len(), run)?;
        let place = if by_length {
            let length = Length::Mean(epsilon);
            self.network.by_length(&node.name, place, run, length)?
        } else {
            self.push(node, Op::Normalise { epsilon }, place)?
        };
        let place = self.network.by_channel(&node.name, place, gain, offset)?;
        Ok(vec![Value { place, ..value }])
    }

    /// Each group of channels, all its places together, by its own mean and variance; then a gain
    /// and an offset for each channel, or before opset 21 for each group. One channel a group is an
    /// InstanceNormalization.
    pub(super) fn group_norm(&mut self, node: &Node<'_>) -> Result<Vec<Value>, NetworkError> {
        let value = self.value(node, 0)?;
        let dims = value.dims();
        let single = node.proto.op_type == "InstanceNormalization";
        let channels = dims.get(1).copied().unwrap_or(0);
        if !single {
            node.expect_int("stash_type", 1, "use stash_type = 1")?;
        }
        let groups = if single {
            channels
        } else {
            usize::try_from(node.int("num_groups", 0)).unwrap_or(0)
        };
        if groups == 0 || !channels.is_multiple_of(groups) || dims.first() != Some(&1) {
            let message = format!("{groups} groups of the channels of {dims:?}");
            return Err(node.malformed(message));
        }
        let epsilon = node.float("epsilon", 1e-5);
        let each = |tensor: &Tensor| -> Result<Vec<f32>, NetworkError> {
            let count = tensor.values.len();
            if ![groups, channels].contains(&count) {
                let message = format!("a scale of shape {:?} for {dims:?}", tensor.shape);
                return Err(node.malformed(message));
            }
            let times = channels / count;
            let repeated = tensor.values.iter().flat_map(|&value| vec![value; times]);
            Ok(repeated.collect())
        };
        let gain = each(self.needed(node, 1)?)?;
        let offset = each(self.needed(node, 2)?)?;
        let value = self.as_written(node, value)?;
        let place = self.rows(node, value.place, value.len(), value.len() / groups)?;
        let place = self.push(node, Op::Normalise { epsilon }, place)?;
        let normal = Value { place, ..value };
        let shape = [vec![channels], vec![1; dims.len() - 2]].concat();
        let scale = Tensor::new(&node.name, shape, gain.clone())?;
        let (normal, gain) = self.channelled(node, normal, &scale)?;
        let scale = Tensor::new(&node.name, scale.shape, offset)?;
        let (normal, offset) = self.channelled(node, normal, &scale)?;
        if gain.len() != offset.len() {
            let (gain, offset) = (gain.len(), offset.len());
            return Err(node.malformed(format!("{gain} gains and {offset} offsets")));
        }
        let place = self.push(node, Op::Scale { gain, offset }, normal.place)?;
        Ok(vec![Value { place, ..normal }])
    }
}

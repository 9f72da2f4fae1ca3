//! Operators that move values, or take some of them: slices, splits, stacks, other orders of axes.

use super::file::Operator;
use super::{Import, held, product, tensor};
use crate::import::shapes::{self, places_along, slice_indices, transposed_places};
use crate::limits::MAX_LENGTH;
use crate::{NetworkError, Op};

impl Import<'_> {
    /// True if an operator was one of these, which are then done. One that reads no value computes
    /// the shape of a reshape, which its result has.
    ///
    /// # Errors
    /// [`NetworkError`].
    pub(super) fn place(
        &mut self,
        operator: &Operator<'_>,
        name: &str,
    ) -> Result<bool, NetworkError> {
        // SPLIT has its value second.
        let data = usize::from(operator.code == 49);
        let value = operator.inputs.get(data).copied().unwrap_or(-1);
        let known =
            [36, 39, 45, 49, 65, 69, 77, 81, 83, 88, 102, 105, 130].contains(&operator.code);
        let is_value = operator
            .inputs
            .iter()
            .any(|index| self.places.contains_key(index));
        let of_shapes = (operator.inputs.iter()).any(|index| self.shapes.contains(index));
        if operator.code == 77 || !is_value && (of_shapes || known) {
            self.shapes.extend(&operator.outputs);
            return Ok(true);
        }
        if !known || operator.code == 81 {
            return Ok(false);
        }
        if operator.code == 83 {
            self.stack(operator, name)?;
            return Ok(true);
        }
        let x = self.value(operator, data, name)?;
        let dims = tensor(self.model, value)?.shape.clone();
        let length = self.network.nodes[x].len();
        if product(&dims) != length {
            return Err(NetworkError::malformed(
                name,
                format!("{length} values of shape {dims:?}"),
            ));
        }
        for (&output, places) in operator
            .outputs
            .iter()
            .zip(self.taken(operator, name, &dims)?)
        {
            let shape = held(&tensor(self.model, output)?.shape, places.len());
            let own = self.free_name(&tensor(self.model, output)?.name);
            let is_all = places.len() == length && places.is_sorted();
            let chosen = if is_all {
                x
            } else {
                let op = shapes::selection(&places, vec![places.len()]);
                let inner = self.free_name(&format!("{own} choice"));
                self.network.push(&inner, op, vec![x])?
            };
            let place = self.network.push(&own, Op::Reshape(shape), vec![chosen])?;
            self.places.insert(output, place);
        }
        Ok(true)
    }

    /// Integers at an input.
    pub(super) fn integers(
        &self,
        operator: &Operator<'_>,
        input: usize,
        name: &str,
    ) -> Result<Vec<i64>, NetworkError> {
        let index = operator.inputs.get(input).copied().unwrap_or(-1);
        let list = &tensor(self.model, index)?.integers;
        if list.is_empty() {
            return Err(NetworkError::unsupported(
                name,
                "an index or axis that is computed",
                "use constants",
            ));
        }
        Ok(list.clone())
    }

    /// For each output the places, in what is read, of its values.
    fn taken(
        &self,
        operator: &Operator<'_>,
        name: &str,
        dims: &[usize],
    ) -> Result<Vec<Vec<usize>>, NetworkError> {
        let option = |id: usize| option(operator, id);
        Ok(match operator.code {
            36 => vec![self.gather(operator, name, dims)?],
            39 => vec![self.transpose(operator, name, dims)?],
            45 => vec![self.strided_slice(operator, name, dims)?],
            65 => vec![self.slice(operator, name, dims)?],
            49 | 102 => self.split(operator, name, dims)?,
            69 | 130 => vec![self.repeat(operator, name, dims)?],
            88 => {
                let axis = axis_in(name, dims, option(1)?.into())?;
                (0..dims[axis])
                    .map(|index| places_along(dims, axis, &[index]))
                    .collect()
            }
            _ => {
                let axes = self.integers(operator, 1, name)?;
                let mut lists: Vec<Vec<usize>> = dims.iter().map(|&n| (0..n).collect()).collect();
                for axis in axes {
                    lists[axis_in(name, dims, axis)?].reverse();
                }
                vec![along_all(dims, &lists)]
            }
        })
    }

    /// Places of the values at constant indices along one axis (GATHER).
    fn gather(
        &self,
        operator: &Operator<'_>,
        name: &str,
        dims: &[usize],
    ) -> Result<Vec<usize>, NetworkError> {
        let axis = axis_in(name, dims, option(operator, 0)?.into())?;
        if option(operator, 1)? != 0 {
            return Err(NetworkError::unsupported(
                name,
                "GATHER in batches",
                "use batch_dims = 0",
            ));
        }
        let indices = self.integers(operator, 1, name)?;
        let indices = indices
            .iter()
            .map(|&index| index_in(name, dims, axis, index))
            .collect::<Result<Vec<_>, _>>()?;
        Ok(places_along(dims, axis, &indices))
    }

    /// Places of the values with the axes in another order (TRANSPOSE).
    fn transpose(
        &self,
        operator: &Operator<'_>,
        name: &str,
        dims: &[usize],
    ) -> Result<Vec<usize>, NetworkError> {
        let order = self.integers(operator, 1, name)?;
        let order: Vec<usize> = order
            .iter()
            .map(|&axis| axis_in(name, dims, axis))
            .collect::<Result<_, _>>()?;
        let mut sorted = order.clone();
        sorted.sort_unstable();
        if sorted != (0..dims.len()).collect::<Vec<_>>() {
            return Err(misfit(name, dims));
        }
        Ok(transposed_places(dims, &order))
    }

    /// Places of a range with a step along each axis (STRIDED_SLICE). Bits of its masks open a
    /// bound or take a single index.
    fn strided_slice(
        &self,
        operator: &Operator<'_>,
        name: &str,
        dims: &[usize],
    ) -> Result<Vec<usize>, NetworkError> {
        let lists = [1, 2, 3].map(|input| self.integers(operator, input, name));
        let [starts, ends, steps] = lists;
        let (starts, ends, steps) = (starts?, ends?, steps?);
        let mask = |id: usize| option(operator, id);
        if mask(2)? != 0 || mask(3)? != 0 || starts.len() > dims.len() {
            return Err(NetworkError::unsupported(
                name,
                "a slice with an ellipsis or a new axis",
                "write the slice out for every axis",
            ));
        }
        let (from_start, to_end, single) = (mask(0)?, mask(1)?, mask(4)?);
        let mut lists = Vec::new();
        for axis in 0..starts.len() {
            let has = |mask: i32| mask >> axis & 1 == 1;
            let step = steps.get(axis).copied().unwrap_or(1);
            if has(single) {
                lists.push(vec![index_in(name, dims, axis, starts[axis])?]);
                continue;
            }
            let open = if step > 0 {
                [0, i64::MAX]
            } else {
                [i64::MAX, i64::MIN]
            };
            let start = if has(from_start) {
                open[0]
            } else {
                starts[axis]
            };
            let end = if has(to_end) {
                open[1]
            } else {
                ends.get(axis).copied().unwrap_or(0)
            };
            lists.push(slice_indices(dims[axis], start, end, step));
        }
        Ok(along_all(dims, &lists))
    }

    /// Places of a start and a size along each axis (SLICE); a negative size reaches to the end.
    fn slice(
        &self,
        operator: &Operator<'_>,
        name: &str,
        dims: &[usize],
    ) -> Result<Vec<usize>, NetworkError> {
        let (starts, sizes) = (
            self.integers(operator, 1, name)?,
            self.integers(operator, 2, name)?,
        );
        if starts.len() != dims.len() || sizes.len() != dims.len() {
            return Err(misfit(name, dims));
        }
        let mut lists = Vec::new();
        for axis in 0..dims.len() {
            let start = index_in(name, dims, axis, starts[axis])?;
            let size = usize::try_from(sizes[axis]).unwrap_or(dims[axis] - start);
            if start.saturating_add(size) > dims[axis] {
                return Err(misfit(name, dims));
            }
            lists.push((start..start + size).collect());
        }
        Ok(along_all(dims, &lists))
    }

    /// For each output the places of its part of one axis (SPLIT, SPLIT_V).
    fn split(
        &self,
        operator: &Operator<'_>,
        name: &str,
        dims: &[usize],
    ) -> Result<Vec<Vec<usize>>, NetworkError> {
        let axis = self.integers(operator, if operator.code == 49 { 0 } else { 2 }, name)?;
        let axis = axis_in(name, dims, axis[0])?;
        let count = operator.outputs.len().max(1);
        let sizes = if operator.code == 49 {
            vec![(dims[axis] / count) as i64; count]
        } else {
            self.integers(operator, 1, name)?
        };
        let known: i64 = sizes.iter().filter(|&&n| n > 0).sum();
        let mut start = 0;
        let mut found = Vec::new();
        for size in sizes {
            let size = if size < 0 {
                dims[axis] as i64 - known
            } else {
                size
            };
            let size = usize::try_from(size).map_err(|_| misfit(name, dims))?;
            if start + size > dims[axis] {
                return Err(misfit(name, dims));
            }
            found.push(places_along(
                dims,
                axis,
                &(start..start + size).collect::<Vec<_>>(),
            ));
            start += size;
        }
        if start != dims[axis] {
            return Err(misfit(name, dims));
        }
        Ok(found)
    }

    /// Places of values repeated along each axis (TILE), or broadcast to a shape (BROADCAST_TO).
    fn repeat(
        &self,
        operator: &Operator<'_>,
        name: &str,
        dims: &[usize],
    ) -> Result<Vec<usize>, NetworkError> {
        let list = self.integers(operator, 1, name)?;
        let tile = operator.code == 69;
        let lead = if tile {
            0
        } else {
            list.len().saturating_sub(dims.len())
        };
        if list.len() != dims.len() + lead {
            return Err(misfit(name, dims));
        }
        let own = [vec![1; lead], dims.to_vec()].concat();
        let mut lists: Vec<Vec<usize>> = Vec::new();
        let mut count = 1_usize;
        for (&length, &n) in own.iter().zip(&list) {
            let n = usize::try_from(n).map_err(|_| misfit(name, dims))?;
            if !tile && length != 1 && length != n || n > MAX_LENGTH {
                return Err(misfit(name, dims));
            }
            let all = if tile { length.saturating_mul(n) } else { n };
            count = count.saturating_mul(all);
            if count > MAX_LENGTH {
                let message = format!("{dims:?} repeated by {list:?}");
                return Err(NetworkError::too_large(name, message));
            }
            lists.push((0..all).map(|i| i % length).collect());
        }
        Ok(along_all(&own, &lists))
    }

    /// Values on top of each other along a new axis.
    fn stack(&mut self, operator: &Operator<'_>, name: &str) -> Result<(), NetworkError> {
        let from = (0..operator.inputs.len()).map(|input| self.value(operator, input, name));
        let from = from.collect::<Result<Vec<_>, _>>()?;
        let dims = tensor(self.model, operator.inputs[0])?.shape.clone();
        let axis = operator
            .options
            .map_or(Ok(0), |options| options.int(1, 0))?;
        let axis = if axis < 0 {
            axis + dims.len() as i32 + 1
        } else {
            axis
        };
        let axis = usize::try_from(axis).unwrap_or(usize::MAX).min(dims.len());
        let (outer, run): (usize, usize) = (product(&dims[..axis]), product(&dims[axis..]));
        let mut parts = Vec::new();
        for x in from {
            let shape = if outer == 1 {
                vec![run]
            } else {
                vec![outer, run]
            };
            let part = self.free_name(&format!("{name} part"));
            parts.push(self.network.push(&part, Op::Reshape(shape), vec![x])?);
        }
        let inner = self.free_name(&format!("{name} side by side"));
        let place = self
            .network
            .push(&inner, Op::Concatenate(usize::from(outer != 1)), parts)?;
        let output = operator.outputs[0];
        let shape = held(
            &tensor(self.model, output)?.shape,
            self.network.nodes[place].len(),
        );
        let place = self.network.push(name, Op::Reshape(shape), vec![place])?;
        self.places.insert(output, place);
        Ok(())
    }

    pub(super) fn concatenate(
        &mut self,
        operator: &Operator<'_>,
        name: &str,
        axis: i32,
    ) -> Result<usize, NetworkError> {
        let from = (0..operator.inputs.len()).map(|input| self.value(operator, input, name));
        let from = from.collect::<Result<Vec<_>, _>>()?;
        let info = tensor(self.model, operator.inputs.first().copied().unwrap_or(-1))?;
        let axes = info.shape.len() as i32;
        let axis = if axis < 0 { axis + axes } else { axis };
        // The shape here is that of the file, mostly without the batch.
        let held = from
            .first()
            .map_or(0, |&x| self.network.nodes[x].shape.len() as i32);
        let place = axis - (axes - held);
        let known = (axes - held == 1 && info.shape.first() == Some(&1)) || axes == held;
        if !known || !(0..held).contains(&place) {
            return Err(NetworkError::unsupported(
                name,
                format!("a concatenation of {:?} along axis {axis}", info.shape),
                "concatenate along an axis after the batch",
            ));
        }
        self.network
            .push(name, Op::Concatenate(place as usize), from)
    }
}

/// Places of the values at the given indices of every axis, all indices where there are none for an
/// axis.
fn along_all(dims: &[usize], lists: &[Vec<usize>]) -> Vec<usize> {
    let mut places = vec![0];
    for (axis, &length) in dims.iter().enumerate() {
        let all: Vec<usize> = (0..length).collect();
        let list = lists.get(axis).unwrap_or(&all);
        let stride: usize = dims[axis + 1..].iter().product();
        places = places
            .iter()
            .flat_map(|&place| list.iter().map(move |&i| place + i * stride))
            .collect();
    }
    places
}

/// An integer among an operator's options; 0 where it has none.
fn option(operator: &Operator<'_>, id: usize) -> Result<i32, NetworkError> {
    operator.options.map_or(Ok(0), |options| options.int(id, 0))
}

fn misfit(name: &str, dims: &[usize]) -> NetworkError {
    NetworkError::malformed(name, format!("its indices do not fit {dims:?}"))
}

/// An axis of `dims`; a negative one counts from the last.
fn axis_in(name: &str, dims: &[usize], axis: i64) -> Result<usize, NetworkError> {
    from_either_end(axis, dims.len()).ok_or_else(|| {
        let axis = if axis < 0 {
            axis + dims.len() as i64
        } else {
            axis
        };
        NetworkError::malformed(name, format!("axis {axis} of {dims:?}"))
    })
}

/// An index along one axis of `dims`; a negative one counts from the last.
fn index_in(name: &str, dims: &[usize], axis: usize, index: i64) -> Result<usize, NetworkError> {
    from_either_end(index, dims[axis]).ok_or_else(|| misfit(name, dims))
}

fn from_either_end(index: i64, length: usize) -> Option<usize> {
    let index = if index < 0 {
        index + length as i64
    } else {
        index
    };
    usize::try_from(index).ok().filter(|&index| index < length)
}

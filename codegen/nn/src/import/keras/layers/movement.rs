//! Layers and operations that move values, or take some of them: slices, padding, other shapes.

use serde_json::Value;

use super::Import;
use super::values::{axis_of, pair};
use crate::import::keras::config::Layer;
use crate::import::shapes::{self, places_along, slice_indices};
use crate::{NetworkError, Op};

/// Part of an index: a slice, one place, or a new axis.
enum Part {
    Slice(Option<i64>, Option<i64>, i64),
    Place(i64),
    New,
}

fn part(name: &str, value: &Value) -> Result<Part, NetworkError> {
    let wrong = || {
        let nearest = "slices of constants, integers, None and ... work";
        NetworkError::unsupported(name, format!("the index {value}"), nearest)
    };
    if value.is_null() {
        return Ok(Part::New);
    }
    if let Some(place) = value.as_i64() {
        return Ok(Part::Place(place));
    }
    if value["class_name"].as_str() != Some("__slice__") {
        return Err(wrong());
    }
    let bound = |key: &str| match &value["config"][key] {
        Value::Null => Ok(None),
        bound => bound.as_i64().map(Some).ok_or_else(wrong),
    };
    let step = bound("step")?.unwrap_or(1);
    if step == 0 {
        return Err(NetworkError::malformed(name, "a slice with a step of 0"));
    }
    Ok(Part::Slice(bound("start")?, bound("stop")?, step))
}

impl Import<'_> {
    /// `x[key]`: slices and places of axes, the batch's whole.
    pub(super) fn get_item(&mut self, layer: &Layer<'_>, x: usize) -> Result<usize, NetworkError> {
        let name = &layer.name;
        let single = [layer.key.clone()];
        let list = layer.key.as_array().map_or(&single[..], Vec::as_slice);
        let is_rest = |value: &Value| value["class_name"].as_str() == Some("__ellipsis__");
        let axes = self.network.nodes[x].shape.len() + 1;
        let named = list.iter().filter(|v| !v.is_null() && !is_rest(v)).count();
        let rest = list.iter().filter(|value| is_rest(value)).count();
        if named > axes || rest > 1 {
            let message = format!("{named} indices of {axes} axes");
            return Err(NetworkError::malformed(name, message));
        }
        let mut parts = Vec::new();
        for value in list {
            if is_rest(value) {
                parts.extend((0..axes - named).map(|_| Part::Slice(None, None, 1)));
            } else {
                parts.push(part(name, value)?);
            }
        }
        let Some(Part::Slice(None, None, 1)) = parts.first() else {
            return Err(NetworkError::unsupported(
                name,
                "a choice along the batch",
                "begin the index with a colon, x[:, ...]",
            ));
        };
        // The last step is there in each call, others are not.
        let steps = !matches!(
            parts.get(1),
            None | Some(Part::Place(-1) | Part::Slice(None, None, 1))
        );
        if steps {
            self.refuse_sequence(layer, x)?;
        }
        let mut shape = self.network.nodes[x].shape.clone();
        let mut places: Vec<usize> = (0..self.network.nodes[x].len()).collect();
        // Axes that are gone stay as axes of length 1 until the end.
        let (mut kept, mut axis) = (Vec::new(), 0);
        for part in &parts[1..] {
            let indices = match *part {
                Part::New => {
                    kept.push(1);
                    continue;
                }
                Part::Place(place) => {
                    let length = shape[axis] as i64;
                    let at = if place < 0 { place + length } else { place };
                    let at = usize::try_from(at).ok().filter(|&at| at < shape[axis]);
                    let wrong = || {
                        let message = format!("index {place} of an axis of {length}");
                        NetworkError::malformed(name, message)
                    };
                    vec![at.ok_or_else(wrong)?]
                }
                Part::Slice(start, stop, step) => {
                    let (first, last) = if step > 0 {
                        (0, i64::MAX)
                    } else {
                        (-1, i64::MIN / 2)
                    };
                    let indices = slice_indices(
                        shape[axis],
                        start.unwrap_or(first),
                        stop.unwrap_or(last),
                        step,
                    );
                    kept.push(indices.len());
                    indices
                }
            };
            if indices.is_empty() {
                let message = format!("it takes nothing of {shape:?}");
                return Err(NetworkError::malformed(name, message));
            }
            let along = places_along(&shape, axis, &indices);
            places = along.into_iter().map(|place| places[place]).collect();
            shape[axis] = indices.len();
            axis += 1;
        }
        kept.extend(&shape[axis..]);
        if kept.is_empty() {
            kept.push(1);
        }
        self.push(name, shapes::selection(&places, kept), x)
    }

    /// With one step a call, nothing is taken of a sequence along its steps.
    pub(super) fn refuse_sequence(&self, layer: &Layer<'_>, x: usize) -> Result<(), NetworkError> {
        if self.streaming && self.network.nodes[x].shape.len() == 2 {
            return Err(NetworkError::unsupported(
                &layer.name,
                format!("{} over a sequence of open length", layer.class),
                "give the model a fixed number of steps, Input((steps, features))",
            ));
        }
        Ok(())
    }

    /// A softmax or its logarithm, `op`, over one axis, which goes last and comes back.
    pub(super) fn softmax(
        &mut self,
        layer: &Layer<'_>,
        op: Op,
        x: usize,
    ) -> Result<usize, NetworkError> {
        let (name, axis) = (&layer.name, &layer.config["axis"]);
        let axis = match axis.as_array().map(Vec::as_slice) {
            Some([one]) => one,
            Some([]) => &Value::Null,
            _ => axis,
        };
        let axes = self.network.nodes[x].shape.len();
        if axis.is_null() {
            return self.push(name, op, x);
        }
        if axis.as_i64().is_none() {
            let what = format!("a softmax over the axes {axis}");
            return Err(NetworkError::unsupported(name, what, "one axis works"));
        }
        let axis = axis_of(name, axis, axes)?;
        if axis + 1 == axes {
            return self.push(name, op, x);
        }
        self.refuse_sequence(layer, x)?;
        let order: Vec<usize> = (0..axes).filter(|&a| a != axis).chain([axis]).collect();
        let mut back: Vec<usize> = (0..axes - 1).collect();
        back.insert(axis, axes - 1);
        let turned = self.network.append(name, Op::Permute(order), &[x])?;
        let softmax = self.network.append(name, op, &[turned])?;
        self.network.append(name, Op::Permute(back), &[softmax])
    }

    /// Zeros around rows and columns, or rows and columns cut off.
    pub(super) fn padded(&mut self, layer: &Layer<'_>, x: usize) -> Result<usize, NetworkError> {
        let (name, config) = (&layer.name, &layer.config);
        let crops = layer.class.starts_with("Cropping");
        let one = layer.class.ends_with("1D");
        let value = &config[if crops { "cropping" } else { "padding" }];
        let wrong = || {
            let message = format!("{} of {value}", layer.class);
            NetworkError::malformed(name, message)
        };
        let two = |value: &Value| -> Result<[i64; 2], NetworkError> {
            let number = |value: &Value| value.as_i64().filter(|&n| n >= 0).ok_or_else(wrong);
            match value.as_array().map(Vec::as_slice) {
                None => Ok([number(value)?; 2]),
                Some([before, after]) => Ok([number(before)?, number(after)?]),
                Some(_) => Err(wrong()),
            }
        };
        let mut pads = if one {
            vec![two(value)?]
        } else {
            match value.as_array().map(Vec::as_slice) {
                Some([rows, columns]) => vec![two(rows)?, two(columns)?],
                None => vec![two(value)?; 2],
                Some(_) => return Err(wrong()),
            }
        };
        if pads.len() + 1 != self.network.nodes[x].shape.len() {
            let message = format!("{} of {:?}", layer.class, self.network.nodes[x].shape);
            return Err(NetworkError::malformed(name, message));
        }
        if crops {
            for pad in pads.iter_mut().flatten() {
                *pad = -*pad;
            }
        }
        pads.push([0; 2]);
        self.network.padded(name, x, &pads)
    }

    /// Each row and column several times.
    pub(super) fn enlarged(&mut self, layer: &Layer<'_>, x: usize) -> Result<usize, NetworkError> {
        let (name, config) = (&layer.name, &layer.config);
        let way = config["interpolation"].as_str().unwrap_or("nearest");
        if way != "nearest" {
            let what = format!("an UpSampling2D by {way} interpolation");
            return Err(NetworkError::unsupported(
                name,
                what,
                "use interpolation='nearest'",
            ));
        }
        let one = layer.class.ends_with("1D");
        let [rows, columns] = pair(&config["size"], one, 2);
        let times = if one {
            vec![columns]
        } else {
            vec![rows, columns]
        };
        if times.len() + 1 != self.network.nodes[x].shape.len() {
            let message = format!("{} of {:?}", layer.class, self.network.nodes[x].shape);
            return Err(NetworkError::malformed(name, message));
        }
        let mut place = x;
        for (axis, &times) in times.iter().enumerate() {
            let length = self.network.nodes[place].shape[axis];
            if length.saturating_mul(times) > crate::limits::MAX_LENGTH {
                let message = format!("an axis of {length} taken {times} times");
                return Err(NetworkError::too_large(name, message));
            }
            let indices: Vec<usize> = (0..length * times).map(|i| i / times).collect();
            place = self.network.along(name, place, axis, &indices)?;
        }
        Ok(place)
    }

    /// A vector as each step of a sequence.
    pub(super) fn repeated(&mut self, layer: &Layer<'_>, x: usize) -> Result<usize, NetworkError> {
        let name = &layer.name;
        let times = layer.config["n"].as_u64().unwrap_or(0) as usize;
        let &[length] = self.network.nodes[x].shape.as_slice() else {
            return Err(NetworkError::malformed(name, "a RepeatVector of no vector"));
        };
        let row = self.network.reshaped(name, x, &[1, length])?;
        if times.saturating_mul(length) > crate::limits::MAX_LENGTH {
            let message = format!("{length} values taken {times} times");
            return Err(NetworkError::too_large(name, message));
        }
        self.network.spread(name, row, &[times, length])
    }

    /// Operations on shapes: other axes, other orders, the same values.
    pub(super) fn moved(
        &mut self,
        layer: &Layer<'_>,
        from: &[usize],
    ) -> Result<Option<usize>, NetworkError> {
        let (name, config) = (&layer.name, &layer.config);
        let x = from[0];
        let shape = self.network.nodes[x].shape.clone();
        let moves = [
            "Reshape",
            "Transpose",
            "Swapaxes",
            "Flip",
            "ExpandDims",
            "Squeeze",
            "Concatenate",
        ];
        if moves.contains(&layer.class) {
            self.refuse_sequence(layer, x)?;
        }
        Ok(Some(match layer.class {
            "GetItem" => self.get_item(layer, x)?,
            "Concatenate" => {
                let axis = axis_of(name, &config["axis"], shape.len())?;
                self.network
                    .push(name, Op::Concatenate(axis), from.to_vec())?
            }
            "Reshape" => {
                let target = &config["newshape"];
                let target = target.as_array().map_or(&[][..], Vec::as_slice);
                let target: Vec<i64> = target.iter().filter_map(Value::as_i64).collect();
                let length = self.network.nodes[x].len();
                // The first axis is the batch's.
                let (Some(&batch), Some(inner)) = (target.first(), target.get(1..)) else {
                    return Err(NetworkError::malformed(name, "its shape has no axis"));
                };
                let open = shapes::open(name, inner, length);
                let shape = match open {
                    Ok(shape) if [-1, 1].contains(&batch) => shape,
                    _ => {
                        return Err(NetworkError::unsupported(
                            name,
                            format!("the shape {target:?} for {length} values"),
                            "leave the batch its axis, the first",
                        ));
                    }
                };
                let shape = if shape.is_empty() { vec![1] } else { shape };
                self.push(name, Op::Reshape(shape), x)?
            }
            "Transpose" => {
                let axes = config["axes"].as_array().map_or(&[][..], Vec::as_slice);
                let order: Vec<u64> = axes.iter().filter_map(Value::as_u64).collect();
                let Some((0, inner)) = order.split_first() else {
                    return Err(NetworkError::unsupported(
                        name,
                        format!("a transposition to {axes:?}"),
                        "name the axes, the batch's first",
                    ));
                };
                let inner = inner.iter().map(|&axis| (axis as usize).wrapping_sub(1));
                self.push(name, Op::Permute(inner.collect()), x)?
            }
            "Swapaxes" => {
                let axis = |key: &str| axis_of(name, &config[key], shape.len());
                let mut order: Vec<usize> = (0..shape.len()).collect();
                order.swap(axis("axis1")?, axis("axis2")?);
                self.push(name, Op::Permute(order), x)?
            }
            "Flip" => {
                let axis = &config["axis"];
                if axis.as_i64().is_none() {
                    let what = format!("a Flip of the axes {axis}");
                    return Err(NetworkError::unsupported(name, what, "one axis works"));
                }
                let axis = axis_of(name, axis, shape.len())?;
                let indices: Vec<usize> = (0..shape[axis]).rev().collect();
                self.network.along(name, x, axis, &indices)?
            }
            "ExpandDims" | "Squeeze" => {
                let axis = &config["axis"];
                let out = layer.class == "Squeeze";
                if axis.as_i64().is_none() {
                    let what = format!("{} of the axes {axis}", layer.class);
                    return Err(NetworkError::unsupported(name, what, "one axis works"));
                }
                let axis = axis_of(name, axis, shape.len() + usize::from(!out))?;
                let mut shape = shape;
                if !out {
                    shape.insert(axis, 1);
                } else if shape.remove(axis) != 1 {
                    let message = format!("it takes axis {} out", axis + 1);
                    return Err(NetworkError::malformed(name, message));
                }
                let shape = if shape.is_empty() { vec![1] } else { shape };
                self.push(name, Op::Reshape(shape), x)?
            }
            _ => return Ok(None),
        }))
    }
}

//! Arithmetic of constants: what exporters compute of shapes and weights is computed once, here. A
//! batch of 1 is part of every shape.

use super::axes::{
    axis_of, broadcast, gathered, lengths, reshape_target, slices, squeezed, transposition,
};
use super::constant::{Constant, Integers};
use super::constant_arithmetic::{binary, cast, of_numbers, unary};
use super::{Import, Node};
use crate::NetworkError;
use crate::import::shapes::{places_along, slice_indices, spread_places, transposed_places};
use crate::import::tensor::{self, Tensor};

impl Import<'_> {
    /// The constant that a node gives, where it reads nothing but constants and shapes.
    ///
    /// # Errors
    /// [`NetworkError`].
    pub(super) fn constant_of(&self, node: &Node<'_>) -> Result<Option<Constant>, NetworkError> {
        let op = node.proto.op_type.as_str();
        if op == "Constant" {
            return constant_node(node).map(Some);
        }
        let shape = node
            .input(0)
            .and_then(|name| match self.constants.get(name) {
                Some(constant) => Some(constant.shape().to_vec()),
                None => self.values.get(name).map(super::Value::dims),
            });
        match (op, shape) {
            ("Shape", Some(dims)) => return shape_of(node, &dims).map(Some),
            ("Size", Some(dims)) => {
                let size = dims.iter().product::<usize>() as i64;
                return Ok(Some(scalar(size)));
            }
            _ => {}
        }
        let mut inputs = Vec::new();
        for input in 0..node.proto.input.len() {
            let name = node.proto.input[input].as_str();
            match self.constants.get(name) {
                Some(constant) => inputs.push(Some(constant)),
                None if name.is_empty() => inputs.push(None),
                None => return Ok(None),
            }
        }
        if inputs.is_empty() && op != "Range" {
            return Ok(None);
        }
        evaluate(node, &inputs)
    }
}

fn scalar(value: i64) -> Constant {
    Constant::Integers(Integers {
        shape: Vec::new(),
        values: vec![value],
    })
}

fn constant_node(node: &Node<'_>) -> Result<Constant, NetworkError> {
    if let Some(tensor) = node.tensor("value") {
        return Constant::new(tensor);
    }
    let floats = |shape, values| Constant::Floats(Tensor { shape, values });
    if node.has("value_float") {
        return Ok(floats(Vec::new(), vec![node.float("value_float", 0.0)]));
    }
    if node.has("value_floats") {
        let values = node.floats("value_floats").to_vec();
        return Ok(floats(vec![values.len()], values));
    }
    if node.has("value_int") {
        return Ok(scalar(node.int("value_int", 0)));
    }
    match node.ints("value_ints") {
        Some(values) => Ok(Constant::Integers(Integers::list(values.to_vec()))),
        None => Err(node.unsupported("a Constant of this kind", "use a tensor")),
    }
}

/// Part of a shape, from `start` to `end`.
fn shape_of(node: &Node<'_>, dims: &[usize]) -> Result<Constant, NetworkError> {
    let count = dims.len() as i64;
    let bound = |n: i64| if n < 0 { n + count } else { n }.clamp(0, count) as usize;
    let (start, end) = (bound(node.int("start", 0)), bound(node.int("end", count)));
    let dims = dims.get(start..end.max(start)).unwrap_or(&[]);
    Ok(Constant::Integers(Integers::list(
        dims.iter().map(|&n| n as i64).collect(),
    )))
}

/// Numbers from the first bound, a step apart, before the second.
fn fractions(node: &Node<'_>, bounds: [&Tensor; 3]) -> Result<Constant, NetworkError> {
    let [Some(&from), Some(&to), Some(&step)] = bounds.map(|bound| bound.values.first()) else {
        return Err(node.malformed("its bounds are empty"));
    };
    let count = ((to - from) / step).ceil();
    if !count.is_finite() {
        return Err(node.malformed("its bounds are not finite, or its step is zero"));
    }
    let count = count.max(0.0) as usize;
    tensor::count(&node.name, &[count])?;
    let values = (0..count).map(|k| from + k as f32 * step).collect();
    let shape = vec![count];
    Ok(Constant::Floats(Tensor { shape, values }))
}

type Inputs<'c> = [Option<&'c Constant>];

/// The constant that an operator gives; none where it is no arithmetic of constants.
fn evaluate(node: &Node<'_>, inputs: &Inputs<'_>) -> Result<Option<Constant>, NetworkError> {
    let op = node.proto.op_type.as_str();
    let read = |input: usize| {
        node.input(input);
        inputs.get(input).copied().flatten()
    };
    let integers = |input: usize, attribute: &str| {
        let given = read(input).and_then(|constant| match constant {
            Constant::Integers(list) => Some(list.values.clone()),
            Constant::Floats(_) => None,
        });
        given.or_else(|| node.ints(attribute).map(<[i64]>::to_vec))
    };
    let Some(x) = read(0) else { return Ok(None) };
    let dims = x.shape().to_vec();
    let reshaped = |shape: Vec<usize>| -> Result<Option<Constant>, NetworkError> {
        if shape.iter().product::<usize>() != x.len() {
            return Err(node.malformed(format!("{dims:?} has not as many values as {shape:?}")));
        }
        let places: Vec<usize> = (0..x.len()).collect();
        Ok(Some(x.taken(shape, &places)))
    };
    match op {
        "Identity" => reshaped(dims.clone()),
        "Cast" => cast(node, x).map(Some),
        "Reshape" => {
            let target = integers(1, "shape").ok_or_else(|| node.malformed("it has no shape"))?;
            node.expect_int("allowzero", 0, "use allowzero = 0")?;
            reshaped(reshape_target(node, &target, &dims)?)
        }
        "Unsqueeze" | "Squeeze" => reshaped(squeezed(node, &dims, integers(1, "axes"))?),
        "Flatten" => {
            let axis = node.int("axis", 1);
            let axis = if axis == dims.len() as i64 {
                dims.len()
            } else {
                axis_of(node, axis, dims.len())?
            };
            reshaped(vec![
                dims[..axis].iter().product(),
                dims[axis..].iter().product(),
            ])
        }
        "Transpose" => transposed(node, x).map(Some),
        "Gather" => match read(1) {
            Some(Constant::Integers(indices)) => gather(node, x, indices).map(Some),
            _ => Ok(None),
        },
        "Slice" => {
            let names = ["starts", "ends", "axes", "steps"];
            let lists = [1, 2, 3, 4].map(|input| integers(input, names[input - 1]));
            Ok(Some(sliced(x, slices(node, lists, dims.len())?)))
        }
        "Concat" => {
            let parts: Option<Vec<&Constant>> = (0..inputs.len()).map(read).collect();
            let Some(parts) = parts else { return Ok(None) };
            concatenated(node, &parts).map(Some)
        }
        "ConstantOfShape" => match x {
            Constant::Integers(shape) => filled(node, shape).map(Some),
            Constant::Floats(_) => Ok(None),
        },
        "Expand" => {
            let target = integers(1, "").ok_or_else(|| node.malformed("it has no shape"))?;
            let shape = broadcast(node, &dims, &lengths(node, &target)?)?;
            tensor::count(&node.name, &shape)?;
            Ok(Some(x.taken(shape.clone(), &spread_places(&dims, &shape))))
        }
        "Range" => range(node, [Some(x), read(1), read(2)]),
        "Where" => match (x, read(1), read(2)) {
            (Constant::Integers(condition), Some(a), Some(b)) => {
                chosen(node, condition, [a, b]).map(Some)
            }
            _ => Ok(None),
        },
        "ReduceProd" | "ReduceSum" | "ReduceMax" | "ReduceMin" if x.len() > 0 => {
            let axes = integers(1, "axes");
            // Of a list, as shapes are.
            if dims.len() > 1 || axes.is_some_and(|axes| axes.len() > 1) {
                return Ok(None);
            }
            Ok(Some(reduced(node, x)))
        }
        "MatMul" => match (x, read(1)) {
            (Constant::Floats(a), Some(Constant::Floats(b))) => product(node, a, b),
            _ => Ok(None),
        },
        "DequantizeLinear" => {
            let (Constant::Integers(_), Some(Constant::Floats(scale))) = (x, read(1)) else {
                return Ok(None);
            };
            dequantised(node, x, scale, read(2)).map(Some)
        }
        _ => match read(1) {
            Some(other) if inputs.len() == 2 => binary(node, x, other),
            None if inputs.len() == 1 => unary(node, x),
            _ => Ok(None),
        },
    }
}

/// The axes of `x` in the order that a Transpose asks for.
fn transposed(node: &Node<'_>, x: &Constant) -> Result<Constant, NetworkError> {
    let dims = x.shape();
    let order = transposition(node, dims.len())?;
    let shape: Vec<usize> = order.iter().map(|&axis| dims[axis]).collect();
    Ok(x.taken(shape, &transposed_places(dims, &order)))
}

/// Values of `x` at indices along one axis (Gather).
fn gather(node: &Node<'_>, x: &Constant, indices: &Integers) -> Result<Constant, NetworkError> {
    let dims = x.shape();
    let axis = axis_of(node, node.int("axis", 0), dims.len())?;
    let list = gathered(node, &indices.values, dims[axis])?;
    let shape = [&dims[..axis], &indices.shape, &dims[axis + 1..]].concat();
    tensor::count(&node.name, &shape)?;
    Ok(x.taken(shape, &places_along(dims, axis, &list)))
}

/// Ranges of `x`: for each axis start, end and step.
fn sliced(x: &Constant, ranges: Vec<(usize, [i64; 3])>) -> Constant {
    let mut found = x.clone();
    for (axis, [start, end, step]) in ranges {
        let mut shape = found.shape().to_vec();
        let indices = slice_indices(shape[axis], start, end, step);
        let places = places_along(&shape, axis, &indices);
        shape[axis] = indices.len();
        found = found.taken(shape, &places);
    }
    found
}

/// One value in a given shape (ConstantOfShape); without the attribute it is 0.
fn filled(node: &Node<'_>, shape: &Integers) -> Result<Constant, NetworkError> {
    let shape = lengths(node, &shape.values)?;
    let count = tensor::count(&node.name, &shape)?;
    let value = node.tensor("value").map(Constant::new).transpose()?;
    let value = value.unwrap_or_else(|| {
        Constant::Floats(Tensor {
            shape: vec![1],
            values: vec![0.0],
        })
    });
    if value.len() != 1 {
        return Err(node.malformed("its value is no single number"));
    }
    Ok(value.taken(shape, &vec![0; count]))
}

/// Numbers between bounds of one kind: start, limit and step (Range).
fn range(
    node: &Node<'_>,
    bounds: [Option<&Constant>; 3],
) -> Result<Option<Constant>, NetworkError> {
    use Constant::{Floats, Integers as Whole};
    match bounds {
        [Some(Floats(a)), Some(Floats(b)), Some(Floats(c))] => fractions(node, [a, b, c]).map(Some),
        [Some(Whole(a)), Some(Whole(b)), Some(Whole(c))] => {
            whole_numbers(node, [a, b, c]).map(Some)
        }
        _ => Ok(None),
    }
}

/// Whole numbers from the first bound, a step apart, before the second; none at a step of 0.
fn whole_numbers(node: &Node<'_>, bounds: [&Integers; 3]) -> Result<Constant, NetworkError> {
    let [Some(&a), Some(&b), Some(&c)] = bounds.map(|bound| bound.values.first()) else {
        return Err(node.malformed("its bounds are empty"));
    };
    let count = if c == 0 {
        0
    } else {
        (i128::from(b) - i128::from(a)) / i128::from(c)
    };
    tensor::count(
        &node.name,
        &[usize::try_from(count.max(0)).unwrap_or(usize::MAX)],
    )?;
    let mut values = Vec::new();
    let mut at = a;
    while c != 0 && ((c > 0 && at < b) || (c < 0 && at > b)) {
        values.push(at);
        at = at.saturating_add(c);
    }
    Ok(Constant::Integers(Integers::list(values)))
}

/// Each value from the first of two constants where the condition holds, else from the second
/// (Where). All three are broadcast to one shape.
fn chosen(
    node: &Node<'_>,
    condition: &Integers,
    [a, b]: [&Constant; 2],
) -> Result<Constant, NetworkError> {
    let dims = &condition.shape[..];
    let shape = broadcast(node, &broadcast(node, dims, a.shape())?, b.shape())?;
    let count = tensor::count(&node.name, &shape)?;
    let [c, a_at, b_at] = [dims, a.shape(), b.shape()].map(|from| spread_places(from, &shape));
    let (left, right) = (a.numbers(), b.numbers());
    let values = (0..count)
        .map(|i| {
            if condition.values[c[i]] != 0 {
                left[a_at[i]]
            } else {
                right[b_at[i]]
            }
        })
        .collect();
    let whole = matches!((a, b), (Constant::Integers(_), Constant::Integers(_)));
    Ok(of_numbers(shape, values, whole))
}

/// Product, sum or extreme of a list.
fn reduced(node: &Node<'_>, x: &Constant) -> Constant {
    let numbers = x.numbers().into_iter();
    let value = match node.proto.op_type.as_str() {
        "ReduceProd" => numbers.product(),
        "ReduceSum" => numbers.sum(),
        "ReduceMax" => numbers.fold(f64::NEG_INFINITY, f64::max),
        _ => numbers.fold(f64::INFINITY, f64::min),
    };
    let shape = if node.int("keepdims", 1) != 0 {
        vec![1; x.shape().len()]
    } else {
        Vec::new()
    };
    of_numbers(shape, vec![value], matches!(x, Constant::Integers(_)))
}

/// The product of a constant and a constant matrix; none where the second is no matrix.
fn product(node: &Node<'_>, a: &Tensor, b: &Tensor) -> Result<Option<Constant>, NetworkError> {
    let (&[inner, columns], Some((&last, outer))) = (&b.shape[..], a.shape.split_last()) else {
        return Ok(None);
    };
    if last != inner || inner == 0 || columns == 0 {
        return Err(node.malformed(format!("a product of {:?} and {:?}", a.shape, b.shape)));
    }
    let shape = [outer, &[columns]].concat();
    tensor::count(&node.name, &shape)?;
    let mut values = Vec::new();
    for row in a.values.chunks(inner) {
        for column in 0..columns {
            let weights = b.values.iter().skip(column).step_by(columns);
            let terms = row.iter().zip(weights);
            let sum: f64 = terms.map(|(&a, &b)| f64::from(a) * f64::from(b)).sum();
            values.push(sum);
        }
    }
    Ok(Some(of_numbers(shape, values, false)))
}

fn concatenated(node: &Node<'_>, parts: &[&Constant]) -> Result<Constant, NetworkError> {
    let axes = parts.first().map_or(0, |part| part.shape().len());
    let axis = axis_of(node, node.int("axis", 0), axes)?;
    let mut shape = parts[0].shape().to_vec();
    for part in &parts[1..] {
        let other = part.shape();
        let alike = other.len() == axes && (0..axes).all(|i| i == axis || other[i] == shape[i]);
        if !alike {
            return Err(
                node.malformed(format!("{shape:?} and {other:?} differ beside axis {axis}"))
            );
        }
        shape[axis] += other[axis];
    }
    tensor::count(&node.name, &shape)?;
    let outer: usize = shape[..axis].iter().product();
    let whole = parts
        .iter()
        .all(|part| matches!(part, Constant::Integers(_)));
    let lists: Vec<Vec<f64>> = parts.iter().map(|part| part.numbers()).collect();
    let mut values = Vec::new();
    for run in 0..outer {
        for list in &lists {
            let length = list.len() / outer;
            values.extend_from_slice(&list[run * length..][..length]);
        }
    }
    Ok(of_numbers(shape, values, whole))
}

fn dequantised(
    node: &Node<'_>,
    x: &Constant,
    scale: &Tensor,
    zero: Option<&Constant>,
) -> Result<Constant, NetworkError> {
    let dims = x.shape();
    let axis = node.int("axis", 1);
    let per_axis = scale.values.len() != 1;
    let axis = if per_axis {
        axis_of(node, axis, dims.len())?
    } else {
        0
    };
    if per_axis && (scale.shape.len() != 1 || scale.values.len() != dims[axis]) {
        return Err(node.unsupported(
            "scales in blocks",
            "one scale for a tensor or an axis works",
        ));
    }
    let zero = zero.map_or_else(|| vec![0.0; scale.values.len()], Constant::numbers);
    if zero.len() != scale.values.len() {
        return Err(node.malformed("scales and zero points of different lengths"));
    }
    let inner: usize = dims.iter().skip(axis + 1).product();
    let at = |i: usize| if per_axis { i / inner % dims[axis] } else { 0 };
    let values = x.numbers();
    let values = values.iter().enumerate();
    let values = values
        .map(|(i, q)| (q - zero[at(i)]) * f64::from(scale.values[at(i)]))
        .collect();
    Ok(of_numbers(dims.to_vec(), values, false))
}

//! Functions of constants, number by number, in double precision.

use super::Node;
use super::axes::broadcast;
use super::constant::{BOOL, Constant, DOUBLE, FLOAT, FLOAT16, INT32, INT64, Integers, type_name};
use crate::NetworkError;
use crate::import::shapes::spread_places;
use crate::import::tensor::{self, Tensor};

/// A constant of these values: integers where `whole`, single precision otherwise.
pub(super) fn of_numbers(shape: Vec<usize>, values: Vec<f64>, whole: bool) -> Constant {
    if whole {
        let values = values.into_iter().map(|value| value as i64).collect();
        Constant::Integers(Integers { shape, values })
    } else {
        let values = values.into_iter().map(|value| value as f32).collect();
        Constant::Floats(Tensor { shape, values })
    }
}

/// The values as another type.
pub(super) fn cast(node: &Node<'_>, x: &Constant) -> Result<Constant, NetworkError> {
    let to = node.int("to", 0) as i32;
    let numbers = x.numbers();
    let shape = x.shape().to_vec();
    Ok(match to {
        FLOAT | DOUBLE => of_numbers(shape, numbers, false),
        INT32 | INT64 => of_numbers(shape, numbers, true),
        BOOL => of_numbers(
            shape,
            numbers.iter().map(|&n| f64::from(n != 0.0)).collect(),
            true,
        ),
        FLOAT16 => return Err(node.unsupported("a cast to float16", "export in float32")),
        other => {
            return Err(node.unsupported(format!("a cast to {}", type_name(other)), "use float32"));
        }
    })
}

/// A function of one constant; `None` where the operator is no such function.
pub(super) fn unary(node: &Node<'_>, x: &Constant) -> Result<Option<Constant>, NetworkError> {
    let whole = matches!(x, Constant::Integers(_));
    let f: fn(f64) -> f64 = match node.proto.op_type.as_str() {
        "Neg" => |x| -x,
        "Abs" => f64::abs,
        "Not" => |x| f64::from(x == 0.0),
        "Sqrt" if !whole => f64::sqrt,
        "Exp" if !whole => f64::exp,
        "Log" if !whole => f64::ln,
        "Reciprocal" if !whole => |x| 1.0 / x,
        "Floor" if !whole => f64::floor,
        "Ceil" if !whole => f64::ceil,
        _ => return Ok(None),
    };
    let values = x.numbers().into_iter().map(f).collect();
    Ok(Some(of_numbers(x.shape().to_vec(), values, whole)))
}

/// A function of two constants, broadcast; `None` where the operator is no such function.
pub(super) fn binary(
    node: &Node<'_>,
    a: &Constant,
    b: &Constant,
) -> Result<Option<Constant>, NetworkError> {
    let whole = matches!((a, b), (Constant::Integers(_), Constant::Integers(_)));
    let op = node.proto.op_type.as_str();
    let f: fn(f64, f64) -> f64 = match op {
        "Add" => |a, b| a + b,
        "Sub" => |a, b| a - b,
        "Mul" => |a, b| a * b,
        "Div" if whole => |a, b| if b == 0.0 { 0.0 } else { (a / b).trunc() },
        "Div" => |a, b| a / b,
        "Mod" if whole && node.int("fmod", 0) == 0 => |a, b| {
            if b == 0.0 {
                0.0
            } else {
                a - b * (a / b).floor()
            }
        },
        "Pow" => f64::powf,
        "Max" => f64::max,
        "Min" => f64::min,
        "Equal" => |a, b| f64::from(a == b),
        "Less" => |a, b| f64::from(a < b),
        "Greater" => |a, b| f64::from(a > b),
        "LessOrEqual" => |a, b| f64::from(a <= b),
        "GreaterOrEqual" => |a, b| f64::from(a >= b),
        "And" => |a, b| f64::from(a != 0.0 && b != 0.0),
        "Or" => |a, b| f64::from(a != 0.0 || b != 0.0),
        _ => return Ok(None),
    };
    let shape = broadcast(node, a.shape(), b.shape())?;
    let count = tensor::count(&node.name, &shape)?;
    let (a_at, b_at) = (
        spread_places(a.shape(), &shape),
        spread_places(b.shape(), &shape),
    );
    let (left, right) = (a.numbers(), b.numbers());
    let values = (0..count)
        .map(|i| f(left[a_at[i]], right[b_at[i]]))
        .collect();
    let condition = ["Equal", "Less", "Greater", "LessOrEqual", "GreaterOrEqual"].contains(&op);
    Ok(Some(of_numbers(shape, values, whole || condition)))
}

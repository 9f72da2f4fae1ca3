//! Values of a layer's settings, in the forms that Keras writes.

use serde_json::Value;

use crate::NetworkError;
use crate::import::keras::settings::Settings;

/// The name of an activation: a text, or an object with one.
///
/// # Errors
/// It is a function of somebody's own, which may be called like one of Keras's.
pub(super) fn activation_name<'v>(
    layer: &str,
    config: &'v Settings<'_>,
    key: &str,
) -> Result<&'v str, NetworkError> {
    let value = &config[key];
    let class = value["class_name"].as_str();
    let inner = value["config"].as_str();
    if class == Some("function") {
        let name = inner.unwrap_or("");
        return Err(NetworkError::unsupported(
            layer,
            format!("the {key} {name:?}, which is code of its own,"),
            "name one of Keras's: activation='tanh'",
        ));
    }
    Ok(value.as_str().or(inner).or(class).unwrap_or("linear"))
}

pub(super) fn float(value: &Value) -> Option<f32> {
    value.as_f64().map(|x| x as f32)
}

/// A number that a layer's setting states; none where the setting is not there.
///
/// # Errors
/// It is something else.
pub(super) fn stated(layer: &str, key: &str, value: &Value) -> Result<Option<f32>, NetworkError> {
    // Keras 2 writes a number of NumPy as an object.
    let value = if value.is_object() {
        &value["value"]
    } else {
        value
    };
    match (value.is_null(), float(value)) {
        (true, _) => Ok(None),
        (_, Some(number)) => Ok(Some(number)),
        _ => Err(NetworkError::unsupported(
            layer,
            format!("{key} = {value}"),
            "a number works",
        )),
    }
}

/// Numbers in a list, in lists, or one alone.
pub(super) fn numbers(value: &Value) -> Vec<f32> {
    match value {
        Value::Array(list) => list.iter().flat_map(numbers).collect(),
        _ => float(value).into_iter().collect(),
    }
}

/// Rows and columns of a size; one number stands for both, and for the columns where there is one
/// axis.
pub(super) fn pair(value: &Value, one: bool, otherwise: usize) -> [usize; 2] {
    let size = |value: &Value| value.as_u64().and_then(|n| usize::try_from(n).ok());
    let list: Vec<usize> = match value {
        Value::Array(list) => list.iter().filter_map(size).collect(),
        _ => size(value).into_iter().collect(),
    };
    match (one, list.as_slice()) {
        (true, [columns, ..]) => [1, *columns],
        (true, []) => [1, otherwise],
        (false, [rows, columns, ..]) => [*rows, *columns],
        (false, [both]) => [*both, *both],
        (false, []) => [otherwise; 2],
    }
}

/// An axis without the batch; negative ones count from the end.
pub(super) fn axis_of(layer: &str, value: &Value, axes: usize) -> Result<usize, NetworkError> {
    let axis = value.as_i64().unwrap_or(-1);
    let place = if axis < 0 {
        axis + axes as i64
    } else {
        axis - 1
    };
    usize::try_from(place)
        .ok()
        .filter(|&place| place < axes)
        .ok_or_else(|| {
            if axis == 0 {
                let what = format!("axis 0, the batch's, beside {axes} others");
                return NetworkError::unsupported(layer, what, "use an axis after the batch");
            }
            NetworkError::malformed(layer, format!("axis {axis} of {axes} axes and the batch"))
        })
}

//! Numbers in attributes.

use nalgebra::Vector3;

use super::document::Node;
use crate::error::Result;

/// Numbers of an attribute; `None` where it is not there.
///
/// # Errors
/// `File` for text, and for a number that is not finite.
pub fn numbers(node: &Node, key: &str, text: Option<&str>) -> Result<Option<Vec<f64>>> {
    let Some(text) = text else {
        return Ok(None);
    };
    let mut numbers = Vec::new();
    for word in text.split_whitespace() {
        match word.parse::<f64>() {
            Ok(number) if number.is_finite() => numbers.push(number),
            _ => {
                let message = format!("`{word}` in `{key}` of {} is not a number", node.called());
                return Err(node.error(message));
            }
        }
    }
    Ok(Some(numbers))
}

/// One number of an attribute.
///
/// # Errors
/// As [`numbers`], and where there are none or several.
pub fn number(node: &Node, key: &str, text: Option<&str>) -> Result<Option<f64>> {
    match numbers(node, key, text)?.as_deref() {
        None => Ok(None),
        Some([number]) => Ok(Some(*number)),
        Some(other) => {
            let count = other.len();
            let message = format!("`{key}` of {} has {count} numbers, not 1", node.called());
            Err(node.error(message))
        }
    }
}

/// Three numbers of an attribute.
///
/// # Errors
/// As [`numbers`], and where there are not three.
pub fn vector(node: &Node, key: &str, text: Option<&str>) -> Result<Option<Vector3<f64>>> {
    match numbers(node, key, text)?.as_deref() {
        None => Ok(None),
        Some([x, y, z]) => Ok(Some(Vector3::new(*x, *y, *z))),
        Some(other) => {
            let count = other.len();
            let message = format!("`{key}` of {} has {count} numbers, not 3", node.called());
            Err(node.error(message))
        }
    }
}

/// A direction of unit length.
///
/// # Errors
/// As [`vector`], and for a vector of no length.
pub fn direction(node: &Node, key: &str, text: Option<&str>) -> Result<Option<Vector3<f64>>> {
    let Some(vector) = vector(node, key, text)? else {
        return Ok(None);
    };
    match vector.try_normalize(1e-12) {
        Some(direction) => Ok(Some(direction)),
        None => Err(node.error(format!("`{key}` of {} has no length", node.called()))),
    }
}

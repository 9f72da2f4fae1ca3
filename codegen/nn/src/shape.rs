//! The shape that a layer gives, or why it does not fit what it reads.

use super::limits::{MAX_AXES, MAX_LENGTH, MAX_PARAMETERS, MAX_SELECTED};
use super::{Activation, NetworkError, Op, Recurrent, Window};

/// # Errors
/// [`NetworkError`], naming `layer`.
pub(super) fn infer(layer: &str, op: &Op, inputs: &[&[usize]]) -> Result<Vec<usize>, NetworkError> {
    let wrong = |message: String| Err(NetworkError::malformed(layer, message));
    let expected = match op {
        Op::Input => 0,
        Op::Add | Op::Concatenate(_) => inputs.len().max(1),
        Op::Multiply | Op::Maximum | Op::Minimum => 2,
        _ => 1,
    };
    if inputs.len() != expected {
        return wrong(format!(
            "it reads {} layers: expected {expected}",
            inputs.len()
        ));
    }
    let from = inputs.first().copied().unwrap_or(&[]);
    let shape = match op {
        Op::Input => return wrong("a network has one input, its first layer".into()),
        Op::Dense(dense) => {
            let (inputs, outputs) = (length(from), dense.bias.len());
            tensor(layer, "weights", dense.weights.len(), &[outputs, inputs])?;
            vec![outputs]
        }
        Op::Convolution(convolution) => {
            let window = &convolution.window;
            let (image, channels) = image(layer, from)?;
            let filters = convolution.bias.len();
            let expected = [filters, window.size[0], window.size[1], channels];
            tensor(layer, "weights", convolution.weights.len(), &expected)?;
            with_channels(from, slide(layer, window, image)?, filters)
        }
        Op::Pool(pool) => {
            let (image, channels) = image(layer, from)?;
            let output = slide(layer, &pool.window, image)?;
            // Padding as wide as the window would leave windows with nothing in them.
            let narrow = |axis: usize| {
                pool.window.before[axis].max(pool.window.after[axis]) < pool.window.size[axis]
            };
            if !narrow(0) || !narrow(1) {
                return wrong("its padding is as wide as its window".into());
            }
            with_channels(from, output, channels)
        }
        Op::Reshape(shape) => {
            if length(shape) != length(from) {
                return wrong(format!("{from:?} has not as many values as {shape:?}"));
            }
            shape.clone()
        }
        Op::Permute(axes) => {
            let mut sorted = axes.clone();
            sorted.sort_unstable();
            if sorted != (0..from.len()).collect::<Vec<_>>() {
                return wrong(format!("{axes:?} is no order of the axes of {from:?}"));
            }
            axes.iter().map(|&axis| from[axis]).collect()
        }
        Op::Scale { gain, offset } => {
            let channels = from.last().copied().unwrap_or(0);
            tensor(layer, "gain", gain.len(), &[channels])?;
            tensor(layer, "offset", offset.len(), &[channels])?;
            from.to_vec()
        }
        Op::Activation(Activation::Clip { low, high })
            if low > high || low.is_nan() || high.is_nan() =>
        {
            return wrong(format!("its bounds are {low} and {high}"));
        }
        Op::Activation(_) | Op::Softmax | Op::LogSoftmax => from.to_vec(),
        Op::Recurrent(recurrent) => steps(layer, recurrent, from)?,
        Op::Add => {
            if let Some(other) = inputs.iter().find(|other| **other != from) {
                return wrong(format!(
                    "it adds {from:?} to {other:?}: shapes have to be equal"
                ));
            }
            from.to_vec()
        }
        Op::Multiply | Op::Maximum | Op::Minimum => {
            if inputs[0] != inputs[1] {
                let (a, b) = (inputs[0], inputs[1]);
                return wrong(format!("it reads {a:?} and {b:?}: shapes have to be equal"));
            }
            from.to_vec()
        }
        Op::Select(selection) => {
            let (places, shape) = (&selection.places, &selection.shape);
            if length(from) > MAX_SELECTED {
                let message = format!("a choice of {from:?}: at most {MAX_SELECTED} values");
                return Err(NetworkError::too_large(layer, message));
            }
            if let Some(place) = places.iter().flatten().find(|&&p| p >= length(from)) {
                return wrong(format!("{from:?} has no value {place}"));
            }
            if length(shape) != places.len() {
                return wrong(format!("{} places for the shape {shape:?}", places.len()));
            }
            shape.clone()
        }
        Op::Normalise { epsilon } => {
            if !epsilon.is_finite() || *epsilon < 0.0 {
                return wrong(format!("its epsilon is {epsilon}"));
            }
            from.to_vec()
        }
        Op::Concatenate(axis) => side_by_side(layer, *axis, inputs)?,
    };
    check(layer, &shape)?;
    Ok(shape)
}

/// That a shape is one that can be emitted.
///
/// # Errors
/// [`NetworkError::TooLarge`], or [`NetworkError::Malformed`] for an axis of nothing.
pub(super) fn check(layer: &str, shape: &[usize]) -> Result<(), NetworkError> {
    if shape.contains(&0) {
        return Err(NetworkError::malformed(
            layer,
            format!("an axis of {shape:?} is empty"),
        ));
    }
    if shape.is_empty() || shape.len() > MAX_AXES {
        return Err(NetworkError::unsupported(
            layer,
            format!("a shape of {} axes", shape.len()),
            format!("1 to {MAX_AXES} axes work, the batch aside"),
        ));
    }
    let length = shape
        .iter()
        .try_fold(1_usize, |n, &axis| n.checked_mul(axis));
    if length.is_none_or(|length| length > MAX_LENGTH) {
        return Err(NetworkError::too_large(
            layer,
            format!("{shape:?} are more than {MAX_LENGTH} values"),
        ));
    }
    Ok(())
}

fn length(shape: &[usize]) -> usize {
    shape.iter().fold(1, |n, &axis| n.saturating_mul(axis))
}

fn tensor(layer: &str, name: &str, found: usize, shape: &[usize]) -> Result<(), NetworkError> {
    if length(shape) > MAX_PARAMETERS {
        return Err(NetworkError::too_large(
            layer,
            format!("{name} {shape:?} are more than {MAX_PARAMETERS} values"),
        ));
    }
    if found != length(shape) {
        return Err(NetworkError::malformed(
            layer,
            format!(
                "{found} values of {name}: expected {} for {shape:?}",
                length(shape)
            ),
        ));
    }
    Ok(())
}

/// Rows and columns, and channels.
fn image(layer: &str, shape: &[usize]) -> Result<([usize; 2], usize), NetworkError> {
    match *shape {
        [columns, channels] => Ok(([1, columns], channels)),
        [rows, columns, channels] => Ok(([rows, columns], channels)),
        _ => Err(NetworkError::malformed(
            layer,
            format!(
                "{shape:?} is no image: expected (columns, channels) or (rows, columns, channels)"
            ),
        )),
    }
}

fn with_channels(from: &[usize], output: [usize; 2], channels: usize) -> Vec<usize> {
    if from.len() == 2 {
        vec![output[1], channels]
    } else {
        vec![output[0], output[1], channels]
    }
}

/// Size of what a window leaves of an image.
pub(super) fn slide(
    layer: &str,
    window: &Window,
    image: [usize; 2],
) -> Result<[usize; 2], NetworkError> {
    let mut output = [0; 2];
    for axis in 0..2 {
        let numbers = [
            window.size[axis],
            window.stride[axis],
            window.dilation[axis],
            window.before[axis],
            window.after[axis],
        ];
        if numbers.iter().any(|&n| n > MAX_LENGTH) || numbers[..3].contains(&0) {
            return Err(NetworkError::malformed(
                layer,
                format!("its window (size, stride, dilation, padding) is {numbers:?}"),
            ));
        }
        let reach = (numbers[0] - 1) * numbers[2] + 1;
        let padded = image[axis] + numbers[3] + numbers[4];
        let Some(room) = padded.checked_sub(reach) else {
            return Err(NetworkError::malformed(
                layer,
                format!(
                    "a window that reaches over {reach} does not fit {padded}, padding included"
                ),
            ));
        };
        output[axis] = room / numbers[1] + 1;
    }
    Ok(output)
}

fn steps(layer: &str, recurrent: &Recurrent, from: &[usize]) -> Result<Vec<usize>, NetworkError> {
    let (steps, inputs) = match *from {
        [inputs] => (1, inputs),
        [steps, inputs] => (steps, inputs),
        _ => {
            let message = format!("{from:?} is no sequence: expected (steps, features)");
            return Err(NetworkError::malformed(layer, message));
        }
    };
    let (gates, units) = (recurrent.cell.gates(), recurrent.units);
    tensor(
        layer,
        "kernel",
        recurrent.kernel.len(),
        &[gates, units, inputs],
    )?;
    tensor(
        layer,
        "recurrent",
        recurrent.recurrent.len(),
        &[gates, units, units],
    )?;
    tensor(layer, "bias", recurrent.bias.len(), &[gates, units])?;
    let inner = match recurrent.cell {
        super::Cell::Gru {
            reset_after: true, ..
        } => units,
        _ => 0,
    };
    tensor(layer, "inner_bias", recurrent.inner_bias.len(), &[inner])?;
    if let Some(g) = recurrent
        .cell
        .activations()
        .iter()
        .find(|g| !g.slope_from_value())
    {
        return Err(NetworkError::unsupported(
            layer,
            format!("{g:?} within a recurrent layer"),
            "the nearest is tanh".to_owned(),
        ));
    }
    if recurrent.streaming && steps != 1 {
        return Err(NetworkError::malformed(
            layer,
            format!("it takes one step a call, but is given {steps}"),
        ));
    }
    Ok(match (recurrent.sequences, from.len()) {
        (true, 2) => vec![steps, units],
        _ => vec![units],
    })
}

fn side_by_side(layer: &str, axis: usize, inputs: &[&[usize]]) -> Result<Vec<usize>, NetworkError> {
    let mut shape = inputs[0].to_vec();
    if axis >= shape.len() {
        return Err(NetworkError::malformed(
            layer,
            format!("{shape:?} has no axis {axis}"),
        ));
    }
    for other in &inputs[1..] {
        let alike = other.len() == shape.len()
            && (0..shape.len()).all(|i| i == axis || other[i] == shape[i]);
        if !alike {
            let message = format!("{:?} and {other:?} differ beside axis {axis}", inputs[0]);
            return Err(NetworkError::malformed(layer, message));
        }
        shape[axis] = shape[axis].saturating_add(other[axis]);
    }
    Ok(shape)
}

//! Convolutions and pools in double precision.

use super::Real;
use crate::{Convolution, Pool, PoolKind, Window};

/// Rows, columns and channels of a shape of two or three axes.
fn image(shape: &[usize]) -> [usize; 3] {
    match *shape {
        [columns, channels] => [1, columns, channels],
        [rows, columns, channels] => [rows, columns, channels],
        _ => [0; 3],
    }
}

/// For output cell `(p, q)`: the window's elements that lie within the image, as (place in the
/// window, cell of the image).
fn within(
    window: Window,
    image: [usize; 3],
    (p, q): (usize, usize),
) -> impl Iterator<Item = (usize, usize)> {
    let [rows, columns, _] = image;
    let [high, wide] = window.size;
    (0..high * wide).filter_map(move |place| {
        let (i, j) = (place / wide, place % wide);
        let row = (p * window.stride[0] + i * window.dilation[0]).checked_sub(window.before[0])?;
        let column =
            (q * window.stride[1] + j * window.dilation[1]).checked_sub(window.before[1])?;
        (row < rows && column < columns).then_some((place, row * columns + column))
    })
}

fn cells(shape: &[usize]) -> impl Iterator<Item = (usize, usize)> {
    let [rows, columns, _] = image(shape);
    (0..rows).flat_map(move |p| (0..columns).map(move |q| (p, q)))
}

pub(super) fn convolve<T: Real>(
    layer: &Convolution,
    from: &[usize],
    to: &[usize],
    x: &[T],
) -> Vec<T> {
    let image = image(from);
    let channels = image[2];
    let per_filter = layer.weights.len() / layer.bias.len();
    let mut y = Vec::new();
    for cell in cells(to) {
        for (filter, &bias) in layer.bias.iter().enumerate() {
            let weights = &layer.weights[filter * per_filter..][..per_filter];
            let mut sum = T::of(f64::from(bias));
            for (place, at) in within(layer.window, image, cell) {
                let weights = &weights[place * channels..][..channels];
                sum = sum + super::dot(weights, &x[at * channels..][..channels]);
            }
            y.push(sum);
        }
    }
    y
}

pub(super) fn pool<T: Real>(layer: &Pool, from: &[usize], to: &[usize], x: &[T]) -> Vec<T> {
    let image = image(from);
    let channels = image[2];
    let mut y = Vec::new();
    for cell in cells(to) {
        for channel in 0..channels {
            let values: Vec<&T> = within(layer.window, image, cell)
                .map(|(_, at)| &x[at * channels + channel])
                .collect();
            let count = match layer.kind {
                PoolKind::AverageWithPadding => layer.window.size[0] * layer.window.size[1],
                PoolKind::Average | PoolKind::Max => values.len(),
            };
            y.push(match layer.kind {
                // The first of equals, as the kernels take it.
                PoolKind::Max => values
                    .into_iter()
                    .cloned()
                    .reduce(larger)
                    .unwrap_or(T::of(0.0)),
                _ => {
                    let sum = values
                        .into_iter()
                        .cloned()
                        .fold(T::of(0.0), |sum, x| sum + x);
                    sum / T::of(count as f64)
                }
            });
        }
    }
    y
}

fn larger<T: Real>(a: T, b: T) -> T {
    if b.number() > a.number() { b } else { a }
}

//! Recurrent layers in double precision.

use super::{Real, apply, dot};
use crate::{Cell, Recurrent};

/// Output of the layer for its whole input, and its state after it. `state` is empty for a layer
/// that begins each call at rest.
pub(super) fn run<T: Real>(layer: &Recurrent, x: &[T], state: &[T]) -> (Vec<T>, Vec<T>) {
    let mut state = if layer.streaming {
        state.to_vec()
    } else {
        vec![T::of(0.0); layer.units * layer.cell.vectors()]
    };
    let mut y = Vec::new();
    for x in x.chunks(layer.inputs()) {
        state = step(layer, x, &state);
        if layer.sequences {
            y.extend_from_slice(&state[..layer.units]);
        }
    }
    if !layer.sequences {
        y = state[..layer.units].to_vec();
    }
    (y, state)
}

fn step<T: Real>(layer: &Recurrent, x: &[T], state: &[T]) -> Vec<T> {
    let n = layer.units;
    let h = &state[..n];
    let row = |weights: &[f32], gate: usize, unit: usize, length: usize, v: &[T]| {
        dot(&weights[(gate * n + unit) * length..][..length], v)
    };
    let input = |gate, unit| {
        row(&layer.kernel, gate, unit, x.len(), x) + T::of(f64::from(layer.bias[gate * n + unit]))
    };
    let recurrent = |gate, unit, h: &[T]| row(&layer.recurrent, gate, unit, n, h);
    let gate = |g, gate| -> Vec<T> {
        (0..n)
            .map(|unit| apply(g, input(gate, unit) + recurrent(gate, unit, h)))
            .collect()
    };
    match layer.cell {
        Cell::Simple { activation } => gate(activation, 0),
        Cell::Gru {
            activation,
            gates,
            reset_after,
        } => {
            let (update, reset) = (gate(gates, 0), gate(gates, 1));
            let kept: Vec<T> = h
                .iter()
                .zip(&reset)
                .map(|(h, r)| h.clone() * r.clone())
                .collect();
            (0..n)
                .map(|unit| {
                    let inner = if reset_after {
                        let bias = T::of(f64::from(layer.inner_bias[unit]));
                        reset[unit].clone() * (recurrent(2, unit, h) + bias)
                    } else {
                        recurrent(2, unit, &kept)
                    };
                    let candidate = apply(activation, input(2, unit) + inner);
                    let z = update[unit].clone();
                    z.clone() * h[unit].clone() + (T::of(1.0) - z) * candidate
                })
                .collect()
        }
        Cell::Lstm { activation, gates } => {
            let (i, f) = (gate(gates, 0), gate(gates, 1));
            let (g, o) = (gate(activation, 2), gate(gates, 3));
            let cell: Vec<T> = (0..n)
                .map(|k| f[k].clone() * state[n + k].clone() + i[k].clone() * g[k].clone())
                .collect();
            let h = (0..n).map(|k| o[k].clone() * apply(activation, cell[k].clone()));
            h.chain(cell.iter().cloned()).collect()
        }
    }
}

//! Lines that both kinds of networks take derivatives by.

use crate::spec::{Activation, Layer};

/// The lines that take derivatives from the last layer back to the second.
pub(super) fn chain(layers: &[Layer]) -> Vec<String> {
    let last = layers.len();
    let mut lines = Vec::new();
    let slope = |n: usize| slope(n, &layers[n - 1]);
    let zeros = |n: usize| format!("let mut t{n} = [[0.0; NY]; {}];", layers[n - 1].outputs());
    if last == 1 {
        lines.extend([slope(1), zeros(1)]);
        lines.push("network::seed_diagonal(&d1, &mut t1);".into());
    } else {
        let n = last - 1;
        match layers[last - 1].activation() {
            None | Some(Activation::Linear) => {
                lines.extend([slope(n), zeros(n)]);
                lines.push(format!("network::seed_linear(&W{last}, &d{n}, &mut t{n});"));
            }
            Some(Activation::Tanh | Activation::Relu) => {
                lines.extend([slope(last), slope(n), zeros(n)]);
                lines.push(format!(
                    "network::seed(&W{last}, &d{last}, &d{n}, &mut t{n});"
                ));
            }
        }
        for n in (1..last - 1).rev() {
            lines.extend([slope(n), zeros(n)]);
            lines.push(format!(
                "network::chain(&t{0}, &W{0}, &d{n}, &mut t{n});",
                n + 1
            ));
        }
    }
    lines
}

/// Slopes of a layer's results; a recurrent layer takes its own into account.
pub(super) fn slope(n: usize, layer: &Layer) -> String {
    match layer.activation() {
        None | Some(Activation::Linear) => format!("let d{n} = [1.0; {}];", layer.outputs()),
        Some(Activation::Tanh) => format!("let d{n} = network::tanh_slope(&a.a{n});"),
        Some(Activation::Relu) => format!("let d{n} = network::relu_slope(&a.a{n});"),
    }
}

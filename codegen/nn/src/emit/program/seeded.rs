//! A network that ends in a dense layer with few outputs: its weights are the adjoints to begin
//! with.

use super::body::Body;
use super::seed::Seed;
use super::{ALONG, CURVATURE, JACOBIAN};
use crate::Op;
use crate::emit::backward::adjoint;
use crate::emit::forward::{activation, call, constant};

impl Body<'_> {
    pub(super) fn seeded(&self, seed: &Seed) -> String {
        format!(
            "{}{JACOBIAN}pub fn predict_with_jacobian(
    x: &[f32; INPUTS],
    jacobian: &mut [[f32; OUTPUTS]; INPUTS],
) -> [f32; OUTPUTS] {{
    let mut a = Activations::ZERO;
    forward(x, &mut a);
{}    {}
}}

{CURVATURE}pub fn curvature(x: &[f32; INPUTS], weights: &[f32; OUTPUTS], h: &mut [[f32; INPUTS]; INPUTS]) {{
    for (i, row) in h.iter_mut().enumerate() {{
        let x = along(x, i);
        let mut a = Activations::ZERO;
        forward(&x, &mut a);
{}        *row = t_x.map(|[t]| t.tangent);
    }}
}}

{ALONG}",
            self.predict(),
            self.first_order(seed),
            self.result(),
            self.second_order(seed),
        )
    }

    fn weights(&self, node: usize, suffix: &str) -> String {
        format!("&weights::{}", constant(self.plan, node, suffix))
    }

    /// An activation's node as its function and its values.
    fn activation(&self, node: usize) -> [String; 2] {
        let g = match self.plan.network.nodes[node].op {
            Op::Activation(g) => activation(g),
            _ => String::new(),
        };
        [g, self.plan.borrowed(node)]
    }

    /// The statements that fill `jacobian`.
    fn first_order(&self, seed: &Seed) -> String {
        let gain = seed.scale.map(|node| self.weights(node, "_GAIN"));
        let outer = match (seed.outer, gain) {
            (None, None) => "&[1.0; OUTPUTS]".to_string(),
            (None, Some(gain)) => gain,
            (Some(node), None) => format!("&slopes({})", self.activation(node).join(", ")),
            (Some(node), Some(gain)) => {
                format!(
                    "&weighed({gain}, slopes({}))",
                    self.activation(node).join(", ")
                )
            }
        };
        let weights = self.weights(seed.dense, "_W");
        if self.plan.buffer[seed.begin] == 0 {
            return call(4, "dense_seed", &[weights, outer, "jacobian".into()]);
        }
        let go = format!("    backward(&a, {}t, jacobian);\n", self.given);
        if let Some(node) = seed.inner {
            let [g, a] = self.activation(node);
            if seed.rectified {
                let first = self.weights(seed.begin, "_W");
                let arguments = [weights, outer, a, first, "jacobian".into()];
                return call(4, "rectified_back", &arguments);
            }
            let of = call(4, "dense_seed_activated", &[weights, outer, g, a]);
            return format!("    let t = {}{go}", of.trim_start());
        }
        let length = self.plan.network.nodes[seed.begin].len();
        format!("    let mut t = [[0.0; OUTPUTS]; {length}];\n")
            + &call(4, "dense_seed", &[weights, outer, "&mut t".into()])
            + &go
    }

    /// The statements from `weights` to `t_x`, both with their derivatives along one input.
    fn second_order(&self, seed: &Seed) -> String {
        let plan = self.plan;
        let mutable = if seed.outer.is_some() && seed.scale.is_none() {
            "mut "
        } else {
            ""
        };
        let mut text =
            format!("        let {mutable}t_y = weights.map(|weight| [Dual::constant(weight)]);\n");
        let mut own = "t_y".to_string();
        if let Some(node) = seed.scale {
            own = adjoint(plan, seed.dense);
            let gain = self.weights(node, "_GAIN");
            text += &format!("        let mut {own} = [[Dual::ZERO; 1]; OUTPUTS];\n");
            text += &call(
                8,
                "scale_back",
                &[gain, "&t_y".into(), format!("&mut {own}")],
            );
        }
        if let Some(node) = seed.outer {
            let [g, a] = self.activation(node);
            text += &call(
                8,
                "activate_back",
                &[g, a.clone(), a, format!("&mut {own}")],
            );
        }
        let zero = "        let mut t_x = [[Dual::ZERO; 1]; INPUTS];\n";
        let direct = plan.buffer[seed.begin] == 0;
        let target = if direct { "t_x" } else { "t" };
        if !direct {
            let length = plan.network.nodes[seed.begin].len();
            text += &format!("        let mut t = [[Dual::ZERO; 1]; {length}];\n");
        } else {
            text += zero;
        }
        let mut arguments = vec![self.weights(seed.dense, "_W"), format!("&{own}")];
        let function = match seed.inner {
            Some(node) => {
                arguments.extend(self.activation(node));
                "dense_back_activated"
            }
            None => "dense_back",
        };
        arguments.push(format!("&mut {target}"));
        text += &call(8, function, &arguments);
        if !direct {
            let given = if self.given.is_empty() { "" } else { "&x, " };
            text += zero;
            text += &format!("        backward(&a, {given}t, &mut t_x);\n");
        }
        text
    }
}

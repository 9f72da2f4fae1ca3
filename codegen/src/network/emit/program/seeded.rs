//! A network that ends in a dense layer: its weights are the adjoints to begin with.

use super::body::Body;
use super::{ALONG, CURVATURE, JACOBIAN};
use crate::network::Op;
use crate::network::emit::forward;

impl Body<'_> {
    /// A network that ends in a dense layer with few outputs: its weights are the adjoints to begin with.
    pub(super) fn seeded(&self) -> String {
        let plan = self.plan;
        let dense = self.seed.unwrap_or(0);
        let begin = plan.network.nodes[dense].from[0];
        let weights = format!("&weights::{}", forward::constant(plan, dense, "_W"));
        let length = plan.network.nodes[begin].len();
        let given = self.given;
        let last = plan.network.nodes.len() - 1;
        let slopes = match plan.network.nodes[last].op {
            Op::Activation(g) if last != dense => {
                let y = plan.borrowed(last);
                let g = forward::activation(g);
                Some((g, y))
            }
            _ => None,
        };
        let direct = plan.buffer[begin] == 0;
        let (declare, target, go) = if direct {
            (String::new(), "jacobian".to_string(), String::new())
        } else {
            (
                format!("    let mut t = [[0.0; OUTPUTS]; {length}];\n"),
                "&mut t".to_string(),
                format!("    backward(&a, {given}t, jacobian);\n"),
            )
        };
        let seed = match &slopes {
            Some((g, y)) => forward::call(
                4,
                "dense_seed_activated",
                &[weights.clone(), g.clone(), y.clone(), target.clone()],
            ),
            None => forward::call(4, "dense_seed", &[weights.clone(), target.clone()]),
        };
        let scaled = match &slopes {
            Some((g, y)) => {
                let y = y.trim_start_matches('&');
                format!("        activate_back({g}, &{y}, &{y}, &mut t_y);\n")
            }
            None => String::new(),
        };
        let mutable = if slopes.is_some() { "mut " } else { "" };
        let (declare_dual, target_dual, go_dual) = if direct {
            (String::new(), "&mut t_x", String::new())
        } else {
            (
                format!("        let mut t = [[Dual::ZERO; 1]; {length}];\n"),
                "&mut t",
                format!(
                    "        backward(&a, {}t, &mut t_x);\n",
                    if given.is_empty() { "" } else { "&x, " }
                ),
            )
        };
        format!(
            "{}{JACOBIAN}pub fn predict_with_jacobian(
    x: &[f32; INPUTS],
    jacobian: &mut [[f32; OUTPUTS]; INPUTS],
) -> [f32; OUTPUTS] {{
    let mut a = Activations::ZERO;
    forward(x, &mut a);
{declare}{seed}{go}    {}
}}

{CURVATURE}pub fn curvature(x: &[f32; INPUTS], weights: &[f32; OUTPUTS], h: &mut [[f32; INPUTS]; INPUTS]) {{
    for (i, row) in h.iter_mut().enumerate() {{
        let x = along(x, i);
        let mut a = Activations::ZERO;
        forward(&x, &mut a);
        let {mutable}t_y = weights.map(|weight| [Dual::constant(weight)]);
{scaled}{declare_dual}{}        let mut t_x = [[Dual::ZERO; 1]; INPUTS];
{go_dual}        *row = t_x.map(|[t]| t.tangent);
    }}
}}

{ALONG}",
            self.predict(),
            self.result(),
            if direct {
                String::new()
            } else {
                forward::call(
                    8,
                    "dense_back",
                    &[weights.clone(), "&t_y".into(), target_dual.into()],
                )
            },
        )
        .replace(
            "        let mut t_x = [[Dual::ZERO; 1]; INPUTS];\n        *row",
            &format!(
                "        let mut t_x = [[Dual::ZERO; 1]; INPUTS];\n{}        *row",
                forward::call(
                    8,
                    "dense_back",
                    &[weights, "&t_y".into(), "&mut t_x".into()]
                )
            ),
        )
    }
}

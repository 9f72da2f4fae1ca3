//! Any other network that remembers nothing.

use super::body::Body;
use super::{ALONG, CURVATURE, JACOBIAN, ROWS};
use crate::emit::plan::BLOCK;

impl Body<'_> {
    pub(super) fn stateless(&self) -> String {
        let given = self.given;
        let given_dual = if given.is_empty() { "" } else { "&x, " };
        format!(
            "{}{JACOBIAN}pub fn predict_with_jacobian(
    x: &[f32; INPUTS],
    jacobian: &mut [[f32; OUTPUTS]; INPUTS],
) -> [f32; OUTPUTS] {{
    let mut a = Activations::ZERO;
    forward(x, &mut a);
    for first in (0..OUTPUTS).step_by(ROWS) {{
        let mut seed = [[0.0; ROWS]; OUTPUTS];
        for (k, seed) in seed.iter_mut().skip(first).take(ROWS).enumerate() {{
            if let Some(own) = seed.get_mut(k) {{
                *own = 1.0;
            }}
        }}
        let mut t_x = [[0.0; ROWS]; INPUTS];
        backward(&a, {given}seed, &mut t_x);
        for (row, t) in jacobian.iter_mut().zip(&t_x) {{
            for (place, t) in row.iter_mut().skip(first).zip(t) {{
                *place = *t;
            }}
        }}
    }}
    {}
}}

{CURVATURE}pub fn curvature(x: &[f32; INPUTS], weights: &[f32; OUTPUTS], h: &mut [[f32; INPUTS]; INPUTS]) {{
    for (i, row) in h.iter_mut().enumerate() {{
        let x = along(x, i);
        let mut a = Activations::ZERO;
        forward(&x, &mut a);
        let seed = weights.map(|weight| [Dual::constant(weight)]);
        let mut t_x = [[Dual::ZERO; 1]; INPUTS];
        backward(&a, {given_dual}seed, &mut t_x);
        *row = t_x.map(|[t]| t.tangent);
    }}
}}

{ROWS}{ALONG}",
            self.predict(),
            self.result(),
        )
        .replace(
            "const ROWS: usize = 0",
            &format!(
                "const ROWS: usize = {}",
                BLOCK.min(self.plan.network.outputs())
            ),
        )
    }
}

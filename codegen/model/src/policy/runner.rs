//! A policy on this computer, as the printed crate computes it but for the network, which is in
//! double precision here.

use sinew_nn::evaluate;

use super::PolicySpec;

/// A policy in a loop.
#[derive(Clone, Debug)]
pub struct Runner<'a> {
    spec: &'a PolicySpec,
    /// Latest first; empty before the first sample.
    y: Vec<Vec<f32>>,
    u: Vec<Vec<f32>>,
}

impl<'a> Runner<'a> {
    /// A policy that has seen nothing, at the safe command.
    pub fn new(spec: &'a PolicySpec) -> Self {
        let safe: Vec<f32> = spec.inputs.iter().map(|input| input.safe).collect();
        Self {
            spec,
            y: Vec::new(),
            u: vec![safe; spec.past_inputs],
        }
    }

    /// Commands for a sample and the reference from the next period on, in order; limits hold
    /// exactly.
    pub fn step<'r>(&mut self, y: &[f64], ahead: impl Fn(usize) -> &'r [f64]) -> Vec<f64> {
        let spec = self.spec;
        let y: Vec<f32> = y.iter().map(|y| *y as f32).collect();
        if self.y.is_empty() {
            self.y = vec![y.clone(); spec.past_outputs];
        }
        self.y.rotate_right(1);
        self.y[0] = y;
        let past = self.y.iter().chain(&self.u).flatten();
        let mut raw: Vec<f64> = past.map(|value| f64::from(*value)).collect();
        for j in 1..=spec.ahead {
            raw.extend(ahead(j).iter().map(|r| f64::from(*r as f32)));
        }
        let change = evaluate::run(&spec.network, &raw);
        let applied = spec.inputs.iter().zip(&change).zip(&self.u[0]);
        let applied: Vec<f32> = applied
            .map(|((limit, change), before)| {
                let asked = before + *change as f32;
                let asked = if asked.is_finite() { asked } else { *before };
                let boxed = asked.clamp(limit.lower, limit.upper);
                inside(boxed, *before, limit.rate)
            })
            .collect();
        self.u.rotate_right(1);
        self.u[0].clone_from(&applied);
        applied.into_iter().map(f64::from).collect()
    }
}

/// The nearest number whose distance from `before` is the rate at most, exactly.
fn inside(asked: f32, before: f32, rate: f32) -> f32 {
    let (wide, rate) = (f64::from(before), f64::from(rate));
    let most = f64::from(asked) - wide;
    if most.abs() <= rate {
        return asked;
    }
    let edge = (wide + rate.copysign(most)) as f32;
    // Rounding is inwards.
    if (f64::from(edge) - wide).abs() <= rate {
        edge
    } else if most > 0.0 {
        edge.next_down()
    } else {
        edge.next_up()
    }
}

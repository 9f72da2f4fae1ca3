//! Second derivatives of a chain of dense layers along a direction: the direction forward through
//! the layers by [`along`], then weights and what the direction changes of them back by [`back`]
//! (docs/explanation/controller.md, eq. 3a).

/// `z = W x` without the bias: the direction before a layer's activation; after it, times the
/// slopes.
///
/// Shapes: `w` is `[OUT][IN]`. Cost: `IN OUT` multiply-adds.
#[inline(always)]
pub fn along<const IN: usize, const OUT: usize>(w: &[[f32; IN]; OUT], x: &[f32; IN]) -> [f32; OUT] {
    let mut z = [0.0; OUT];
    for (z, row) in z.iter_mut().zip(w) {
        for (w, x) in row.iter().zip(x) {
            *z += w * x;
        }
    }
    z
}

/// Weights of a layer's results, and how they change along the direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Adjoint<const N: usize> {
    /// The weights.
    pub weights: [f32; N],
    /// Their change along the direction.
    pub change: [f32; N],
}

/// One layer back: `t_in = W' (slope t)`, `dt_in = W' (bend z t + slope dt)`, `z` from [`along`].
///
/// `slope` and `bend` are the activation's first and second derivatives (`bend` of tanh is
/// [`tanh_bend`](crate::math::tanh_bend), of a linear or rectified layer nought).
/// Cost: `2 IN OUT` multiply-adds.
#[inline(always)]
pub fn back<const IN: usize, const OUT: usize>(
    w: &[[f32; IN]; OUT],
    slope: &[f32; OUT],
    bend: &[f32; OUT],
    z: &[f32; OUT],
    of_result: &Adjoint<OUT>,
) -> Adjoint<IN> {
    let mut of_input = Adjoint {
        weights: [0.0; IN],
        change: [0.0; IN],
    };
    let adjoints = of_result.weights.iter().zip(&of_result.change);
    let shapes = slope.iter().zip(bend).zip(z);
    for ((row, (t, dt)), ((slope, bend), z)) in w.iter().zip(adjoints).zip(shapes) {
        let (weight, change) = (slope * t, bend * z * t + slope * dt);
        let places = of_input.weights.iter_mut().zip(&mut of_input.change);
        for (w, (t, dt)) in row.iter().zip(places) {
            *t += w * weight;
            *dt += w * change;
        }
    }
    of_input
}

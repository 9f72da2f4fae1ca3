//! Step of a Levenberg-Marquardt search inside limits and rate limits: a convex quadratic problem,
//! solved by the alternating direction method of multipliers (Boyd et al. 2011; Stellato et al.
//! 2020, algorithm 1).

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use crate::layout::Layout;

/// Iterations between two changes of the penalty.
const ROUND: usize = 25;
/// Rounds at most.
const ROUNDS: usize = 24;
/// Violation of a limit, in units of the variables, that a projection may mend afterwards.
const ACCURACY: f64 = 1e-6;
/// Regularisation of the variables' own term (sigma of algorithm 1).
const SIGMA: f64 = 1e-9;

/// Limits of a step from a point: bounds of each variable, then of each change between knots.
struct StepLimits {
    low: DVector<f64>,
    high: DVector<f64>,
    knots: usize,
}

impl StepLimits {
    fn new(layout: &Layout, x: &[f64]) -> Self {
        let knots = layout.knots();
        let count = x.len();
        let mut low = DVector::zeros(2 * count);
        let mut high = DVector::zeros(2 * count);
        for (index, &here) in x.iter().enumerate() {
            let (input, knot) = (index / knots, index % knots);
            let [least, most] = layout.range(input);
            (low[index], high[index]) = (least - here, most - here);
            let last = match knot {
                0 => layout.origin(input),
                _ => x[index - 1],
            };
            let change = layout.change(input, knot);
            (low[count + index], high[count + index]) =
                (-change - (here - last), change - (here - last));
        }
        Self { low, high, knots }
    }

    /// Variables and changes of a step.
    fn of(&self, step: &DVector<f64>) -> DVector<f64> {
        let count = step.len();
        DVector::from_fn(2 * count, |row, _| match row.checked_sub(count) {
            None => step[row],
            Some(index) if index % self.knots == 0 => step[index],
            Some(index) => step[index] - step[index - 1],
        })
    }

    /// Transpose of [`StepLimits::of`].
    fn back(&self, forces: &DVector<f64>) -> DVector<f64> {
        let count = forces.len() / 2;
        DVector::from_fn(count, |index, _| {
            let mut sum = forces[index] + forces[count + index];
            if (index + 1) % self.knots != 0 {
                sum -= forces[count + index + 1];
            }
            sum
        })
    }

    fn clamp(&self, values: &DVector<f64>) -> DVector<f64> {
        DVector::from_fn(values.len(), |row, _| {
            values[row].max(self.low[row]).min(self.high[row])
        })
    }
}

/// Minimises `step' H step / 2 + gradient' step` inside the limits around `x`. `None` where `H`
/// cannot be factored.
pub(crate) fn within(
    layout: &Layout,
    hessian: &DMatrix<f64>,
    gradient: &DVector<f64>,
    x: &[f64],
) -> Option<DVector<f64>> {
    let limits = StepLimits::new(layout, x);
    let free = -hessian.clone().cholesky()?.solve(gradient);
    let wanted = limits.of(&free);
    if (limits.clamp(&wanted) - &wanted).amax() <= ACCURACY {
        return Some(free);
    }
    let count = x.len();
    let mut penalty = hessian.diagonal().mean().max(f64::MIN_POSITIVE);
    let mut step = DVector::zeros(count);
    let mut inside = limits.clamp(&limits.of(&step));
    let mut forces = DVector::zeros(2 * count);
    for _ in 0..ROUNDS {
        let factor = factored(hessian, penalty, &limits)?;
        let mut residuals = (0.0, 0.0);
        for _ in 0..ROUND {
            let right = &step * SIGMA - gradient + limits.back(&(&inside * penalty - &forces));
            step = factor.solve(&right);
            let values = limits.of(&step);
            let next = limits.clamp(&(&values + &forces / penalty));
            forces += (&values - &next) * penalty;
            let moved = limits.back(&((&next - &inside) * penalty));
            residuals = ((values - &next).amax(), moved.amax());
            inside = next;
        }
        let (primal, dual) = residuals;
        let slope = gradient.amax().max(f64::MIN_POSITIVE);
        if primal <= ACCURACY && dual <= 1e-4 * slope {
            break;
        }
        let unbalance = (primal / (dual / slope).max(1e-12)).sqrt();
        penalty *= unbalance.clamp(0.1, 10.0);
    }
    Some(step)
}

/// Factor of `H + sigma I + penalty A' A`, `A` being [`StepLimits::of`].
fn factored(
    hessian: &DMatrix<f64>,
    penalty: f64,
    limits: &StepLimits,
) -> Option<Cholesky<f64, Dyn>> {
    let mut matrix = hessian.clone();
    let count = matrix.nrows();
    for index in 0..count {
        // The bound of the variable, its change, and the change of the next knot.
        matrix[(index, index)] += SIGMA + 2.0 * penalty;
        if (index + 1) % limits.knots != 0 {
            matrix[(index, index)] += penalty;
            matrix[(index, index + 1)] -= penalty;
            matrix[(index + 1, index)] -= penalty;
        }
    }
    matrix.cholesky()
}

//! Cost-to-go at the end of the horizon, an option (docs/explanation/controller.md, eq. 4d): a
//! model wrapped in [`Valued`] costs `|W z|^2` more, for everything that comes after the horizon.
//! Nothing of this is linked where nothing is wrapped.
//!
//! z holds the regressor at the end, the disturbance and the reference from r(k+N) on. W has `R`
//! rows at each of some operating points, straight between them. It comes from the model before
//! the firmware is built (docs/decisions/0091-cost-to-go.md). A short horizon then does the work
//! of a long one.

use crate::cost::{CostTerm, End};
use crate::model::{Model, Regressor};
use crate::sensitivity::{self, Propagate, Sensitivities, Stage};

/// Rows W of a cost-to-go at one operating point, in model units. `R` rows; an element of z has a
/// weight in each.
#[derive(Clone, Copy, Debug)]
pub struct ValuePoint<
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
    const R: usize,
> {
    /// Place of the point: `direction' r` of its outputs.
    pub at: f32,
    /// Weights of u(k+N-1), u(k+N-2) ..: `[lag][row][channel]`.
    pub u: [[[f32; NU]; R]; ND],
    /// Weights of y(k+N), y(k+N-1) ..: `[lag][row][output]`.
    pub y: [[[f32; NY]; R]; DD],
    /// Weights of s(k+N).
    pub s: [[f32; NS]; R],
    /// Constant of each row.
    pub offset: [f32; R],
    /// Weights of the disturbance, a column of `R` for each of its elements.
    pub disturbance: &'static [[f32; R]],
    /// Weights of r(k+N), r(k+N+1) ..: `[step][row][output]`.
    pub reference: &'static [[[f32; NY]; R]],
}

impl<
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
    const R: usize,
> ValuePoint<NU, NY, NS, ND, DD, R>
{
    /// No cost at all.
    pub const ZERO: Self = Self {
        at: 0.0,
        u: [[[0.0; NU]; R]; ND],
        y: [[[0.0; NY]; R]; DD],
        s: [[0.0; NS]; R],
        offset: [0.0; R],
        disturbance: &[],
        reference: &[],
    };

    /// The part of each row that no command changes.
    fn constant(&self, reference: &[[f32; NY]], disturbance: &[f32]) -> [f32; R] {
        let mut constant = self.offset;
        for (column, d) in self.disturbance.iter().zip(disturbance) {
            for (sum, weight) in constant.iter_mut().zip(column) {
                *sum += weight * d;
            }
        }
        for (rows, r) in self.reference.iter().zip(reference) {
            for (sum, row) in constant.iter_mut().zip(rows) {
                for (weight, r) in row.iter().zip(r) {
                    *sum += weight * r;
                }
            }
        }
        constant
    }
}

/// A model with a cost-to-go of `R` rows. [`Barred`](crate::barrier::Barred) goes around it where
/// both are wanted.
#[derive(Clone, Debug)]
pub struct Valued<
    M,
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
    const R: usize,
> {
    model: M,
    direction: [f32; NY],
    points: &'static [ValuePoint<NU, NY, NS, ND, DD, R>],
    /// W of this step, all that is constant in `offset`.
    now: ValuePoint<NU, NY, NS, ND, DD, R>,
}

impl<
    M,
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
    const R: usize,
> Valued<M, NU, NY, NS, ND, DD, R>
{
    /// The model with `points` in the order of their places along `direction`, model units. Without
    /// a point there is no cost-to-go.
    pub const fn new(
        model: M,
        direction: [f32; NY],
        points: &'static [ValuePoint<NU, NY, NS, ND, DD, R>],
    ) -> Self {
        Self {
            model,
            direction,
            points,
            now: ValuePoint::ZERO,
        }
    }

    /// The two points around a place, and how far it is from the first to the second, 0 to 1; at
    /// either end the last point.
    #[inline(always)]
    fn around(&self, place: f32) -> Option<[(&'static ValuePoint<NU, NY, NS, ND, DD, R>, f32); 2]> {
        let mut below = self.points.first()?;
        let mut above = below;
        for point in self.points {
            above = point;
            if point.at > place {
                break;
            }
            below = point;
        }
        let (distance, length) = (place - below.at, above.at - below.at);
        // Below the first point, and where both are one: all of it.
        let weight = if distance > 0.0 && length > 0.0 {
            distance / length
        } else {
            0.0
        };
        Some([(below, 1.0 - weight), (above, weight)])
    }
}

impl<
    M: Propagate<NU, NY, NS, ND, DD>,
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
    const R: usize,
> CostTerm<NU, NY, NS, ND, DD> for Valued<M, NU, NY, NS, ND, DD, R>
{
    type Model = M;
    type Residuals = [f32; R];
    const RESIDUALS: [f32; R] = [0.0; R];

    #[inline(always)]
    fn model(&self) -> &M {
        &self.model
    }

    /// Cost: per point and row `NY` multiply-adds for each row of the reference from r(k+N) on.
    #[inline(always)]
    fn prepare(&mut self, reference: &[[f32; NY]], disturbance: &[f32]) {
        let mut place = 0.0;
        for (direction, r) in (self.direction.iter()).zip(reference.first().unwrap_or(&[0.0; NY])) {
            place += direction * r;
        }
        let Some(points) = self.around(place) else {
            return;
        };
        self.now = ValuePoint::ZERO;
        for (point, weight) in points {
            let constant = point.constant(reference, disturbance);
            for (sum, value) in self.now.offset.iter_mut().zip(&constant) {
                *sum += weight * value;
            }
            for (sum, rows) in self.now.u.iter_mut().zip(&point.u) {
                sensitivity::add_scaled(sum, weight, rows);
            }
            for (sum, rows) in self.now.y.iter_mut().zip(&point.y) {
                sensitivity::add_scaled(sum, weight, rows);
            }
            sensitivity::add_scaled(&mut self.now.s, weight, &point.s);
        }
    }

    #[inline(always)]
    fn cost_to_go(&self, end: &Regressor<NU, NY, NS, ND, DD>, residuals: &mut [f32; R]) -> f32 {
        let now = &self.now;
        let mut sums = now.offset;
        for (rows, u) in now.u.iter().zip(&end.u) {
            add_products(&mut sums, rows, u);
        }
        for (rows, y) in now.y.iter().zip(&end.y) {
            add_products(&mut sums, rows, y);
        }
        add_products(&mut sums, &now.s, &end.s);
        *residuals = sums;
        let mut cost = 0.0;
        for sum in &sums {
            cost += sum * sum;
        }
        cost
    }

    /// The rows of W count as outputs of weight one: their sensitivities by (5), gradient and
    /// Hessian by (6) and (7).
    #[inline(always)]
    fn linearise_cost_to_go<const NB: usize>(
        &self,
        residuals: &[f32; R],
        end: &End<'_, NU, NY, NS, DD, NB>,
        gradient: &mut [[f32; NU]],
        pairs: &mut [[[f32; NU]; NU]],
    ) {
        let mut blocks = const { [[[[0.0; NU]; R]]; NB] };
        let sensitivities = end.blocks.iter().zip(end.channels);
        for ([row], (lags, channel)) in blocks.iter_mut().zip(sensitivities).take(end.active) {
            for (rows, lag) in self.now.y.iter().zip(lags) {
                sensitivity::add_product(row, rows, lag);
            }
            if <M as Model<NU, NY, NS, ND, DD>>::PREDICTS_CHANNELS {
                sensitivity::add_product(row, &self.now.s, channel);
            }
        }
        sensitivity::enter_inputs(&self.now.u, end.inputs, &mut blocks);
        let stage = Stage {
            active_before: end.active,
            active: end.active,
            inputs: end.inputs,
            weighted: Some(residuals),
            tracking: &[1.0; R],
        };
        let mut sensitivities = Sensitivities {
            blocks: &mut blocks,
            gradient,
            pairs,
        };
        sensitivity::add_up(&stage, &mut sensitivities);
    }
}

/// `sums += rows x`.
#[inline(always)]
fn add_products<const R: usize, const C: usize>(
    sums: &mut [f32; R],
    rows: &[[f32; C]; R],
    x: &[f32; C],
) {
    for (sum, row) in sums.iter_mut().zip(rows) {
        for (weight, x) in row.iter().zip(x) {
            *sum += weight * x;
        }
    }
}

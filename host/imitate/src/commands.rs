//! Commands that make a plant go as demonstrated: Gauss-Newton steps, each a Riccati recursion over
//! the derivatives of every period (docs/explanation/imitation.md, eq. 7 and 8).

use nalgebra::{DMatrix, DVector};
use sinew_sim::{Plant, SimulationError, Stepper};

use crate::limits::Limits;
use crate::period::Linearised;

/// Commands for a motion, and the motion that they make: a row a period. States and outputs have
/// one row more, where the last command leads.
#[derive(Clone, Debug, PartialEq)]
pub struct Inverse {
    /// Commands.
    pub u: Vec<Vec<f64>>,
    /// States of the plant.
    pub x: Vec<Vec<f64>>,
    /// Outputs.
    pub y: Vec<Vec<f64>>,
}

/// Gauss-Newton steps at most.
const STEPS: usize = 12;
/// Change of a command that costs as much as an error of the noise's size, in steps of its rate.
const USUAL: f64 = 0.1;
/// Relative fall of the cost that ends the steps.
const SETTLED: f64 = 1e-4;

/// A motion to be made, and the plant that makes it.
pub(crate) struct Problem<'a> {
    pub plant: &'a Plant,
    pub values: &'a [f64],
    pub start: &'a [f64],
    pub outputs: &'a [usize],
    /// Wanted outputs, a row a period, the start's first.
    pub wanted: &'a [Vec<f64>],
    /// Error of each output that is usual.
    pub noise: &'a [f64],
    pub limits: &'a Limits,
    pub period_s: f64,
}

type Result<T> = std::result::Result<T, SimulationError>;

/// Finds commands under which `plant` goes from `start` as `wanted` says, up to errors of the size
/// of `noise`: a row a period, the present first. Limits hold.
///
/// # Errors
/// The plant diverges from the start on.
#[allow(
    clippy::too_many_arguments,
    reason = "one motion, one plant, said once"
)]
pub fn inverse(
    plant: &Plant,
    values: &[f64],
    start: &[f64],
    outputs: &[usize],
    wanted: &[Vec<f64>],
    noise: &[f64],
    limits: &Limits,
    period_s: f64,
) -> Result<Inverse> {
    Problem {
        plant,
        values,
        start,
        outputs,
        wanted,
        noise,
        limits,
        period_s,
    }
    .solve()
}

/// Feedback of a Gauss-Newton step: change of the command's move by the deviation of the state and
/// the last command, and what is added whatever they are.
struct Gain {
    feedback: DMatrix<f64>,
    ahead: DVector<f64>,
}

impl Problem<'_> {
    fn solve(&self) -> Result<Inverse> {
        let periods = self.wanted.len().saturating_sub(1);
        let held = vec![self.limits.safe.clone(); periods];
        let mut best = self.simulate(&held)?;
        let mut cost = self.cost(&best);
        for _ in 0..STEPS {
            let gains = self.gains(&best)?;
            let mut improved = None;
            for share in [1.0, 0.5, 0.25, 0.1, 0.02] {
                let Ok(tried) = self.follow(&best, &gains, share) else {
                    continue;
                };
                let of_tried = self.cost(&tried);
                if of_tried < cost {
                    improved = Some((tried, of_tried));
                    break;
                }
            }
            let Some((found, lower)) = improved else {
                break;
            };
            let settled = cost - lower < SETTLED * cost;
            (best, cost) = (found, lower);
            if settled {
                break;
            }
        }
        Ok(best)
    }

    fn simulate(&self, u: &[Vec<f64>]) -> Result<Inverse> {
        let mut plant = Stepper::new(self.plant, self.values, self.start)?;
        let read = |plant: &Stepper<f64>| -> Vec<f64> {
            self.outputs.iter().map(|s| plant.signal(*s)).collect()
        };
        let (mut x, mut y) = (vec![self.start.to_vec()], vec![read(&plant)]);
        for u in u {
            plant.advance(self.period_s, u)?;
            x.push(plant.state());
            y.push(read(&plant));
        }
        Ok(Inverse {
            u: u.to_vec(),
            x,
            y,
        })
    }

    /// Squared errors in units of the noise and squared moves in units of the usual one (eq. 7).
    fn cost(&self, course: &Inverse) -> f64 {
        let usual = self.limits.step();
        let errors = course.y.iter().zip(self.wanted).map(|(y, wanted)| {
            let each = y.iter().zip(wanted).zip(self.noise);
            each.map(|((y, wanted), noise)| ((y - wanted) / noise).powi(2))
                .sum::<f64>()
        });
        let before = std::iter::once(&self.limits.safe).chain(&course.u);
        let moves = course.u.iter().zip(before).map(|(u, before)| {
            let each = u.iter().zip(before).zip(&usual);
            each.map(|((u, before), usual)| ((u - before) / (USUAL * usual)).powi(2))
                .sum::<f64>()
        });
        errors.sum::<f64>() + moves.sum::<f64>()
    }

    /// Backward recursion over the state and the last command together, the move as the unknown.
    fn gains(&self, course: &Inverse) -> Result<Vec<Gain>> {
        let (states, inputs) = (self.start.len(), self.limits.safe.len());
        let (width, outputs) = (states + inputs, self.outputs.len());
        let usual = self.limits.step();
        let weight = DMatrix::from_fn(inputs, inputs, |i, j| {
            if i == j {
                (USUAL * usual[i]).powi(-2)
            } else {
                0.0
            }
        });
        let mut plant = Linearised::new(self.plant, self.values, self.start)?;
        let mut periods = Vec::with_capacity(course.u.len());
        for (x, u) in course.x.iter().zip(&course.u) {
            let period = plant.advance(x, u, self.period_s, self.outputs)?;
            periods.push(DMatrix::from_row_slice(
                states + outputs,
                width,
                &period.slopes,
            ));
        }
        let mut value = DMatrix::<f64>::zeros(width, width);
        let mut slope = DVector::<f64>::zeros(width);
        let mut gains = Vec::with_capacity(periods.len());
        for k in (0..periods.len()).rev() {
            // The next state and the command that is then the last one.
            let mut next = DMatrix::zeros(width, width);
            next.view_mut((0, 0), (states, width))
                .copy_from(&periods[k].rows(0, states));
            next.view_mut((states, states), (inputs, inputs))
                .fill_with_identity();
            let reading = periods[k].rows(states, outputs).into_owned();
            let mut scaled = reading.clone();
            let error = DVector::from_fn(outputs, |i, _| {
                (course.y[k + 1][i] - self.wanted[k + 1][i]) / self.noise[i]
            });
            for (i, noise) in self.noise.iter().enumerate() {
                scaled.row_mut(i).scale_mut(1.0 / noise);
            }
            let before = match k {
                0 => &self.limits.safe,
                _ => &course.u[k - 1],
            };
            let moved = DVector::from_fn(inputs, |i, _| course.u[k][i] - before[i]);
            // Of deviations of state and command u(k) (both columns), then of the move.
            let h = scaled.transpose() * &scaled + next.transpose() * &value * &next;
            let g = scaled.transpose() * error + next.transpose() * &slope;
            // u(k) = u(k-1) + move: the columns of the command belong to both.
            let of_u = h.view((states, states), (inputs, inputs)).into_owned() + &weight;
            let Some(factor) = of_u.cholesky() else {
                return Ok(Vec::new());
            };
            let feedback = factor.solve(&h.rows(states, inputs).into_owned());
            let ahead = factor.solve(&(g.rows(states, inputs) + &weight * moved));
            let gain = Gain {
                feedback: -feedback,
                ahead: -ahead,
            };
            let cross = h.rows(states, inputs).into_owned();
            value = &h + cross.transpose() * &gain.feedback;
            value = 0.5 * (&value + value.transpose());
            slope = g + cross.transpose() * &gain.ahead;
            gains.push(gain);
        }
        gains.reverse();
        Ok(gains)
    }

    /// The course that a share of a step leads to, inside the limits.
    fn follow(&self, course: &Inverse, gains: &[Gain], share: f64) -> Result<Inverse> {
        let (states, inputs) = (self.start.len(), self.limits.safe.len());
        let mut plant = Stepper::new(self.plant, self.values, self.start)?;
        let mut found = Inverse {
            u: Vec::new(),
            x: vec![course.x[0].clone()],
            y: vec![course.y[0].clone()],
        };
        let safe = self.limits.safe.clone();
        for (k, gain) in gains.iter().enumerate() {
            let (last, planned) = match k {
                0 => (&safe, &safe),
                _ => (&found.u[k - 1], &course.u[k - 1]),
            };
            let state = &found.x[k];
            let deviation = DVector::from_fn(states + inputs, |i, _| match i.checked_sub(states) {
                None => state[i] - course.x[k][i],
                Some(i) => last[i] - planned[i],
            });
            let change = &gain.feedback * deviation + &gain.ahead * share;
            let asked = (0..inputs).map(|i| course.u[k][i] + last[i] - planned[i] + change[i]);
            let u: Vec<f64> = asked
                .enumerate()
                .map(|(i, asked)| self.limits.limit(i, asked, last[i]).0)
                .collect();
            plant.advance(self.period_s, &u)?;
            found.x.push(plant.state());
            let outputs = self.outputs.iter();
            found.y.push(outputs.map(|s| plant.signal(*s)).collect());
            found.u.push(u);
        }
        Ok(found)
    }
}

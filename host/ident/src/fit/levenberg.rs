//! Levenberg–Marquardt over the parameters and all start states
//! (docs/explanation/identification.md, eq. 4 to 8).

use nalgebra::{DMatrix, DVector};

use super::belonging::Belonging;
use super::derivatives::Normal;
use super::segment::{Problem, Segment};

/// Decision variables: plant parameters and one initial state per segment. `z` is derived from
/// `values`: `values[slot] = scale * z`.
#[derive(Clone)]
pub(crate) struct DecisionVariables {
    /// Every parameter of the plant, fitted or not, SI.
    pub values: Vec<f64>,
    /// One start state a segment, SI.
    pub states: Vec<Vec<f64>>,
}

/// Bounds and Gaussian prior of the fitted parameters.
pub(crate) struct Prior {
    /// Bounds of each fitted parameter, SI; infinite where there are none.
    pub bounds: Vec<[f64; 2]>,
    /// Nominal values of the rig, SI.
    pub written: Vec<f64>,
    /// Standard deviation of the prior around each, in units of `Problem::scale`: wide, or
    /// infinite.
    pub widths: Vec<f64>,
    /// Fitted parameters that change together, by the same part of their scales: a list of indices
    /// each.
    pub tied: Vec<Vec<usize>>,
    /// Sums of fitted parameters with a standard normal prior: a list of (index, factor per SI
    /// unit) each.
    pub sums: Vec<Vec<(usize, f64)>>,
    /// The fleet that the device is of, in place of finite widths.
    pub fleet: Option<Belonging>,
}

/// Reason for which a search ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stop {
    /// The next step would gain nothing that noise does not drown.
    Converged,
    /// No step lowers the error any more, though the linear theory promises one: a kink, as
    /// sticking makes.
    Stalled,
    /// The permitted number of steps was taken.
    IterationLimit,
}

/// Stopping criteria of a search.
pub(crate) struct StoppingCriteria {
    pub iterations: usize,
    /// Stops when the predicted reduction falls below this part of the cost.
    pub relative: f64,
}

/// A decrease of the cost, in units of noise squared, that is not worth a step.
const NOTHING: f64 = 1e-3;

/// Rules of the damping. The gain ratio is the reduction of the cost over the predicted reduction.
struct Damping {
    /// Damping of the first step.
    first: f64,
    /// Gain ratio above which a step is accepted.
    accept: f64,
    /// Gain ratio above which the damping shrinks.
    good: f64,
    /// Gain ratio below which the damping grows although the step is accepted.
    fair: f64,
    /// Factor of the damping after a good step.
    shrink: f64,
    /// Factor of the damping after an accepted step below the fair gain ratio.
    grow: f64,
    /// Factor of the damping after a rejected step.
    grow_rejected: f64,
    /// Smallest damping after an accepted step.
    smallest: f64,
    /// Smallest damping after a rejected step.
    smallest_rejected: f64,
    /// Largest damping; above it the search counts as stalled.
    largest: f64,
}

const DAMPING: Damping = Damping {
    first: 1e-3,
    accept: 1e-3,
    good: 0.7,
    fair: 0.2,
    shrink: 0.1,
    grow: 4.0,
    grow_rejected: 8.0,
    smallest: 1e-12,
    smallest_rejected: 1e-6,
    largest: 1e9,
};

impl Damping {
    /// Factor of the damping after an accepted step with this gain ratio.
    fn factor(&self, gain_ratio: f64) -> f64 {
        if gain_ratio > self.good {
            self.shrink
        } else if gain_ratio > self.fair {
            1.0
        } else {
            self.grow
        }
    }
}

/// Relative rounding error of a cost that is summed in another order.
const ROUNDING: f64 = 1e-9;

/// Lowers the cost from `unknowns` on; `progress` hears of each accepted step. `None` where not
/// even the starting point can be simulated.
pub(crate) fn minimise(
    problem: &Problem,
    belief: &Prior,
    segments: &[Segment],
    unknowns: &mut DecisionVariables,
    effort: &StoppingCriteria,
    progress: &mut dyn FnMut(usize, f64),
) -> Option<(Stop, usize)> {
    // What costs more than the best so far is not taken, however much more: its simulations need
    // not end.
    let judge = |candidate: &DecisionVariables, most| {
        let most = most + ROUNDING * most;
        cost_below(problem, belief, segments, candidate, most)
    };
    descend(
        problem, belief, segments, unknowns, effort, progress, &judge,
    )
}

/// [`minimise`] by what `judge` says of a candidate that has this cost to beat.
pub(super) fn descend(
    problem: &Problem,
    belief: &Prior,
    segments: &[Segment],
    unknowns: &mut DecisionVariables,
    effort: &StoppingCriteria,
    progress: &mut dyn FnMut(usize, f64),
    judge: &dyn Fn(&DecisionVariables, f64) -> f64,
) -> Option<(Stop, usize)> {
    let mut cost = total_cost(problem, belief, segments, unknowns);
    if !cost.is_finite() {
        return None;
    }
    let mut damping = DAMPING.first;
    let mut idle = 0;
    for iteration in 0..effort.iterations {
        let normals = problem.linearise(segments, &unknowns.values, &unknowns.states)?;
        loop {
            let step = Step::solve(problem, belief, &normals, unknowns, damping);
            let enough = (effort.relative * cost).max(NOTHING);
            let Some(step) = step else {
                return Some((Stop::Stalled, iteration));
            };
            let candidate = step.apply(problem, belief, unknowns);
            let lower = judge(&candidate, cost);
            // A strongly damped step is short and promises little wherever it is.
            if damping <= 1.0 && step.predicted_reduction.abs() <= enough {
                if lower <= cost {
                    *unknowns = candidate;
                }
                return Some((Stop::Converged, iteration + 1));
            }
            let ratio = (cost - lower) / step.predicted_reduction;
            if lower < cost && ratio > DAMPING.accept {
                damping = (damping * DAMPING.factor(ratio)).max(DAMPING.smallest);
                idle = if cost - lower < enough { idle + 1 } else { 0 };
                *unknowns = candidate;
                cost = lower;
                break;
            }
            damping = (damping * DAMPING.grow_rejected).max(DAMPING.smallest_rejected);
            if damping > DAMPING.largest {
                return Some((Stop::Stalled, iteration));
            }
        }
        progress(iteration + 1, cost);
        if idle == 3 {
            return Some((Stop::Stalled, iteration + 1));
        }
    }
    Some((Stop::IterationLimit, effort.iterations))
}

/// Half the weighted squares plus the prior.
pub(crate) fn total_cost(
    problem: &Problem,
    belief: &Prior,
    segments: &[Segment],
    unknowns: &DecisionVariables,
) -> f64 {
    cost_below(problem, belief, segments, unknowns, f64::INFINITY)
}

/// As [`total_cost`]; infinite where it exceeds `most` by more than rounding.
fn cost_below(
    problem: &Problem,
    belief: &Prior,
    segments: &[Segment],
    unknowns: &DecisionVariables,
    most: f64,
) -> f64 {
    let pulls = belief.pull(problem, &unknowns.values);
    let sums = belief.sums_at(problem, &unknowns.values);
    let prior: f64 = (pulls.iter().chain(&sums))
        .map(|pull| 0.5 * pull * pull)
        .sum();
    let prior = prior + belief.strangeness(problem, &unknowns.values);
    if !prior.is_finite() {
        return f64::INFINITY;
    }
    problem.cost_below(segments, &unknowns.values, &unknowns.states, most - prior) + prior
}

impl Prior {
    /// Prior where no parameter is fitted.
    pub fn none() -> Self {
        Self {
            bounds: Vec::new(),
            written: Vec::new(),
            widths: Vec::new(),
            tied: Vec::new(),
            sums: Vec::new(),
            fleet: None,
        }
    }

    /// Each sum of parameters.
    fn sums_at(&self, problem: &Problem, values: &[f64]) -> Vec<f64> {
        let sum = |terms: &Vec<(usize, f64)>| {
            let each = terms
                .iter()
                .map(|&(j, factor)| factor * values[problem.slots[j]]);
            each.sum()
        };
        self.sums.iter().map(sum).collect()
    }

    /// Change of a sum by a step in units of the scales.
    fn sum_of_step(&self, sum: usize, problem: &Problem, dz: &DVector<f64>) -> f64 {
        let terms = self.sums[sum].iter();
        terms
            .map(|&(j, factor)| factor * problem.scale[j] * dz[j])
            .sum()
    }

    /// Cost of the fleet's prior; infinite for a value that no device of it can have.
    fn strangeness(&self, problem: &Problem, values: &[f64]) -> f64 {
        let fleet = self.fleet.as_ref();
        fleet.map_or(0.0, |it| it.cost(&problem.of_slots(values)))
    }

    /// Gradient of the fleet's prior by `z`, and its curvature.
    fn of_fleet(&self, problem: &Problem, values: &[f64]) -> Option<(DVector<f64>, DMatrix<f64>)> {
        let fleet = self.fleet.as_ref()?;
        Some(fleet.linearised(&problem.of_slots(values), &problem.scale))
    }

    /// Curvature of the fleet's prior by `z`.
    pub(super) fn curvature(&self, problem: &Problem, values: &[f64]) -> Option<DMatrix<f64>> {
        self.of_fleet(problem, values)
            .map(|(_, curvature)| curvature)
    }

    /// Distance of each fitted parameter from the rig, in standard deviations of the prior.
    fn pull(&self, problem: &Problem, values: &[f64]) -> Vec<f64> {
        (0..problem.parameters())
            .map(|j| {
                (values[problem.slots[j]] - self.written[j]) / (self.widths[j] * problem.scale[j])
            })
            .collect()
    }
}

/// One step: `dz`, and `dx` of each segment in units of its scale.
struct Step {
    dz: DVector<f64>,
    dx: Vec<DVector<f64>>,
    /// Reduction of the cost that the linearisation predicts.
    predicted_reduction: f64,
}

impl Step {
    /// Eliminates the start states (eq. 6), solves for the parameters with those at a bound held
    /// (eq. 7), and goes back for the states. `None` where the equations cannot be solved even
    /// damped.
    fn solve(
        problem: &Problem,
        belief: &Prior,
        normals: &[Normal],
        unknowns: &DecisionVariables,
        damping: f64,
    ) -> Option<Self> {
        let parameters = problem.parameters();
        let mut reduced = DMatrix::<f64>::zeros(parameters, parameters);
        let mut gradient = DVector::<f64>::zeros(parameters);
        let mut steps = Vec::with_capacity(normals.len());
        for (normal, state) in normals.iter().zip(&unknowns.states) {
            let normal = problem.held(normal, &unknowns.values, state);
            let factor = damped(&normal.xx, damping).cholesky()?;
            let back = factor.solve(&normal.zx.transpose());
            reduced += &normal.zz - &normal.zx * &back;
            let alone = factor.solve(&normal.bx);
            gradient += &normal.bz - &normal.zx * &alone;
            steps.push((alone, back));
        }
        let pull = belief.pull(problem, &unknowns.values);
        for j in 0..parameters {
            reduced[(j, j)] += belief.widths[j].powi(-2);
            gradient[j] -= pull[j] / belief.widths[j];
        }
        let sums = belief.sums_at(problem, &unknowns.values);
        for (terms, sum) in belief.sums.iter().zip(&sums) {
            for &(i, of_i) in terms {
                gradient[i] -= of_i * problem.scale[i] * sum;
                for &(j, of_j) in terms {
                    reduced[(i, j)] += of_i * problem.scale[i] * of_j * problem.scale[j];
                }
            }
        }
        let fleet = belief.of_fleet(problem, &unknowns.values);
        if let Some((slope, curvature)) = &fleet {
            reduced += curvature;
            gradient -= slope;
        }

        let free = unblocked(problem, belief, unknowns, &gradient);
        let free = together(&free, &belief.tied);
        let over = |group: &[usize], of: &dyn Fn(usize) -> f64| -> f64 {
            group.iter().map(|&j| of(j)).sum()
        };
        let small = DMatrix::from_fn(free.len(), free.len(), |row, column| {
            over(&free[row], &|i| over(&free[column], &|j| reduced[(i, j)]))
        });
        let slope = DVector::from_fn(free.len(), |row, _| over(&free[row], &|j| gradient[j]));
        let mut dz = DVector::zeros(parameters);
        if !free.is_empty() {
            let solution = damped(&small, damping).cholesky()?.solve(&slope);
            for (group, &change) in free.iter().zip(&solution) {
                for &j in group {
                    dz[j] = change;
                }
            }
        }
        clip(problem, belief, unknowns, &mut dz);
        let dx: Vec<DVector<f64>> = (steps.into_iter().zip(&unknowns.states))
            .map(|((alone, back), state)| {
                let mut dx = alone - back * &dz;
                problem.clip_local(&unknowns.values, state, &mut dx);
                dx
            })
            .collect();
        let mut predicted_reduction = predicted_reduction(belief, normals, &pull, &dz, &dx);
        for (index, sum) in sums.iter().enumerate() {
            let change = belief.sum_of_step(index, problem, &dz);
            predicted_reduction -= sum * change + 0.5 * change * change;
        }
        if let Some((slope, curvature)) = &fleet {
            predicted_reduction -= slope.dot(&dz) + 0.5 * dz.dot(&(curvature * &dz));
        }
        (predicted_reduction.is_finite()).then_some(Self {
            dz,
            dx,
            predicted_reduction,
        })
    }

    fn apply(
        &self,
        problem: &Problem,
        belief: &Prior,
        unknowns: &DecisionVariables,
    ) -> DecisionVariables {
        let mut next = unknowns.clone();
        for (j, &slot) in problem.slots.iter().enumerate() {
            let [low, high] = belief.bounds[j];
            // Clamped once more: `scale * dz` may round past the bound that `clip` aimed at.
            next.values[slot] =
                (next.values[slot] + problem.scale[j] * self.dz[j]).clamp(low, high);
        }
        for (state, dx) in next.states.iter_mut().zip(&self.dx) {
            for (i, x) in state.iter_mut().enumerate() {
                *x += problem.state_scale[i] * dx[i];
            }
        }
        next
    }
}

/// Marquardt's damping: a multiple of the diagonal, and a trace so that an empty row can be
/// factored.
fn damped(matrix: &DMatrix<f64>, damping: f64) -> DMatrix<f64> {
    let mut matrix = matrix.clone();
    let largest = matrix.diagonal().amax().max(f64::MIN_POSITIVE);
    for i in 0..matrix.nrows() {
        matrix[(i, i)] = matrix[(i, i)] * (1.0 + damping) + 1e-13 * largest;
    }
    matrix
}

/// Parameters that are not held at a bound by the descent direction.
fn unblocked(
    problem: &Problem,
    belief: &Prior,
    unknowns: &DecisionVariables,
    gradient: &DVector<f64>,
) -> Vec<usize> {
    (0..problem.parameters())
        .filter(|&j| {
            let value = unknowns.values[problem.slots[j]];
            let [low, high] = belief.bounds[j];
            !((value <= low && gradient[j] <= 0.0) || (value >= high && gradient[j] >= 0.0))
        })
        .collect()
}

/// Free variables; tied parameters count as one.
fn together(free: &[usize], tied: &[Vec<usize>]) -> Vec<Vec<usize>> {
    let group = |&j: &usize| -> Vec<usize> {
        match tied.iter().find(|group| group.contains(&j)) {
            Some(group) => group.iter().copied().filter(|j| free.contains(j)).collect(),
            None => vec![j],
        }
    };
    let groups = free.iter().map(|j| (j, group(j)));
    let first = groups.filter(|(j, group)| group.first() == Some(j));
    first.map(|(_, group)| group).collect()
}

/// Cuts each component of the step where it would leave its bounds.
fn clip(problem: &Problem, belief: &Prior, unknowns: &DecisionVariables, dz: &mut DVector<f64>) {
    for j in 0..problem.parameters() {
        let value = unknowns.values[problem.slots[j]];
        let [low, high] = belief.bounds[j];
        dz[j] = dz[j].clamp(
            (low - value) / problem.scale[j],
            (high - value) / problem.scale[j],
        );
    }
}

/// Decrease of the quadratic model along the step actually taken (eq. 8).
fn predicted_reduction(
    belief: &Prior,
    normals: &[Normal],
    pull: &[f64],
    dz: &DVector<f64>,
    dx: &[DVector<f64>],
) -> f64 {
    let mut decrease = 0.0;
    for (normal, dx) in normals.iter().zip(dx) {
        decrease += normal.bz.dot(dz) + normal.bx.dot(dx);
        decrease -= 0.5 * dz.dot(&(&normal.zz * dz))
            + dz.dot(&(&normal.zx * dx))
            + 0.5 * dx.dot(&(&normal.xx * dx));
    }
    for ((pull, dz), width) in pull.iter().zip(dz.iter()).zip(&belief.widths) {
        let change = dz / width;
        decrease -= pull * change + 0.5 * change * change;
    }
    decrease
}

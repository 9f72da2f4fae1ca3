//! Searches that are held against each other, each with what it cost.

use std::cell::RefCell;

use anyhow::Result;
use argmin::core::{CostFunction, Executor};
use argmin::solver::neldermead::NelderMead;
use nalgebra::{DMatrix, DVector};

use super::problem::{DERIVATIVES, Problem};

/// The strategy that plans are held against, too.
#[path = "../../../../../host/plan/examples/baselines/cma.rs"]
mod cma;

/// Size of the first simplex and of the first generation, as logarithms of parameters.
const SIZE: f64 = 0.3;
/// Longest step of Levenberg-Marquardt, as the logarithm of a parameter.
const LONGEST: f64 = 1.0;
/// Beginnings of the recording that are fitted before the whole, one in so many rows.
const PARTS: [usize; 2] = [16, 4];
/// Part of the error below which a step of Levenberg-Marquardt gains nothing.
const GAIN: f64 = 1e-9;

/// Lowest error so far after so many simulations, whenever it fell.
#[derive(Default)]
pub struct Trace {
    simulations: usize,
    fallen: Vec<(usize, f64)>,
}

impl Trace {
    /// The lowest error; infinite before the first simulation.
    pub fn lowest(&self) -> f64 {
        self.fallen
            .last()
            .map_or(f64::INFINITY, |(_, error)| *error)
    }

    /// Simulations until an error was reached; `None` where it never was.
    pub fn until(&self, error: f64) -> Option<usize> {
        let mut reached = self.fallen.iter().filter(|(_, fallen)| *fallen <= error);
        reached.next().map(|(count, _)| *count)
    }

    /// Adds what another search did after this one.
    fn append(&mut self, later: &Self) {
        let before = self.simulations;
        for (count, error) in &later.fallen {
            if *error < self.lowest() {
                self.fallen.push((before + count, *error));
            }
        }
        self.simulations += later.simulations;
    }

    fn note(&mut self, simulations: usize, error: f64) {
        self.simulations += simulations;
        if error < self.lowest() {
            self.fallen.push((self.simulations, error));
        }
    }
}

/// Levenberg and Marquardt's method with exact derivatives (Nocedal and Wright 2006, section 10.3),
/// damped in each parameter's own curvature.
pub fn levenberg_marquardt(problem: &Problem, start: &[f64]) -> Trace {
    from(problem, start).0
}

/// The same over the first sixteenth of the rows, then over a quarter, then over all: what runs out
/// of phase over a whole recording does not over its beginning.
///
/// # Errors
/// As [`Problem::beginning`].
pub fn growing(problem: &Problem, start: &[f64]) -> Result<Trace> {
    let mut at = start.to_vec();
    let mut before = 0.0;
    for part in PARTS {
        let (trace, found) = from(&problem.beginning(part)?, &at);
        before += trace.simulations as f64 / part as f64;
        at = found;
    }
    let mut trace = Trace::default();
    trace.note(before.ceil() as usize, f64::INFINITY);
    let (whole, _) = from(problem, &at);
    trace.append(&whole);
    Ok(trace)
}

/// The trace from a start, and the point that it ended at.
fn from(problem: &Problem, start: &[f64]) -> (Trace, Vec<f64>) {
    let count = problem.unknowns();
    let mut trace = Trace::default();
    let mut at = DVector::from_column_slice(start);
    let mut damping = 1e-2;
    while trace.simulations < problem.most {
        let Some(residuals) = problem.linearised(at.as_slice()) else {
            break;
        };
        let rows = residuals.len() as f64;
        let error = residuals.iter().map(|r| r.value * r.value).sum::<f64>() / rows;
        trace.note(1 + count, error);
        let mut normal = DMatrix::<f64>::zeros(count, count);
        let mut gradient = DVector::<f64>::zeros(count);
        for residual in &residuals {
            let slopes = &residual.derivative[..count.min(DERIVATIVES)];
            for (i, a) in slopes.iter().enumerate() {
                gradient[i] += a * residual.value;
                for (j, b) in slopes.iter().enumerate() {
                    normal[(i, j)] += a * b;
                }
            }
        }
        let Some(next) = damped(
            problem,
            &mut trace,
            (&at, error),
            (&normal, &gradient),
            &mut damping,
        ) else {
            break;
        };
        let gained = error - trace.lowest();
        at = next;
        if gained < GAIN * error {
            break;
        }
    }
    (trace, at.as_slice().to_vec())
}

/// The first point along growing damping that lowers the error.
fn damped(
    problem: &Problem,
    trace: &mut Trace,
    (at, error): (&DVector<f64>, f64),
    (normal, gradient): (&DMatrix<f64>, &DVector<f64>),
    damping: &mut f64,
) -> Option<DVector<f64>> {
    while *damping < 1e8 && trace.simulations < problem.most {
        let mut system = normal.clone();
        for i in 0..system.nrows() {
            system[(i, i)] += *damping * normal[(i, i)].max(f64::MIN_POSITIVE);
        }
        if let Some(factor) = system.cholesky() {
            let step = factor.solve(gradient);
            let next = at - &step * (LONGEST / step.amax().max(LONGEST));
            let reached = problem.error(next.as_slice());
            trace.note(1, reached);
            if reached < error {
                *damping = (*damping / 5.0).max(1e-12);
                return Some(next);
            }
        }
        *damping *= 5.0;
    }
    None
}

/// Error and its trace, as the solver wants them.
struct Counted<'a> {
    problem: &'a Problem,
    trace: &'a RefCell<Trace>,
}

impl CostFunction for Counted<'_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, at: &Vec<f64>) -> Result<f64> {
        let error = self.problem.error(at);
        self.trace.borrow_mut().note(1, error);
        // The solver compares, and infinity is no number to it.
        Ok(error.min(f64::MAX))
    }
}

/// Nelder and Mead's simplex.
pub fn simplex(problem: &Problem, start: &[f64]) -> Trace {
    let trace = RefCell::new(Trace::default());
    let corner = |i: usize| {
        let mut corner = start.to_vec();
        corner[i] += SIZE;
        corner
    };
    let mut corners = vec![start.to_vec()];
    corners.extend((0..start.len()).map(corner));
    let counted = Counted {
        problem,
        trace: &trace,
    };
    // Most iterations cost one or two simulations.
    let run = Executor::new(counted, NelderMead::new(corners))
        .configure(|state| state.max_iters(problem.most as u64 / 2))
        .run();
    drop(run);
    trace.into_inner()
}

/// CMA-ES.
pub fn evolution(problem: &Problem, start: &[f64], seed: u64) -> Trace {
    let trace = RefCell::new(Trace::default());
    let cost = |at: &[f64]| {
        let error = problem.error(at);
        trace.borrow_mut().note(1, error);
        error
    };
    cma::minimise(start.to_vec(), SIZE, problem.most, seed, &|_| (), &cost);
    trace.into_inner()
}

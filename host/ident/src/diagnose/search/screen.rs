//! A first look at every term, at the price of one simulation a start: what one joint step of the
//! linear theory would leave (docs/explanation/diagnosis.md, eq. 5). It orders the halving and only
//! spares the hopeless from it.

use crate::diagnose::config::CONFIG;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use crate::diagnose::candidate::Trial;
use crate::diagnose::model::Model;
use crate::diagnose::search::subset::Subset;
use crate::error::Result;
use crate::fit::derivatives::Rows;
use crate::fit::levenberg::DecisionVariables;

/// Derivatives of the parent's residuals in its own parameters and start states, factored once.
pub(crate) struct Screen {
    intervals: Vec<Stretch>,
    /// Parameters, start states eliminated.
    reduced: Cholesky<f64, Dyn>,
}

struct Stretch {
    own: Rows,
    width: usize,
    /// Start states.
    states: Cholesky<f64, Dyn>,
    /// `A_xx^-1 A_xz`.
    back: DMatrix<f64>,
}

impl Screen {
    /// `None` where the parent cannot be simulated.
    ///
    /// # Errors
    /// None that fitting the parent has not excluded.
    pub fn new(subset: &Subset, parent: &Trial) -> Result<Option<Self>> {
        let model = &parent.model;
        let segments = subset.data.segments(&model.plant, &subset.intervals)?;
        let from = DecisionVariables {
            values: parent.point.values.clone(),
            states: parent.point.states.clone(),
        };
        let problem = model.problem(subset.data, &segments, &from);
        let parameters = problem.parameters();
        // The prior of a fit: what the data leave open stays near what the rig says.
        let mut reduced =
            DMatrix::<f64>::identity(parameters, parameters) / CONFIG.model.prior_width.powi(2);
        let mut intervals = Vec::new();
        let width = parameters + problem.state_scale.len();
        let seeded = problem.seeded::<8>(&segments, &from.values, width);
        for (segment, state) in segments.iter().zip(&from.states) {
            let Some(own) = problem.rows_by(&seeded, segment, state) else {
                return Ok(None);
            };
            let normal = problem.normal(segment, &own, state);
            let Some(states) = traced(normal.xx).cholesky() else {
                return Ok(None);
            };
            let back = states.solve(&normal.zx.transpose());
            reduced += &normal.zz - &normal.zx * &back;
            intervals.push(Stretch {
                own,
                width: parameters + state.len(),
                states,
                back,
            });
        }
        Ok(traced(reduced)
            .cholesky()
            .map(|reduced| Self { intervals, reduced }))
    }

    /// Half the squares that a model with new parameters would keep after one joint linear step
    /// from `from`; infinite where it cannot be simulated.
    ///
    /// # Errors
    /// None that fitting the parent has not excluded.
    pub fn predicted_cost(
        &self,
        subset: &Subset,
        model: &Model,
        from: &DecisionVariables,
    ) -> Result<f64> {
        let segments = subset.data.segments(&model.plant, &subset.intervals)?;
        let mut problem = model.problem(subset.data, &segments, from);
        let slots = problem
            .slots
            .split_off(model.own.max(self.own_parameters()));
        let scale = problem.scale.split_off(problem.slots.len());
        problem.slots = slots;
        problem.scale = scale;
        let fresh = problem.parameters();
        // Last column: the residual itself.
        let mut inner = DMatrix::<f64>::zeros(fresh + 1, fresh + 1);
        let parameters = self.own_parameters();
        let mut across = DMatrix::<f64>::zeros(parameters, fresh + 1);
        let seeded = problem.seeded::<4>(&segments, &from.values, fresh);
        for ((segment, state), stretch) in segments.iter().zip(&from.states).zip(&self.intervals) {
            let Some(rows) = problem.rows_by(&seeded, segment, state) else {
                return Ok(f64::INFINITY);
            };
            let (ee, own) = stretch.products(&rows, fresh);
            let z = own.rows(0, parameters);
            let x = own.rows(parameters, stretch.width - parameters);
            inner += ee - x.transpose() * stretch.states.solve(&x);
            across += z - stretch.back.transpose() * x;
        }
        inner -= across.transpose() * self.reduced.solve(&across);
        let left = inner[(fresh, fresh)];
        let right = inner.view((0, fresh), (fresh, 1)).into_owned();
        let square = inner.view((0, 0), (fresh, fresh)).into_owned();
        let gained = match traced(square).cholesky() {
            Some(factor) => {
                let step: DVector<f64> = factor.solve(&right.column(0).into_owned());
                step.dot(&right.column(0))
            }
            None => 0.0,
        };
        Ok(0.5 * (left - gained))
    }

    fn own_parameters(&self) -> usize {
        self.intervals.first().map_or(0, |s| s.back.ncols())
    }
}

impl Stretch {
    /// Products of new columns and residual among themselves, and with the parent's own columns.
    fn products(&self, rows: &Rows, fresh: usize) -> (DMatrix<f64>, DMatrix<f64>) {
        let mut inner = DMatrix::<f64>::zeros(fresh + 1, fresh + 1);
        let mut own = DMatrix::<f64>::zeros(self.width, fresh + 1);
        let columns = rows.jacobian.chunks_exact(fresh.max(1));
        let known = self.own.jacobian.chunks_exact(self.width);
        for ((column, known), residual) in columns.zip(known).zip(&rows.residual) {
            let at = |j: usize| if j < fresh { column[j] } else { *residual };
            for j in 0..=fresh {
                for i in 0..=fresh {
                    inner[(i, j)] += at(i) * at(j);
                }
                for (i, known) in known.iter().enumerate() {
                    own[(i, j)] += known * at(j);
                }
            }
        }
        (inner, own)
    }
}

fn traced(mut matrix: DMatrix<f64>) -> DMatrix<f64> {
    let largest = matrix.diagonal().amax().max(f64::MIN_POSITIVE);
    for i in 0..matrix.nrows() {
        matrix[(i, i)] += CONFIG.screening.regularisation * largest;
    }
    matrix
}

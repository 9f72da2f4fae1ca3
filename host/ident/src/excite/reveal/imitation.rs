//! Imitation of an effect by a rig's own numbers: its free parameters and its start, refitted to a
//! run with an effect that it lacks (docs/explanation/experiments.md, eq. 5).

use sinew_sim::{Dual, InputTrajectory, Plant, Scalar};

use crate::error::Result;
use crate::parallel;

/// Derivatives carried by one simulation.
const CHUNK: usize = 8;

/// Effort that goes into an imitation.
#[derive(Clone, Copy)]
pub(in crate::excite) struct Effort {
    /// Most steps of Gauss and Newton.
    pub(in crate::excite) steps: usize,
    /// A distance that is not worth another step.
    pub(in crate::excite) enough: f64,
    /// Halvings of a step that does not reduce the error.
    pub(in crate::excite) halvings: usize,
    /// A step that leaves more than this of what there was is the last.
    pub(in crate::excite) worth: f64,
}

/// The rig as it is, and orthonormal directions in which its unknowns move the signals: free
/// parameters, then start states.
pub(in crate::excite) struct Imitation<'a> {
    plant: &'a Plant,
    drive: &'a InputTrajectory,
    times: &'a [f64],
    /// Of the noise, one entry a sensor.
    deviations: &'a [f64],
    /// Values of the unknowns and their bounds.
    unknowns: Vec<f64>,
    bounds: Vec<[f64; 2]>,
    /// Signals in standard deviations of their noise.
    plain: Vec<f64>,
    /// Orthonormal, in the same units.
    directions: Vec<Vec<f64>>,
    /// Motion of the unknowns along each direction.
    moves: Vec<Vec<f64>>,
}

pub(in crate::excite) fn norm(vector: &[f64]) -> f64 {
    dot(vector, vector).sqrt()
}

pub(in crate::excite) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// `to += share * from`.
fn add(to: &mut [f64], share: f64, from: &[f64]) {
    to.iter_mut()
        .zip(from)
        .for_each(|(to, from)| *to += share * from);
}

impl<'a> Imitation<'a> {
    /// # Errors
    /// `Simulation` where the rig cannot be simulated.
    pub(super) fn of(
        plant: &'a Plant,
        start: &[f64],
        experiment: (&'a InputTrajectory, &'a [f64]),
        deviations: &'a [f64],
    ) -> Result<Self> {
        let mut imitation = Self::without_directions(plant, start, experiment, deviations)?;
        let count = imitation.unknowns.len();
        for (unknown, column) in imitation.columns(count)?.into_iter().enumerate() {
            imitation.add(unknown, column);
        }
        Ok(imitation)
    }

    /// The rig as it is, with no direction in which it could move.
    ///
    /// # Errors
    /// `Simulation` where the rig cannot be simulated.
    pub(in crate::excite) fn without_directions(
        plant: &'a Plant,
        start: &[f64],
        (drive, times): (&'a InputTrajectory, &'a [f64]),
        deviations: &'a [f64],
    ) -> Result<Self> {
        let values = plant.values();
        let free = plant.free_slots();
        let free = free.iter().map(|&slot| {
            let known = &plant.parameters()[slot];
            let least = if known.non_negative {
                0.0
            } else {
                f64::NEG_INFINITY
            };
            let low = known.min.unwrap_or(least).max(least);
            (values[slot], [low, known.max.unwrap_or(f64::INFINITY)])
        });
        let states = start
            .iter()
            .map(|&x| (x, [f64::NEG_INFINITY, f64::INFINITY]));
        let (unknowns, bounds) = free.chain(states).unzip();
        let mut imitation = Self {
            plant,
            drive,
            times,
            deviations,
            unknowns,
            bounds,
            plain: Vec::new(),
            directions: Vec::new(),
            moves: Vec::new(),
        };
        imitation.plain = imitation.signals(&imitation.unknowns)?;
        Ok(imitation)
    }

    /// Derivatives of the signals by the first `count` unknowns, in standard deviations of the
    /// noise.
    ///
    /// # Errors
    /// `Simulation` where the rig cannot be simulated.
    pub(in crate::excite) fn columns(&self, count: usize) -> Result<Vec<Vec<f64>>> {
        let chunks: Vec<usize> = (0..count).step_by(CHUNK).collect();
        let derived: Vec<Vec<Vec<f64>>> = parallel::try_map(&chunks, |&from| {
            self.derivatives(from..(from + CHUNK).min(count))
        })?;
        Ok(derived.into_iter().flatten().collect())
    }

    /// Difference of signals from the rig's own, in standard deviations of the noise.
    pub(in crate::excite) fn difference(&self, signals: &[f64]) -> Vec<f64> {
        let mut difference = self.in_deviations(signals);
        add(&mut difference, -1.0, &self.plain);
        difference
    }

    /// Half of the 95 % interval of each free parameter, SI; infinite where no direction moves it.
    ///
    /// The directions are orthonormal in standard deviations of the noise, so the covariance is the
    /// sum of the squares of what each moves.
    pub(super) fn half_widths(&self) -> Vec<f64> {
        let free = 0..self.plant.free_slots().len();
        let of = |unknown: usize| {
            let moved: f64 = self.moves.iter().map(|moves| moves[unknown].powi(2)).sum();
            if moved > 0.0 {
                1.96 * moved.sqrt()
            } else {
                f64::INFINITY
            }
        };
        free.map(of).collect()
    }

    /// Number of directions.
    pub(super) fn directions(&self) -> usize {
        self.directions.len()
    }

    /// The unknowns as what the plant takes: parameter values and a start.
    fn split<S: Scalar>(&self, unknowns: &[S]) -> (Vec<S>, Vec<S>) {
        let slots = self.plant.free_slots();
        let mut values: Vec<S> = self.plant.values().into_iter().map(S::constant).collect();
        for (slot, unknown) in slots.iter().zip(unknowns) {
            values[*slot] = *unknown;
        }
        (values, unknowns[slots.len()..].to_vec())
    }

    /// The rig's signals in standard deviations of their noise.
    fn signals(&self, unknowns: &[f64]) -> Result<Vec<f64>> {
        let (values, start) = self.split(unknowns);
        let run = self
            .plant
            .simulate(&values, &start, self.drive, self.times)?;
        Ok(self.in_deviations(&run.signals))
    }

    fn in_deviations(&self, signals: &[f64]) -> Vec<f64> {
        let pairs = signals.iter().zip(self.deviations.iter().cycle());
        pairs
            .map(|(signal, deviation)| signal / deviation)
            .collect()
    }

    /// Derivatives of the signals by some unknowns.
    fn derivatives(&self, here: std::ops::Range<usize>) -> Result<Vec<Vec<f64>>> {
        let seeded = self.unknowns.iter().enumerate().map(|(k, &x)| {
            if here.contains(&k) {
                Dual::<CHUNK>::variable(x, k - here.start)
            } else {
                Dual::constant(x)
            }
        });
        let (values, start) = self.split(&seeded.collect::<Vec<_>>());
        let run = self
            .plant
            .simulate(&values, &start, self.drive, self.times)?;
        let column = |seed: usize| {
            (run.signals.iter().zip(self.deviations.iter().cycle()))
                .map(|(signal, deviation)| signal.derivative[seed] / deviation)
                .collect()
        };
        Ok((0..here.len()).map(column).collect())
    }

    /// Adds what is new in a direction (Gram and Schmidt, twice for the digits); one that is not
    /// new by a millionth, or that does nothing, is left out.
    fn add(&mut self, unknown: usize, mut column: Vec<f64>) {
        let before = norm(&column);
        if !(before.is_finite() && before > 0.0) {
            return;
        }
        let mut moves = vec![0.0; self.unknowns.len()];
        moves[unknown] = 1.0;
        for _ in 0..2 {
            let back = self.remove(&mut column);
            add(&mut moves, -1.0, &back);
        }
        let after = norm(&column);
        if after > 1e-6 * before {
            column.iter_mut().for_each(|x| *x /= after);
            moves.iter_mut().for_each(|x| *x /= after);
            self.directions.push(column);
            self.moves.push(moves);
        }
    }

    /// Takes out of a vector what the directions hold of it, and returns how the unknowns would
    /// have to move for that.
    fn remove(&self, vector: &mut [f64]) -> Vec<f64> {
        let mut moved = vec![0.0; self.unknowns.len()];
        for (column, moves) in self.directions.iter().zip(&self.moves) {
            let share = dot(column, vector);
            add(vector, -share, column);
            add(&mut moved, share, moves);
        }
        moved
    }

    /// Part of a run with an effect that no unknowns can imitate: the projection of the difference,
    /// and where more than enough of it is left but less than is imitated, that of steps of Gauss
    /// and Newton, each a run of the rig with other numbers inside their bounds. Where more is left
    /// than is imitated, the higher orders of the imitation could not make it up.
    pub(super) fn left(&self, with: &[f64], effort: Effort) -> Vec<f64> {
        let with = self.in_deviations(with);
        let off = |signals: &[f64]| -> (Vec<f64>, Vec<f64>, f64) {
            let mut left: Vec<f64> = with.iter().zip(signals).map(|(a, b)| a - b).collect();
            let whole = dot(&left, &left);
            let step = self.remove(&mut left);
            let imitated = (whole - dot(&left, &left)).max(0.0).sqrt();
            (left, step, imitated)
        };
        let mut at = self.unknowns.clone();
        let (mut left, mut step, imitated) = off(&self.plain);
        if imitated < norm(&left) {
            return left;
        }
        for _ in 0..effort.steps {
            let before = norm(&left);
            if before <= effort.enough || step.iter().all(|x| *x == 0.0) {
                break;
            }
            let better = (0..=effort.halvings).find_map(|halved| {
                let part = 0.5f64.powi(halved as i32);
                let tried = self.moved(&at, part, &step);
                let (left, step, _) = off(&self.signals(&tried).ok()?);
                (norm(&left) < before).then_some((tried, left, step))
            });
            let Some((tried, less, next)) = better else {
                break;
            };
            (at, left, step) = (tried, less, next);
            if norm(&left) > effort.worth * before {
                break;
            }
        }
        left
    }

    /// Unknowns a part of a step on, inside their bounds.
    fn moved(&self, at: &[f64], part: f64, step: &[f64]) -> Vec<f64> {
        (at.iter().zip(step).zip(&self.bounds))
            .map(|((x, step), [low, high])| (x + part * step).max(*low).min(*high))
            .collect()
    }
}

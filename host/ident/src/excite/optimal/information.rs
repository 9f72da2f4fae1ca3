//! Information of a segment: what free parameters and weak effects do to its signals, in products
//! that add up over segments (docs/explanation/experiments.md, eq. 7).

use nalgebra::{Cholesky, DMatrix, DVector};
use sinew_sim::{Plant, Rig};

use crate::error::Result;
use crate::excite::Experiment;
use crate::excite::reveal::{Imitation, Instance, bounded, dot, driven, settings};

/// Part of a parameter's own information that is added to it, so that what nothing determines
/// leaves the others alone.
const RIDGE: f64 = 1e-9;

/// Products of derivatives and differences, in standard deviations of the noise.
#[derive(Clone)]
pub(super) struct Information {
    /// `J' J` of the free parameters, (parameters, parameters).
    parameters: DMatrix<f64>,
    /// One entry an effect: `J' d` and `d' d`.
    effects: Vec<(DVector<f64>, f64)>,
}

/// Linear measure of a design.
pub(super) struct Measure {
    /// One entry an effect: distance from all that the free parameters could imitate, (5).
    pub(super) distances: Vec<f64>,
    /// One entry a free parameter: half of its 95 % interval, SI.
    pub(super) half_widths: Vec<f64>,
}

impl Information {
    /// Of one segment that begins at rest. An effect that cannot be simulated there says nothing.
    ///
    /// # Errors
    /// `Simulation` where the rig itself cannot be simulated.
    pub(super) fn of(
        rig: &Rig,
        segment: &Experiment,
        instances: &[Instance],
        deviations: &[f64],
    ) -> Result<Self> {
        let plant = Plant::new(rig)?.with_settings(settings());
        let (start, drive) = driven(&plant, segment)?;
        let plain = plant.simulate(&plant.values(), &start, &drive, &segment.t)?;
        let settings = bounded(settings(), plain.report.most_substeps);
        let plant = plant.with_settings(settings);
        let experiment = (&drive, segment.t.as_slice());
        let rigid = Imitation::without_directions(&plant, &start, experiment, deviations)?;
        let columns = rigid.columns(plant.free_slots().len())?;
        let count = columns.len();
        let parameters = DMatrix::from_fn(count, count, |a, b| dot(&columns[a], &columns[b]));
        let effects = instances.iter().map(|instance| {
            let Some(signals) = instance.signals(rig, segment, settings) else {
                return (DVector::zeros(count), 0.0);
            };
            let difference = rigid.difference(&signals);
            let with = columns.iter().map(|column| dot(column, &difference));
            (
                DVector::from_iterator(count, with),
                dot(&difference, &difference),
            )
        });
        Ok(Self {
            effects: effects.collect(),
            parameters,
        })
    }

    /// Sum over segments; nothing where there are none.
    pub(super) fn sum<'a>(mut parts: impl Iterator<Item = &'a Self>) -> Option<Self> {
        let first = parts.next()?.clone();
        Some(parts.fold(first, |mut sum, part| {
            sum.parameters += &part.parameters;
            for ((with, own), (other, add)) in sum.effects.iter_mut().zip(&part.effects) {
                *with += other;
                *own += add;
            }
            sum
        }))
    }

    /// The same, of a part of the time.
    pub(super) fn scaled(mut self, part: f64) -> Self {
        self.parameters *= part;
        for (with, own) in &mut self.effects {
            *with *= part;
            *own *= part;
        }
        self
    }

    /// Distances (5) and intervals, from the Schur complement of the parameters.
    pub(super) fn measure(&self) -> Measure {
        let own = self.parameters.diagonal();
        // Each parameter in units of its own information: their sizes differ by many decades.
        let scale = own.map(|x| if x > 0.0 { x.sqrt().recip() } else { 0.0 });
        let count = scale.len();
        let scaled = DMatrix::from_fn(count, count, |a, b| {
            let ridge = if a == b { RIDGE } else { 0.0 };
            let empty = if a == b && scale[a] == 0.0 { 1.0 } else { 0.0 };
            scale[a] * self.parameters[(a, b)] * scale[b] + ridge + empty
        });
        let factor = Cholesky::new(scaled);
        let distances = self.effects.iter().map(|(with, own)| {
            let with = with.component_mul(&scale);
            let imitated = factor
                .as_ref()
                .map_or(0.0, |factor| with.dot(&factor.solve(&with)));
            (own - imitated).max(0.0).sqrt()
        });
        let half_widths = match &factor {
            Some(factor) => {
                let covariance = factor.inverse();
                let of = |k: usize| match scale[k] {
                    0.0 => f64::INFINITY,
                    scale => 1.96 * scale * covariance[(k, k)].max(0.0).sqrt(),
                };
                (0..count).map(of).collect()
            }
            None => vec![f64::INFINITY; count],
        };
        Measure {
            distances: distances.collect(),
            half_widths,
        }
    }
}

/// Rest of each effect after a projection off the free parameters: the judge of the products.
#[cfg(test)]
pub(super) fn projected(
    rig: &Rig,
    segment: &Experiment,
    instances: &[Instance],
    deviations: &[f64],
) -> Vec<Vec<f64>> {
    let plant = Plant::new(rig)
        .expect("the rig is sound")
        .with_settings(settings());
    let (start, drive) = driven(&plant, segment).expect("the segment drives it");
    let experiment = (&drive, segment.t.as_slice());
    let rigid = Imitation::without_directions(&plant, &start, experiment, deviations);
    let rigid = rigid.expect("the rig runs");
    let columns = rigid
        .columns(plant.free_slots().len())
        .expect("the rig runs");
    let rows = columns.first().map_or(0, Vec::len);
    let matrix = DMatrix::from_fn(rows, columns.len(), |row, column| columns[column][row]);
    let basis = matrix.qr().q();
    let left = instances.iter().map(|instance| {
        let Some(signals) = instance.signals(rig, segment, settings()) else {
            return Vec::new();
        };
        let difference = DVector::from_vec(rigid.difference(&signals));
        let imitated = &basis * (basis.transpose() * &difference);
        (difference - imitated).iter().copied().collect()
    });
    left.collect()
}

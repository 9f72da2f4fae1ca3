//! Residuals of a fitted rig over recordings, block by block of time
//! (docs/explanation/diagnosis.md).

use std::ops::Range;

use crate::diagnose::config::CONFIG;
use crate::diagnose::data::Data;
use crate::diagnose::model::Model;
use crate::diagnose::noise::{Excess, beyond_rounding, excess};
use crate::error::Result;
use crate::fit::experiment::Views;
use crate::fit::levenberg::DecisionVariables;
use crate::fit::segment::Segment;
use crate::fit::start;

/// Residuals of a rig over the recordings of one role, start states fitted to each interval.
#[derive(Clone)]
pub(crate) struct Residuals {
    /// One entry a sensor: the residuals of each interval, SI, valid samples only.
    pub series: Vec<Vec<Vec<f64>>>,
    /// Rows and values beside them, for plots: (recording, row, residual).
    pub origin: Vec<Vec<(usize, usize)>>,
}

impl Residuals {
    /// Runs a rig over intervals of the data, each from the start state that explains it best.
    ///
    /// # Errors
    /// None that reading the recordings has not excluded.
    pub fn of(
        model: &Model,
        values: &[f64],
        data: &Data,
        intervals: &[(usize, Range<usize>)],
        known: Option<&[Vec<f64>]>,
    ) -> Result<Option<Self>> {
        let mut segments = data.segments(&model.plant, intervals)?;
        let problem = data.judging(&model.plant);
        let whole = segments.iter().all(|segment| segment.rows.start == 0);
        let states = match known {
            Some(states) if whole || data.added(&model.plant).is_empty() => states.to_vec(),
            _ => settled(model, values, data, &mut segments)?,
        };
        let point = DecisionVariables {
            values: values.to_vec(),
            states,
        };
        let sensors = data.sigma.len();
        let mut residuals = Self {
            series: vec![Vec::new(); sensors],
            origin: vec![Vec::new(); sensors],
        };
        for (segment, state) in segments.iter().zip(&point.states) {
            let Some(signals) = problem.signals(segment, &point.values, state) else {
                return Ok(None);
            };
            for sensor in 0..sensors {
                let measured = &data.experiments[segment.experiment].signals[sensor];
                let mut series = Vec::new();
                for (at, row) in segment.rows.clone().enumerate() {
                    if measured[row].is_finite() {
                        series.push(measured[row] - signals[at * sensors + sensor]);
                        residuals.origin[sensor].push((segment.experiment, row));
                    }
                }
                residuals.series[sensor].push(series);
            }
        }
        Ok(Some(residuals))
    }

    /// Excess of each sensor beside noise, roundings to an encoder's step forgiven.
    pub fn excess(&self, data: &Data) -> Vec<Excess> {
        self.series
            .iter()
            .enumerate()
            .map(|(sensor, series)| {
                let step = data.step[sensor];
                if step > 0.0 {
                    let forgiven: Vec<Vec<f64>> = series
                        .iter()
                        .map(|part| part.iter().map(|r| beyond_rounding(*r, step)).collect())
                        .collect();
                    let white = (data.noise[sensor].powi(2) - step * step / 12.0).max(0.0);
                    excess(&forgiven, white.sqrt())
                } else {
                    excess(series, data.noise[sensor])
                }
            })
            .collect()
    }

    /// Number of recordings.
    pub fn recordings(&self) -> usize {
        let indices = self.origin.iter().flatten().map(|(recording, _)| recording);
        indices.max().map_or(0, |last| last + 1)
    }

    /// Root mean square of one sensor's residuals, SI.
    pub fn rms(&self, sensor: usize) -> f64 {
        let count: usize = self.series[sensor].iter().map(Vec::len).sum();
        let squares: f64 = self.series[sensor].iter().flatten().map(|r| r * r).sum();
        (squares / count.max(1) as f64).sqrt()
    }

    /// Sums of squares and counts over blocks of time, one entry a sensor.
    pub fn blocks(&self, length: usize) -> Vec<Vec<[f64; 2]>> {
        self.series
            .iter()
            .map(|series| {
                let parts = series.iter().flat_map(|part| part.chunks(length.max(1)));
                parts
                    .map(|part| [part.iter().map(|r| r * r).sum(), part.len() as f64])
                    .collect()
            })
            .collect()
    }

    /// Samples over which the residuals remember themselves: 1 for white noise, the longest of the
    /// sensors.
    pub fn correlation_time(&self) -> f64 {
        let of_sensor = |series: &Vec<Vec<f64>>| {
            let long: Vec<&Vec<f64>> = series
                .iter()
                .filter(|part| part.len() >= CONFIG.model.correlated_rows)
                .collect();
            let sum: f64 = long
                .iter()
                .map(|part| crate::fit::uncertainty::integrated_autocorrelation(part))
                .sum();
            sum / long.len().max(1) as f64
        };
        self.series.iter().map(of_sensor).fold(1.0, f64::max)
    }
}

/// The start state that explains each interval best; what effects have added goes on from where the
/// interval before ended, so that no memory begins anew with every interval.
fn settled(
    model: &Model,
    values: &[f64],
    data: &Data,
    segments: &mut [Segment],
) -> Result<Vec<Vec<f64>>> {
    let problem = data.judging(&model.plant);
    let views = Views::new(&model.rig, &model.plant);
    let guess = start::states(&problem, &views, segments, values)?;
    let added = data.added(&model.plant);
    if added.is_empty() {
        return Ok(start::settle(&problem, segments, values, guess));
    }
    let mut states: Vec<Vec<f64>> = Vec::with_capacity(segments.len());
    for (index, mut state) in guess.into_iter().enumerate() {
        if let (Some(before), Some(from)) = (index.checked_sub(1), states.last())
            && segments[before].experiment == segments[index].experiment
            && segments[before].rows.end == segments[index].rows.start
            && let Some(ended) = problem.final_state(&segments[before], values, from)
        {
            for &at in &added {
                state[at] = ended[at];
            }
        }
        let segment = &mut segments[index..=index];
        data.hold(&model.plant, &mut segment[0], &state);
        states.extend(start::settle(&problem, segment, values, vec![state]));
    }
    Ok(states)
}

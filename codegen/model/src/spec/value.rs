//! Cost-to-go at the end of the horizon, `[control] terminal = "value"`.

use super::limits::MAX_HORIZON;
use super::validate::check;
use super::{Signal, SpecError};

/// Most rows of a cost-to-go.
pub const MAX_VALUE_ROWS: usize = 3;
/// Most operating points.
pub const MAX_POINTS: usize = 9;

/// A cost-to-go in the place of the steps after the horizon (docs/explanation/controller.md,
/// eq. 4d). Its numbers come from the model ([`crate::value`]), so they are those of the weights
/// that stand beside it.
#[derive(Clone, Debug, PartialEq)]
pub struct ValueSpec {
    /// Rows, 1 to [`MAX_VALUE_ROWS`].
    pub rows: usize,
    /// Rows of the reference after the horizon that enter; the last one is held.
    pub ahead: usize,
    /// Outputs at the operating points, physical units, one point after the other along a way.
    pub points: Vec<Vec<f64>>,
}

impl ValueSpec {
    pub(super) fn validate(&self, horizon: usize, outputs: usize) -> Result<(), SpecError> {
        check(
            "control.value.rows",
            self.rows,
            format!("1 to {MAX_VALUE_ROWS}"),
            |n| (1..=MAX_VALUE_ROWS).contains(&n),
        )?;
        let most = MAX_HORIZON - horizon;
        check(
            "control.value.ahead",
            self.ahead,
            format!("0 to {most}: with the horizon at most {MAX_HORIZON} rows of the reference"),
            |n| n <= most,
        )?;
        check(
            "control.value.points",
            self.points.len(),
            format!("1 to {MAX_POINTS} points"),
            |n| (1..=MAX_POINTS).contains(&n),
        )?;
        for (index, point) in self.points.iter().enumerate() {
            check(
                format!("control.value.points.{index}"),
                point.len(),
                format!("{outputs}: a number for each output"),
                |n| n == outputs,
            )?;
            for (output, y) in point.iter().enumerate() {
                check(
                    format!("control.value.points.{index}.{output}"),
                    *y,
                    "a finite number",
                    |y| (y as f32).is_finite(),
                )?;
            }
        }
        Ok(())
    }

    /// The points in model units, and the direction from the first to the last, of length one; zero
    /// for one point.
    #[must_use]
    pub fn scaled(&self, outputs: &[Signal]) -> (Vec<Vec<f64>>, Vec<f64>) {
        let points: Vec<Vec<f64>> = self
            .points
            .iter()
            .map(|point| {
                let signals = point.iter().zip(outputs);
                signals.map(|(y, s)| (y - s.offset) / s.span).collect()
            })
            .collect();
        let (Some(first), Some(last)) = (points.first(), points.last()) else {
            return (Vec::new(), Vec::new());
        };
        let mut way: Vec<f64> = last.iter().zip(first).map(|(l, f)| l - f).collect();
        let length = way.iter().map(|x| x * x).sum::<f64>().sqrt();
        if length > 0.0 {
            way.iter_mut().for_each(|x| *x /= length);
        }
        (points, way)
    }

    /// Every point lies further along the direction than the one before, in the firmware's
    /// precision.
    pub(crate) fn goes_one_way(&self, outputs: &[Signal]) -> bool {
        let (points, direction) = self.scaled(outputs);
        let place = |y: &[f64]| y.iter().zip(&direction).map(|(y, d)| y * d).sum::<f64>() as f32;
        points
            .windows(2)
            .all(|pair| place(&pair[1]) > place(&pair[0]))
    }
}

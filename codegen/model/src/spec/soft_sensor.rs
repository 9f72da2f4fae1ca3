//! Soft sensor: a map from channels to outputs (docs/explanation/controller.md, section 11).

use super::validate::check;
use super::{Layer, ModelSpec, SpecError};

/// Quadratic map from the channels to the outputs, both in model units
/// (docs/explanation/controller.md, eq. 21). The network then sees no channel.
#[derive(Clone, Debug, PartialEq)]
pub struct SoftSensorSpec {
    /// Root mean square error of each output on stretches of the calibration that did not
    /// calibrate it, physical units, `[n_y]`.
    pub error: Vec<f64>,
    /// c, `[n_y]`.
    pub bias: Vec<f32>,
    /// A, `[n_y][n_s]`, row by row.
    pub linear: Vec<f32>,
    /// B, `[n_y][products]`, row by row; the products z_i z_j with j >= i: 11, 12, .., 1n, 22, ..
    pub quadratic: Vec<f32>,
    /// Relation of each channel to the others, by which one that dies or drifts is found.
    pub watch: Option<WatchSpec>,
}

/// Linear map from all other channels to each, model units (docs/explanation/controller.md,
/// eq. 25).
#[derive(Clone, Debug, PartialEq)]
pub struct WatchSpec {
    /// b, `[n_s]`.
    pub bias: Vec<f32>,
    /// W, `[n_s][n_s]`, row by row; its diagonal is zero.
    pub weights: Vec<f32>,
    /// Spread of each channel about what the others say, `[n_s]`.
    pub spread: Vec<f32>,
}

impl WatchSpec {
    /// Fewest channels of which one can be left out.
    pub const LEAST: usize = 4;

    /// Channels as the others say them, from channels in model units; double precision.
    #[must_use]
    pub fn said(&self, z: &[f64]) -> Vec<f64> {
        let rows = self.bias.iter().zip(self.weights.chunks(z.len().max(1)));
        rows.map(|(bias, row)| {
            let terms = row.iter().zip(z).map(|(w, z)| f64::from(*w) * z);
            f64::from(*bias) + terms.sum::<f64>()
        })
        .collect()
    }

    fn validate(&self, n_s: usize) -> Result<(), SpecError> {
        check(
            "soft_sensor.watched",
            n_s,
            format!("{} channels or more where they are watched", Self::LEAST),
            |n| n >= Self::LEAST,
        )?;
        let shapes = [
            ("watch.bias", &self.bias, n_s),
            ("watch.weights", &self.weights, n_s * n_s),
            ("watch.spread", &self.spread, n_s),
        ];
        for (name, weights, expected) in shapes {
            check(
                "soft_sensor",
                weights.len(),
                format!("{expected} finite weights in `{name}`"),
                |n| n == expected && weights.iter().all(|w| w.is_finite()),
            )?;
        }
        let own = self.weights.iter().step_by(n_s + 1);
        check(
            "soft_sensor",
            "`watch.weights` with a diagonal",
            "zeros on it: no channel says what it should read itself",
            |_| own.into_iter().all(|w| *w == 0.0),
        )?;
        check(
            "soft_sensor",
            "`watch.spread` with a number that is not positive",
            "normal positive numbers: they divide",
            |_| self.spread.iter().all(|s| *s >= f32::MIN_POSITIVE),
        )
    }
}

impl SoftSensorSpec {
    /// Number of products of two of `channels`, each once.
    #[must_use]
    pub const fn products(channels: usize) -> usize {
        channels * (channels + 1) / 2
    }

    /// Outputs in model units, from channels in model units; double precision.
    #[must_use]
    pub fn outputs(&self, z: &[f64]) -> Vec<f64> {
        let (n_s, n_q) = (z.len(), Self::products(z.len()));
        let rows = self.bias.iter().enumerate();
        rows.map(|(r, c)| {
            let linear = &self.linear[r * n_s..(r + 1) * n_s];
            let mut products = self.quadratic[r * n_q..(r + 1) * n_q].iter();
            let mut y = f64::from(*c);
            for (i, a) in linear.iter().enumerate() {
                let mut slope = f64::from(*a);
                for (z_j, b) in z[i..].iter().zip(products.by_ref()) {
                    slope += f64::from(*b) * z_j;
                }
                y += slope * z[i];
            }
            y
        })
        .collect()
    }
}

impl ModelSpec {
    /// Channels that the network or the filter sees: none behind a soft sensor, which takes them.
    #[must_use]
    pub fn seen_channels(&self) -> &[super::Signal] {
        match self.soft_sensor {
            None => &self.channels,
            Some(_) => &[],
        }
    }

    pub(super) fn validate_soft_sensor(&self) -> Result<(), SpecError> {
        let Some(sensor) = &self.soft_sensor else {
            return Ok(());
        };
        check(
            "channel",
            self.channels.len(),
            "at least one, which the soft sensor takes",
            |n| n > 0,
        )?;
        let recurrent = matches!(self.layers.first(), Some(Layer::Recurrent(_)));
        check(
            "soft_sensor",
            "a soft sensor",
            "none for a model with a state or with a recurrent layer: train one on past readings",
            |_| self.state.is_none() && !recurrent,
        )?;
        let (n_s, n_y) = (self.channels.len(), self.outputs.len());
        let shapes = [
            ("bias", &sensor.bias, n_y),
            ("linear", &sensor.linear, n_y * n_s),
            (
                "quadratic",
                &sensor.quadratic,
                n_y * SoftSensorSpec::products(n_s),
            ),
        ];
        for (name, weights, expected) in shapes {
            check(
                "soft_sensor",
                weights.len(),
                format!("{expected} finite weights in `{name}`"),
                |n| n == expected && weights.iter().all(|w| w.is_finite()),
            )?;
        }
        check(
            "soft_sensor.error",
            sensor.error.len(),
            format!("{n_y} numbers, 0 or more: one for each output"),
            |n| n == n_y && sensor.error.iter().all(|e| e.is_finite() && *e >= 0.0),
        )?;
        match &sensor.watch {
            None => Ok(()),
            Some(watch) => watch.validate(n_s),
        }
    }
}

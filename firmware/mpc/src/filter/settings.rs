//! Prior, noise and rules of a filter.

/// Belief before any reading; model units. Deviations are standard deviations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prior<const NX: usize, const NU: usize, const NP: usize> {
    /// State at rest, and after a gap.
    pub x: [f32; NX],
    /// Deviation of the state at a start at rest: small where rest says what the state is, as with
    /// a velocity. Readings that contradict it widen it to `state_deviation`.
    pub rest_deviation: [f32; NX],
    /// Deviation of the state after a gap, when the plant may move. A reading that is the first
    /// after a start is never refused, so wide is safe.
    pub state_deviation: [f32; NX],
    /// Deviation of the input disturbance about 0.
    pub disturbance_deviation: [f32; NU],
    /// Parameters of the usual device.
    pub theta: [f32; NP],
    /// Deviation of the parameters over the devices: as uncertain as they ever become.
    pub parameter_deviation: [f32; NP],
    /// Least value of each parameter.
    pub lower: [f32; NP],
    /// Largest value of each parameter.
    pub upper: [f32; NP],
}

/// Noise and rules; model units. May change between two calls.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilterSettings<const NX: usize, const NU: usize, const NM: usize, const NP: usize> {
    /// Standard deviation of what a period adds to each state and the model does not know.
    pub state_noise: [f32; NX],
    /// Standard deviation of the change of each input's disturbance over a period.
    pub disturbance_noise: [f32; NU],
    /// Standard deviation of the change of each parameter over a period; 0 for a constant.
    pub parameter_noise: [f32; NP],
    /// Standard deviation of each measurement.
    pub measurement_noise: [f32; NM],
    /// Largest innovation that is believed, in its standard deviations; infinite: all are.
    pub gate: f32,
    /// The parameters are estimated; `false` keeps them.
    pub adapt: bool,
    /// Periods in a row without any accepted reading, before the state starts anew.
    pub max_missing_samples: u16,
}

/// A field of [`FilterSettings`] that is out of its range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InvalidFilterSetting {
    /// A noise of a state is negative or not finite.
    StateNoise,
    /// A noise of a disturbance is negative or not finite.
    DisturbanceNoise,
    /// A noise of a parameter is negative or not finite.
    ParameterNoise,
    /// A noise of a measurement is not positive, not finite, or its square is no f32.
    MeasurementNoise,
    /// The gate is not above 0.
    Gate,
}

impl<const NX: usize, const NU: usize, const NM: usize, const NP: usize>
    FilterSettings<NX, NU, NM, NP>
{
    /// Checks every field.
    ///
    /// # Errors
    /// The first field that is out of its range. A filter with such settings takes a noise for 0
    /// and leaves out the measurement.
    pub fn validate(&self) -> Result<(), InvalidFilterSetting> {
        let is_noise = |v: &f32| (0.0..f32::INFINITY).contains(&(v * v)) && *v >= 0.0;
        if !self.state_noise.iter().all(is_noise) {
            Err(InvalidFilterSetting::StateNoise)
        } else if !self.disturbance_noise.iter().all(is_noise) {
            Err(InvalidFilterSetting::DisturbanceNoise)
        } else if !self.parameter_noise.iter().all(is_noise) {
            Err(InvalidFilterSetting::ParameterNoise)
        } else if !self.measurement_noise.iter().all(|v| variance(*v) > 0.0) {
            Err(InvalidFilterSetting::MeasurementNoise)
        } else if !(self.gate > 0.0) {
            Err(InvalidFilterSetting::Gate)
        } else {
            Ok(())
        }
    }
}

/// Square of a standard deviation; 0 where that is no finite number.
#[inline(always)]
pub(super) const fn variance(deviation: f32) -> f32 {
    let square = deviation * deviation;
    if deviation > 0.0 && square.is_finite() {
        square
    } else {
        0.0
    }
}

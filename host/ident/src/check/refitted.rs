//! A rig refitted to a recording, and what it leaves.

use sinew_sim::{Plant, Rig};

use crate::fit::{Fit, FitOptions, fit};
use crate::noise::noise_level;
use crate::recording::Recording;

/// Largest rig that is refitted: a check is a matter of seconds.
const STATES: usize = 4;

/// A fault is named where the squares without it are below this part of those with it.
pub(super) const FAR_LESS: f64 = 0.2;

/// Error beside the spread of the signals below which a rig explains a recording.
pub(super) const GOOD: f64 = 0.2;

/// Error beside the spread below which nothing is looked for.
pub(super) const EXACT: f64 = 1e-3;

/// Error beside the noise below which a rig leaves nothing but noise.
pub(super) const NOISE_ALONE: f64 = 2.0;

/// Part of the noise that its estimate may exceed it by, squared.
const SURELY_NOISE: f64 = 0.25;

/// Factor by which refitted parameters that are no fault differ from the rig's.
pub(super) const BELIEVED: f64 = 5.0;

/// Factor between a parameter and what the rig says of it that no guess is wrong by.
pub(super) const INCREDIBLE: f64 = 50.0;

/// Steps that show whether a fit goes where it is expected to.
const FEW: usize = 12;

/// A refitted rig beside the recording.
pub(super) struct Refit {
    pub(super) fit: Fit,
    /// Mean square of the error over that of the signals.
    pub(super) squares: f64,
}

impl Refit {
    /// `None` where the rig cannot be fitted.
    pub(super) fn of(rig: &Rig, recording: &Recording) -> Option<Self> {
        Self::by(&FitOptions::default(), rig, recording)
    }

    /// The search alone, for what it leaves.
    pub(super) fn searched(rig: &Rig, recording: &Recording) -> Option<Self> {
        let options = FitOptions {
            search_only: true,
            ..FitOptions::default()
        };
        Self::by(&options, rig, recording)
    }

    /// A few steps from a rig that was fitted before, for what they leave.
    pub(super) fn from_near(fitted: &Rig, recording: &Recording) -> Option<Self> {
        let options = FitOptions {
            iterations: FEW,
            near: true,
            search_only: true,
            ..FitOptions::default()
        };
        Self::by(&options, fitted, recording)
    }

    /// A refit that the search promises to leave less than so many squares; `None` where it does
    /// not. Most faults are not there, and a search is several times as quick as a whole fit.
    pub(super) fn below(most: f64, rig: &Rig, recording: &Recording) -> Option<Self> {
        let promising = Self::searched(rig, recording).is_some_and(|it| it.squares < most);
        promising.then(|| Self::of(rig, recording))?
    }

    fn by(options: &FitOptions, rig: &Rig, recording: &Recording) -> Option<Self> {
        let recordings = std::slice::from_ref(recording);
        let fit = fit(rig, recordings, options, &mut |_| {}).ok()?;
        let squares = squares(&fit)?;
        Some(Self { fit, squares })
    }

    /// Error over the spread of the signals.
    pub(super) fn error(&self) -> f64 {
        self.squares.sqrt()
    }

    /// Fitted value of a parameter; `None` where the recording does not determine it.
    pub(super) fn value(&self, name: &str) -> Option<f64> {
        let parameter = self.fit.parameters.iter().find(|p| p.name == name)?;
        parameter.ci95.map(|_| parameter.value)
    }

    /// Largest factor between a parameter and what the rig says of it.
    pub(super) fn farthest(&self) -> f64 {
        let parameters = self.fit.parameters.iter();
        let factors = parameters
            .filter(|p| p.as_written > 0.0)
            .map(|p| (p.value.max(1e-300) / p.as_written).ln().abs().exp());
        factors.fold(1.0, f64::max)
    }
}

/// Mean square of the error over that of the signals.
pub(super) fn squares(fit: &Fit) -> Option<f64> {
    let sensors = fit.sensors.iter().filter(|s| s.spread > 0.0);
    let parts: Vec<f64> = sensors.map(|s| (s.rms / s.spread).powi(2)).collect();
    let sum: f64 = parts.iter().sum();
    (!parts.is_empty() && sum.is_finite()).then(|| sum / parts.len() as f64)
}

/// True of a rig that is small enough for [`super::refit::detect`].
pub(super) fn is_small(rig: &Rig) -> bool {
    let states = Plant::new(rig).map(|plant| plant.state_len());
    states.is_ok_and(|states| states <= STATES) && !rig.actuators.is_empty()
}

/// Tells whether a refit leaves noise alone of a recording of which `plain` leaves far more.
pub(super) fn explains_all_but_noise(
    rig: &Rig,
    recording: &Recording,
    plain: &Refit,
    refit: &Refit,
) -> bool {
    let noise = EXACT.max(NOISE_ALONE * noise(rig, recording));
    refit.squares < FAR_LESS * plain.squares && refit.error() < noise
}

/// Tells whether nothing can be far less than what the rig leaves: noise alone cannot become a
/// fifth of itself.
pub(super) fn is_noise(rig: &Rig, recording: &Recording, plain: &Refit) -> bool {
    let own = noise(rig, recording);
    plain.error() < EXACT || FAR_LESS * plain.squares < SURELY_NOISE * own * own
}

/// White noise of the sensors over their spread, root mean square.
pub(super) fn noise(rig: &Rig, recording: &Recording) -> f64 {
    let parts = rig.sensors.iter().filter_map(|sensor| {
        let values = recording.column(&sensor.signal)?;
        let valid: Vec<f64> = values.iter().copied().filter(|y| y.is_finite()).collect();
        let count = valid.len().max(1) as f64;
        let mean = valid.iter().sum::<f64>() / count;
        let variance = valid.iter().map(|y| (y - mean).powi(2)).sum::<f64>() / count;
        let noise = noise_level(recording.t(), values);
        (variance > 0.0).then(|| noise * noise / variance)
    });
    let parts: Vec<f64> = parts.collect();
    (parts.iter().sum::<f64>() / parts.len().max(1) as f64).sqrt()
}

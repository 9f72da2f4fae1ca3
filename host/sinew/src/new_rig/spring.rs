//! Presence of a spring, decided by fits to the recording.

use sinew_sim::Rig;

use sinew_ident::cli::progress::Stage;
use sinew_ident::fit::{FitOptions, SensorFit, fit};
use sinew_ident::recording::Recording;

/// With a spring the rig must leave less than this part of what it leaves without: a stiffness is a
/// parameter more.
const WORTH: f64 = 0.7;

/// Result of the two fits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Verdict {
    pub spring: bool,
    /// Free-run error after a fit, as a part of what the sensors move, with a spring and without;
    /// infinite where the rig cannot be fitted.
    left: [f64; 2],
}

impl Verdict {
    /// Fits both rigs.
    pub fn of(recording: &Recording, with: &str, without: &str, quiet: bool) -> Self {
        let stage = Stage::begin("ask the recording for a spring", quiet);
        let left = [with, without].map(|text| left(recording, text));
        let verdict = Self {
            spring: left[0] < WORTH * left[1],
            left,
        };
        stage.end(verdict.sentence());
        verdict
    }

    /// For the file and the terminal.
    pub fn sentence(&self) -> String {
        let said = |left: f64| match left {
            left if left < 1.0 => format!("{:.1} %", 100.0 * left),
            _ => "all of it".into(),
        };
        let [with, without] = self.left.map(said);
        format!(
            "{} spring: a fit with one misses the motion by {with}, without {without}",
            if self.spring { "a" } else { "no" }
        )
    }
}

/// Free-run error of a rig on a recording relative to the motion, the sensors' geometric mean.
fn left(recording: &Recording, text: &str) -> f64 {
    let fitted = Rig::parse(text, "with or without a spring")
        .map_err(sinew_ident::error::Error::from)
        .and_then(|rig| {
            let options = FitOptions::default();
            fit(&rig, std::slice::from_ref(recording), &options, &mut |_| {})
        });
    let Ok(fitted) = fitted else {
        return f64::INFINITY;
    };
    let part = |s: &SensorFit| (s.rms / s.spread.max(f64::MIN_POSITIVE)).max(f64::MIN_POSITIVE);
    let logs = fitted.sensors.iter().map(|sensor| part(sensor).ln());
    (logs.sum::<f64>() / fitted.sensors.len().max(1) as f64).exp()
}

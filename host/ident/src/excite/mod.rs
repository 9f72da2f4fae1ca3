//! Designed experiments: inputs that a rig can be driven with, inside its limits and rate limits,
//! and what they would reveal (docs/explanation/experiments.md).
//!
//! ```
//! use sinew_ident::excite::{Kind, Options, design};
//! let rig = sinew_sim::Rig::parse(
//!     "format='sinew-rig/1'\nname='x'\n[[body]]\nname='m'\nmotion='slide'\ninertia=1.0\n\
//!      [[actuator]]\nname='a'\ndrives='m'\ninput='u_N'\ngain=1.0\nlimit=[-2.0, 2.0]\nrate_limit=8.0\n",
//!     "x.toml",
//! )?;
//! let plant = sinew_sim::Plant::new(&rig)?;
//! let options = Options { kind: Kind::Steps, seconds: 4.0, rate_hz: 100.0, ..Options::default() };
//! let experiment = design(&plant, "x.toml", &options)?;
//! let u = &experiment.inputs[0];
//! assert!(u.windows(2).all(|w| (w[1] - w[0]).abs() <= 0.08) && u.iter().all(|u| u.abs() <= 2.0));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod json;
mod limits;
pub mod optimal;
pub mod reveal;
mod signal;
mod table;

use std::path::Path;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use sinew_sim::{Input, Plant};

use crate::error::{Error, Result};
use crate::recording::{Column, Recording};
use crate::report::significant;
pub use table::table;

/// Shape of the inputs of an experiment.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Sines of many frequencies at once, each input with frequencies of its own.
    Multisine,
    /// Levels at random, held for times at random.
    Steps,
    /// Slow triangles that grow: small and large loops, almost without inertia.
    Triangle,
    /// A sine whose frequency rises.
    Chirp,
    /// A quarter of each.
    Mixed,
}

impl Kind {
    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Multisine => "multisine",
            Self::Steps => "steps",
            Self::Triangle => "triangle",
            Self::Chirp => "chirp",
            Self::Mixed => "mixed",
        }
    }
}

/// Settings of a design.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// Shape of the inputs.
    pub kind: Kind,
    /// Duration, s.
    pub seconds: f64,
    /// Samples a second.
    pub rate_hz: f64,
    /// Seed of everything that is drawn.
    pub seed: u64,
    /// Fraction of each input's range that is used, about its middle.
    pub amplitude: f64,
    /// Lowest and highest frequency of sines, Hz; without it two periods in the experiment and a
    /// twelfth of the rate.
    pub band_hz: Option<[f64; 2]>,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            kind: Kind::Mixed,
            seconds: 30.0,
            rate_hz: 120.0,
            seed: 1,
            amplitude: 0.8,
            band_hz: None,
        }
    }
}

/// Longest experiment: what a person would wait for and a recording still holds.
const MOST_ROWS: f64 = 2e6;
/// Fewest rows of an experiment.
const LEAST_ROWS: f64 = 16.0;

/// A design: times, and a column an input of the plant, SI.
///
/// ```
/// use sinew_ident::excite::{Kind, Options, design};
/// use sinew_sim::{Plant, Rig};
///
/// let rig = Rig::parse(include_str!("../../../../rigs/mass-spring-damper.toml"), "rig.toml")?;
/// let plant = Plant::new(&rig)?;
/// let options = Options { kind: Kind::Chirp, seconds: 2.0, rate_hz: 100.0, ..Options::default() };
/// let experiment = design(&plant, "rig.toml", &options)?;
/// assert_eq!((experiment.t.len(), experiment.inputs.len()), (201, plant.inputs().len()));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Experiment {
    /// s, from 0.
    pub t: Vec<f64>,
    /// One column an input, in the plant's order.
    pub inputs: Vec<Vec<f64>>,
}

impl Options {
    /// Checks that the settings are consistent.
    fn check(&self) -> Result<()> {
        let positive = |x: f64| x.is_finite() && x > 0.0;
        for (flag, value, unit, example) in [
            ("--seconds", self.seconds, "s", "--seconds 20"),
            ("--rate", self.rate_hz, "Hz", "--rate 120"),
        ] {
            if !positive(value) {
                let expectation = format!("more than 0 {unit}");
                return Err(
                    Error::must_be(flag, expectation, value).help(format!("for example {example}"))
                );
            }
        }
        let rows = self.seconds * self.rate_hz;
        if !(LEAST_ROWS..=MOST_ROWS).contains(&rows) {
            let (least, most) = (LEAST_ROWS / self.rate_hz, MOST_ROWS / self.rate_hz);
            let expectation = format!(
                "{} to {} s at {} Hz",
                significant(least, 3),
                significant(most, 3),
                self.rate_hz
            );
            let help =
                format!("that is {LEAST_ROWS} to {MOST_ROWS} rows; for example --seconds 20");
            return Err(Error::must_be("--seconds", expectation, self.seconds).help(help));
        }
        if !(self.amplitude > 0.0 && self.amplitude <= 1.0) {
            let expectation = "a fraction of the range in (0, 1]";
            return Err(Error::must_be("--amplitude", expectation, self.amplitude)
                .help("for example --amplitude 0.8; 1 reaches the limits themselves"));
        }
        match self.band_hz {
            Some([low, high]) if !(low > 0.0 && low < high && high <= self.rate_hz / 2.0) => {
                let most = self.rate_hz / 2.0;
                let expectation = format!("LOW,HIGH in Hz with 0 < LOW < HIGH <= {most}");
                Err(
                    Error::must_be("--band", expectation, format!("{low},{high}"))
                        .help("for example --band 0.1,10; HIGH is at most half the rate"),
                )
            }
            _ => Ok(()),
        }
    }

    fn band(&self) -> [f64; 2] {
        self.band_hz.unwrap_or_else(|| {
            let low = 2.0 / self.seconds;
            [low, (self.rate_hz / 12.0).max(2.0 * low)]
        })
    }
}

/// Designs an experiment for a plant; `file` is its rig's, for errors.
///
/// Every column begins at zero (or at the limit that is nearest to it), keeps to its actuator's
/// `limit` and changes from row to row by no more than `rate_limit` allows, to the last bit as the
/// CSV has them.
///
/// # Errors
/// `Arguments` for numbers that make no sense; `File`, with the actuator's line, where an input has
/// no limit.
pub fn design(plant: &Plant, file: impl AsRef<Path>, options: &Options) -> Result<Experiment> {
    options.check()?;
    if plant.inputs().is_empty() {
        return Err(Error::file(
            file,
            "the rig has no actuator: nothing can excite it",
        ));
    }
    if let Some(reason) = plant.only_recordings() {
        let message = format!("only a recording can drive this rig: {reason}");
        return Err(Error::file(file, message).expected("a rig that its actuators alone drive"));
    }
    let rows = (options.seconds * options.rate_hz).round() as usize + 1;
    let t: Vec<f64> = (0..rows).map(|k| k as f64 / options.rate_hz).collect();
    let count = plant.inputs().len();
    let inputs = plant.inputs().iter().enumerate().map(|(index, input)| {
        // Each input draws from a stream of its own, so that one more leaves the others as they
        // were.
        let mut random = ChaCha8Rng::seed_from_u64(options.seed);
        random.set_stream(index as u64);
        let signal = signal::shape(options, options.band(), &t, (index, count), &mut random);
        Ok(bounds_of(input, file.as_ref(), options.amplitude)?.keep(&t, &signal))
    });
    let inputs = inputs.collect::<Result<_>>()?;
    Ok(Experiment { t, inputs })
}

/// Part of an actuator's range that is used, about its middle.
///
/// # Errors
/// `File`, with the actuator's line, where it has no limit.
fn bounds_of(input: &Input, file: &Path, amplitude: f64) -> Result<limits::Bounds> {
    let Some(limit) = input.limit else {
        let message = format!("actuator `{}` has no `limit`", input.actuator);
        return Err(Error::file(file, message)
            .at(input.line, 1)
            .expected("`limit = [lower, upper]`: what it may be driven with"));
    };
    Ok(limits::Bounds::of(input, limit, amplitude))
}

impl Experiment {
    /// The experiment as a recording of input columns, in the columns' own units.
    ///
    /// # Errors
    /// None beyond what [`Recording::new`] refuses.
    pub fn recording(&self, plant: &Plant, path: impl AsRef<Path>) -> Result<Recording> {
        let columns = plant.inputs().iter().zip(&self.inputs);
        let columns = columns.map(|(input, values)| Column {
            name: input.column.clone(),
            values: values.iter().map(|u| u / input.column_factor).collect(),
        });
        Recording::new(path, self.t.clone(), columns.collect())
    }
}

#[cfg(test)]
mod tests;

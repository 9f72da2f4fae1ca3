//! A watched run as a recording: CSV.

use std::fmt::Write as _;
use std::io::Write;
use std::path::Path;

use sinew_device::mode::Mode;
use sinew_device::protocol::Telemetry;

use super::Names;
use super::topics::STATUSES;
use sinew_ident::error::{Error, Result};

/// The file of a run, written as it goes, so that it is whole up to the moment when something
/// breaks.
pub struct Saved {
    path: std::path::PathBuf,
    file: std::io::BufWriter<Box<dyn std::io::Write + Send>>,
    /// Factors to SI of the columns of inputs, and of outputs.
    factors: [Vec<f64>; 2],
    /// Columns of learned parameters.
    learned: usize,
}

impl Saved {
    /// Begins the file.
    ///
    /// # Errors
    /// `Write`.
    pub fn create(path: &Path, names: &Names) -> Result<Self> {
        let file = sinew_files::open(path)?;
        let mut saved = Self {
            path: path.to_path_buf(),
            file: std::io::BufWriter::new(file),
            factors: [&names.inputs, &names.outputs].map(|columns| names.units.factors(columns)),
            learned: names.learned.names().count(),
        };
        let of = |what: &str| {
            names
                .outputs
                .iter()
                .map(move |n| format!("{what}_{n}"))
                .collect()
        };
        let groups: [Vec<String>; 5] = [
            names.inputs.clone(),
            names.outputs.clone(),
            of("reference"),
            of("estimate"),
            of("disturbance"),
        ];
        let header = groups.concat().join(",");
        saved.line(&format!("# status: {}", statuses()))?;
        saved.line(&names.learned.model_line())?;
        let learned: String = names.learned.names().map(|it| format!(",{it}")).collect();
        saved.line(&format!(
            "t,{header},armed_1,status_1,iterations_1,step_ticks_1,late_1,tick_1{learned}"
        ))?;
        Ok(saved)
    }

    /// Adds a tick.
    ///
    /// # Errors
    /// `Write`.
    pub fn row(&mut self, seen: &Telemetry, learned: Option<&[f64]>) -> Result<()> {
        let mut line = format!("{}", seen.at_us as f64 * 1e-6);
        let [inputs, outputs] = &self.factors;
        for (values, factors) in [
            (&seen.u, inputs),
            (&seen.y, outputs),
            (&seen.reference, outputs),
            (&seen.estimate, outputs),
            (&seen.disturbance, outputs),
        ] {
            for (value, factor) in values.iter().zip(factors) {
                // A missing value is an empty field, and what is in SI keeps its digits.
                let text = if value.is_nan() {
                    String::new()
                } else if *factor == 1.0 {
                    value.to_string()
                } else {
                    (f64::from(*value) / factor).to_string()
                };
                let _ = write!(line, ",{text}");
            }
        }
        let armed = u8::from(matches!(seen.state.mode, Mode::Armed(_)));
        let _ = write!(
            line,
            ",{armed},{},{},{},{},{}",
            seen.status as u8, seen.iterations, seen.ticks, seen.deadline_misses, seen.tick
        );
        for i in 0..self.learned {
            let value = learned.and_then(|values| values.get(i));
            let _ = write!(line, ",{}", value.map_or(String::new(), f64::to_string));
        }
        self.line(&line)
    }

    fn line(&mut self, text: &str) -> Result<()> {
        writeln!(self.file, "{text}").map_err(|e| Error::write(&self.path, e))
    }

    /// Writes what waits.
    ///
    /// # Errors
    /// `Write`.
    pub fn flush(&mut self) -> Result<()> {
        self.file.flush().map_err(|e| Error::write(&self.path, e))
    }
}

/// Meanings of the numbers in the status column.
fn statuses() -> String {
    STATUSES
        .map(|status| format!("{} {status:?}", status as u8))
        .join(", ")
}

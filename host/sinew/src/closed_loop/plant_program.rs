//! A plant that another program simulates: lines of text over its standard input and output
//! (docs/how-to/plant-program.md, "A plant of another program"). A plant that shares no code with
//! this one is the harder judge.

use std::io::{BufRead, BufReader, Write};
use std::process::{ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::time::{Duration, Instant};

use sinew_sim::{InputTrajectory, Plant};

use crate::device::Guarded;
use sinew_ident::error::{Error, Result};

/// First line of every such program.
const FORMAT: &str = "sinew-plant/1";
/// Longest wait for one line. A program may have to load a simulator first.
const PATIENCE: Duration = Duration::from_secs(60);
/// Longest wait for the end of a program that says nothing more, so that its status can be told.
const LEAVE: Duration = Duration::from_secs(2);
/// Time of listening after the last answer.
const LAST_WORDS: Duration = Duration::from_millis(100);
/// Variables that say which of several plants is wanted.
const DRAW: &str = "SINEW_DRAW";
const SPREAD: &str = "SINEW_SPREAD";

/// A program that simulates the plant, and which of its plants.
#[derive(Clone, Debug, PartialEq)]
pub struct PlantProgram {
    /// The command line, for `sh`.
    pub command: String,
    /// 0: as the program has it. Every other number is another plant.
    pub draw: usize,
    /// Largest relative deviation of the parameters of a drawn plant.
    pub spread: f64,
}

/// Recording of a program.
pub struct Recorded {
    /// One entry a sensor of the rig, SI; `None` for one that the program has not.
    pub signals: Vec<Option<Vec<f64>>>,
    /// Signals of the program that no sensor of the rig is called.
    pub strangers: Vec<String>,
}

/// One that runs.
pub struct Running {
    command: String,
    // Killed when this is dropped.
    child: Guarded,
    to: ChildStdin,
    from: Receiver<String>,
    /// Position of each sensor of the rig in a line, and its unit in SI.
    sensors: Vec<Option<(usize, f64)>>,
    /// Units of the inputs in SI.
    inputs: Vec<f64>,
    columns: usize,
    strangers: Vec<String>,
    values: Vec<f64>,
}

impl PlantProgram {
    /// Starts it and hears what it begins with. `wanted`: sensors of `plant` that it must have.
    ///
    /// # Errors
    /// It does not start, says something else, or has other inputs or not all sensors.
    pub fn start(&self, plant: &Plant, wanted: &[usize]) -> Result<Running> {
        let mut command = Command::new("sh");
        command
            .args(["-c", &self.command])
            .env(DRAW, self.draw.to_string())
            .env(SPREAD, self.spread.to_string())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped());
        let failed =
            |e: std::io::Error| complaint(&self.command, format!("cannot be started: {e}"));
        let mut child = Guarded::spawn(&mut command).map_err(failed)?;
        let (Some(to), Some(from)) = (child.stdin(), child.stdout()) else {
            return Err(complaint(&self.command, "has no standard input and output"));
        };
        // Short: a program that talks on and on waits, as it would on a terminal.
        let (lines, heard) = sync_channel(4);
        // A thread of its own, so that a program that says nothing is noticed.
        std::thread::spawn(move || {
            for line in BufReader::new(from).lines() {
                let Ok(line) = line else { break };
                if lines.send(line).is_err() {
                    break;
                }
            }
        });
        let inputs = plant.inputs().iter();
        let mut running = Running {
            command: self.command.clone(),
            child,
            to,
            from: heard,
            sensors: Vec::new(),
            inputs: inputs.clone().map(|i| i.column_factor).collect(),
            columns: 0,
            strangers: Vec::new(),
            values: Vec::new(),
        };
        let format = running.line()?;
        if format.trim() != FORMAT {
            return Err(running.said(&format, FORMAT));
        }
        let columns: Vec<&str> = inputs.map(|i| i.column.as_str()).collect();
        let said = running.line()?;
        if names(&said) != columns {
            let expected = format!("the rig's inputs, in its order: {}", columns.join(","));
            return Err(running.said(&said, &expected));
        }
        let said = running.line()?;
        let has = names(&said);
        let sensors = plant.sensors().iter().map(|sensor| {
            let at = has.iter().position(|name| *name == sensor.column)?;
            Some((at, sensor.column_factor))
        });
        let sensors: Vec<_> = sensors.collect();
        if let Some(missing) = wanted.iter().find(|sensor| sensors[**sensor].is_none()) {
            let column = &plant.sensors()[*missing].column;
            return Err(running.said(&said, &format!("names of signals, `{column}` among them")));
        }
        if sensors.iter().all(Option::is_none) {
            return Err(running.said(&said, "names of signals, the rig's among them"));
        }
        let is_known = |name: &&str| plant.sensors().iter().any(|s| s.column == *name);
        let strangers = has.iter().filter(|name| !is_known(name));
        running.strangers = strangers.map(|name| (*name).to_string()).collect();
        running.columns = has.len();
        running.sensors = sensors;
        running.hear()?;
        Ok(running)
    }

    /// Signal of each sensor of `plant` at times `t` while `drive` is held from row to row.
    ///
    /// # Errors
    /// As [`PlantProgram::start`] and [`Running::advance`].
    pub fn record(&self, plant: &Plant, t: &[f64], drive: &InputTrajectory) -> Result<Recorded> {
        let mut running = self.start(plant, &[])?;
        let mut signals: Vec<Option<Vec<f64>>> = running
            .sensors
            .iter()
            .map(|place| place.map(|_| Vec::with_capacity(t.len())))
            .collect();
        for (row, now) in t.iter().enumerate() {
            for (sensor, signal) in signals.iter_mut().enumerate() {
                if let Some(signal) = signal {
                    signal.push(running.signal(sensor));
                }
            }
            if let Some(next) = t.get(row + 1) {
                let inputs = (0..plant.inputs().len()).map(|input| drive.column(input)[row]);
                running.advance(next - now, &inputs.collect::<Vec<_>>())?;
            }
        }
        // In a recording of a few rows its lines may come just in time for each.
        running.silent(LAST_WORDS)?;
        Ok(Recorded {
            signals,
            strangers: running.strangers,
        })
    }
}

impl Running {
    /// A sensor's signal in SI, now; not a number where the program has no such signal.
    pub fn signal(&self, sensor: usize) -> f64 {
        let place = self.sensors.get(sensor).copied().flatten();
        place.map_or(f64::NAN, |(at, factor)| self.values[at] * factor)
    }

    /// Lets time pass with inputs that are held, in SI.
    ///
    /// # Errors
    /// The program ended, is silent, or says something else than numbers.
    pub fn advance(&mut self, seconds: f64, inputs: &[f64]) -> Result<()> {
        let mut line = seconds.to_string();
        for (value, factor) in inputs.iter().zip(&self.inputs) {
            line += &format!(",{}", value / factor);
        }
        line.push('\n');
        self.silent(Duration::ZERO)?;
        // One that has ended is noticed, with its status, by `hear`.
        let _ = self
            .to
            .write_all(line.as_bytes())
            .and_then(|()| self.to.flush());
        self.hear()
    }

    /// Says so if it talks without being asked: taken for an answer, that would put every later one
    /// a step behind.
    fn silent(&mut self, patience: Duration) -> Result<()> {
        match self.from.recv_timeout(patience) {
            Ok(unasked) => Err(self.said(
                &unasked,
                "nothing before it is asked: one line of signals for each line it gets",
            )),
            Err(_) => Ok(()),
        }
    }

    fn hear(&mut self) -> Result<()> {
        let line = self.line()?;
        let values: Option<Vec<f64>> = line.split(',').map(|v| v.trim().parse().ok()).collect();
        match values {
            Some(values)
                if values.len() == self.columns && values.iter().all(|v| v.is_finite()) =>
            {
                self.values = values;
                Ok(())
            }
            _ => Err(self.said(
                &line,
                &format!("as many finite numbers as signals: {}", self.columns),
            )),
        }
    }

    fn line(&mut self) -> Result<String> {
        match self.from.recv_timeout(PATIENCE) {
            Ok(line) => Ok(line),
            Err(RecvTimeoutError::Timeout) => {
                let message = format!("said nothing for {} s", PATIENCE.as_secs());
                Err(complaint(&self.command, message).help("does it flush every line?"))
            }
            Err(RecvTimeoutError::Disconnected) => {
                let until = Instant::now() + LEAVE;
                loop {
                    match self.child.try_wait() {
                        Ok(None) if Instant::now() < until => {
                            std::thread::sleep(Duration::from_millis(5));
                        }
                        // A line that is no text ends the listening too.
                        Ok(None) => {
                            let message = "runs, but its output was closed or is no text";
                            return Err(complaint(&self.command, message));
                        }
                        Ok(Some(status)) => {
                            let message = format!("ended by itself ({status})");
                            return Err(complaint(&self.command, message));
                        }
                        Err(error) => return Err(complaint(&self.command, error)),
                    }
                }
            }
        }
    }

    fn said(&self, line: &str, expected: &str) -> Error {
        complaint(&self.command, format!("said `{}`", line.trim())).expected(expected)
    }
}

fn names(line: &str) -> Vec<&str> {
    line.split(',').map(str::trim).collect()
}

fn complaint(command: &str, message: impl std::fmt::Display) -> Error {
    Error::failed(format!("the plant `{command}` {message}"))
        .help("docs/how-to/plant-program.md, \"A plant of another program\", has an example")
}

#[cfg(test)]
mod tests {
    use sinew_sim::Rig;

    use super::*;

    /// Result of a recording of a single row, for which a program is never asked for anything.
    fn one_row(says: &str) -> Result<Recorded> {
        let text = "format = \"sinew-rig/1\"\nname = \"cart\"\n[[body]]\nname = \"cart\"\nmotion = \"slide\"\n\
                    inertia = 1.0\n[[actuator]]\nname = \"push\"\ndrives = \"cart\"\ninput = \"u_N\"\ngain = 1.0\n\
                    [[sensor]]\nname = \"ruler\"\nreads = \"cart.position\"\nsignal = \"q_m\"\n";
        let rig = Rig::parse(text, "cart.toml").expect("the text is a rig");
        let plant = Plant::new(&rig).expect("the rig can be simulated");
        let drive = InputTrajectory::new(&plant, 1, &[&[0.0]]).expect("one row");
        let program = PlantProgram {
            // It stays: what is noticed is what it says, not that it has gone.
            command: format!("printf '{FORMAT}\\nu_N\\nq_m\\n{says}'; exec sleep 60"),
            draw: 0,
            spread: 0.0,
        };
        program.record(&plant, &[0.0], &drive)
    }

    #[test]
    fn a_program_that_talks_after_its_last_answer_is_refused() {
        let recorded = one_row("0.25\\n").expect("the program records its request");
        assert_eq!(recorded.signals, [Some(vec![0.25])]);
        let refused = one_row("0.25\\n0.5\\n").err().expect("one line too many");
        let said = refused.to_string();
        assert!(said.contains("said `0.5`"), "{said}");
    }
}

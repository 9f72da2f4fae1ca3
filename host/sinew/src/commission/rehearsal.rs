//! Rehearsal: the bare model's firmware in QEMU, in real time, with a simulated rig behind its
//! converters. The code that a real board meets.

use std::fs::{File, OpenOptions};
use std::io::{Read, Write};
use std::path::Path;

use nix::sys::stat::Mode;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use sinew_model::spec::ModelSpec;
use sinew_sim::{Plant, Stepper};

use crate::device::{Device, Workplace};
use crate::project::{self, Board, Optimise, board_folder};
use sinew_ident::error::{Error, Result};
use sinew_ident::noise::gaussian;

/// Full scale of the board's converters (boards/qemu/src/rig.rs).
const FULL_SCALE: f64 = 4095.0;
/// Standard deviation of the sensors' noise, as a fraction of a span.
const NOISE: f64 = 5e-4;

/// Builds the firmware of a model for QEMU, in `folder`, and starts it with `plant` behind its
/// converters. `cache`: build outputs, where they are shared.
///
/// # Errors
/// Firmware that does not build, QEMU that does not start, a plant that has not the model's
/// signals.
pub fn start(
    spec: &ModelSpec,
    plant: &Plant,
    folder: &Path,
    cache: Option<&Path>,
    quiet: bool,
) -> Result<Device> {
    let bench = SimulatedRig::new(spec, plant)?;
    project::write(folder, spec, Optimise::Speed)?;
    let built = project::build_shown(folder, Board::Qemu, cache, quiet)?;
    let image = (built.free).ok_or_else(|| Error::failed("there is no free-running image"))?;
    let failed = |e: std::io::Error| Error::failed(format!("the simulated rig: {e}"));
    let place = Workplace::new().map_err(failed)?;
    let at = |name: &str| place.path().join(name);
    for name in ["sensors", "actuators"] {
        nix::unistd::mkfifo(&at(name), Mode::S_IRWXU).map_err(|e| failed(e.into()))?;
    }
    let (to, from) = (at("sensors"), at("actuators"));
    // Ends when QEMU does: its ends of the FIFOs are closed then.
    std::thread::spawn(move || bench.serve(&to, &from));
    let runner = board_folder(folder, Board::Qemu).join("run.sh");
    Device::serial_in(place, &runner, &image)
}

/// A plant behind converters of 12 bits, scaled as a board without a wiring scales them.
pub(super) struct SimulatedRig {
    stepper: Stepper<f64>,
    /// Index in the plant, span and offset of each sensor.
    sensors: Vec<(usize, f64, f64)>,
    /// Lower and upper end of each actuator.
    actuators: Vec<(f64, f64)>,
    period_s: f64,
    random: ChaCha8Rng,
}

impl SimulatedRig {
    /// A plant at its rest under the safe commands, or where it starts.
    ///
    /// # Errors
    /// Signals of the model that the plant has not.
    pub(super) fn new(spec: &ModelSpec, plant: &Plant) -> Result<Self> {
        let columns: Vec<&str> = plant.inputs().iter().map(|i| i.column.as_str()).collect();
        let inputs: Vec<&str> = spec.inputs.iter().map(|i| i.name.as_str()).collect();
        if columns != inputs {
            return Err(Error::failed(format!(
                "the plant has the inputs {}, the rig {}",
                columns.join(", "),
                inputs.join(", ")
            )));
        }
        let sensors = spec.outputs.iter().chain(&spec.channels).map(|signal| {
            let found = plant.sensors().iter().position(|s| s.column == signal.name);
            let index = found.ok_or_else(|| {
                Error::failed(format!(
                    "the plant has no sensor of the column `{}`",
                    signal.name
                ))
            })?;
            Ok((index, signal.span, signal.offset))
        });
        let sensors = sensors.collect::<Result<_>>()?;
        let values = plant.values();
        let start = plant.initial_state(&values, &vec![None; plant.sensors().len()])?;
        let rest = plant.rest(&values, &spec.control.safe, &start);
        let start = rest.map_or(start, |rest| rest.state);
        let mut stepper = Stepper::new(plant, &values, &start)?;
        stepper.hold(&spec.control.safe)?;
        let ends = spec.control.lower.iter().zip(&spec.control.upper);
        Ok(Self {
            stepper,
            sensors,
            actuators: ends.map(|(low, high)| (*low, *high)).collect(),
            period_s: spec.period_s,
            random: ChaCha8Rng::seed_from_u64(1),
        })
    }

    /// Readings now, with noise, SI.
    pub(super) fn readings(&mut self) -> Vec<f64> {
        let each = self.sensors.iter();
        each.map(|(index, span, _)| {
            self.stepper.signal(*index) + NOISE * span * gaussian(&mut self.random)
        })
        .collect()
    }

    /// Lets a period pass with commands that are held; none while the power stages are off.
    ///
    /// # Errors
    /// The plant diverges.
    pub(super) fn advance(&mut self, u: &[f64], live: bool) -> Result<()> {
        let off = vec![0.0; u.len()];
        let u = if live { u } else { &off };
        Ok(self.stepper.advance(self.period_s, u)?)
    }

    /// Answers the board tick by tick, until it is gone or the plant diverges.
    fn serve(mut self, to_board: &Path, from_board: &Path) {
        // In the order in which the board opens its ends.
        let Ok(mut to) = OpenOptions::new().write(true).open(to_board) else {
            return;
        };
        let Ok(mut from) = File::open(from_board) else {
            return;
        };
        let mut words = vec![0; 2 * (self.actuators.len() + 1)];
        loop {
            let readings = self.readings();
            let codes = readings.iter().zip(&self.sensors);
            let codes = codes.map(|(y, (_, span, offset))| {
                let share = ((y - offset) / span + 1.0) / 2.0;
                (share * FULL_SCALE).round().clamp(0.0, FULL_SCALE) as u16
            });
            let bytes: Vec<u8> = codes.flat_map(u16::to_le_bytes).collect();
            if to.write_all(&bytes).is_err() || from.read_exact(&mut words).is_err() {
                return;
            }
            let word = |i: usize| u16::from_le_bytes([words[2 * i], words[2 * i + 1]]);
            let live = word(self.actuators.len()) == 1;
            let duties = self.actuators.iter().enumerate();
            let u: Vec<f64> = duties
                .map(|(i, (low, high))| low + (high - low) * f64::from(word(i)) / FULL_SCALE)
                .collect();
            if self.advance(&u, live).is_err() {
                return;
            }
        }
    }
}

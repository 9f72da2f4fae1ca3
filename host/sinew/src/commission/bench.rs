//! The board on the bench: what may be asked of it before anything is known, and the emergency stop
//! behind everything that moves.

use std::path::Path;
use std::time::{Duration, Instant};

use sinew_device::mode::{Drive, Mode, State};
use sinew_device::protocol::{Identity, Reason, Telemetry, ToDevice, ToHost};

use super::rest::{BLOCK, mean};
use super::setup::Setup;
use crate::device::Device;
use crate::live::Names;
use crate::live::record::{Recorded, Watch, record_watched};
use sinew_ident::cli::interrupt::Interrupt;
use sinew_ident::error::{Error, Result};

/// Line of a Ctrl-C while the board is in use.
const STOPPING: &str = "emergency stop";
/// Period of the lines that tell the board that somebody is there.
const ALIVE: Duration = Duration::from_millis(300);
/// Longest silence of a board, and longest wait for a ramp to the safe command.
const SILENCE: Duration = Duration::from_secs(10);

/// Longest wait for a rig that swings.
const RESTLESS: Duration = Duration::from_secs(20);
/// Part of a span within which a sensor is at rest.
const STILL: f64 = 0.002;

/// Reason for the end of a motion before its last row.
#[derive(Clone, Debug, PartialEq)]
pub enum Cut {
    /// The caller's watch asked for it.
    Asked,
    /// A reading ran away: the sensor's index. The emergency stop was sent.
    RanAway(usize),
    /// The board disarmed itself.
    Board(State),
}

/// A motion and what the sensors said.
#[derive(Debug)]
pub struct Played {
    /// The recording, SI.
    pub recorded: Recorded,
    /// Commands as applied, a row a tick.
    pub u: Vec<Vec<f64>>,
    /// Readings, a column a sensor.
    pub y: Vec<Vec<f64>>,
    /// The end, if it came early.
    pub cut: Option<Cut>,
}

/// A board that carries the bare model.
pub struct Bench {
    device: Device,
    names: Names,
    identity: Identity,
    /// Safe commands, to the bit.
    safe: Vec<f32>,
    /// A motion is under way.
    moves: bool,
}

impl Drop for Bench {
    fn drop(&mut self) {
        if self.moves {
            // Whatever went wrong in between; the board also ends it by itself when nobody talks.
            let _ = self.device.send(&ToDevice::EmergencyStop);
        }
    }
}

impl Bench {
    /// Greets the board and waits until it is disarmed, at the safe command.
    ///
    /// # Errors
    /// The wrong board, no board, one that does not come to rest.
    pub fn new(mut device: Device, names: Names) -> Result<Self> {
        let identity = names.greet(&mut device)?;
        let mut bench = Self {
            device,
            names,
            identity,
            safe: Vec::new(),
            moves: false,
        };
        bench.settle()?;
        Ok(bench)
    }

    /// Disarms, and waits until telemetry says disarmed and the command stays where it is.
    ///
    /// # Errors
    /// The board does not say so.
    pub fn settle(&mut self) -> Result<()> {
        self.device.insist(&ToDevice::Disarm, is_state)?;
        self.device
            .insist(&ToDevice::Stream { every: 1 }, is_state)?;
        let mut last: Vec<f32> = Vec::new();
        let mut same = 0;
        let patience = Instant::now() + SILENCE;
        while Instant::now() < patience {
            let Some(seen) = self.next()? else { continue };
            let still = seen.u.as_slice() == last.as_slice();
            same = if still { same + 1 } else { 0 };
            last = seen.u.to_vec();
            if seen.state.mode == Mode::Disarmed && same >= 3 {
                self.safe = last;
                return Ok(());
            }
        }
        Err(
            Error::failed("the board does not come to rest: its telemetry never says disarmed")
                .help("switch the power stages off, reset the board, look at its log"),
        )
    }

    /// Readings of a board that does nothing, for so many seconds: a column a sensor.
    ///
    /// # Errors
    /// The board is gone or armed; Ctrl-C.
    pub fn listen(&mut self, seconds: f64) -> Result<(Vec<f64>, Vec<Vec<f64>>)> {
        let interrupt = Interrupt::saying(STOPPING);
        let ticks = (seconds * f64::from(self.identity.rate_mhz) / 1000.0).ceil() as usize;
        let sensors = self.names.outputs.len() + self.names.channels.len();
        let (mut t, mut y) = (Vec::new(), vec![Vec::new(); sensors]);
        let mut first = None;
        let patience = Instant::now() + Duration::from_secs_f64(2.0 * seconds) + SILENCE;
        while t.len() < ticks {
            if interrupt.stop.is_asked() {
                self.device.emergency_stop()?;
                return Err(Error::interrupted());
            }
            if Instant::now() > patience {
                return Err(silent());
            }
            let Some(seen) = self.next()? else { continue };
            if seen.state.mode != Mode::Disarmed {
                return Err(Error::failed("the board was armed while it was to rest"));
            }
            let first = *first.get_or_insert(seen.at_us);
            t.push(seen.at_us.saturating_sub(first) as f64 * 1e-6);
            let readings = seen.y.iter().chain(&seen.s);
            for (column, value) in y.iter_mut().zip(readings) {
                column.push(f64::from(*value));
            }
        }
        Ok((t, y))
    }

    /// Waits until the sensors are at rest: over half a second the means of blocks stay within
    /// twice the thresholds or a part of the spans. A rig that does not come to rest in time is
    /// taken as it is.
    ///
    /// # Errors
    /// As [`Bench::listen`].
    pub fn come_to_rest(&mut self, thresholds: &[f64], spans: &[f64]) -> Result<()> {
        self.settle()?;
        let until = Instant::now() + RESTLESS;
        while Instant::now() < until {
            let (_, y) = self.listen(0.5)?;
            let bounds = thresholds.iter().zip(spans);
            let bounds = bounds.map(|(threshold, span)| (2.0 * threshold).max(STILL * span));
            if y.iter().zip(bounds).all(|(y, bound)| range(y) < bound) {
                return Ok(());
            }
        }
        Ok(())
    }

    /// Sends an emergency stop and waits for telemetry that says so: the seconds that this took.
    ///
    /// # Errors
    /// No such telemetry, or a command other than the safe one in it.
    pub fn stop(&mut self) -> Result<f64> {
        let sent = Instant::now();
        let state = self.device.emergency_stop()?;
        self.moves = false;
        if state.mode != Mode::Tripped {
            return Err(Error::failed(format!(
                "the board answered {:?} to an emergency stop",
                state.mode
            )));
        }
        while sent.elapsed() < SILENCE {
            let Some(seen) = self.next()? else { continue };
            if seen.state.mode == Mode::Tripped {
                if seen.u.as_slice() != self.safe.as_slice() {
                    return Err(Error::failed(
                        "after the emergency stop the command is not the safe one",
                    ));
                }
                return Ok(sent.elapsed().as_secs_f64());
            }
        }
        Err(Error::failed(
            "no telemetry says that the emergency stop took effect",
        ))
    }

    /// Arms for an excitation without a row: the power stages are on, at the safe command.
    ///
    /// # Errors
    /// The board refuses, or its telemetry does not say armed.
    pub fn arm_at_rest(&mut self) -> Result<()> {
        self.moves = true;
        let (drive, blend_steps) = (Drive::Excitation, 0);
        self.device
            .insist(&ToDevice::Arm { drive, blend_steps }, is_state)?;
        let patience = Instant::now() + SILENCE;
        while Instant::now() < patience {
            let Some(seen) = self.next()? else { continue };
            if seen.state.mode == Mode::Armed(Drive::Excitation) {
                return Ok(());
            }
        }
        Err(Error::failed("the board does not say that it is armed"))
    }

    /// True if the board refuses to be armed.
    ///
    /// # Errors
    /// The board does not answer.
    pub fn refuses_to_arm(&mut self) -> Result<bool> {
        let (drive, blend_steps) = (Drive::Excitation, 0);
        for _ in 0..3 {
            self.device.send(&ToDevice::Arm { drive, blend_steps })?;
            let until = Instant::now() + Duration::from_secs(1);
            while let Some(answer) = self.device.answer(until)? {
                match answer {
                    ToHost::Refused {
                        reason: Reason::Mode,
                    } => return Ok(true),
                    ToHost::State(state) if matches!(state.mode, Mode::Armed(_)) => {
                        self.moves = true;
                        return Ok(false);
                    }
                    _ => {}
                }
            }
        }
        Err(silent())
    }

    /// Limits that the board itself keeps from now on: ranges about the safe commands, SI, and a
    /// change a second. What has no room stays at the safe command.
    ///
    /// # Errors
    /// The board refuses them.
    pub fn limit(&mut self, setup: &Setup, ranges: &[(f64, f64)], rates: &[f64]) -> Result<()> {
        self.settle()?;
        let ends = ranges.iter().zip(&self.safe);
        let lower = ends.clone().map(|((low, _), safe)| inside(*low, *safe));
        let upper = ends.map(|((_, high), safe)| inside(*high, *safe));
        let rate = rates.iter().zip(&setup.actuators).map(|(rate, actuator)| {
            // A little less than the model's own, which was rounded as well.
            (rate.min(actuator.rate) * setup.period_s * (1.0 - 1e-6)) as f32
        });
        let limit = ToDevice::Limit {
            lower: lower.collect(),
            upper: upper.collect(),
            rate: rate.collect(),
        };
        self.device
            .insist(&limit, |answer| matches!(answer, ToHost::Tuned))?;
        Ok(())
    }

    /// Plays commands, SI, a row a tick. `guard`: for each sensor the readings between which it has
    /// to stay; beyond, the emergency stop is sent. So it is at a Ctrl-C. `watch` may end it.
    ///
    /// # Errors
    /// The board cannot be reached, refuses, or falls silent; Ctrl-C.
    pub fn play(
        &mut self,
        rows: &[Vec<f64>],
        guard: &[(f64, f64)],
        watch: &mut dyn FnMut(&Telemetry) -> bool,
    ) -> Result<Played> {
        let interrupt = Interrupt::saying(STOPPING);
        let rows: Vec<Vec<f32>> = (rows.iter())
            .map(|row| row.iter().map(|u| *u as f32).collect())
            .collect();
        let (mut away, mut asked) = (None, false);
        self.moves = true;
        let result = record_watched(
            &mut self.device,
            &self.names,
            &rows,
            Path::new("board.csv"),
            true,
            &mut |seen| {
                if interrupt.stop.is_asked() {
                    return Watch::Stop;
                }
                let Some(seen) = seen else { return Watch::Go };
                let readings = seen.y.iter().chain(&seen.s).zip(guard);
                let outside = |(y, (low, high)): (&f32, &(f64, f64))| {
                    f64::from(*y) < *low || f64::from(*y) > *high
                };
                away = readings.map(outside).position(|outside| outside);
                if away.is_some() {
                    return Watch::Stop;
                }
                asked = watch(seen);
                if asked { Watch::End } else { Watch::Go }
            },
        );
        if interrupt.stop.is_asked() {
            // Whatever came of the motion: it may have ended in the same moment.
            self.device.emergency_stop()?;
            self.moves = false;
            return Err(Error::interrupted());
        }
        let recorded = result?;
        self.moves = false;
        let cut = match (away, recorded.ended) {
            (Some(sensor), _) => Some(Cut::RanAway(sensor)),
            (None, Some(state)) => Some(Cut::Board(state)),
            (None, None) if asked => Some(Cut::Asked),
            (None, None) => None,
        };
        let recording = &recorded.recording;
        let column = |name: &String| recording.held(name, "the board").map(|held| held.values);
        let columns = self.names.inputs.iter().map(column);
        let columns = columns.collect::<Result<Vec<_>>>()?;
        let u = (0..recording.len())
            .map(|k| columns.iter().map(|column| column[k]).collect())
            .collect();
        let sensors = self.names.outputs.iter().chain(&self.names.channels);
        let y = sensors.map(|name| Ok(recording.require(name, "the board")?.to_vec()));
        let y = y.collect::<Result<_>>()?;
        Ok(Played {
            recorded,
            u,
            y,
            cut,
        })
    }

    /// The next telemetry, if it comes soon; the board is told that somebody is there.
    fn next(&mut self) -> Result<Option<Telemetry>> {
        if let Some(seen) = self.device.telemetry(Instant::now() + ALIVE)? {
            return Ok(Some(seen));
        }
        self.device.send(&ToDevice::Stream { every: 1 })?;
        Ok(None)
    }
}

/// Range of the means of blocks.
fn range(values: &[f64]) -> f64 {
    let blocks = values.chunks_exact(BLOCK).map(mean);
    let (low, high) = blocks
        .filter(|mean| mean.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), mean| {
            (low.min(mean), high.max(mean))
        });
    (high - low).max(0.0)
}

fn is_state(answer: &ToHost) -> bool {
    matches!(answer, ToHost::State(_))
}

fn silent() -> Error {
    Error::failed("the board says nothing any more")
        .help("is it powered, and the cable in? It disarms itself when the line is silent")
}

/// A limit as the board takes it: one step of f32 towards the safe command, for the rounding of the
/// model's own.
fn inside(end: f64, safe: f32) -> f32 {
    let end = end as f32;
    if end < safe {
        end.next_up().next_up().min(safe)
    } else if end > safe {
        end.next_down().next_down().max(safe)
    } else {
        safe
    }
}

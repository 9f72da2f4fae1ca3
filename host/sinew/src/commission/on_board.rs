//! Steps on the board, from the emergency stop to the recordings.

use sinew_ident::error::{Error, Result};
use sinew_ident::excite::{Options, design};
use sinew_ident::report::quantity;
use sinew_sim::Plant;

use super::bench::{Bench, Cut};
use super::journal::{AtRest, Cause, End, Fault, Stop};
use super::moves::{self, Motion, Outcome};
use super::step::Step;
use super::{Commissioning, RECORDINGS, RIG, ends, rest, soft_limits};

/// Change of scale that a sentence mentions.
const WORTH_SAYING: f64 = 1.25;

impl Commissioning {
    /// Takes one step on the board: what was seen, a sentence a line. The emergency stop has to be
    /// proven on this bench before anything that moves: the caller takes [`Step::Stop`] first.
    ///
    /// # Errors
    /// A fault, which the journal holds as well; a board that is gone; Ctrl-C. Nothing moves then.
    pub fn on_board(&mut self, step: Step, bench: &mut Bench) -> Result<Vec<String>> {
        let lines = match step {
            Step::Stop => self.stop(bench),
            Step::Rest => self.rest(bench),
            Step::Move => self.moves(bench),
            Step::Ends => self.ends(bench),
            Step::Excite => self.excite(bench),
            Step::Check | Step::Fit | Step::Diagnose | Step::Build => {
                return Err(Error::failed(format!("`{}` needs no board", step.name())));
            }
        }?;
        self.finish(step)?;
        Ok(lines)
    }

    fn stop(&mut self, bench: &mut Bench) -> Result<Vec<String>> {
        let disarmed_s = bench.stop()?;
        if !bench.refuses_to_arm()? {
            return Err(self.fault(
                Step::Stop,
                "the board lets itself be armed during an emergency stop".into(),
                Vec::new(),
            ));
        }
        bench.settle()?;
        bench.arm_at_rest()?;
        let armed_s = bench.stop()?;
        bench.settle()?;
        self.journal.stop = Some(Stop {
            disarmed_s,
            armed_s,
        });
        Ok(vec![format!(
            "emergency stop: confirmed by telemetry after {} disarmed and {} armed; arming is \
             refused until it is acknowledged",
            quantity(disarmed_s, "s"),
            quantity(armed_s, "s")
        )])
    }

    fn rest(&mut self, bench: &mut Bench) -> Result<Vec<String>> {
        bench.settle()?;
        let (t, y) = bench.listen(self.settings.rest_s)?;
        let at_rest = rest::figures(&self.setup, &t, &y);
        let causes = rest::faults(&at_rest, &self.spans(), self.settings.rest_s);
        let lines = at_rest.iter().map(rest_line).collect();
        self.journal.sensors = at_rest;
        if causes.is_empty() {
            return Ok(lines);
        }
        Err(self.fault(Step::Rest, "a sensor cannot be used".into(), causes))
    }

    fn moves(&mut self, bench: &mut Bench) -> Result<Vec<String>> {
        let motion = Motion {
            amplitude: self.settings.amplitude,
            tolerance: self.settings.tolerance,
        };
        let at_rest = self.at_rest()?;
        let guard = self.guard(&at_rest, 0.5);
        let mut lines = Vec::new();
        self.journal.actuators.clear();
        for driven in 0..self.setup.actuators.len() {
            let before = self.journal.actuators.clone();
            self.come_to_rest(bench, &at_rest)?;
            let outcome = moves::one(
                bench,
                &self.setup,
                driven,
                &at_rest,
                (&before, motion),
                &guard,
            )?;
            match outcome {
                Outcome::Confirmed(moved) => {
                    let ratios = moved.ratios.iter().map(|(signal, ratio)| {
                        if (1.0 / WORTH_SAYING..=WORTH_SAYING).contains(ratio) {
                            format!("`{signal}` as predicted")
                        } else {
                            let ratio = sinew_ident::report::significant(*ratio, 2);
                            format!("`{signal}` {ratio} times as far as predicted, the right way")
                        }
                    });
                    lines.push(format!(
                        "`{}` alone, {:.0} % of its range: {}",
                        moved.input,
                        100.0 * moved.part,
                        ratios.collect::<Vec<_>>().join(", ")
                    ));
                    self.journal.actuators.push(moved);
                }
                Outcome::Fault(sentence, causes) => {
                    return Err(self.fault(Step::Move, sentence, causes));
                }
            }
        }
        Ok(lines)
    }

    fn ends(&mut self, bench: &mut Bench) -> Result<Vec<String>> {
        let at_rest = self.at_rest()?;
        let guard = self.guard(&at_rest, 1.5);
        let mut lines = Vec::new();
        for driven in 0..self.setup.actuators.len() {
            let actuator = &self.setup.actuators[driven];
            let Some(moved) = self.journal.actuators.get(driven).cloned() else {
                return Err(Error::failed(format!(
                    "`{}` was not moved yet",
                    actuator.column
                )));
            };
            let mut side = |side: f64| {
                self.come_to_rest(bench, &at_rest)?;
                let way = (self.settings.sweep_s, side);
                ends::side(bench, &self.setup, driven, (&at_rest, &moved), way, &guard)
            };
            let ends = [side(-1.0)?, side(1.0)?];
            let of = |end: &End| {
                format!(
                    "{} ({})",
                    quantity(end.command, &actuator.unit),
                    if end.saturated {
                        "in front of an end of the motion"
                    } else {
                        "the end of its range"
                    }
                )
            };
            lines.push(format!(
                "`{}`: soft limits {} and {}",
                actuator.column,
                of(&ends[0]),
                of(&ends[1])
            ));
            if let Some(kept) = self.journal.actuators.get_mut(driven) {
                kept.ends = Some(ends);
            }
        }
        self.write_rig()?;
        lines.push(format!(
            "{}: the rig with these limits",
            self.folder.join(RIG).display()
        ));
        Ok(lines)
    }

    /// Writes the rig with the soft limits that were found.
    fn write_rig(&self) -> Result<()> {
        let limits = self.journal.actuators.iter().filter_map(|moved| {
            let [low, high] = moved.ends.as_ref()?;
            Some((moved.input.as_str(), low.command, high.command))
        });
        let limits: Vec<_> = limits.collect();
        let text = soft_limits::written(&self.setup.rig, &limits, &self.setup.unread)?;
        Ok(sinew_files::write(self.folder.join(RIG), text)?)
    }

    fn excite(&mut self, bench: &mut Bench) -> Result<Vec<String>> {
        let path = self.folder.join(RIG);
        let rig = crate::rig_file::load(&path)?;
        let plant = Plant::new(&rig)?;
        let at_rest = self.at_rest()?;
        let guard = self.guard(&at_rest, 1.5);
        let ranges = plant.inputs().iter().zip(&self.setup.actuators);
        let ranges: Vec<(f64, f64)> = ranges
            .map(|(input, actuator)| input.limit.unwrap_or((actuator.low, actuator.high)))
            .collect();
        let rates: Vec<f64> = self.setup.actuators.iter().map(|a| a.rate).collect();
        let mut lines = Vec::new();
        for (run, name) in RECORDINGS.iter().enumerate() {
            let options = Options {
                seconds: self.settings.excite_s,
                rate_hz: 1.0 / self.setup.period_s,
                seed: self.settings.seed + run as u64,
                ..Options::default()
            };
            let experiment = design(&plant, &path, &options)?;
            let rows: Vec<Vec<f64>> = (0..experiment.t.len())
                .map(|k| experiment.inputs.iter().map(|column| column[k]).collect())
                .collect();
            self.come_to_rest(bench, &at_rest)?;
            bench.limit(&self.setup, &ranges, &rates)?;
            let played = bench.play(&rows, &guard, &mut |_| false)?;
            match played.cut {
                Some(Cut::RanAway(sensor)) => {
                    let name = &self.setup.sensors[sensor].column;
                    return Err(Error::failed(format!(
                        "`{name}` left the range that the rig predicts: the emergency stop was sent"
                    ))
                    .help("narrow --range, then --again ends"));
                }
                Some(Cut::Board(state)) => {
                    return Err(Error::failed(format!(
                        "the board stopped by itself ({:?}) during the experiment",
                        state.cause
                    ))
                    .help("docs/reference/faults.md says what this means"));
                }
                Some(Cut::Asked) | None => {}
            }
            let out = self.folder.join(name);
            self.setup
                .in_columns(&played.recorded.recording, &out)?
                .write(&out)?;
            lines.push(format!(
                "{}: {} rows, {} ticks lost on the way, {} samples missing, {} rows changed by \
                 the limits",
                out.display(),
                played.recorded.recording.len(),
                played.recorded.lost_ticks,
                played.recorded.missing_samples,
                played.recorded.limited_rows
            ));
        }
        bench.settle()?;
        Ok(lines)
    }

    /// Waits until the rig is at rest.
    fn come_to_rest(&self, bench: &mut Bench, at_rest: &[AtRest]) -> Result<()> {
        let thresholds: Vec<f64> = at_rest.iter().map(rest::threshold).collect();
        bench.come_to_rest(&thresholds, &self.spans())
    }

    /// Readings between which each sensor has to stay: so many spans of the bare model about what
    /// it read at rest.
    fn guard(&self, at_rest: &[AtRest], spans: f64) -> Vec<(f64, f64)> {
        let each = at_rest.iter().zip(self.spans());
        each.map(|(sensor, span)| (sensor.mean - spans * span, sensor.mean + spans * span))
            .collect()
    }

    /// Spans of the sensors in the bare model, SI.
    fn spans(&self) -> Vec<f64> {
        let signals = self.bare.outputs.iter().chain(&self.bare.channels);
        signals.map(|signal| signal.span).collect()
    }

    fn at_rest(&self) -> Result<Vec<AtRest>> {
        if self.journal.sensors.len() == self.setup.sensors.len() {
            return Ok(self.journal.sensors.clone());
        }
        Err(Error::failed("nothing is known of the sensors at rest").help("--again rest"))
    }

    /// Notes a fault and makes the error of it.
    fn fault(&mut self, step: Step, sentence: String, causes: Vec<Cause>) -> Error {
        let mut message = format!("{sentence}, so nothing moves any more");
        for (i, cause) in causes.iter().enumerate() {
            let lead = if i == 0 { "" } else { "or " };
            message += &format!("\n  {lead}{}", cause.sentence);
        }
        let mut remedies: Vec<String> = causes.iter().map(|cause| cause.remedy.clone()).collect();
        if remedies.is_empty() {
            remedies.push("no single fault of the wiring explains it: look at the rig file".into());
        }
        remedies.push(format!(
            "then run the same command again: it goes on at `{}`",
            step.name()
        ));
        self.journal.fault = Some(Fault {
            step: step.name().into(),
            sentence,
            causes,
        });
        let error = Error::failed(message).help(remedies.join("\n        "));
        match self.journal.save(&self.folder) {
            Ok(_) => error,
            Err(unsaved) => unsaved,
        }
    }
}

/// A sensor at rest in one line.
fn rest_line(sensor: &AtRest) -> String {
    let of = |value: f64| quantity(value, &sensor.unit);
    let still = if sensor.frozen {
        ": it did not change in one bit, so motion has to show that it lives"
    } else {
        ""
    };
    format!(
        "`{}`: {} at rest, noise {}, drift {}/s{still}",
        sensor.signal,
        of(sensor.mean),
        of(sensor.noise),
        of(sensor.drift)
    )
}

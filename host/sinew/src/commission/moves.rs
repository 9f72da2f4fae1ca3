//! Each actuator alone, a little way up and down: sign and scale of every sensor.

use super::bench::{Bench, Cut, Played};
use super::journal::{AtRest, Cause, Moved};
use super::judge::{Seen, Verdict, judge};
use super::rest::threshold;
use super::setup::Setup;
use sinew_ident::error::Result;

/// Parts of the largest amplitude, tried one after the other until the motion says enough.
const SHARES: [f64; 3] = [0.25, 0.5, 1.0];
/// Seconds at rest, of a ramp from the safe command to an end, and of a hold there.
const PAUSE_S: f64 = 0.5;
const RAMP_S: f64 = 1.5;
const HOLD_S: f64 = 0.5;
/// Rate limit that the board keeps, in rates of the ramp: its steepest point has 1.875.
const RATE: f64 = 2.5;

/// Settings of the motions.
#[derive(Clone, Copy, Debug)]
pub struct Motion {
    /// Largest part of the way from the safe command to a limit.
    pub amplitude: f64,
    /// Factor by which a scale may be off.
    pub tolerance: f64,
}

/// Outcome of one actuator's motion.
pub enum Outcome {
    /// Signs and scales are right.
    Confirmed(Moved),
    /// A fault; explanations by a single cause.
    Fault(String, Vec<Cause>),
}

/// Parts of the way at each tick: up, down past the middle where there is room, and back.
pub fn profile(setup: &Setup, driven: usize, amplitude: f64) -> Vec<f64> {
    let ticks = |seconds: f64| (seconds / setup.period_s).round().max(1.0) as usize;
    let actuator = &setup.actuators[driven];
    let mut parts = vec![0.0; ticks(PAUSE_S)];
    for side in [1.0, -1.0] {
        if !actuator.has_side(side) {
            continue;
        }
        let n = ticks(RAMP_S);
        let up = (1..=n).map(|k| side * amplitude * jerk_free(k as f64 / n as f64));
        let up: Vec<f64> = up.collect();
        parts.extend(&up);
        parts.extend(std::iter::repeat_n(side * amplitude, ticks(HOLD_S)));
        parts.extend(up.iter().rev().skip(1));
        parts.extend(vec![0.0; ticks(PAUSE_S)]);
    }
    parts
}

/// Minimum-jerk move from 0 to 1.
fn jerk_free(x: f64) -> f64 {
    x * x * x * (10.0 - 15.0 * x + 6.0 * x * x)
}

/// Commands of a profile of one actuator, all others at their safe command.
fn commands(setup: &Setup, driven: usize, parts: &[f64]) -> Vec<Vec<f64>> {
    let row = |part: &f64| {
        let each = setup.actuators.iter().enumerate();
        each.map(|(j, a)| if j == driven { a.at(*part) } else { a.safe })
            .collect()
    };
    parts.iter().map(row).collect()
}

/// Moves one actuator, further and further until its motion says enough. The board keeps every
/// other one at its safe command.
///
/// # Errors
/// The board is gone or refuses; Ctrl-C.
pub fn one(
    bench: &mut Bench,
    setup: &Setup,
    driven: usize,
    at_rest: &[AtRest],
    (before, motion): (&[Moved], Motion),
    guard: &[(f64, f64)],
) -> Result<Outcome> {
    let actuator = &setup.actuators[driven];
    let mut last = None;
    for share in SHARES {
        let part = share * motion.amplitude;
        let parts = profile(setup, driven, part);
        let ranges: Vec<(f64, f64)> = (setup.actuators.iter().enumerate())
            .map(|(j, a)| match j {
                j if j == driven => (a.at(-part), a.at(part)),
                _ => (a.safe, a.safe),
            })
            .collect();
        let rates: Vec<f64> = (setup.actuators.iter())
            .map(|a| RATE * part * (a.high - a.low) / RAMP_S)
            .collect();
        bench.limit(setup, &ranges, &rates)?;
        let played = bench.play(&commands(setup, driven, &parts), guard, &mut |_| false)?;
        if let Some(Cut::Board(state)) = played.cut {
            return Ok(Outcome::Fault(
                format!(
                    "the board stopped by itself ({:?}) while `{}` moved",
                    state.cause, actuator.column
                ),
                Vec::new(),
            ));
        }
        let verdict = compared(setup, driven, &played, at_rest, (before, motion))?;
        if let Some(Cut::RanAway(sensor)) = played.cut {
            let causes = match verdict {
                Verdict::Confirmed(_) => Vec::new(),
                Verdict::Weak(causes) | Verdict::Fault(causes) => causes,
            };
            return Ok(Outcome::Fault(
                format!(
                    "`{}` ran away while `{}` moved: the emergency stop was sent",
                    setup.sensors[sensor].column, actuator.column
                ),
                causes,
            ));
        }
        match verdict {
            Verdict::Confirmed(ratios) => {
                let named = |(i, ratio): &(usize, f64)| (setup.sensors[*i].column.clone(), *ratio);
                return Ok(Outcome::Confirmed(Moved {
                    input: actuator.column.clone(),
                    unit: actuator.unit.clone(),
                    part,
                    ratios: ratios.iter().map(named).collect(),
                    ends: None,
                }));
            }
            Verdict::Weak(causes) => last = Some(causes),
            Verdict::Fault(causes) => {
                let sentence = format!("`{}` does not move what the rig predicts", actuator.column);
                return Ok(Outcome::Fault(sentence, causes));
            }
        }
    }
    let causes = last.unwrap_or_default();
    let sentence = if causes.is_empty() {
        format!(
            "no sensor shows the motion of `{}` at {:.0} % of its range above the noise",
            actuator.column,
            100.0 * motion.amplitude
        )
    } else {
        format!("`{}` moves less than the rig predicts", actuator.column)
    };
    Ok(Outcome::Fault(sentence, causes))
}

/// Compares what was seen with what the rig predicts for this actuator and for each other one.
fn compared(
    setup: &Setup,
    driven: usize,
    played: &Played,
    at_rest: &[AtRest],
    (before, motion): (&[Moved], Motion),
) -> Result<Verdict> {
    let actuator = &setup.actuators[driven];
    let parts: Vec<f64> = played
        .u
        .iter()
        .map(|row| actuator.part(row[driven]))
        .collect();
    let pause = (PAUSE_S / setup.period_s).round().max(1.0) as usize;
    let start = |y: &[f64]| {
        let valid = y.iter().take(pause).copied().filter(|v| v.is_finite());
        super::rest::mean(&valid.collect::<Vec<_>>())
    };
    let changes = |y: &Vec<f64>| {
        let start = start(y);
        y.iter().map(|y| y - start).collect::<Vec<f64>>()
    };
    let first: Vec<f64> = played.y.iter().map(|y| start(y)).collect();
    let dy: Vec<Vec<f64>> = played.y.iter().map(changes).collect();
    let predicted = (0..setup.actuators.len()).map(|k| {
        let u = if k == driven {
            played.u.clone()
        } else {
            commands(setup, k, &parts)
        };
        let y = setup.predict(&u, &first)?;
        Ok(y.iter().map(changes).collect())
    });
    let predicted = predicted.collect::<Result<Vec<Vec<Vec<f64>>>>>()?;
    let seen: Vec<Seen> = (setup.sensors.iter().zip(&dy).zip(at_rest))
        .map(|((sensor, dy), at_rest)| Seen {
            name: &sensor.column,
            dy,
            threshold: threshold(at_rest),
            confirmed: before.iter().any(|b| b.ratios.contains_key(&sensor.column)),
        })
        .collect();
    let inputs: Vec<&str> = setup.actuators.iter().map(|a| a.column.as_str()).collect();
    let known: Vec<bool> = (inputs.iter())
        .map(|input| before.iter().any(|b| b.input == *input))
        .collect();
    Ok(judge(
        (driven, &inputs),
        &known,
        &seen,
        &predicted,
        motion.tolerance,
    ))
}

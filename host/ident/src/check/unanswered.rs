//! Inputs that do not move the device: its sensors move by something else.

use sinew_sim::{Plant, Rig};

use super::finding::{Check, number};
use super::motion::{from_rest, spread};
use super::refitted::{BELIEVED, FAR_LESS, GOOD, INCREDIBLE, Refit};
use crate::recording::{Column, Recording};

/// Motion by the inputs, beside that recorded, that the rig as written must expect.
const EXPECTED: f64 = 1.0;

/// Motion by the inputs, beside that recorded, below which the refitted rig has none.
const NONE: f64 = 0.1;

const REMEDY: &str = "check that the drive was on and that the column is the command it got";

/// `unanswered_input`: the inputs would move the rig as written at least as far as was recorded,
/// and move the refitted rig a tenth of that or less. The fit could only stop them by parameters
/// that grow without end. It is certain where the rig explains the motion, and only without them.
pub(super) fn detect(rig: &Rig, recording: &Recording, plain: &Refit) -> Option<Check> {
    let runs_off = plain.fit.parameters.iter().any(|p| p.ci95.is_none());
    if plain.error() < GOOD && !runs_off {
        return None;
    }
    if let Some(free) = free_motion(rig, recording, plain) {
        return Some(free);
    }
    let expected = motion_by_inputs(rig, recording)?;
    let found = motion_by_inputs(&plain.fit.rig, recording)?;
    let (expected, found) = (smallest(&expected)?, largest(&found)?);
    (expected > EXPECTED && found < NONE).then(|| {
        let inputs: Vec<&str> = rig.actuators.iter().map(|it| it.input.as_str()).collect();
        let inputs = inputs.join(" and ");
        let sentence = format!(
            "the sensors do not answer to {inputs}, which would move the rig as it is written {} \
             times as far as was recorded: refitted, it moves {} times as far by it",
            number(expected),
            number(found)
        );
        Check::likely(recording, 0, "unanswered_input", sentence, REMEDY)
    })
}

/// `unanswered_input`, certain: the refitted rig explains the recording with its inputs at rest,
/// and not with what they were.
fn free_motion(rig: &Rig, recording: &Recording, plain: &Refit) -> Option<Check> {
    let inputs: Vec<&str> = rig.actuators.iter().map(|it| it.input.as_str()).collect();
    let columns = recording.columns().iter().map(|column| Column {
        name: column.name.clone(),
        values: if inputs.contains(&column.name.as_str()) {
            vec![0.0; column.values.len()]
        } else {
            column.values.clone()
        },
    });
    let at_rest = Recording::new(recording.path(), recording.t().to_vec(), columns.collect());
    let at_rest = at_rest.ok()?;
    let refit = Refit::below(GOOD * GOOD, rig, &at_rest)?;
    let explains = refit.error() < GOOD && refit.farthest() < BELIEVED;
    let poor = plain.error() > GOOD && refit.squares < FAR_LESS * plain.squares;
    (explains && (poor || plain.farthest() > INCREDIBLE)).then(|| {
        let inputs = inputs.join(" and ");
        let sentence = format!(
            "the sensors do not answer to {inputs}: the refitted rig misses {} % of them with \
             {inputs} at 0 and parameters at most {} times as believed; as recorded {} %, with \
             parameters {} times that",
            number(100.0 * refit.error()),
            number(refit.farthest()),
            number(100.0 * plain.error()),
            number(plain.farthest())
        );
        Check::certain(recording, 0, "unanswered_input", sentence, REMEDY)
    })
}

/// Motion of each sensor from rest by the inputs, beside that recorded.
fn motion_by_inputs(rig: &Rig, recording: &Recording) -> Option<Vec<f64>> {
    let run = from_rest(&Plant::new(rig).ok()?, recording)?;
    let sensors = rig.sensors.iter().enumerate();
    let parts = sensors.map(|(index, sensor)| {
        let recorded = spread(recording.column(&sensor.signal)?) * sensor.column_factor.abs();
        (recorded > 0.0).then(|| spread(&run.column(index)) / recorded)
    });
    parts.collect()
}

fn smallest(parts: &[f64]) -> Option<f64> {
    parts.iter().copied().reduce(f64::min)
}

fn largest(parts: &[f64]) -> Option<f64> {
    parts.iter().copied().reduce(f64::max)
}

//! Times in minutes or hours, by a rig: it moves as believed once they are seconds.

use sinew_sim::{Plant, Rig, SimulationSettings};

use super::finding::{Check, number};
use super::motion::from_rest;
use super::refitted::{BELIEVED, GOOD, INCREDIBLE, Refit};
use super::timescale::is_guessed;
use crate::recording::Recording;

/// Units of several seconds: their seconds, flags, words and kinds.
const UNITS: [(f64, &str, &str, &str); 2] = [
    (60.0, "min", "minutes", "time_in_minutes"),
    (3600.0, "h", "hours", "time_in_hours"),
];

/// Sub-steps a sample of a rig that its samples show: four samples a period of its fastest motion.
const MOST_SUBSTEPS: usize = 16;

/// Rows that show whether they do.
const ROWS: usize = 100;

/// `time_in_minutes` or `time_in_hours`: the refitted rig has parameters as believed with the times
/// in that unit, and far from that, or no fit, with times in seconds.
pub(super) fn detect(rig: &Rig, recording: &Recording, plain: &Refit) -> Option<Check> {
    if plain.error() < GOOD && plain.farthest() < BELIEVED {
        return None;
    }
    UNITS.iter().find_map(|&(seconds, flag, words, kind)| {
        let converted = in_seconds(recording, seconds)?;
        if !resolves(rig, &converted) {
            return None;
        }
        let refit = Refit::below(GOOD * GOOD, rig, &converted)?;
        let explains = refit.error() < GOOD && refit.farthest() < BELIEVED;
        let poor = plain.error() > GOOD.max(2.0 * refit.error());
        let far = plain.farthest() > INCREDIBLE.max(2.0 * refit.farthest());
        (explains && (poor || far)).then(|| {
            let sentence = format!(
                "the rig moves as it says if t is in {words}: the refitted parameters are at most \
                 {} times as believed and {} % is missed; in seconds they are {} times that, and \
                 {} % is missed",
                number(refit.farthest()),
                number(100.0 * refit.error()),
                number(plain.farthest()),
                number(100.0 * plain.error())
            );
            // Guesses may be a thousand times the truth.
            let grade = if is_guessed(rig) {
                Check::likely
            } else {
                Check::certain
            };
            grade(recording, 0, kind, sentence, format!("--time-unit {flag}"))
        })
    })
}

/// Tells whether samples stand close enough to show the rig as it is written. Where they do not,
/// times cannot be in that unit, and a simulation would take thousands of steps a sample.
fn resolves(rig: &Rig, recording: &Recording) -> bool {
    let settings = SimulationSettings {
        max_substeps: MOST_SUBSTEPS,
        ..SimulationSettings::default()
    };
    let few = recording.rows(0..recording.len().min(ROWS));
    let plant = Plant::new(rig).map(|plant| plant.with_settings(settings));
    let (Ok(few), Ok(plant)) = (few, plant) else {
        return false;
    };
    from_rest(&plant, &few).is_some()
}

/// The recording with times of so many seconds each.
fn in_seconds(recording: &Recording, seconds: f64) -> Option<Recording> {
    let t = recording.t().iter().map(|t| t * seconds).collect();
    Recording::new(recording.path(), t, recording.columns().to_vec()).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The servo's diagnosis took minutes longer while its rig was refitted to samples hours apart.
    #[test]
    fn a_rig_is_not_refitted_to_samples_that_stand_too_far_apart_to_show_it() {
        let folder = concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/tests/cases/24-wrong-bare-mass/"
        );
        let rig = Rig::load(format!("{folder}mass.toml")).unwrap();
        let recording = Recording::read(format!("{folder}A.csv")).unwrap();
        assert!(resolves(&rig, &recording));
        for (seconds, ..) in UNITS {
            assert!(!resolves(&rig, &in_seconds(&recording, seconds).unwrap()));
            let in_unit = in_seconds(&recording, 1.0 / seconds).unwrap();
            assert!(resolves(&rig, &in_seconds(&in_unit, seconds).unwrap()));
        }
    }
}

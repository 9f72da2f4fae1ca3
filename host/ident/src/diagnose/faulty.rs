//! Faults of recordings that a check named (docs/reference/checks.md), beside what was found: they
//! can look like physics, and hide it.

use std::path::Path;

use sinew_sim::Rig;

use crate::check::{Check, clipped_at, without_clipped};
use crate::diagnose::Recordings;
use crate::diagnose::config::CONFIG;
use crate::diagnose::finding::{Diagnosis, FoundEffect, Verdict};
use crate::diagnose::imitated_sensors::{DRIFT, LATE};
use crate::recording::Recording;

/// Kinds of likely faults that an effect can imitate.
const IMITATED: [&str; 11] = [
    CLIPPED,
    "dead_channel",
    "different_devices",
    "input_leads",
    "input_not_held",
    DRIFT,
    "sensor_gain",
    LATE,
    "sensor_offset",
    "spike",
    "stuck_channel",
];

const CLIPPED: &str = "clipped";

/// Recordings without the samples that a clipped sensor cut off, and a note of how many; `None`
/// where no check named one.
pub(crate) fn without_cut_samples(
    rig: &Rig,
    recordings: &Recordings,
    checks: &[Check],
) -> Option<(Recordings, String)> {
    checks.iter().find(|check| check.kind == CLIPPED)?;
    let all = recordings.fit.iter().chain(&recordings.check);
    let all: Vec<&Recording> = all.chain(&recordings.test).collect();
    let ends = clipped_at(&all, rig);
    let mut total = 0;
    let mut cleared = |all: &Vec<Recording>| -> Vec<Recording> {
        let each = all.iter().map(|recording| {
            let (cleared, count) = without_clipped(recording, &ends);
            total += count;
            cleared
        });
        each.collect()
    };
    let recordings = Recordings {
        fit: cleared(&recordings.fit),
        check: cleared(&recordings.check),
        test: cleared(&recordings.test),
    };
    let note = format!(
        "The {total} samples at an end of a sensor's range are left out: the sensor is clipped \
         there"
    );
    (total > 0).then_some((recordings, note))
}

/// Lowers the confidence of what is named beside faults that can look the same, and says them.
pub(crate) fn judge(found: &mut Diagnosis, rig: &Rig, recordings: &Recordings, checks: &[Check]) {
    let names = rig.sensors.iter();
    let offsets: Vec<String> = names.map(|it| format!("{}.offset", it.name)).collect();
    let judged = |check: &&Check| {
        let mut all = recordings.fit.iter().chain(&recordings.check);
        all.any(|recording| recording.path() == Path::new(&check.file))
    };
    let counts = |check: &&Check| check.certain || IMITATED.contains(&check.kind);
    let mut suspected: Vec<&Check> = checks.iter().filter(judged).filter(counts).collect();
    suspected.sort_by_key(|check| check.kind);
    suspected.dedup_by_key(|check| check.kind);
    let wrong = matches!(
        found.verdict,
        Verdict::MissingPhysics | Verdict::Unexplained
    );
    if suspected.is_empty() || !wrong {
        return;
    }
    // What the diagnosis has found out by itself is said already.
    let known = |effect: &FoundEffect, check: &Check| {
        let mut alike = effect.indistinguishable_from.iter();
        let offset = check.kind == "sensor_offset"
            && alike
                .clone()
                .any(|rival| offsets.contains(&rival.component));
        offset || check.kind == DRIFT && alike.any(|rival| rival.kind == DRIFT)
    };
    for effect in &mut found.effects {
        if suspected.iter().any(|check| !known(effect, check)) {
            effect.confidence *= CONFIG.calibration.doubt;
        }
    }
    let new = |check: &&Check| {
        let mut effects = found.effects.iter();
        found.effects.is_empty() || effects.any(|effect| !known(effect, check))
    };
    suspected.retain(new);
    if suspected.is_empty() {
        return;
    }
    let said = suspected.iter().map(|check| {
        let file = Path::new(&check.file).file_name().unwrap_or_default();
        format!(
            "{} ({} in {})",
            check.sentence,
            check.kind,
            file.to_string_lossy()
        )
    });
    let said: Vec<String> = said.collect();
    found.sentence += &format!(
        " A fault of the recordings may be the cause instead: {}.",
        said.join("; ")
    );
    let kinds: Vec<&str> = suspected.iter().map(|check| check.kind).collect();
    let note = format!(
        "less sure: the check of the recordings names {}",
        kinds.join(", ")
    );
    found.notes.push(note);
}

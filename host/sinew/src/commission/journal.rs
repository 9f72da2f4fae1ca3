//! State of a commissioning on disk: `commission.json`, format `sinew-commission/1`
//! (docs/reference/commission.md).

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

use serde::{Deserialize, Serialize};

use super::step::Step;
use sinew_ident::error::{Error, Result};

/// Format that the file names.
pub const FORMAT: &str = "sinew-commission/1";
/// The file's name in its folder.
pub const FILE: &str = "commission.json";
/// Largest file that is read, bytes.
const LARGEST: u64 = 1 << 20;

/// Everything that is known of a commissioning.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Journal {
    /// [`FORMAT`].
    pub format: String,
    /// Name of the rig.
    pub rig: String,
    /// The plant was simulated: it says nothing of any device.
    pub rehearsal: bool,
    /// Steps that are finished, by their names.
    pub done: BTreeMap<String, Done>,
    /// Emergency stop, when it was proven last.
    pub stop: Option<Stop>,
    /// Sensors at rest.
    pub sensors: Vec<AtRest>,
    /// Actuators, alone.
    pub actuators: Vec<Moved>,
    /// The fault that the last run ended with.
    pub fault: Option<Fault>,
}

/// A step that is finished.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Done {
    /// Seconds since 1970.
    pub unix_s: u64,
    /// CRC-32 of the rig file that it was done with.
    pub rig_crc32: u32,
}

/// Proof of the emergency stop.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stop {
    /// From the frame to telemetry that says so, while disarmed, seconds.
    pub disarmed_s: f64,
    /// The same while armed, seconds.
    pub armed_s: f64,
}

/// One sensor while nothing moves, SI.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AtRest {
    /// Column.
    pub signal: String,
    /// Unit.
    pub unit: String,
    /// Mean reading.
    pub mean: f64,
    /// Standard deviation of the white noise.
    pub noise: f64,
    /// Standard deviation of the means of eight samples.
    pub wander: f64,
    /// Change a second.
    pub drift: f64,
    /// Part of the samples that is missing.
    pub missing: f64,
    /// Every sample had the same bits.
    pub frozen: bool,
}

/// One actuator, SI.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Moved {
    /// Column.
    pub input: String,
    /// Unit.
    pub unit: String,
    /// Part of the way from the safe command to the limits that was enough.
    pub part: f64,
    /// Sensors that it moves: measured over predicted motion.
    pub ratios: BTreeMap<String, f64>,
    /// End positions, once they were sought.
    pub ends: Option<[End; 2]>,
}

/// One end of an actuator, SI.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct End {
    /// Soft limit of the command.
    pub command: f64,
    /// The motion ended before the command did.
    pub saturated: bool,
    /// Readings there, by column.
    pub readings: BTreeMap<String, f64>,
}

/// A fault that was found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fault {
    /// Step.
    pub step: String,
    /// Sentence.
    pub sentence: String,
    /// Explanations, the likeliest first; one where the data leave no other.
    pub causes: Vec<Cause>,
}

/// One explanation of a fault.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cause {
    /// Name: `reversed_sensor` and the like.
    pub kind: String,
    /// Columns that it is about.
    pub signals: Vec<String>,
    /// Sentence without a full stop.
    pub sentence: String,
    /// Remedy.
    pub remedy: String,
}

impl Journal {
    /// A commissioning that has not begun.
    pub fn new(rig: &str, rehearsal: bool) -> Self {
        Self {
            format: FORMAT.into(),
            rig: rig.into(),
            rehearsal,
            done: BTreeMap::new(),
            stop: None,
            sensors: Vec::new(),
            actuators: Vec::new(),
            fault: None,
        }
    }

    /// Reads the file of `folder`, or begins one.
    ///
    /// # Errors
    /// A file that is none, of another rig, or of a rehearsal where a device is meant.
    pub fn open(folder: &Path, rig: &str, rehearsal: bool) -> Result<Self> {
        let path = folder.join(FILE);
        if !path.exists() {
            return Ok(Self::new(rig, rehearsal));
        }
        let bytes = sinew_files::read(&path, LARGEST)?;
        let refused = |message: String| {
            Error::file(&path, message)
                .expected(format!("a file of sinew commission, {FORMAT}"))
                .help("another --out begins anew")
        };
        let journal: Self = serde_json::from_slice(&bytes).map_err(|e| refused(e.to_string()))?;
        if journal.format != FORMAT {
            return Err(refused(format!("the format is \"{}\"", journal.format)));
        }
        if journal.rig != rig {
            return Err(refused(format!(
                "it is about the rig `{}`, not `{rig}`",
                journal.rig
            )));
        }
        if journal.rehearsal != rehearsal {
            let (is, not) = if journal.rehearsal {
                ("a rehearsal", "a device")
            } else {
                ("a device", "a rehearsal")
            };
            return Err(refused(format!("it is about {is}, not about {not}")));
        }
        if let Some(name) = journal.done.keys().find(|name| Step::named(name).is_none()) {
            return Err(refused(format!("there is no step `{name}`")));
        }
        Ok(journal)
    }

    /// Writes the file, whole or not at all.
    ///
    /// # Errors
    /// The folder cannot be written.
    pub fn save(&self, folder: &Path) -> Result<PathBuf> {
        let path = folder.join(FILE);
        let value = serde_json::to_value(self).map_err(|e| Error::failed(e.to_string()))?;
        sinew_files::write(&path, format!("{value:#}\n"))?;
        Ok(path)
    }

    /// True for a step that is finished, with a rig of this CRC-32 where the rig matters.
    pub fn has(&self, step: Step, rig_crc32: u32) -> bool {
        let done = self.done.get(step.name());
        done.is_some_and(|done| !step.depends_on_rig() || done.rig_crc32 == rig_crc32)
    }

    /// Notes a finished step.
    pub fn finish(&mut self, step: Step, rig_crc32: u32) {
        let since = SystemTime::now().duration_since(UNIX_EPOCH);
        let unix_s = since.map_or(0, |since| since.as_secs());
        let done = Done { unix_s, rig_crc32 };
        self.done.insert(step.name().into(), done);
        self.fault = None;
    }

    /// Forgets a step and those after it.
    pub fn forget(&mut self, from: Step) {
        let later = Step::ALL.iter().filter(|step| **step >= from);
        for step in later {
            self.done.remove(step.name());
        }
        if from <= Step::Rest {
            self.sensors.clear();
        }
        if from <= Step::Move {
            self.actuators.clear();
        }
        if from <= Step::Ends {
            self.actuators.iter_mut().for_each(|a| a.ends = None);
        }
        self.fault = None;
    }
}

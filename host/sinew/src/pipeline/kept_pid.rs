//! Gains of PIDs that an earlier run of the same build tuned: a tuning costs thousands of loops.

use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use sinew_ident::error::{Error, Result};
use sinew_mpc::feedback::pid::{PidGains, PidState};

use crate::closed_loop::baseline::Tuning;
use crate::closed_loop::setup::{BUDGET, Setup};

/// Tuned gains of one channel, physical units, in the order of [`PidGains`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct Channel {
    gains: [f32; 7],
    lead: usize,
}

impl Channel {
    fn new(tuning: &Tuning<PidGains>) -> Self {
        let g = tuning.gains;
        Self {
            gains: [
                g.kp,
                g.ki,
                g.kd,
                g.filter_s,
                g.proportional_setpoint_weight,
                g.derivative_setpoint_weight,
                g.tracking_time_s,
            ],
            lead: tuning.lead,
        }
    }

    fn tuning(&self) -> Tuning<PidGains> {
        let [kp, ki, kd, filter_s, b, c, tracking_time_s] = self.gains;
        Tuning {
            gains: PidGains {
                kp,
                ki,
                kd,
                filter_s,
                proportional_setpoint_weight: b,
                derivative_setpoint_weight: c,
                tracking_time_s,
            },
            lead: self.lead,
        }
    }
}

/// Tunings by a key of everything that they depend on.
type Tunings = BTreeMap<String, Vec<Channel>>;

/// The file of an output folder that keeps its tunings.
pub(super) struct KeptPids {
    file: PathBuf,
    /// Hash of what all tunings of a build depend on.
    key: u64,
    earlier: Tunings,
    now: Tunings,
}

impl KeptPids {
    /// Tunings in `file`; a file that is absent or of another format has none. `key`: hash of rig,
    /// recordings, seed and firmware.
    pub(super) fn open(file: PathBuf, key: u64) -> Self {
        let text = std::fs::read(&file).ok();
        let earlier = text.and_then(|text| serde_json::from_slice(&text).ok());
        Self {
            file,
            key,
            earlier: earlier.unwrap_or_default(),
            now: Tunings::new(),
        }
    }

    /// Gains of the PID for `plants`, and whether an earlier run has tuned them.
    ///
    /// # Errors
    /// As [`Setup::tuned`]; the file cannot be written.
    pub(super) fn tuned(
        &mut self,
        bench: &Setup<'_>,
        plants: &[Vec<f64>],
    ) -> Result<(Vec<Tuning<PidGains>>, bool)> {
        let key = self.key_of(plants);
        if let Some(found) = self.earlier.get(&key).or(self.now.get(&key)) {
            let found = found.clone();
            let tuning = found.iter().map(Channel::tuning).collect();
            self.now.insert(key, found);
            return Ok((tuning, true));
        }
        let tuning = bench.tuned::<PidState>(plants, BUDGET)?;
        self.now
            .insert(key, tuning.iter().map(Channel::new).collect());
        let text = serde_json::to_string(&self.now)
            .map_err(|error| Error::failed(format!("{}: {error}", self.file.display())))?;
        sinew_files::write(&self.file, text)?;
        Ok((tuning, false))
    }

    fn key_of(&self, plants: &[Vec<f64>]) -> String {
        let mut hasher = DefaultHasher::new();
        self.key.hash(&mut hasher);
        // Loops and search are this program's own: another build of it may tune otherwise.
        let program = std::env::current_exe().and_then(|path| path.metadata());
        if let Ok(program) = program {
            program.len().hash(&mut hasher);
            program.modified().ok().hash(&mut hasher);
        }
        for value in plants.iter().flatten() {
            value.to_bits().hash(&mut hasher);
        }
        format!("{:016x}", hasher.finish())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::closed_loop::control_problem::ControlProblem;
    use crate::closed_loop::disturbance::Disturbance;
    use sinew_ident::recording::Recording;
    use sinew_sim::{Plant, Rig};

    #[test]
    fn gains_are_tuned_once_for_the_same_plants() {
        let rigs = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../rigs");
        let rig = Rig::load(rigs.join("mass-spring-damper.toml")).unwrap();
        let recording = Recording::read(rigs.join("mass-spring-damper.fit.csv")).unwrap();
        let plant = Plant::new(&rig).unwrap();
        let recordings = [recording.clone()];
        let mut task = ControlProblem::new(&rig, &plant, &recordings, &recording).unwrap();
        // A short loop: only its being tuned matters here.
        task.reference = task.reference.backwards(40);
        let bench = Setup {
            plant: &plant,
            task: &task,
            seed: 1,
            disturbance: Disturbance::None,
            delay_s: 0.0,
            program: None,
            fleet: None,
        };
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("pid.json");
        let plants = [plant.values()];
        let tuned = |key| {
            KeptPids::open(file.clone(), key)
                .tuned(&bench, &plants)
                .unwrap()
        };
        let (first, reused) = tuned(7);
        assert!(!reused);
        assert_eq!(tuned(7), (first, true));
        assert!(!tuned(8).1, "another rig, recording or seed");
        std::fs::write(&file, "not JSON").unwrap();
        assert!(!tuned(8).1);
    }
}

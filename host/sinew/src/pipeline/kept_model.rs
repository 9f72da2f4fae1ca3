//! A model that is there already: `sinew train` made it of the same rig, recordings, fleet and
//! seed, and nobody has changed its files since.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::Path;

use serde::{Deserialize, Serialize};
use sinew_ident::error::{Error, Result};
use sinew_ident::population::Fleet;
use sinew_ident::recording::Recording;
use sinew_model::spec::ModelSpec;
use sinew_model::store;
use sinew_sim::Rig;

use super::learn::Record;
use super::predictor::key_of;

/// The file beside a model that says of what it was trained.
pub const FILE: &str = "training.json";
/// Files of a model.
const FILES: [&str; 2] = [store::MODEL_FILE, "weights.safetensors"];

/// Record of a training, and hashes of what went in and of what came out.
#[derive(Debug, Serialize, Deserialize)]
pub struct Kept {
    key: u64,
    files: u64,
    /// Record of the training.
    pub record: Record,
    /// Line about its soft sensor.
    pub sensor: Option<String>,
}

/// Hash that changes with anything that a training depends on.
pub fn key(
    rig: &Rig,
    (fit, test): (&[Recording], &[Recording]),
    seed: u64,
    fleet: Option<&Fleet>,
) -> u64 {
    let mut hasher = DefaultHasher::new();
    "train".hash(&mut hasher);
    fit.len().hash(&mut hasher);
    let all: Vec<Recording> = fit.iter().chain(test).cloned().collect();
    key_of(rig, &all, seed, fleet).hash(&mut hasher);
    hasher.finish()
}

impl Kept {
    /// The model in `folder` with its record, if it was trained with this key.
    pub fn find(folder: &Path, key: u64) -> Option<(Self, ModelSpec)> {
        let text = std::fs::read(folder.join(FILE)).ok()?;
        let kept: Self = serde_json::from_slice(&text).ok()?;
        let same = kept.key == key && kept.files == files(folder)?;
        let spec = store::load(folder).ok()?;
        same.then_some((kept, spec))
    }

    /// Notes of what the model in `folder` was trained.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn note(folder: &Path, key: u64, record: &Record, sensor: Option<String>) -> Result<()> {
        let path = folder.join(FILE);
        let Some(files) = files(folder) else {
            return Err(Error::failed(format!("{}: no model", folder.display())));
        };
        let kept = Self {
            key,
            files,
            record: record.clone(),
            sensor,
        };
        let text = serde_json::to_string(&kept)
            .map_err(|error| Error::failed(format!("{}: {error}", path.display())))?;
        Ok(sinew_files::write(path, text)?)
    }
}

/// Hash of a model's files.
fn files(folder: &Path) -> Option<u64> {
    let mut hasher = DefaultHasher::new();
    for name in FILES {
        std::fs::read(folder.join(name)).ok()?.hash(&mut hasher);
    }
    Some(hasher.finish())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record() -> Record {
        Record {
            history: vec![],
            kept: 3,
            parameters: 12,
            one_step_rms: vec![1e-4],
            horizon_rms: vec![1e-3],
            horizon: 12,
        }
    }

    #[test]
    fn a_model_is_found_again_only_for_what_it_was_trained_on_and_unchanged() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        let rig = crate::rig_file::load(root.join("rigs/mass-spring-damper.toml"));
        let rig = rig.expect("a shipped rig");
        let read = |name: &str| {
            let path = root.join(format!("rigs/mass-spring-damper.{name}.csv"));
            [Recording::read(path).expect("a shipped recording")]
        };
        let (fit, test) = (read("fit"), read("test"));
        let same = key(&rig, (&fit, &test), 1, None);
        assert_eq!(same, key(&rig, (&fit, &test), 1, None));
        for other in [
            key(&rig, (&fit, &test), 2, None),
            key(&rig, (&fit, &[]), 1, None),
            key(&rig, (&[fit.clone(), test.clone()].concat(), &[]), 1, None),
            key(&rig, (&test, &fit), 1, None),
        ] {
            assert_ne!(same, other);
        }

        let folder = tempfile::tempdir().expect("a folder");
        let folder = folder.path();
        assert!(Kept::find(folder, same).is_none(), "there is nothing");
        let spec = store::load(&root.join("models/reference-s")).expect("a committed model");
        store::save(folder, &spec).expect("a folder");
        assert!(Kept::find(folder, same).is_none(), "a model alone");
        Kept::note(folder, same, &record(), Some("a sensor".into())).expect("a folder");
        let (kept, found) = Kept::find(folder, same).expect("it was noted");
        assert_eq!(
            (kept.record.kept, kept.sensor.as_deref()),
            (3, Some("a sensor"))
        );
        assert_eq!(found.name, spec.name);
        assert!(Kept::find(folder, same + 1).is_none(), "of something else");
        let path = folder.join(store::MODEL_FILE);
        let text = std::fs::read_to_string(&path).expect("it was saved");
        std::fs::write(&path, text + "# tuned by hand\n").expect("a folder");
        assert!(Kept::find(folder, same).is_none(), "somebody changed it");
    }
}

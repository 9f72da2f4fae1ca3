//! The predictor of a rig, trained and tuned, or taken from an earlier run on the same files.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::Path;

use serde::{Deserialize, Serialize};
use sinew_model::spec::ModelSpec;
use sinew_model::store;
use sinew_sim::{Plant, Rig};

use crate::closed_loop::setup::Setup;
use crate::pipeline::learn::{CHECKPOINT_FILE, Record, SAMPLED_STATES, learn, save, went_on};
use crate::pipeline::plants::Plants;
use crate::pipeline::soft_sensor::{as_sensed, attach};
use crate::project;
use crate::tuning::tune::tune_quickly;
use sinew_ident::cli::progress::Stage;
use sinew_ident::error::{Error, Result};
use sinew_ident::fit::{FreeRun, free_run};
use sinew_ident::population::Fleet;
use sinew_ident::recording::Recording;
use sinew_train::dataset::{SampledState, sampled_states};

/// A trained and tuned network.
pub(super) struct Predictor {
    /// The network with its tuned weights.
    pub spec: ModelSpec,
    /// Record of the training.
    pub record: Record,
    /// It came from an earlier run on the same files.
    pub reused: bool,
}

/// Key of an earlier training, and its record.
#[derive(Serialize, Deserialize)]
struct Kept {
    key: u64,
    record: Record,
}

/// The predictor of `rig`: from an earlier run on the same files in the folder `out`, or trained
/// and tuned now, with cargo's build outputs in `cache`.
///
/// # Errors
/// The plant diverges, nothing is learned, no weights give a finite loop, or a file cannot be
/// written.
pub(super) fn predictor(
    rig: &Rig,
    recordings: &[Recording],
    bench: &Setup<'_>,
    (out, cache): (&Path, Option<&Path>),
    quiet: bool,
) -> Result<Predictor> {
    let plant = bench.plant;
    let folder = out.join("model");
    let kept = out.join("training.json");
    let key = key(rig, recordings, bench);
    if let Some(found) = earlier(&kept, key)
        && let Ok(spec) = store::load(&folder)
    {
        Stage::begin("train the network", quiet).end("as before: same rig, recordings and seed");
        return Ok(Predictor {
            spec,
            record: found.record,
            reused: true,
        });
    }
    let stage = Stage::begin("train the network", quiet);
    let runs = recordings.iter().map(|recording| free_run(rig, recording));
    let starts = starts(plant, recordings, &runs.collect::<Result<Vec<_>>>()?)?;
    let mut first = None;
    let learned = learn(
        rig,
        plant,
        Plants {
            usual: &plant.values(),
            fleet: bench.fleet,
        },
        &starts,
        &as_sensed(bench.task, plant, recordings)?,
        (bench.seed, &out.join(CHECKPOINT_FILE)),
        |done, of, losses| {
            first.get_or_insert(done);
            stage.share(done, of, &format!("passes, loss {:.4}", losses.validation));
        },
    )?;
    stage.end(format!(
        "{} weights, {} after {} steps{}",
        learned.record.parameters,
        sinew_ident::report::quantity(
            learned.record.horizon_rms[0],
            &plant.sensors()[bench.task.outputs[0]].unit
        ),
        learned.record.horizon,
        went_on(first)
    ));

    let mut spec = learned.spec;
    attach(&mut spec, bench.task, plant, recordings, false)?;
    tune_quickly(&mut spec, bench, out, cache, quiet)?;

    save(&folder, &spec)?;
    let text = serde_json::to_string(&Kept {
        key,
        record: learned.record.clone(),
    })
    .map_err(|e| Error::failed(format!("{}: {e}", kept.display())))?;
    sinew_files::write(&kept, text)?;
    Ok(Predictor {
        spec,
        record: learned.record,
        reused: false,
    })
}

fn earlier(path: &Path, key: u64) -> Option<Kept> {
    let kept: Kept = serde_json::from_slice(&std::fs::read(path).ok()?).ok()?;
    (kept.key == key).then_some(kept)
}

/// Hash that changes with anything that training and tuning depend on.
pub(super) fn key(rig: &Rig, recordings: &[Recording], bench: &Setup<'_>) -> u64 {
    key_of(rig, recordings, bench.seed, bench.fleet)
}

/// As [`key`], of what a [`Setup`] has.
pub(super) fn key_of(rig: &Rig, recordings: &[Recording], seed: u64, fleet: Option<&Fleet>) -> u64 {
    let mut hasher = DefaultHasher::new();
    env!("CARGO_PKG_VERSION").hash(&mut hasher);
    format!("{:?}", sinew_train::train::Options::default()).hash(&mut hasher);
    // Tuning runs the firmware.
    project::hash_sources(&mut hasher);
    rig.to_toml().hash(&mut hasher);
    seed.hash(&mut hasher);
    if let Some(fleet) = fleet {
        fleet.to_toml().hash(&mut hasher);
    }
    for recording in recordings {
        recording.to_csv().hash(&mut hasher);
    }
    hasher.finish()
}

/// States along the recordings of the fit, from the free runs of its rig.
///
/// # Errors
/// A column is missing, or the plant diverges.
pub fn starts(
    plant: &Plant,
    recordings: &[Recording],
    runs: &[FreeRun],
) -> Result<Vec<SampledState>> {
    let mut all = Vec::new();
    for (recording, run) in recordings.iter().zip(runs) {
        let columns = plant
            .inputs()
            .iter()
            .map(|input| Ok(recording.input(input)?.values))
            .collect::<Result<Vec<_>>>()?;
        let slices: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
        let count = SAMPLED_STATES / recordings.len().max(1);
        all.extend(sampled_states(
            plant,
            &run.values,
            &run.start,
            recording.t(),
            &slices,
            count,
        )?);
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::closed_loop::control_problem::ControlProblem;
    use crate::closed_loop::disturbance::Disturbance;
    use crate::rig_file;

    /// A fleet of devices that all weigh about `mass`.
    fn fleet(mass: f64) -> Fleet {
        let mut text = String::from(
            "format = \"sinew-fleet/1\"\nrig = \"m\"\nwidening = 1.0\nfreedom = 50\n\
             covariance = [[1e-4, 0.0, 0.0], [0.0, 1e-4, 0.0], [0.0, 0.0, 1e-4]]\n\
             covariance_of_mean = [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]\n",
        );
        for (name, mean) in [
            ("mass.inertia", mass),
            ("coil.stiffness", 40.0),
            ("dashpot.damping", 1.2),
        ] {
            text += &format!(
                "[[parameter]]\nname = \"{name}\"\nunit = \"\"\nscale = \"log\"\nmean = {mean:?}\n"
            );
        }
        Fleet::parse(&text, Path::new("fleet.toml")).expect("the text is a fleet")
    }

    #[test]
    fn with_a_fleet_every_plant_is_a_device_of_it_and_another_fleet_trains_anew() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../rigs");
        let rig = rig_file::load(root.join("mass-spring-damper.toml")).expect("a shipped rig");
        let plant = Plant::new(&rig).expect("it can be simulated");
        let recording = Recording::read(root.join("mass-spring-damper.fit.csv"));
        let recordings = [recording.expect("a shipped recording")];
        let task = ControlProblem::new(&rig, &plant, &recordings, &recordings[0]);
        let task = task.expect("a control problem");
        let bench = |fleet| Setup {
            plant: &plant,
            task: &task,
            seed: 1,
            disturbance: Disturbance::None,
            delay_s: 0.0,
            program: None,
            fleet,
        };
        let [light, alike, heavy] = [0.3, 0.3, 3.0].map(fleet);
        let mass = plant.slot("mass.inertia").expect("a parameter");
        for (fleet, wanted) in [(None, 1.0), (Some(&light), 0.3), (Some(&heavy), 3.0)] {
            let bench = bench(fleet);
            // The first of them is the fitted plant.
            let tuning = bench.tuning_plants(4).split_off(1);
            let (of_loop, moved) = bench.perturbed_plant();
            for values in tuning.iter().chain([&of_loop]) {
                let part = values[mass] / wanted;
                assert!((0.79..1.21).contains(&part), "{part} of {wanted}");
            }
            assert_eq!(moved.len(), 3);
        }
        let key = |fleet| key(&rig, &recordings, &bench(fleet));
        assert_eq!(key(Some(&light)), key(Some(&alike)));
        assert_ne!(key(Some(&light)), key(Some(&heavy)));
        assert_ne!(key(Some(&light)), key(None));
    }
}

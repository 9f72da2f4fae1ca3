//! Weak instances of effects: every law of the vocabulary at every place of a rig, of a size that
//! an experiment asks for.

use sinew_sim::effects::Kind;
use sinew_sim::rig::Site;
use sinew_sim::{Plant, Rig, SimulationSettings};

use super::driven;
use crate::error::Result;
use crate::excite::Experiment;
use crate::scales::Run;

/// An effect at a place, with the parameters that are simulated.
#[derive(Clone, Debug)]
pub(in crate::excite) struct Instance {
    pub(super) kind: Kind,
    pub(super) site: Site,
    pub(super) values: Vec<f64>,
}

impl Instance {
    /// Instances at every place, their sizes from the motion of the rig in an experiment.
    ///
    /// # Errors
    /// `Simulation` where the rig cannot be simulated.
    pub(super) fn all(rig: &Rig, plant: &Plant, experiment: &Experiment) -> Result<Vec<Self>> {
        let (start, drive) = driven(plant, experiment)?;
        let values = plant.values();
        let mut run = Run::new(rig, plant, &values, &[&experiment.inputs]);
        run.take((&values, &start), &drive, &experiment.t)?;
        let places = (Kind::ALL.iter())
            .flat_map(|&kind| kind.sites(rig).into_iter().map(move |site| (kind, site)));
        let instances = places.map(|(kind, site)| {
            let first = kind.starts(&run.at(site)).into_iter().next();
            Self {
                kind,
                site,
                values: first.unwrap_or_default(),
            }
        });
        Ok(instances.collect())
    }

    /// Signals of the rig with this effect more; none where it cannot be simulated so.
    pub(in crate::excite) fn signals(
        &self,
        rig: &Rig,
        experiment: &Experiment,
        settings: SimulationSettings,
    ) -> Option<Vec<f64>> {
        let rig = rig.with_effect(self.kind, self.site, &self.values).ok()?;
        let plant = Plant::new(&rig).ok()?.with_settings(settings);
        let (start, drive) = driven(&plant, experiment).ok()?;
        let run = plant.simulate(&plant.values(), &start, &drive, &experiment.t);
        Some(run.ok()?.signals)
    }
}

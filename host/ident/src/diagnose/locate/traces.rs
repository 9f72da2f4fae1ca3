//! Recovered forces of several recordings, and the statistics that are tried for them
//! (docs/explanation/diagnosis.md, eq. 13).

use sinew_sim::rig::Reads;
use sinew_sim::{Plant, Rig};

use crate::diagnose::config::CONFIG;
use crate::diagnose::data::Data;
use crate::diagnose::locate::latent_force::{Place, Pushed, Trace, Wander};
use crate::error::Result;

/// The recordings with few enough rows for a filter.
pub(super) fn thin(data: &Data, rig: &Rig, plant: &Plant) -> Data {
    let every = data.rows() / (CONFIG.locate.rows * data.experiments.len().max(1));
    data.thinned(rig, plant, every.max(1))
}

/// Recovered forces of all recordings up to the first that cannot be simulated.
pub(super) fn recover_all(
    pushed: &Pushed,
    rig: &Rig,
    (place, wander): (&Place, Wander),
    data: &Data,
) -> Result<Vec<Trace>> {
    let mut traces = Vec::with_capacity(data.experiments.len());
    for experiment in 0..data.experiments.len() {
        match pushed.recover(rig, place, wander, data, experiment)? {
            Some(trace) => traces.push(trace),
            None => break,
        }
    }
    Ok(traces)
}

/// Sizes and correlation times to try: parts of the force that moves the body, and of the time in
/// which it moves.
pub(super) fn wanders(rig: &Rig, data: &Data, place: &Place) -> Vec<Wander> {
    let Some((position, velocity)) = data.size_of(&rig.bodies[place.to].name) else {
        return Vec::new();
    };
    let time = position / velocity;
    let inertia = rig.bodies[place.to].inertia.value.abs();
    let effort = rig.sensors.iter().zip(&data.spread);
    let effort = effort.filter(|(sensor, _)| sensor.reads == Reads::Effort(place.to));
    let effort = effort.map(|(sensor, spread)| (spread / sensor.gain.value).abs());
    let force = effort.fold(inertia * velocity / time, f64::max);
    let wanders = CONFIG.locate.sizes.into_iter().flat_map(|share| {
        CONFIG.locate.times.map(|part| Wander {
            size: share * force,
            time: part * time,
        })
    });
    wanders.collect()
}

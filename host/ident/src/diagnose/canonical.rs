//! The form in which parameters are reported where several describe the same motion.

use crate::diagnose::model::{Model, Point};
use crate::diagnose::term::Term;
use sinew_sim::rig::{End, Site};

/// Brings every effect at a body beside a free damper of the rig to its canonical form (contract of
/// the vocabulary): what the rig's own damper can take over stands there.
pub(crate) fn settle(model: &Model, terms: &[Term], point: &mut Point) {
    for term in terms {
        let Some((kind, place)) = term.single() else {
            continue;
        };
        let Site::Body(body) = place.site else {
            continue;
        };
        let damper = model.rig.dampers.iter().find(|damper| {
            damper.damping.free
                && [(damper.from, damper.to), (damper.to, damper.from)]
                    .contains(&(End::Ground, End::Body(body)))
        });
        let damper =
            damper.and_then(|damper| model.plant.slot(&format!("{}.damping", damper.name)));
        let names = term.parameters();
        let slots = names.iter().map(|name| model.plant.slot(name));
        let (Some(damper), Some(slots)) = (damper, slots.collect::<Option<Vec<usize>>>()) else {
            continue;
        };
        let mut own: Vec<f64> = slots.iter().map(|&slot| point.values[slot]).collect();
        let mut damping = point.values[damper];
        kind.canonical(&mut own, &mut damping);
        point.values[damper] = damping;
        for (slot, value) in slots.into_iter().zip(own) {
            point.values[slot] = value;
        }
    }
}

//! One way of writing what can be written in many: parameters that trade exactly against each other.

use sinew_sim::effects::Kind;
use sinew_sim::rig::End;

use super::model::{Model, Point};
use super::suspect::Suspect;

/// Moves the smaller damping of a direction-dependent friction into a free damper that the rig has at the same
/// body (contract of the vocabulary): the motion stays the same to the bit but for rounding.
pub(super) fn settle(model: &Model, suspects: &[Suspect], point: &mut Point) {
    for suspect in suspects {
        let Suspect::Effect { kind, component } = suspect else {
            continue;
        };
        if Kind::named("direction_dependent_friction") != Some(*kind) {
            continue;
        }
        let rig = &model.rig;
        let Some(body) = rig.bodies.iter().position(|body| body.name == *component) else {
            continue;
        };
        let damper = rig.dampers.iter().find(|damper| {
            damper.damping.free
                && [(damper.from, damper.to), (damper.to, damper.from)]
                    .contains(&(End::Ground, End::Body(body)))
        });
        let slot = |name: &str| {
            model
                .plant
                .slot(&format!("{component}.direction_dependent_friction.{name}"))
        };
        let (Some(damper), Some(forward), Some(backward)) =
            (damper, slot("damping_pos"), slot("damping_neg"))
        else {
            continue;
        };
        let Some(own) = model.plant.slot(&format!("{}.damping", damper.name)) else {
            continue;
        };
        let common = point.values[forward].min(point.values[backward]);
        if point.values[own] + common >= 0.0 {
            point.values[own] += common;
            point.values[forward] -= common;
            point.values[backward] -= common;
        }
    }
}

//! Actuators: motors at joints, and the tensions of tendons.

use sinew_sim::effects::Kind;
use sinew_sim::rig::{Actuator, Drives, Rig, Site};

use super::xml::Element;
use super::{Model, effect, unnamed, value};

/// A tension that nothing reaches, N.
const FAR: f64 = 1e12;

/// Samples that MuJoCo keeps of a delayed command.
const KEPT: &str = "1000";

/// One actuator of MuJoCo an actuator of the rig, in its order, so that `ctrl` has the rig's
/// inputs.
pub(super) fn add(rig: &Rig, model: &mut Model) {
    let mut driven = vec![false; rig.tendons.len()];
    for (index, actuator) in rig.actuators.iter().enumerate() {
        let element = match actuator.drives {
            Drives::Body(body) => {
                let element = Element::new("general")
                    .with("name", &actuator.name)
                    .with("joint", &rig.bodies[body].name)
                    .number("gainprm", actuator.gain.value);
                position_loop(actuator, element, model)
            }
            Drives::Tendon(tendon) if !driven[tendon] => {
                driven[tendon] = true;
                tension(rig, tendon, Some(index))
            }
            // It keeps its place among the controls; what it does has no counterpart.
            Drives::Hasel(hasel) => {
                let name = &rig.geometry.hasels[hasel].name;
                model.left_out.push(format!("HASEL actuator `{name}`"));
                Element::new("general")
                    .with("name", &actuator.name)
                    .with("joint", &rig.bodies[0].name)
                    .number("gainprm", 0.0)
            }
            Drives::Tendon(tendon) => Element::new("general")
                .with("name", &actuator.name)
                .with("tendon", &rig.tendons[tendon].name)
                .number("gainprm", let_out(rig, tendon, index)),
        };
        left_out(rig, index, model);
        model.actuators.push(dynamics(rig, index, element));
    }
}

/// The position loop of an actuator: a bias that pulls back with the gain, and a limit of the
/// force.
fn position_loop(actuator: &Actuator, mut element: Element, model: &mut Model) -> Element {
    let Some(position_loop) = &actuator.position_loop else {
        return element;
    };
    let gain = actuator.gain.value;
    element = (element.with("biastype", "affine")).numbers("biasprm", &[0.0, -gain, 0.0]);
    if let Some(limit) = &position_loop.effort_limit {
        element = element
            .with("forcelimited", "true")
            .numbers("forcerange", &[-limit.value, limit.value]);
    }
    if position_loop.dead_band.is_some() {
        let name = &actuator.name;
        let what =
            format!("dead band of the position loop of `{name}`: MuJoCo's actuators have none");
        model.left_out.push(what);
    }
    element
}

/// Force of a tendon per unit of the input of an actuator that lets it out: stiffness times gain,
/// positive since a longer tendon pulls less.
fn let_out(rig: &Rig, tendon: usize, actuator: usize) -> f64 {
    rig.tendons[tendon].stiffness.value * rig.actuators[actuator].gain.value
}

/// `-T = k gain u - (T0 - k slack) - k stretch - c stretch'`, and never above zero where it cannot
/// push.
pub(super) fn tension(rig: &Rig, index: usize, actuator: Option<usize>) -> Element {
    let tendon = &rig.tendons[index];
    let slack = effect(rig, Kind::TendonSlack, Site::Tendon(index));
    let stiffness = tendon.stiffness.value;
    let by = slack.map_or(0.0, |effect| effect.parameters[0].value);
    let bias = [
        -(tendon.pretension.value - stiffness * by),
        -stiffness,
        -tendon.damping.value,
    ];
    let name = match actuator {
        Some(actuator) => rig.actuators[actuator].name.clone(),
        None => format!("{}.tension", tendon.name),
    };
    let gain = actuator.map_or(0.0, |actuator| let_out(rig, index, actuator));
    let mut element = Element::new("general")
        .with("name", &name)
        .with("tendon", &tendon.name)
        .number("gainprm", gain)
        .with("biastype", "affine")
        .numbers("biasprm", &bias)
        .remark(format!("its force is minus the tension of {}", tendon.name));
    if tendon.unilateral || slack.is_some() {
        element = element
            .with("forcelimited", "true")
            .numbers("forcerange", &[-FAR, 0.0]);
    }
    element
}

/// Effects on the input that MuJoCo cannot carry.
fn left_out(rig: &Rig, index: usize, model: &mut Model) {
    let site = Site::Actuator(index);
    for (kind, instead) in [
        (
            Kind::InputDeadZone,
            "apply it to the command before writing ctrl",
        ),
        (
            Kind::InputCurvature,
            "apply it to the command before writing ctrl",
        ),
        (
            Kind::Backlash,
            "apply the play to the command before writing ctrl",
        ),
    ] {
        if let Some(effect) = effect(rig, kind, site) {
            model.left_out.push(unnamed(rig, effect, instead));
        }
    }
}

/// Delay, saturation and lag of the input, in this order, as in the rig.
fn dynamics(rig: &Rig, index: usize, mut element: Element) -> Element {
    let site = Site::Actuator(index);
    let delay = value(rig, Kind::InputDelay, site, 0);
    if delay > 0.0 {
        element = element.number("delay", delay).with("nsample", KEPT);
    }
    if let Some(effect) = effect(rig, Kind::InputSaturation, site) {
        let limit = effect.parameters[0].value;
        element = element
            .with("ctrllimited", "true")
            .numbers("ctrlrange", &[-limit, limit]);
    } else if let Some((low, high)) = rig.actuators[index].limit {
        // What a controller may ask for; a plant does not clip it.
        element = element
            .with("ctrllimited", "false")
            .numbers("ctrlrange", &[low, high]);
    }
    let lag = value(rig, Kind::ActuatorLag, site, 0);
    if lag > 0.0 {
        element = element.with("dyntype", "filterexact").number("dynprm", lag);
    }
    element
}

//! Couplings between coordinates: springs, dampers and tendons, as MuJoCo's fixed tendons.

use sinew_sim::effects::Kind;
use sinew_sim::rig::{Drives, End, Rig, Site};

use super::stiffness::{coil, ends_at_ground, ground_spring, pot, trimmed};
use super::xml::Element;
use super::{Model, effect, unnamed, value};

/// A rest length of exactly this means to MuJoCo that it is to be worked out.
const SENTINEL: f64 = -1.0;

pub(super) fn add(rig: &Rig, model: &mut Model) {
    for index in 0..rig.springs.len() {
        spring(rig, index, model);
    }
    for (index, damper) in rig.dampers.iter().enumerate() {
        let grounded = (0..rig.bodies.len()).any(|b| ends_at_ground(damper.from, damper.to, b));
        if !grounded {
            let [linear, drag] = pot(rig, index);
            let element = Element::new("fixed")
                .with("name", &damper.name)
                .numbers("damping", &trimmed([linear, drag, 0.0]));
            model
                .tendons
                .push(between(rig, element, damper.from, damper.to));
        }
    }
    for effect in &rig.effects {
        if let (Kind::CrossCoupling, Site::Pair(a, b)) = (effect.kind, effect.site) {
            let element = Element::new("fixed")
                .with("name", &rig.site_name(effect.site))
                .number("stiffness", effect.parameters[0].value)
                .with("springlength", "0");
            model
                .tendons
                .push(between(rig, element, End::Body(a), End::Body(b)));
        }
    }
    for index in 0..rig.tendons.len() {
        tendon(rig, index, model);
    }
}

/// One coordinate of a fixed tendon.
pub(super) fn arm(joint: &str, coefficient: f64) -> Element {
    Element::new("joint")
        .with("joint", joint)
        .number("coef", coefficient)
}

fn between(rig: &Rig, mut element: Element, from: End, to: End) -> Element {
    for (end, coefficient) in [(to, 1.0), (from, -1.0)] {
        if let End::Body(body) = end {
            element = element.holding(arm(&rig.bodies[body].name, coefficient));
        }
    }
    element
}

fn spring(rig: &Rig, index: usize, model: &mut Model) {
    let spring = &rig.springs[index];
    let site = Site::Spring(index);
    for (kind, instead) in [
        (Kind::Hysteresis, "MuJoCo has no hysteretic spring"),
        (Kind::Creep, "MuJoCo has no branch without a mass"),
        (Kind::PlasticSet, "MuJoCo has no spring that takes a set"),
    ] {
        if let Some(effect) = effect(rig, kind, site) {
            model.left_out.push(unnamed(rig, effect, instead));
        }
    }
    let stands = |body: usize| ground_spring(rig, body) == Some(index);
    if (0..rig.bodies.len()).any(stands) {
        return; // its joint has it
    }
    let mut rest = spring.rest.value;
    let [linear, mut quadratic, cubic] = coil(rig, index);
    let gap = value(rig, Kind::Backlash, site, 0);
    let (mut from, mut to) = (spring.from, spring.to);
    if gap == 0.0 && rest == SENTINEL {
        // The same spring from its other end.
        (rest, quadratic, from, to) = (-rest, -quadratic, to, from);
    }
    let lengths = if gap == 0.0 {
        vec![rest]
    } else {
        vec![rest - 0.5 * gap, rest + 0.5 * gap]
    };
    let mut element = Element::new("fixed")
        .with("name", &spring.name)
        .numbers("stiffness", &trimmed([linear, quadratic, cubic]))
        .numbers("springlength", &lengths);
    let damping = value(rig, Kind::Viscous, site, 0);
    if damping != 0.0 {
        element = element.number("damping", damping);
    }
    model.tendons.push(between(rig, element, from, to));
}

/// Actuators that pull at a tendon.
fn pulling(rig: &Rig, tendon: usize) -> Vec<usize> {
    (0..rig.actuators.len())
        .filter(|&actuator| rig.actuators[actuator].drives == Drives::Tendon(tendon))
        .collect()
}

/// A tendon's path; its tension is an actuator's (see [`super::actuator`]) unless nothing drives it
/// and it can push.
fn tendon(rig: &Rig, index: usize, model: &mut Model) {
    let tendon = &rig.tendons[index];
    let site = Site::Tendon(index);
    let element = Element::new("fixed").with("name", &tendon.name);
    let element = (tendon.arms(rig).into_iter()).fold(element, |element, (body, coefficient)| {
        element.holding(arm(&rig.bodies[body].name, coefficient))
    });
    model.tendons.push(element);
    for (kind, instead) in [
        (
            Kind::Backlash,
            "MuJoCo's dead band does not move with the motor",
        ),
        (Kind::LoadDependent, "MuJoCo has no capstan friction"),
    ] {
        if let Some(effect) = effect(rig, kind, site) {
            model.left_out.push(unnamed(rig, effect, instead));
        }
    }
    let drivers = pulling(rig, index);
    match drivers[..] {
        [] => model.loads.push(super::actuator::tension(rig, index, None)),
        [_] => {}
        _ => model.left_out.push(format!(
            "tendon {}: more than one actuator lets it out; only the first has its stiffness",
            tendon.name
        )),
    }
}

//! Bodies: one joint each, with everything that acts between it and the world.

use sinew_sim::effects::{Kind, Motion};
use sinew_sim::rig::{End, Rig, Site};

use super::stiffness::{coil, ends_at_ground, ground_spring, pot, trimmed};
use super::xml::Element;
use super::{Model, effect, unnamed, value};

/// m/s^2; which value it is does not matter, since a hinge's weight is given as a torque.
pub(super) const STANDARD_GRAVITY: f64 = 9.81;

/// Limit that nothing reaches, where MuJoCo needs one, m or rad.
const FAR: f64 = 1e6;

/// Body `index` with its joint, the springs and dampers that hold it to the ground, its friction,
/// weight and stop.
pub(super) fn add(rig: &Rig, index: usize, step: f64, model: &mut Model) {
    let body = &rig.bodies[index];
    let site = Site::Body(index);
    let kind = match body.motion {
        Motion::Slide => "slide",
        Motion::Hinge => "hinge",
    };
    let mut joint = Element::new("joint")
        .with("name", &body.name)
        .with("type", kind)
        .with("axis", "0 1 0");
    joint = grounded(rig, index, joint);
    joint = friction(rig, index, step, joint, model);
    joint = stop(rig, index, joint);
    let inertial = match weight(rig, index) {
        Some(weight) => weight,
        None => Element::new("inertial")
            .with("pos", "0 0 0")
            .number("mass", body.inertia.value)
            .numbers("diaginertia", &[body.inertia.value; 3]),
    };
    let element = Element::new("body")
        .with("name", &body.name)
        .holding(inertial)
        .holding(joint);
    model.bodies.push(element);
    push(rig, index, model);
    hidden(rig, index, model);
    if let Some(effect) = effect(rig, Kind::PositionRipple, site) {
        let instead =
            "MuJoCo has no force that follows a sine of the position; write it to qfrc_applied";
        model.left_out.push(unnamed(rig, effect, instead));
    }
}

/// The one spring to the ground that a joint can have, and all dampers and drag there.
fn grounded(rig: &Rig, index: usize, mut joint: Element) -> Element {
    if let Some(spring) = ground_spring(rig, index) {
        let curve = coil(rig, spring);
        // Seen from the body, extension and force both turn round where it is the spring's `from`.
        let side = if rig.springs[spring].to == End::Ground {
            -1.0
        } else {
            1.0
        };
        let [linear, quadratic, cubic] = curve;
        joint = joint
            .numbers("stiffness", &trimmed([linear, side * quadratic, cubic]))
            .number("springref", side * rig.springs[spring].rest.value);
    }
    let own = (rig.dampers.iter().enumerate())
        .filter(|(_, damper)| ends_at_ground(damper.from, damper.to, index));
    let pots: Vec<[f64; 2]> = own.map(|(damper, _)| pot(rig, damper)).collect();
    let dampers: f64 = pots.iter().map(|pot| pot[0]).sum();
    let springs: f64 = ground_spring(rig, index).map_or(0.0, |spring| {
        value(rig, Kind::Viscous, Site::Spring(spring), 0)
    });
    let linear = dampers + springs + value(rig, Kind::Viscous, Site::Body(index), 0);
    let drag = value(rig, Kind::QuadraticDrag, Site::Body(index), 0)
        + pots.iter().map(|pot| pot[1]).sum::<f64>();
    if linear != 0.0 || drag != 0.0 {
        joint = joint.numbers("damping", &trimmed([linear, drag, 0.0]));
    }
    joint
}

fn friction(rig: &Rig, index: usize, step: f64, joint: Element, model: &mut Model) -> Element {
    let site = Site::Body(index);
    let mut level = value(rig, Kind::Coulomb, site, 0);
    if let Some(effect) = effect(rig, Kind::Stribeck, site) {
        level += effect.parameters[0].value;
        let instead = "frictionloss holds its level; the rise towards rest is lost";
        model.left_out.push(unnamed(rig, effect, instead));
    }
    if let Some(effect) = effect(rig, Kind::DirectionDependent, site) {
        level += 0.5 * (effect.parameters[0].value + effect.parameters[1].value);
        let instead = "frictionloss holds the mean of its levels; the rest is lost";
        model.left_out.push(unnamed(rig, effect, instead));
    }
    if let Some(effect) = effect(rig, Kind::LoadDependent, site) {
        let instead = "MuJoCo's frictionloss does not follow a load; set it each step";
        model.left_out.push(unnamed(rig, effect, instead));
    }
    if let Some(effect) = effect(rig, Kind::Presliding, site) {
        let instead = "MuJoCo has no friction that yields before it slips";
        model.left_out.push(unnamed(rig, effect, instead));
    }
    if let Some(effect) = effect(rig, Kind::WarmUp, site) {
        level += effect.parameters[0].value;
        let instead = "frictionloss holds its cold level; it does not warm";
        model.left_out.push(unnamed(rig, effect, instead));
    }
    if level == 0.0 {
        return joint;
    }
    // Nearly hard: what rests creeps by 1e-4 of what pushes it, over two steps.
    joint
        .number("frictionloss", level)
        .with("solimpfriction", "0.9999 0.9999 0.001 0.5 2")
        .numbers("solreffriction", &[2.0 * step, 1.0])
}

/// A stop whose impedance is so small that nothing but its spring and damper acts:
/// `f = m d (b v + k d p) + m d a`, d small, with `solref = -K/m, -B/m` is `f = K p + B v`.
fn stop(rig: &Rig, index: usize, joint: Element) -> Element {
    let Some(effect) = effect(rig, Kind::EndStop, Site::Body(index)) else {
        return joint;
    };
    let [position, stiffness, damping, side] =
        [0, 1, 2, 3].map(|parameter| effect.parameters[parameter].value);
    let inertia = rig.bodies[index].inertia.value;
    let range = if side > 0.0 {
        [-FAR, position]
    } else {
        [position, FAR]
    };
    joint
        .with("limited", "true")
        .numbers("range", &range)
        .numbers("solreflimit", &[-stiffness / inertia, -damping / inertia])
        .with("solimplimit", "0.0001 0.0001 0.001 0.5 2")
}

/// All that swings about a hinge, as one point mass below it: `m g l = amplitude`, and half of the
/// inertia.
fn weight(rig: &Rig, index: usize) -> Option<Element> {
    let body = &rig.bodies[index];
    if body.motion != Motion::Hinge {
        return None;
    }
    let gravities = (rig.gravities.iter())
        .filter(|gravity| gravity.body == index)
        .map(|gravity| (gravity.amplitude.value, gravity.zero.value));
    let site = Site::Body(index);
    let load = effect(rig, Kind::Gravity, site)
        .map(|effect| (effect.parameters[0].value, effect.parameters[1].value));
    let (mut x, mut y) = (0.0, 0.0);
    for (amplitude, zero) in gravities.chain(load) {
        x += amplitude * zero.cos();
        y += amplitude * zero.sin();
    }
    let (amplitude, zero) = (x.hypot(y), y.atan2(x));
    if amplitude == 0.0 {
        return None;
    }
    let inertia = body.inertia.value;
    let length = 0.5 * inertia * STANDARD_GRAVITY / amplitude;
    let mass = amplitude / (STANDARD_GRAVITY * length);
    let rest = inertia - mass * length * length;
    let place = [length * zero.sin(), 0.0, -length * zero.cos()];
    Some(
        Element::new("inertial")
            .numbers("pos", &place)
            .number("mass", mass)
            .numbers("diaginertia", &[rest; 3])
            .remark(format!(
                "weight of {amplitude:?} N m, hanging at {zero:?} rad"
            )),
    )
}

/// Constant forces: a slide's weight and constant loads.
fn push(rig: &Rig, index: usize, model: &mut Model) {
    let body = &rig.bodies[index];
    let site = Site::Body(index);
    let mut force = value(rig, Kind::Constant, site, 0);
    if body.motion == Motion::Slide {
        force -= value(rig, Kind::Gravity, site, 0);
        force -= (rig.gravities.iter())
            .filter(|gravity| gravity.body == index)
            .map(|gravity| gravity.amplitude.value)
            .sum::<f64>();
    }
    if force != 0.0 {
        let load = Element::new("general")
            .with("name", &format!("{}.load", body.name))
            .with("joint", &body.name)
            .with("gainprm", "0")
            .with("biastype", "affine")
            .numbers("biasprm", &[force, 0.0, 0.0])
            .remark("a constant force; its ctrl does nothing");
        model.loads.push(load);
    }
}

/// The mass of a hidden mode, as another body beside it.
fn hidden(rig: &Rig, index: usize, model: &mut Model) {
    let body = &rig.bodies[index];
    let Some(effect) = effect(rig, Kind::HiddenMode, Site::Body(index)) else {
        return;
    };
    let [inertia, stiffness, damping] =
        [0, 1, 2].map(|parameter| effect.parameters[parameter].value);
    let name = hidden_name(&body.name);
    let kind = if body.motion == Motion::Slide {
        "slide"
    } else {
        "hinge"
    };
    let inertial = Element::new("inertial")
        .with("pos", "0 0 0")
        .number("mass", inertia)
        .numbers("diaginertia", &[inertia; 3]);
    let joint = Element::new("joint")
        .with("name", &name)
        .with("type", kind)
        .with("axis", "0 1 0");
    let element = Element::new("body")
        .with("name", &name)
        .holding(inertial)
        .holding(joint)
        .remark(format!("starts where {} starts", body.name));
    model.bodies.push(element);
    let spring = Element::new("fixed")
        .with("name", &name)
        .number("stiffness", stiffness)
        .number("damping", damping)
        .with("springlength", "0")
        .holding(super::line::arm(&name, 1.0))
        .holding(super::line::arm(&body.name, -1.0));
    model.tendons.push(spring);
}

fn hidden_name(body: &str) -> String {
    format!("{body}.hidden")
}

/// Initial state of the rig as a keyframe.
pub(super) fn start(rig: &Rig) -> Option<Element> {
    let says = (rig.bodies.iter()).any(|b| b.start.is_some() || b.start_velocity.is_some());
    if !says {
        return None;
    }
    let (mut positions, mut velocities) = (Vec::new(), Vec::new());
    for (index, body) in rig.bodies.iter().enumerate() {
        // A hidden mass starts with its body.
        let copies = match effect(rig, Kind::HiddenMode, Site::Body(index)) {
            Some(_) => 2,
            None => 1,
        };
        for _ in 0..copies {
            positions.push(body.start.as_ref().map_or(0.0, |start| start.value));
            velocities.push(
                body.start_velocity
                    .as_ref()
                    .map_or(0.0, |start| start.value),
            );
        }
    }
    Some(
        Element::new("key")
            .with("name", "start")
            .numbers("qpos", &positions)
            .numbers("qvel", &velocities),
    )
}

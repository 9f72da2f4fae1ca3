//! Effects put where they sit: laws at ports, states, switches, stages of inputs and readings.

use super::slots::{Slots, input_unit, reading_unit};
use super::topology::{
    BodySlots, Damper, Follow, Followed, Friction, Gap, Law, Load, Memory, Presliding, Spring,
    Stop, Switch, Topology, Warming,
};
use crate::effects::{Family, Kind};
use crate::rig::{Drives, EffectTable, Rig, Site};
use crate::unit::Motion;

/// Every effect of the rig.
pub(super) fn add_effects(rig: &Rig, slots: &mut Slots, topology: &mut Topology) {
    for effect in &rig.effects {
        let slot = add_parameters(rig, effect, slots);
        match effect.site {
            Site::Body(body) => at_body(rig, effect.kind, body, slot, topology),
            Site::Spring(spring) => at_spring(rig, effect.kind, spring, slot, topology),
            Site::Tendon(tendon) => at_tendon(rig, effect.kind, tendon, slot, topology),
            Site::Actuator(actuator) => at_actuator(effect.kind, actuator, slot, topology),
            Site::Sensor(sensor) => at_sensor(effect.kind, sensor, slot, topology),
            Site::Pair(a, b) => topology.springs.push(Spring {
                from: a,
                to: b,
                stiffness: slot,
                rest: None,
                motion: rig.bodies[a].motion,
                curve: None,
                laws: Vec::new(),
                gap: None,
                memory: Vec::new(),
            }),
        }
    }
    topology.rated = topology.internal.len();
    for index in 0..topology.sensors.len() {
        if let Some((_, state)) = &mut topology.sensors[index].lag {
            *state = topology.internal.len();
            let name = format!("{}.sensor_lag.reading", rig.sensors[index].name);
            topology.internal.push(name);
            topology.lagging.push(index);
        }
    }
    topology.shaped = (topology.lines.iter()).any(|line| line.chain != Default::default());
}

/// Completes the topology once the paths of tendons are whole.
pub(super) fn finish(topology: &mut Topology) {
    for friction in &mut topology.frictions {
        if let Some(tendon) = friction.along {
            let path = topology.tendons[tendon].path.iter();
            friction.path = path.map(|&(body, arm)| (body, Some(arm))).collect();
            topology.coupled = true;
        }
    }
    for index in 0..topology.frictions.len() {
        let mut path = topology.frictions[index].path.iter();
        topology.frictions[index].passive = path.all(|&(body, _)| topology.is_imposed(body));
    }
    topology.prescribed = topology.imposed.len() == topology.bodies.len()
        && topology.rated == 0
        && topology.lagging.is_empty();
    topology.linear = topology.is_linear();
}

/// The slots of an effect, in the order of its description; the law reads its parameters from
/// neighbouring slots.
fn add_parameters(rig: &Rig, effect: &EffectTable, slots: &mut Slots) -> usize {
    let description = effect.kind.description();
    let (component, motion) = (rig.site_name(effect.site), rig.site_motion(effect.site));
    let base = match effect.site {
        Site::Actuator(actuator) => Some(input_unit(&rig.actuators[actuator])),
        Site::Sensor(sensor) => Some(reading_unit(rig, rig.sensors[sensor].reads)),
        _ => None,
    };
    let slot = slots.len();
    for (spec, value) in description.parameters.iter().zip(&effect.parameters) {
        let name = format!("{component}.{}.{}", description.kind, spec.name);
        let unit = match base {
            Some(base) => spec.quantity.unit_of(base),
            None => spec.quantity.unit(motion).to_owned(),
        };
        slots.add(name, unit, spec.sign, value);
    }
    slot
}

fn switch(topology: &mut Topology, switch: Switch) -> usize {
    topology.switches.push(switch);
    topology.switches.len() - 1
}

fn internal(topology: &mut Topology, name: String) -> usize {
    topology.internal.push(name);
    topology.internal.len() - 1
}

/// The friction of a body, new where it has none.
fn friction_at(rig: &Rig, body: usize, topology: &mut Topology) -> usize {
    let known = (topology.frictions.iter()).position(|f| f.path == [(body, None)]);
    known.unwrap_or_else(|| {
        topology.frictions.push(Friction {
            path: vec![(body, None)],
            along: None,
            motion: rig.bodies[body].motion,
            laws: Vec::new(),
            follows: Vec::new(),
            warming: Vec::new(),
            passive: false,
        });
        topology.frictions.len() - 1
    })
}

/// Lets a friction follow a load.
fn follow(
    topology: &mut Topology,
    friction: usize,
    coefficient: usize,
    arm: Option<usize>,
    load: Followed,
) {
    let which = topology.frictions[friction].follows.len();
    let switch = switch(topology, Switch::Load(friction, which));
    let index = topology.follows;
    topology.follows += 1;
    topology.frictions[friction].follows.push(Follow {
        coefficient,
        arm,
        load,
        index,
        switch,
    });
}

fn at_body(rig: &Rig, kind: Kind, body: usize, slot: usize, topology: &mut Topology) {
    let motion = rig.bodies[body].motion;
    let law = Law { kind, slot };
    match kind {
        Kind::HiddenMode => add_hidden(rig, body, slot, topology),
        Kind::EndStop => {
            let switch = switch(topology, Switch::Stop(topology.stops.len()));
            topology.stops.push(Stop { body, slot, switch });
        }
        Kind::LoadDependent => {
            let driven = (rig.actuators.iter()).any(|a| a.drives == Drives::Body(body));
            let load = if driven {
                Followed::Motors(body)
            } else {
                Followed::Pulls(body)
            };
            let friction = friction_at(rig, body, topology);
            follow(topology, friction, slot, None, load);
        }
        Kind::Presliding => {
            let name = &rig.bodies[body].name;
            let state = internal(topology, format!("{name}.presliding_friction.share"));
            let direction = switch(topology, Switch::Velocity(body));
            topology.rates_vary = true;
            topology.presliding.push(Presliding {
                body,
                slot,
                state,
                direction,
            });
        }
        Kind::WarmUp => {
            let name = &rig.bodies[body].name;
            let state = internal(topology, format!("{name}.warm_up_friction.theta"));
            let direction = switch(topology, Switch::Velocity(body));
            let friction = friction_at(rig, body, topology);
            topology.frictions[friction].warming.push(Warming {
                slot,
                state,
                direction,
            });
        }
        _ if kind.description().family == Family::Friction => {
            let friction = friction_at(rig, body, topology);
            topology.frictions[friction].laws.push(law);
        }
        _ => {
            topology.rates_vary |= matches!(kind, Kind::Added(_));
            if kind.has_kink_at_rest() {
                topology.rates_vary = true;
                switch(topology, Switch::Velocity(body));
            }
            topology.loads.push(Load { body, motion, law });
        }
    }
}

/// A body of its own on a spring and a damper, which starts with its host.
fn add_hidden(rig: &Rig, host: usize, slot: usize, topology: &mut Topology) {
    let body = topology.bodies.len();
    let name = &rig.bodies[host].name;
    let own =
        |effect: &&EffectTable| effect.kind == Kind::HiddenMode && effect.site == Site::Body(host);
    let line = (rig.effects.iter().find(own)).map_or(1, |e| e.parameters[0].place.line);
    topology.names.push(format!("{name}.hidden_mode"));
    topology.bodies.push(BodySlots {
        line,
        inertia: slot,
        start: None,
        start_velocity: None,
        host: Some(host),
    });
    topology.springs.push(Spring {
        from: host,
        to: body,
        stiffness: slot + 1,
        rest: None,
        motion: rig.bodies[host].motion,
        curve: None,
        laws: Vec::new(),
        gap: None,
        memory: Vec::new(),
    });
    topology.dampers.push(Damper {
        from: host,
        to: body,
        damping: slot + 2,
        curve: None,
    });
}

fn at_spring(rig: &Rig, kind: Kind, spring: usize, slot: usize, topology: &mut Topology) {
    let name = &rig.springs[spring].name;
    match kind {
        Kind::Backlash => {
            let switch = switch(topology, Switch::SpringGap(spring));
            topology.springs[spring].gap = Some(Gap { slot, switch });
        }
        Kind::Hysteresis => {
            let state = internal(topology, format!("{name}.hysteresis.z"));
            let direction = switch(topology, Switch::SpringRate(spring));
            let side = switch(topology, Switch::Internal(state));
            topology.rates_vary = true;
            topology.springs[spring].memory.push(Memory::Hysteresis {
                slot,
                state,
                direction,
                side,
            });
        }
        Kind::Creep => {
            let state = internal(topology, format!("{name}.viscoelastic_creep.force"));
            let creep = Memory::Creep { slot, state };
            topology.springs[spring].memory.push(creep);
        }
        Kind::PlasticSet => {
            let state = internal(topology, format!("{name}.plastic_set.z"));
            let switch = switch(
                topology,
                Switch::Yield {
                    spring,
                    slot,
                    state,
                },
            );
            topology.springs[spring].memory.push(Memory::Plastic {
                slot,
                state,
                switch,
            });
        }
        _ => {
            topology.rates_vary |=
                kind.description().family == Family::Stiffness || matches!(kind, Kind::Added(_));
            topology.springs[spring].laws.push(Law { kind, slot });
        }
    }
}

fn at_tendon(rig: &Rig, kind: Kind, index: usize, slot: usize, topology: &mut Topology) {
    match kind {
        Kind::LoadDependent => {
            let tendon = &rig.tendons[index];
            let (friction, arm) = match topology.tendons[index].path[..] {
                // One body: the same as friction at that body, over the arm.
                [(body, arm)] if tendon.routes.is_empty() => {
                    (friction_at(rig, body, topology), Some(arm))
                }
                _ => {
                    topology.frictions.push(Friction {
                        path: Vec::new(),
                        along: Some(index),
                        motion: Motion::Slide,
                        laws: Vec::new(),
                        follows: Vec::new(),
                        warming: Vec::new(),
                        passive: false,
                    });
                    (topology.frictions.len() - 1, None)
                }
            };
            follow(topology, friction, slot, arm, Followed::Tension(index));
        }
        Kind::Backlash => {
            let switch = switch(topology, Switch::TendonGap(index));
            topology.tendons[index].gap = Some(Gap { slot, switch });
        }
        _ => {
            topology.tendons[index].slack = Some(slot);
            if topology.tendons[index].unilateral.is_none() {
                let switch = switch(topology, Switch::Slack(index));
                topology.tendons[index].unilateral = Some(switch);
            }
        }
    }
}

fn at_actuator(kind: Kind, line: usize, slot: usize, topology: &mut Topology) {
    let stages = &mut topology.lines[line].chain;
    let stage = match kind {
        Kind::InputDelay => &mut stages.delay,
        Kind::Backlash => &mut stages.play,
        Kind::InputDeadZone => &mut stages.dead_zone,
        Kind::InputCurvature => &mut stages.curvature,
        Kind::InputSaturation => &mut stages.saturation,
        _ => &mut stages.lag,
    };
    *stage = Some(slot);
}

fn at_sensor(kind: Kind, sensor: usize, slot: usize, topology: &mut Topology) {
    let sensor = &mut topology.sensors[sensor];
    if kind == Kind::SensorLag {
        // Its state is counted once all states with a rate are.
        sensor.lag = Some((slot, usize::MAX));
    } else {
        sensor.curvature = Some(slot);
    }
}

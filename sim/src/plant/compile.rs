//! From a rig to a plant: names become indices, numbers become slots.

use super::attach;
use super::hasel;
use super::motion;
use super::shapes;
use super::slots::{Slots, input_unit, reading_unit};
use super::topology::{
    BodySlots, Damper, Gap, InputChainSlots, Law, Line, Load, Motor, Sensor, Servo, Spring, Switch,
    Tendon, Topology,
};
use super::{Input, MotionQuantity, Parameter, Plant, SensorChannel};
use crate::effects::{Kind, Sign};
use crate::error::Error;
use crate::law::{Curve, LawKind};
use crate::rig::{AppliedLaw, Drives, End, Hold, Place, PositionLoop, Reads, Rig, Signal, Value};
use crate::settings::SimulationSettings;
use crate::unit::{self, Motion, Quantity};
use std::sync::Arc;

/// Every parameter of a rig with its place in the file, in slot order.
pub(crate) fn parameters(rig: &Rig) -> Vec<(Parameter, Place)> {
    build(rig, &rig.dependences(), &mut Vec::new()).0.entries
}

pub(super) fn compile(rig: &Rig) -> Result<Plant, Error> {
    let inputs = inputs(rig)?;
    let acts = |input: &&Input| input.motion.is_none() && !input.exogenous;
    let mut columns: Vec<&str> = (inputs.iter().filter(acts))
        .map(|input| input.column.as_str())
        .collect();
    let signals = rig.dependences();
    let (slots, topology) = build(rig, &signals, &mut columns);
    let sensors = rig.sensors.iter().map(|sensor| SensorChannel {
        name: sensor.name.clone(),
        column: sensor.signal.clone(),
        unit: signal_unit(rig, sensor),
        column_factor: sensor.column_factor,
        position_of: match sensor.reads {
            Reads::Position(body) => Some(body),
            _ => None,
        },
        line: sensor.line,
    });
    let parameters = slots.entries.into_iter().map(|(parameter, _)| parameter);
    Ok(Plant {
        topology: Arc::new(topology),
        parameters: parameters.collect(),
        sensors: sensors.collect(),
        inputs: inputs.into(),
        settings: SimulationSettings::default(),
    })
}

/// The distinct input columns; actuators that share one must agree about its unit.
fn inputs(rig: &Rig) -> Result<Vec<Input>, Error> {
    let mut inputs: Vec<Input> = Vec::new();
    for actuator in &rig.actuators {
        let Some(shared) = inputs.iter_mut().find(|i| i.column == actuator.input) else {
            inputs.push(Input {
                column: actuator.input.clone(),
                actuator: actuator.name.clone(),
                hold: actuator.hold,
                limit: actuator.limit,
                rate_limit: actuator.rate_limit,
                column_factor: actuator.column_factor,
                line: actuator.line,
                motion: None,
                exogenous: false,
            });
            continue;
        };
        if shared.column_factor != actuator.column_factor {
            return Err(Error {
                file: rig.file.clone(),
                line: Some(actuator.line),
                column: None,
                message: format!(
                    "actuators `{}` and `{}` give the column `{}` two units",
                    shared.actuator, actuator.name, actuator.input
                ),
                help: None,
            });
        }
        shared.limit = match (shared.limit, actuator.limit) {
            (Some(a), Some(b)) => Some((a.0.max(b.0), a.1.min(b.1))),
            (a, b) => a.or(b),
        };
        shared.rate_limit = match (shared.rate_limit, actuator.rate_limit) {
            (Some(a), Some(b)) => Some(a.min(b)),
            (a, b) => a.or(b),
        };
    }
    inputs.extend(rig.dependences().into_iter().map(|signal| Input {
        column: signal.column,
        actuator: signal.name,
        hold: Hold::Zero,
        limit: None,
        rate_limit: None,
        column_factor: signal.column_factor,
        line: signal.line,
        motion: None,
        exogenous: true,
    }));
    for body in &rig.bodies {
        let Some(from) = &body.motion_from else {
            continue;
        };
        inputs.extend(MotionQuantity::ALL.map(|quantity| Input {
            column: from.column.clone(),
            actuator: body.name.clone(),
            hold: Hold::Linear,
            limit: None,
            rate_limit: None,
            column_factor: from.column_factor,
            line: from.line,
            motion: Some(quantity),
            exogenous: false,
        }));
    }
    Ok(inputs)
}

/// Unit of a signal in SI: of the column, or of the reading where a `unit` key converts the column.
fn signal_unit(rig: &Rig, sensor: &crate::rig::Sensor) -> String {
    if sensor.column_factor == 1.0 {
        unit::of_column(&sensor.signal).to_owned()
    } else {
        reading_unit(rig, sensor.reads).to_owned()
    }
}

/// Slots of the numbers of every learned law, one after the other; components that share a law
/// share them.
fn laws(rig: &Rig, slots: &mut Slots) -> Vec<Curve> {
    let laws = rig.laws.iter().map(|law| {
        let quantity = match law.kind {
            LawKind::Spring => Quantity::Stiffness,
            LawKind::Damper => Quantity::Damping,
        };
        let unit = quantity.unit(law.motion);
        let slot = slots.len();
        for (k, number) in law.numbers.iter().enumerate() {
            let name = format!("{}.{}.{k}", law.name, law.kind.key());
            slots.add(name, unit, law.sign(), number);
        }
        Curve {
            shape: law.shape(),
            slot,
            count: law.numbers.len(),
        }
    });
    laws.collect()
}

/// Slots and topology; `columns` are the distinct inputs in order (added to where they are new).
fn build<'a>(
    rig: &'a Rig,
    signals: &[Signal],
    columns: &mut Vec<&'a str>,
) -> (Slots<'a>, Topology) {
    let mut slots = Slots::new(rig);
    // Hidden modes are bodies too, after those of the rig.
    let hidden = (rig.effects.iter()).filter(|effect| effect.kind == Kind::HiddenMode);
    let ground = rig.bodies.len() + hidden.count();
    let bodies = bodies(rig, &mut slots);
    let curves = laws(rig, &mut slots);
    let springs = springs(rig, &mut slots, (ground, &curves));
    let dampers = dampers(rig, &mut slots, (ground, &curves));
    let loads = loads(rig, &mut slots);
    let mut switches = Vec::new();
    let tendons = tendons(rig, &mut slots, &mut switches);
    let mut topology = Topology {
        file: rig.file.clone(),
        names: rig.bodies.iter().map(|body| body.name.clone()).collect(),
        bodies,
        springs,
        dampers,
        tendons,
        loads,
        switches,
        // The stiffness of a learned law depends on the extension.
        rates_vary: !rig.laws.is_empty(),
        ..Topology::default()
    };
    hasel::add(rig, &mut slots, &mut topology);
    add_actuators(rig, columns, &mut slots, &mut topology, signals.len());
    add_sensors(rig, &mut slots, &mut topology);
    attach::add_effects(rig, &mut slots, &mut topology);
    shapes::add(rig, &mut slots, &mut topology);
    (topology.signals, topology.depending) = slots.add_dependences(signals, rig);
    topology.rates_vary |= !topology.depending.is_empty();
    attach::finish(&mut topology);
    (slots, topology)
}

fn index(ground: usize, end: End) -> usize {
    match end {
        End::Ground => ground,
        End::Body(body) => body,
    }
}

fn bodies(rig: &Rig, slots: &mut Slots) -> Vec<BodySlots> {
    let bodies = rig.bodies.iter().map(|body| {
        let mut of = |key, quantity, sign, value| {
            slots.of(&body.name, key, (quantity, body.motion), sign, value)
        };
        BodySlots {
            line: body.inertia.place.line,
            inertia: match body.motion_from {
                Some(_) => of(
                    "inertia",
                    Quantity::Inertia,
                    Sign::NonNegative,
                    &body.inertia,
                ),
                None => of("inertia", Quantity::Inertia, Sign::Positive, &body.inertia),
            },
            start: (body.start.as_ref())
                .map(|start| of("start", Quantity::Coordinate, Sign::Any, start)),
            start_velocity: (body.start_velocity.as_ref())
                .map(|start| of("start_velocity", Quantity::Velocity, Sign::Any, start)),
            host: None,
        }
    });
    bodies.collect()
}

/// Curve of a learned law, if a component has one, at the component's size.
fn curve(curves: &[Curve], applied: &Option<AppliedLaw>) -> Option<Curve> {
    let applied = applied.as_ref()?;
    let mut curve = curves[applied.law];
    curve.shape.length = applied.length;
    curve.shape.width = applied.width;
    Some(curve)
}

fn springs(rig: &Rig, slots: &mut Slots, (ground, curves): (usize, &[Curve])) -> Vec<Spring> {
    let springs = rig.springs.iter().map(|spring| {
        let motion = rig.ends_motion(spring.from, spring.to);
        let mut of = |key, quantity, sign, value| {
            slots.of(&spring.name, key, (quantity, motion), sign, value)
        };
        Spring {
            from: index(ground, spring.from),
            to: index(ground, spring.to),
            stiffness: of(
                "stiffness",
                Quantity::Stiffness,
                Sign::NonNegative,
                &spring.stiffness,
            ),
            rest: Some(of("rest", Quantity::Coordinate, Sign::Any, &spring.rest)),
            motion,
            curve: curve(curves, &spring.law),
            laws: Vec::new(),
            gap: None,
            memory: Vec::new(),
        }
    });
    springs.collect()
}

fn dampers(rig: &Rig, slots: &mut Slots, (ground, curves): (usize, &[Curve])) -> Vec<Damper> {
    let dampers = rig.dampers.iter().map(|damper| {
        let quantity = (Quantity::Damping, rig.ends_motion(damper.from, damper.to));
        Damper {
            from: index(ground, damper.from),
            to: index(ground, damper.to),
            damping: slots.of(
                &damper.name,
                "damping",
                quantity,
                Sign::NonNegative,
                &damper.damping,
            ),
            curve: curve(curves, &damper.law),
        }
    });
    dampers.collect()
}

fn loads(rig: &Rig, slots: &mut Slots) -> Vec<Load> {
    let loads = rig.gravities.iter().map(|gravity| {
        let motion = rig.bodies[gravity.body].motion;
        let mut of = |key, quantity, value| {
            slots.of(&gravity.name, key, (quantity, motion), Sign::Any, value)
        };
        // The law reads its two parameters from neighbouring slots, in this order.
        let slot = of("amplitude", Quantity::Force, &gravity.amplitude);
        of("zero", Quantity::Coordinate, &gravity.zero);
        Load {
            body: gravity.body,
            motion,
            law: Law {
                kind: Kind::Gravity,
                slot,
            },
        }
    });
    loads.collect()
}

fn tendons(rig: &Rig, slots: &mut Slots, switches: &mut Vec<Switch>) -> Vec<Tendon> {
    let tendons = rig.tendons.iter().enumerate().map(|(index, tendon)| {
        let path = tendon.path.iter().map(|(body, arm)| {
            let body_name = &rig.bodies[*body].name;
            let unit = match rig.bodies[*body].motion {
                Motion::Slide => "1",
                Motion::Hinge => "m",
            };
            let name = format!("{}.arm.{body_name}", tendon.name);
            (*body, slots.add(name, unit, Sign::Any, arm))
        });
        let path = path.collect();
        let slide = Motion::Slide;
        let mut of = |key, quantity, sign, value| {
            slots.of(&tendon.name, key, (quantity, slide), sign, value)
        };
        Tendon {
            path,
            stiffness: of(
                "stiffness",
                Quantity::Stiffness,
                Sign::NonNegative,
                &tendon.stiffness,
            ),
            damping: of(
                "damping",
                Quantity::Damping,
                Sign::NonNegative,
                &tendon.damping,
            ),
            pretension: of("pretension", Quantity::Force, Sign::Any, &tendon.pretension),
            unilateral: tendon.unilateral.then(|| {
                switches.push(Switch::Slack(index));
                switches.len() - 1
            }),
            slack: None,
            gap: None,
            lines: Vec::new(),
        }
    });
    tendons.collect()
}

fn add_sensors(rig: &Rig, slots: &mut Slots, topology: &mut Topology) {
    for sensor in &rig.sensors {
        let reading = reading_unit(rig, sensor.reads);
        let signal = signal_unit(rig, sensor);
        let gain = unit::ratio(&signal, reading);
        topology.sensors.push(Sensor {
            reads: sensor.reads,
            gain: slots.add(
                format!("{}.gain", sensor.name),
                gain,
                Sign::Any,
                &sensor.gain,
            ),
            offset: slots.add(
                format!("{}.offset", sensor.name),
                signal,
                Sign::Any,
                &sensor.offset,
            ),
            curvature: None,
            lag: None,
        });
    }
}

fn add_actuators<'a>(
    rig: &'a Rig,
    columns: &mut Vec<&'a str>,
    slots: &mut Slots,
    topology: &mut Topology,
    signals: usize,
) {
    for actuator in &rig.actuators {
        let over = match actuator.drives {
            Drives::Body(body) => Quantity::Force.unit(rig.bodies[body].motion),
            Drives::Tendon(_) => "m",
            Drives::Hasel(_) => "V",
        };
        let per = match (&actuator.position_loop, actuator.drives) {
            (Some(_), Drives::Body(body)) => Quantity::Coordinate.unit(rig.bodies[body].motion),
            _ => input_unit(actuator),
        };
        let unit = unit::ratio(over, per);
        let input =
            (columns.iter().position(|column| *column == actuator.input)).unwrap_or_else(|| {
                columns.push(&actuator.input);
                columns.len() - 1
            });
        let line = topology.lines.len();
        topology.lines.push(Line {
            input,
            gain: slots.add(
                format!("{}.gain", actuator.name),
                unit,
                Sign::Any,
                &actuator.gain,
            ),
            linear: actuator.hold == Hold::Linear,
            chain: InputChainSlots::default(),
            servo: None,
        });
        if let (Some(position_loop), Drives::Body(body)) =
            (&actuator.position_loop, actuator.drives)
        {
            let motion = rig.bodies[body].motion;
            let mut edge = |key: &str, quantity, value: &Option<Value>, switch| {
                value.as_ref().map(|value| {
                    let quantity = (quantity, motion);
                    let slot = slots.of(&actuator.name, key, quantity, Sign::NonNegative, value);
                    topology.switches.push(switch);
                    let switch = topology.switches.len() - 1;
                    Gap { slot, switch }
                })
            };
            let PositionLoop {
                dead_band,
                effort_limit,
            } = position_loop;
            topology.lines[line].servo = Some(Servo {
                body,
                dead_band: edge(
                    "dead_band",
                    Quantity::Coordinate,
                    dead_band,
                    Switch::LoopBand(line),
                ),
                limit: edge(
                    "effort_limit",
                    Quantity::Force,
                    effort_limit,
                    Switch::LoopLimit(line),
                ),
            });
        }
        match actuator.drives {
            Drives::Body(body) => topology.motors.push(Motor { body, line }),
            Drives::Tendon(tendon) => topology.tendons[tendon].lines.push(line),
            Drives::Hasel(hasel) => topology.hasels[hasel].lines.push(line),
        }
    }
    let imposed = (rig.bodies.iter().enumerate()).filter(|(_, body)| body.motion_from.is_some());
    topology.imposed = imposed.map(|(index, _)| index).collect();
    topology.acting = columns.len();
    topology.inputs = columns.len() + signals + motion::INPUTS * topology.imposed.len();
}

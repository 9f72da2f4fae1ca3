//! A rig's numbers as changes to the MJCF that it came from.

use std::path::Path;

use sinew_sim::Rig;
use sinew_sim::effects::Kind;
use sinew_sim::rig::{Drives, EffectTable, End, Site};

use super::text::plain;
use super::tree::{Coordinate, Joint, Motion};
use super::{Cable, Drive, Format, Mechanism, read};
use crate::error::Result;

/// Parts of a number that are rounding.
const ROUNDING: f64 = 1e-9;

/// One attribute of one element.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Change {
    /// File and line of the element.
    pub place: String,
    /// Tag and name, as `joint "elbow"`.
    pub element: String,
    /// Attribute.
    pub attribute: &'static str,
    /// Its text, with its default class; `None` where nothing says it.
    pub old: Option<String>,
    /// The new text.
    pub new: String,
}

/// All changes that a rig asks for.
#[derive(Clone, Debug, Default)]
pub struct Changes {
    /// Changes of attributes.
    pub attributes: Vec<Change>,
    /// Differences that no attribute of a joint or actuator can express, a sentence each.
    pub by_hand: Vec<String>,
}

impl Changes {
    /// The list as CSV: place, element, attribute, old and new; below it, as comments, what is left
    /// to do by hand.
    pub fn to_csv(&self) -> String {
        let field = |text: &str| {
            if text.contains([',', '"', '\n', '\r']) {
                format!("\"{}\"", text.replace('"', "\"\""))
            } else {
                text.to_owned()
            }
        };
        let mut text = String::from("place,element,attribute,old,new\n");
        for change in &self.attributes {
            let old = change.old.as_deref().unwrap_or_default();
            let fields = [
                &change.place,
                &change.element,
                change.attribute,
                old,
                &change.new,
            ];
            text += &fields.map(field).join(",");
            text.push('\n');
        }
        for line in &self.by_hand {
            text += &format!("# by hand: {}\n", line.replace(['\n', '\r'], " "));
        }
        text
    }

    /// One line for a person each.
    pub fn lines(&self) -> Vec<String> {
        let attributes = self.attributes.iter().map(|change| {
            let old = change.old.as_deref().unwrap_or("not there");
            format!(
                "{}: {}: {} = {} (was {old})",
                change.place, change.element, change.attribute, change.new
            )
        });
        let by_hand = self.by_hand.iter().map(|line| format!("by hand: {line}"));
        attributes.chain(by_hand).collect()
    }
}

/// Changes that make the model at `original` say what the rig says. Bodies and actuators of the rig
/// are found by their names, which are those of joints and actuators.
///
/// # Errors
/// As [`super::import`].
pub fn changes(rig: &Rig, original: &Path) -> Result<Changes> {
    let mechanism = read(original, Format::Mjcf)?;
    let mut found = Changes::default();
    let joints = &mechanism.tree.joints;
    let joint_of = |name: &str| joints.iter().position(|joint| plain(&joint.name) == name);
    let moving: Vec<usize> = rig
        .bodies
        .iter()
        .filter_map(|body| joint_of(&body.name))
        .collect();
    let coordinates = mechanism.tree.coordinates(&moving)?;
    let mut told: Vec<usize> = Vec::new();
    for (index, body) in rig.bodies.iter().enumerate() {
        let coordinate = coordinates
            .iter()
            .find(|one| joint_of(&body.name) == Some(one.joint));
        match coordinate {
            Some(coordinate) => {
                let compared = Compared {
                    rig,
                    mechanism: &mechanism,
                    body: index,
                    coordinate,
                };
                compared.joint(&mut found, &mut told);
            }
            None => found.by_hand.push(format!(
                "body `{}` of the rig is no joint of {}",
                body.name,
                original.display()
            )),
        }
    }
    for drive in &mechanism.drives {
        actuator(rig, drive, &joints[drive.joint].name, &mut found);
    }
    for cable in &mechanism.cables {
        tendon(rig, cable, &mut found);
    }
    between_bodies(rig, &mut found);
    for (index, effect) in rig.effects.iter().enumerate() {
        let is_as_read = |drive: &Drive| {
            let here = actuator_of(rig, drive).map(Site::Actuator);
            let limit = drive.limit.filter(|_| drive.clipped);
            let value = effect.parameters.first().map(|parameter| parameter.value);
            here == Some(effect.site) && limit.map(|(_, high)| high) == value
        };
        let own = effect.kind == Kind::InputSaturation && mechanism.drives.iter().any(is_as_read);
        if !told.contains(&index) && !own {
            found.by_hand.push(said(rig, effect));
        }
    }
    Ok(found)
}

/// The rig's actuator of a drive: of its name, or of that name and a number where a joint has the
/// same.
fn actuator_of(rig: &Rig, drive: &Drive) -> Option<usize> {
    let name = plain(&drive.name);
    let number = |other: &str| {
        let number = other.strip_prefix(&name)?.strip_prefix('_')?;
        number.parse::<usize>().ok()
    };
    let found = rig
        .actuators
        .iter()
        .position(|actuator| actuator.name == name);
    found.or_else(|| (rig.actuators.iter()).position(|actuator| number(&actuator.name).is_some()))
}

/// True where the rig has a body of a joint.
fn moves(rig: &Rig, joint: &str) -> bool {
    rig.bodies.iter().any(|body| body.name == plain(joint))
}

/// An effect with its law and its numbers.
fn said(rig: &Rig, effect: &EffectTable) -> String {
    let description = effect.kind.description();
    let numbers: Vec<String> = (description.parameters.iter())
        .zip(&effect.parameters)
        .map(|(spec, value)| format!("{} {:?}", spec.name, value.value))
        .collect();
    format!(
        "{} at {} ({}; {})",
        description.kind,
        rig.site_name(effect.site),
        description.law,
        numbers.join(", ")
    )
}

fn actuator(rig: &Rig, drive: &Drive, joint: &str, found: &mut Changes) {
    let Some(index) = actuator_of(rig, drive) else {
        // A bias alone is a load of the joint.
        if drive.gain != 0.0 && moves(rig, joint) {
            let line = format!("{} \"{}\" is no actuator of the rig", drive.tag, drive.name);
            found.by_hand.push(line);
        }
        return;
    };
    let actuator = &rig.actuators[index];
    let of_loop = |end: &str| format!("{}_{end}", plain(&drive.name));
    let springs = rig
        .springs
        .iter()
        .filter(|part| part.name == of_loop("loop"));
    let stiffness: f64 = springs.map(|part| part.stiffness.value).sum();
    let dampers = rig
        .dampers
        .iter()
        .filter(|part| part.name == of_loop("braking"));
    let damping: f64 = dampers.map(|part| part.damping.value).sum();
    for (what, rig, file) in [
        ("stiffness", stiffness, drive.stiffness),
        ("damping", damping, drive.damping),
    ] {
        if !same(rig, file) {
            found.by_hand.push(format!(
                "the loop of {} \"{}\" has a {what} of {rig:?}, and the file's has {file:?}",
                drive.tag, drive.name
            ));
        }
    }
    let gain = actuator.gain.value;
    if !matches!(actuator.drives, Drives::Body(_)) || same(gain, drive.gain) {
        return;
    }
    if drive.stiffness == 0.0 && drive.damping == 0.0 && drive.load == 0.0 {
        found.attributes.push(Change {
            place: drive.place.to_string(),
            element: format!("{} \"{}\"", drive.tag, drive.name),
            attribute: "gear",
            old: drive.gear_text.clone(),
            new: format!("{:?}", gain / drive.gain * drive.gear),
        });
    } else {
        found.by_hand.push(format!(
            "{} \"{}\" has {gain:?} per unit of ctrl for {:?}",
            drive.tag, drive.name, drive.gain
        ));
    }
}

/// Stiffness and damping of a fixed tendon.
fn tendon(rig: &Rig, cable: &Cable, found: &mut Changes) {
    let name = plain(&cable.name);
    let Some(tendon) = rig.tendons.iter().find(|tendon| tendon.name == name) else {
        return;
    };
    for (attribute, old, new) in [
        ("stiffness", cable.stiffness, tendon.stiffness.value),
        ("damping", cable.damping, tendon.damping.value),
    ] {
        if !same(old, new) {
            found.attributes.push(Change {
                place: cable.place.to_string(),
                element: format!("fixed \"{}\"", cable.name),
                attribute,
                old: Some(format!("{old:?}")),
                new: format!("{new:?}"),
            });
        }
    }
}

/// Springs and dampers between two bodies, which no joint has.
fn between_bodies(rig: &Rig, found: &mut Changes) {
    let joins = |from: End, to: End| from != End::Ground && to != End::Ground;
    let springs = rig.springs.iter().filter(|part| joins(part.from, part.to));
    let springs = springs.map(|part| ("spring", &part.name, part.stiffness.value));
    let dampers = rig.dampers.iter().filter(|part| joins(part.from, part.to));
    let dampers = dampers.map(|part| ("damper", &part.name, part.damping.value));
    for (kind, name, value) in springs.chain(dampers) {
        found.by_hand.push(format!(
            "{kind} `{name}` of {value:?} joins two bodies: a `fixed` tendon with coefficients 1 and -1"
        ));
    }
}

/// Equal but for rounding.
fn same(one: f64, other: f64) -> bool {
    (one - other).abs() <= ROUNDING * one.abs().max(other.abs())
}

/// A body of the rig beside its joint.
struct Compared<'a> {
    rig: &'a Rig,
    mechanism: &'a Mechanism,
    body: usize,
    coordinate: &'a Coordinate,
}

impl Compared<'_> {
    fn joint(&self, found: &mut Changes, told: &mut Vec<usize>) {
        let joint = &self.mechanism.tree.joints[self.coordinate.joint];
        let site = Site::Body(self.body);
        let mut take = |kind: Kind, site: Site| -> f64 {
            let effects = self.rig.effects.iter().enumerate();
            let here = effects.filter(|(_, effect)| effect.kind == kind && effect.site == site);
            here.map(|(index, effect)| {
                told.push(index);
                effect.parameters[0].value
            })
            .sum()
        };
        let (springs, dampers) = (self.springs(), self.dampers());
        let mut damping = [
            dampers + take(Kind::Viscous, site),
            take(Kind::QuadraticDrag, site),
        ];
        let mut stiffness = [0.0; 3];
        let mut rest = joint.rest;
        for spring in &springs {
            let here = Site::Spring(*spring);
            stiffness[0] += self.rig.springs[*spring].stiffness.value;
            stiffness[1] += take(Kind::Quadratic, here);
            stiffness[2] += take(Kind::Cubic, here);
            damping[0] += take(Kind::Viscous, here);
            rest = self.rig.springs[*spring].rest.value;
        }
        let friction = take(Kind::Coulomb, site);
        self.attribute(found, joint, "damping", &joint.damping, &damping);
        self.attribute(found, joint, "frictionloss", &[joint.friction], &[friction]);
        if springs.len() > 1 {
            found.by_hand.push(format!(
                "joint \"{}\" has {} springs to the ground; a joint of MuJoCo has one",
                joint.name,
                springs.len()
            ));
        } else {
            self.attribute(found, joint, "stiffness", &joint.stiffness, &stiffness);
            let turned = |angle: f64| match joint.motion {
                Motion::Hinge if self.mechanism.degrees => angle.to_degrees(),
                _ => angle,
            };
            self.attribute(
                found,
                joint,
                "springref",
                &[turned(joint.rest)],
                &[turned(rest)],
            );
        }
        let load = take(Kind::Constant, site);
        self.inertia(found, joint);
        self.weight(found, joint, take(Kind::Gravity, site));
        let drives = self.mechanism.drives.iter();
        let drives = drives.filter(|drive| drive.joint == self.coordinate.joint);
        let file: f64 = drives.map(|drive| drive.load).sum();
        if !same(load, file) {
            found.by_hand.push(format!(
                "the constant load on joint \"{}\" is {load:?}, and the file's is {file:?}",
                joint.name
            ));
        }
    }

    fn attribute(
        &self,
        found: &mut Changes,
        joint: &Joint,
        attribute: &'static str,
        old: &[f64],
        new: &[f64],
    ) {
        if old.iter().zip(new).all(|(old, new)| same(*old, *new)) {
            return;
        }
        let last = new.iter().rposition(|number| *number != 0.0).unwrap_or(0);
        let numbers = new[..=last]
            .iter()
            .map(|number| format!("{:?}", number + 0.0));
        found.attributes.push(Change {
            place: joint.place.to_string(),
            element: format!("joint \"{}\"", joint.name),
            attribute,
            old: joint.said(attribute),
            new: numbers.collect::<Vec<_>>().join(" "),
        });
    }

    /// More than the bodies have is the armature; less is nobody's attribute.
    fn inertia(&self, found: &mut Changes, joint: &Joint) {
        let rig = self.rig.bodies[self.body].inertia.value;
        let bodies = self.coordinate.inertia;
        if same(rig, bodies + joint.armature) {
            return;
        }
        if rig >= bodies {
            self.attribute(found, joint, "armature", &[joint.armature], &[rig - bodies]);
        } else {
            found.by_hand.push(format!(
                "joint \"{}\" moves an inertia of {rig:?}, and its bodies alone have {bodies:?}: \
                 change their `mass` or `diaginertia`",
                joint.name
            ));
        }
    }

    fn weight(&self, found: &mut Changes, joint: &Joint, added: f64) {
        let gravities = self.rig.gravities.iter();
        let gravities = gravities.filter(|gravity| gravity.body == self.body);
        let (mut x, mut y) = (0.0, 0.0);
        for gravity in gravities {
            let (amplitude, zero) = (gravity.amplitude.value, gravity.zero.value);
            x += amplitude * zero.cos();
            y += amplitude * zero.sin();
        }
        x += added;
        let (amplitude, zero) = self.coordinate.weight;
        let (old_x, old_y) = (amplitude * zero.cos(), amplitude * zero.sin());
        let size = x.hypot(y).max(amplitude.abs());
        if (x - old_x).hypot(y - old_y) > ROUNDING * size {
            let rig = match joint.motion {
                Motion::Slide => format!("{x:?} N against it"),
                _ => format!("{:?} N m, hanging at {:?} rad", x.hypot(y), y.atan2(x)),
            };
            found.by_hand.push(format!(
                "the weight on joint \"{}\" is {rig}, and the file's is {amplitude:?} at {zero:?}: \
                 change `mass` or `pos` of its `inertial`",
                joint.name
            ));
        }
    }

    fn at_ground(&self, from: End, to: End) -> bool {
        [(from, to), (to, from)].contains(&(End::Ground, End::Body(self.body)))
    }

    /// Parts that stand for the loop of an actuator, and are no joint's.
    fn is_loop(&self, name: &str) -> bool {
        self.mechanism.drives.iter().any(|drive| {
            let drive = plain(&drive.name);
            name == format!("{drive}_loop") || name == format!("{drive}_braking")
        })
    }

    fn springs(&self) -> Vec<usize> {
        let springs = self.rig.springs.iter().enumerate();
        let springs = springs.filter(|(_, spring)| {
            self.at_ground(spring.from, spring.to) && !self.is_loop(&spring.name)
        });
        springs.map(|(index, _)| index).collect()
    }

    fn dampers(&self) -> f64 {
        let dampers = self.rig.dampers.iter();
        let dampers = dampers
            .filter(|damper| self.at_ground(damper.from, damper.to) && !self.is_loop(&damper.name));
        dampers.map(|damper| damper.damping.value).sum()
    }
}

//! The rig file of a mechanism.

use std::fmt::Write;

use super::tree::{Coordinate, Joint, Motion};
use super::{Cable, Drive, Mechanism};

/// Names that a rig may have: unique, without `.` and `+`, and not `ground`.
#[derive(Default)]
struct Names {
    taken: Vec<String>,
}

impl Names {
    fn new_one(&mut self, wanted: &str) -> String {
        let plain = plain(wanted);
        let mut name = plain.clone();
        let mut count = 1;
        while self.taken.contains(&name) || name == "ground" {
            count += 1;
            name = format!("{plain}_{count}");
        }
        self.taken.push(name.clone());
        name
    }
}

/// A name without what a rig's names may not have.
pub fn plain(name: &str) -> String {
    let plain = name.trim().replace(['.', '+'], "_");
    let plain: String = plain.chars().filter(|c| !c.is_control()).collect();
    if plain.is_empty() {
        "part".into()
    } else {
        plain
    }
}

/// The text, and what was added to what the file says.
pub fn write(
    mechanism: &mut Mechanism,
    coordinates: &[Coordinate],
    file: &str,
) -> (String, Vec<String>) {
    let mut writer = Writer {
        text: String::new(),
        names: Names::default(),
        bodies: Vec::new(),
        added: Vec::new(),
        columns: Names::default(),
    };
    writer.head(mechanism, file);
    for coordinate in coordinates {
        writer.body(mechanism, coordinate);
    }
    let drives = mechanism.drives.clone();
    for drive in &drives {
        writer.drive(mechanism, drive);
    }
    let cables = mechanism.cables.clone();
    for cable in &cables {
        writer.cable(mechanism, cable);
    }
    writer.sensors(mechanism);
    (writer.text, writer.added)
}

struct Writer {
    text: String,
    names: Names,
    /// Joint and the name of its body.
    bodies: Vec<(usize, String)>,
    added: Vec<String>,
    columns: Names,
}

impl Writer {
    /// Writing to a String cannot fail.
    fn line(&mut self, line: impl std::fmt::Display) {
        let _ = writeln!(self.text, "{line}");
    }

    fn head(&mut self, mechanism: &Mechanism, file: &str) {
        self.line(format_args!(
            "# From {}; what it cannot say was listed. All units are SI.",
            file.replace(['\n', '\r'], " ")
        ));
        self.line("# A bare number is known and stays; { value = ... } is believed, and `sinew fit` finds it.");
        self.line("format = \"sinew-rig/1\"");
        self.line(format_args!("name = {}", quoted(&mechanism.name)));
    }

    /// The body of a joint, if the joint moves.
    fn body_of(&self, joint: usize) -> Option<String> {
        let found = self.bodies.iter().find(|(index, _)| *index == joint)?;
        Some(found.1.clone())
    }

    fn body(&mut self, mechanism: &Mechanism, coordinate: &Coordinate) {
        let joint: &Joint = &mechanism.tree.joints[coordinate.joint];
        let name = self.names.new_one(&joint.name);
        self.bodies.push((coordinate.joint, name.clone()));
        let (motion, unit) = match joint.motion {
            Motion::Slide => ("slide", "kg"),
            _ => ("hinge", "kg m^2"),
        };
        let inertia = coordinate.inertia + joint.armature;
        self.line(format_args!(
            "\n[[body]]\nname = {}\nmotion = \"{motion}\"\ninertia = {}   # {unit}",
            quoted(&name),
            free(inertia)
        ));
        let [linear, quadratic, cubic] = joint.stiffness;
        if joint.stiffness != [0.0; 3] {
            let spring = self.names.new_one(&format!("{name}_spring"));
            self.line(format_args!(
                "\n[[spring]]\nname = {}\nfrom = \"ground\"\nto = {}\nstiffness = {}\nrest = {}",
                quoted(&spring),
                quoted(&name),
                free(linear),
                bare(joint.rest)
            ));
            self.effect("quadratic_stiffness", &spring, "coefficient", quadratic);
            self.effect("cubic_stiffness", &spring, "coefficient", cubic);
        }
        if joint.damping[0] != 0.0 {
            let damper = self.names.new_one(&format!("{name}_damper"));
            self.damper(&damper, &name, &free(joint.damping[0]));
        }
        self.effect("quadratic_drag", &name, "coefficient", joint.damping[1]);
        let (amplitude, zero) = coordinate.weight;
        if amplitude != 0.0 {
            let weight = self.names.new_one(&format!("{name}_weight"));
            self.line(format_args!(
                "\n[[gravity]]\nname = {}\nbody = {}\namplitude = {}\nzero = {}",
                quoted(&weight),
                quoted(&name),
                free(amplitude),
                bare(zero)
            ));
        }
        self.effect("coulomb_friction", &name, "level", joint.friction);
    }

    fn damper(&mut self, name: &str, body: &str, damping: &str) {
        self.line(format_args!(
            "\n[[damper]]\nname = {}\nfrom = \"ground\"\nto = {}\ndamping = {damping}",
            quoted(name),
            quoted(body)
        ));
    }

    /// An effect, unless it is of no size.
    fn effect(&mut self, kind: &str, component: &str, key: &str, value: f64) {
        if value != 0.0 {
            self.line(format_args!(
                "\n[[effect]]\nkind = \"{kind}\"\ncomponent = {}\n{key} = {}",
                quoted(component),
                free(value)
            ));
        }
    }

    fn drive(&mut self, mechanism: &mut Mechanism, drive: &Drive) {
        let Some(body) = self.body_of(drive.joint) else {
            mechanism.left_out.push(format!(
                "{}: actuator \"{}\": its joint is held still",
                drive.place, drive.name
            ));
            return;
        };
        let slides = mechanism.tree.joints[drive.joint].motion == Motion::Slide;
        let unit = match (drive.target, drive.plain, slides) {
            (Some("velocity"), _, true) => "m_s",
            (Some("velocity"), _, false) => "rad_s",
            (Some(_), _, true) => "m",
            (Some(_), _, false) => "rad",
            (None, true, true) => "N",
            (None, true, false) => "Nm",
            (None, false, _) => "1",
        };
        if drive.stiffness != 0.0 {
            let name = self.names.new_one(&format!("{}_loop", drive.name));
            self.line(format_args!(
                "\n# The loop of {}: it pulls back as a spring to the ground does.\n[[spring]]\n\
                 name = {}\nfrom = \"ground\"\nto = {}\nstiffness = {}",
                drive.name.replace(['\n', '\r'], " "),
                quoted(&name),
                quoted(&body),
                bare(drive.stiffness)
            ));
        }
        if drive.damping != 0.0 {
            let name = self.names.new_one(&format!("{}_braking", drive.name));
            self.damper(&name, &body, &bare(drive.damping));
        }
        if drive.load != 0.0 {
            self.effect("constant_load", &body, "level", drive.load);
        }
        // A bias alone: the load above is all that it does.
        if drive.gain == 0.0 {
            return;
        }
        let name = self.names.new_one(&drive.name);
        let column = self
            .columns
            .new_one(&format!("{}_{unit}", column(&drive.name)));
        self.line(format_args!(
            "\n[[actuator]]\nname = {}\ndrives = {}\ninput = {}\ngain = {}",
            quoted(&name),
            quoted(&body),
            quoted(&column),
            bare(drive.gain)
        ));
        let Some((low, high)) = drive.limit else {
            return;
        };
        self.line(format_args!("limit = [{}, {}]", bare(low), bare(high)));
        if !drive.clipped {
            return;
        }
        if low == -high {
            self.line(format_args!(
                "\n[[effect]]\nkind = \"input_saturation\"\ncomponent = {}\nlimit = {}",
                quoted(&name),
                bare(high)
            ));
        } else {
            mechanism.left_out.push(format!(
                "{}: actuator \"{}\": ctrlrange clips in MuJoCo; in the rig it is a limit for \
                 controllers, since no rig clips at {low:?} and {high:?}",
                drive.place, drive.name
            ));
        }
    }

    fn cable(&mut self, mechanism: &mut Mechanism, cable: &Cable) {
        let held = |(joint, _): &&(usize, f64)| self.body_of(*joint).is_none();
        let slides = |joint: usize| mechanism.tree.joints[joint].motion == Motion::Slide;
        let why = if cable.arms.iter().any(|arm| held(&arm)) {
            Some("a joint of it is held still")
        } else if cable.stiffness == 0.0 {
            Some("it has no stiffness")
        } else if cable
            .arms
            .iter()
            .any(|(joint, arm)| slides(*joint) && arm.abs() != 1.0)
        {
            Some("a slide is not on it once, as a rig's tendons have it")
        } else {
            None
        };
        if let Some(why) = why {
            let line = format!("{}: fixed \"{}\": {why}", cable.place, cable.name);
            mechanism.left_out.push(line);
            return;
        }
        let arms: Vec<String> = (cable.arms.iter())
            .map(|(joint, arm)| {
                let body = self.body_of(*joint).unwrap_or_default();
                format!("{{ body = {}, arm = {} }}", quoted(&body), bare(*arm))
            })
            .collect();
        let name = self.names.new_one(&cable.name);
        self.line(format_args!(
            "\n[[tendon]]\nname = {}\npath = [{}]\nstiffness = {}\ndamping = {}\npretension = {}\n\
             unilateral = false",
            quoted(&name),
            arms.join(", "),
            free(cable.stiffness),
            bare(cable.damping),
            bare(-cable.stiffness * cable.length)
        ));
    }

    fn sensors(&mut self, mechanism: &mut Mechanism) {
        let readings = mechanism.readings.clone();
        for reading in &readings {
            let Some(body) = self.body_of(reading.joint) else {
                let line = format!("sensor \"{}\": its joint is held still", reading.name);
                mechanism.left_out.push(line);
                continue;
            };
            self.sensor(
                mechanism,
                &reading.name,
                reading.joint,
                &body,
                reading.velocity,
            );
        }
        let unread: Vec<(usize, String)> = (self.bodies.iter())
            .filter(|(joint, _)| {
                !readings
                    .iter()
                    .any(|reading| reading.joint == *joint && !reading.velocity)
            })
            .cloned()
            .collect();
        for (joint, body) in unread {
            self.sensor(mechanism, &format!("{body}_position"), joint, &body, false);
            self.added
                .push(format!("a sensor of the position of {body}"));
        }
        if mechanism
            .drives
            .iter()
            .all(|drive| self.body_of(drive.joint).is_none())
        {
            self.added
                .push("no actuator: add one that says what drives it".into());
        }
    }

    fn sensor(
        &mut self,
        mechanism: &Mechanism,
        name: &str,
        joint: usize,
        body: &str,
        velocity: bool,
    ) {
        let slides = mechanism.tree.joints[joint].motion == Motion::Slide;
        let (what, unit) = match (velocity, slides) {
            (false, true) => ("position", "m"),
            (false, false) => ("position", "rad"),
            (true, true) => ("velocity", "m_s"),
            (true, false) => ("velocity", "rad_s"),
        };
        let column = self.columns.new_one(&format!("{}_{unit}", column(name)));
        let name = self.names.new_one(name);
        self.line(format_args!(
            "\n[[sensor]]\nname = {}\nreads = {}\nsignal = {}",
            quoted(&name),
            quoted(&format!("{body}.{what}")),
            quoted(&column)
        ));
    }
}

/// A name as a column has it.
fn column(name: &str) -> String {
    name.replace(|c: char| !c.is_alphanumeric() && c != '_', "_")
}

/// A number that a fit may change.
fn free(value: f64) -> String {
    format!("{{ value = {} }}", bare(value))
}

/// A number that stays, and no negative zero.
fn bare(value: f64) -> String {
    format!("{:?}", value + 0.0)
}

/// A TOML string.
fn quoted(text: &str) -> String {
    let mut quoted = String::from("\"");
    for character in text.chars() {
        match character {
            '"' | '\\' => quoted.extend(['\\', character]),
            control if control.is_control() => {
                let _ = write!(quoted, "\\u{:04X}", control as u32);
            }
            other => quoted.push(other),
        }
    }
    quoted.push('"');
    quoted
}

//! A rig as MJCF, so that a MuJoCo user can take its physics home (docs/reference/mjcf.md).
//!
//! MuJoCo has most of it: springs and drag with their curvature, dry friction, stops, tendons that
//! only pull, lags and delays, hidden masses. What it has not is left out, and named in comments
//! and in [`Mjcf::left_out`].

mod actuator;
mod body;
mod law;
mod line;
mod stiffness;
mod timestep;
mod xml;

use sinew_sim::Plant;
use sinew_sim::effects::Kind;
use sinew_sim::rig::{EffectTable, Reads, Rig, Site};

use crate::report::shared_values;
use xml::Element;

/// A rig written for MuJoCo.
#[derive(Clone, Debug)]
pub struct Mjcf {
    /// The file.
    pub text: String,
    /// Parts that MuJoCo cannot represent, one line each.
    pub left_out: Vec<String>,
}

/// The parts of the file while it grows.
#[derive(Default)]
struct Model {
    bodies: Vec<Element>,
    tendons: Vec<Element>,
    actuators: Vec<Element>,
    /// Forces that need no command: they come behind the rig's own actuators.
    loads: Vec<Element>,
    sensors: Vec<Element>,
    left_out: Vec<String>,
}

/// The rig and its effects in MuJoCo's terms.
///
/// ```
/// let rig = sinew_sim::Rig::parse(
///     "format = \"sinew-rig/1\"\nname = \"cart\"\n[[body]]\nname = \"cart\"\nmotion = \"slide\"\n\
///      inertia = 2.0\n[[effect]]\nkind = \"coulomb_friction\"\ncomponent = \"cart\"\nlevel = 0.5\n",
///     "cart.toml",
/// )?;
/// let mjcf = sinew_ident::mjcf::mjcf(&rig);
/// assert!(mjcf.text.contains("frictionloss=\"0.5\"") && mjcf.left_out.is_empty());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn mjcf(rig: &Rig) -> Mjcf {
    let mut model = Model::default();
    let step = timestep::timestep(rig);
    for index in 0..rig.bodies.len() {
        body::add(rig, index, step, &mut model);
    }
    line::add(rig, &mut model);
    actuator::add(rig, &mut model);
    sensors(rig, &mut model);
    for shape in rig.geometry.plates.iter().map(|plate| &plate.name) {
        let what =
            format!("the shape of {shape}: its coordinates are there, where its tip is is not");
        model.left_out.push(what);
    }
    for shape in rig.geometry.chains.iter().map(|chain| &chain.name) {
        let what = format!("the shape of {shape}: its bends are there, where its tip is is not");
        model.left_out.push(what);
    }
    for effect in (rig.effects.iter()).filter(|effect| effect.kind == Kind::Learned) {
        let left_out = unnamed(
            rig,
            effect,
            "apply it as a force of the position and the velocity",
        );
        model.left_out.push(left_out);
    }
    model.left_out.extend(law::left_out(rig));
    model.left_out.extend(dependences(rig));
    model.left_out.extend(shared_values(rig));
    let text = write(rig, step, &model);
    Mjcf {
        text,
        left_out: model.left_out,
    }
}

/// A line about each number that depends on a recorded column: it is written at the column's zero.
fn dependences(rig: &Rig) -> Vec<String> {
    let Ok(plant) = Plant::new(rig) else {
        return Vec::new();
    };
    let slopes = plant.parameters().iter().filter_map(|parameter| {
        let of = parameter.name.strip_suffix(".slope")?;
        let slope = format!("{} {}", parameter.value, parameter.unit);
        Some(format!(
            "{of} by a recorded column: it is written at the column's zero; add {slope} times the \
             column at every step"
        ))
    });
    slopes.collect()
}

fn sensors(rig: &Rig, model: &mut Model) {
    for (index, sensor) in rig.sensors.iter().enumerate() {
        let element = match sensor.reads {
            Reads::Position(body) => Some(("jointpos", "joint", &rig.bodies[body].name)),
            Reads::Velocity(body) => Some(("jointvel", "joint", &rig.bodies[body].name)),
            Reads::Tension(_)
            | Reads::Effort(_)
            | Reads::ActuatorEffort(_)
            | Reads::Shape(_)
            | Reads::Hasel(..) => None,
        };
        let (gain, offset) = (sensor.gain.value, sensor.offset.value);
        match element {
            Some((tag, of, name)) => {
                let mut element = Element::new(tag).with("name", &sensor.name).with(of, name);
                if gain != 1.0 || offset != 0.0 {
                    element = element.remark(format!(
                        "{} = {gain:?} times this, plus {offset:?}",
                        sensor.signal
                    ));
                }
                model.sensors.push(element);
            }
            None => model.left_out.push(format!(
                "sensor {}: MuJoCo has no such reading of this rig",
                sensor.name
            )),
        }
        for kind in [Kind::SensorLag, Kind::SensorCurvature] {
            if let Some(effect) = effect(rig, kind, Site::Sensor(index)) {
                model
                    .left_out
                    .push(unnamed(rig, effect, "apply it to the reading"));
            }
        }
    }
}

/// The effect of a kind at a place.
fn effect(rig: &Rig, kind: Kind, site: Site) -> Option<&EffectTable> {
    (rig.effects.iter()).find(|effect| effect.kind == kind && effect.site == site)
}

/// Value of an effect's parameter `index`, or 0 where the rig has no such effect.
fn value(rig: &Rig, kind: Kind, site: Site, index: usize) -> f64 {
    effect(rig, kind, site).map_or(0.0, |effect| effect.parameters[index].value)
}

/// A line about an effect that MuJoCo cannot carry: its law with numbers, and what to do instead.
fn unnamed(rig: &Rig, effect: &EffectTable, instead: &str) -> String {
    let description = effect.kind.description();
    let numbers: Vec<String> = (description.parameters.iter())
        .zip(&effect.parameters)
        .map(|(spec, value)| format!("{} {:?}", spec.name, value.value))
        .collect();
    format!(
        "{} at {} ({}; {}): {instead}",
        description.kind,
        rig.site_name(effect.site),
        description.law,
        numbers.join(", ")
    )
}

fn write(rig: &Rig, step: f64, model: &Model) -> String {
    let file = rig.file.rsplit(['/', '\\']).next().unwrap_or_default();
    let mut remarks = vec![
        format!("{}, from {file}. Written for MuJoCo 4.0.", rig.name),
        "Every coordinate of the rig is a joint of its own; what joins them are tendons."
            .to_owned(),
    ];
    remarks.extend(rig.actuators.iter().map(|actuator| {
        format!(
            "ctrl \"{}\" takes the column {}, in SI",
            actuator.name, actuator.input
        )
    }));
    remarks.extend(
        model
            .left_out
            .iter()
            .map(|what| format!("LEFT OUT: {what}")),
    );
    let root = Element::new("mujoco").with("model", &rig.name);
    let gravity = [0.0, 0.0, -body::STANDARD_GRAVITY];
    let option = Element::new("option")
        .number("timestep", step)
        .with("integrator", "RK4")
        .numbers("gravity", &gravity)
        .with("iterations", "200")
        .with("tolerance", "0");
    let compiler = Element::new("compiler")
        .with("angle", "radian")
        .with("autolimits", "false")
        .with("boundmass", "0")
        .with("boundinertia", "0");
    let parts = [
        ("worldbody", model.bodies.clone()),
        ("tendon", model.tendons.clone()),
        (
            "actuator",
            [model.actuators.clone(), model.loads.clone()].concat(),
        ),
        ("sensor", model.sensors.clone()),
        ("keyframe", body::start(rig).into_iter().collect()),
    ];
    let mut root = root.holding(compiler).holding(option);
    for (tag, elements) in parts {
        if !elements.is_empty() {
            let part = elements
                .into_iter()
                .fold(Element::new(tag), Element::holding);
            root = root.holding(part);
        }
    }
    xml::document(&remarks, &root)
}

#[cfg(test)]
mod tests;

//! The components of a rig, from their tables.

use super::control;
use super::effect::read_effects;
use super::reader::{Reader, Source, Spanned};
use super::{
    Actuator, Body, Damper, Drives, End, FORMAT, Gravity, Hold, Reads, Rig, Sensor, Spring, Tendon,
};
use crate::effects::Sign;
use crate::error::Error;
use crate::suggest;
use crate::unit::{self, Motion};
use std::collections::HashMap;
use toml_edit::TableLike;

/// What a name in the file belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Component {
    Body(usize),
    Spring(usize),
    Damper,
    Gravity,
    Tendon(usize),
    Actuator,
    Sensor(usize),
}

impl Component {
    pub(super) fn noun(self) -> &'static str {
        match self {
            Self::Body(_) => "a body",
            Self::Spring(_) => "a spring",
            Self::Damper => "a damper",
            Self::Gravity => "a gravity",
            Self::Tendon(_) => "a tendon",
            Self::Actuator => "an actuator",
            Self::Sensor(_) => "a sensor",
        }
    }
}

/// Every name of the file, with its line: names are unique in the whole file.
#[derive(Default)]
pub(super) struct Names<'a> {
    known: HashMap<&'a str, (Component, usize)>,
    order: Vec<&'a str>,
}

impl<'a> Names<'a> {
    fn enter(&mut self, table: &Reader<'a>, component: Component) -> Result<String, Error> {
        let name = table.text("name")?;
        if name.value == "ground" {
            return Err(table.error_at("name", "`ground` is the name of what does not move"));
        }
        if name.value.contains(['.', '+']) {
            return Err(table
                .error_at("name", format!("`{}` is not a name", name.value))
                .helped("a name has no `.` and no `+`: they join names elsewhere"));
        }
        if let Some((_, line)) = self.known.get(name.value) {
            return Err(table
                .error_at("name", format!("the name `{}` is taken", name.value))
                .helped(format!(
                    "names are unique in the whole file; the first is on line {line}"
                )));
        }
        self.known
            .insert(name.value, (component, table.line("name")));
        self.order.push(name.value);
        Ok(name.value.to_owned())
    }

    pub(super) fn get(&self, name: &str) -> Option<Component> {
        self.known.get(name).map(|&(component, _)| component)
    }

    /// The names of the components that pass the filter, in file order.
    pub(super) fn of(&self, wanted: impl Fn(Component) -> bool) -> Vec<&'a str> {
        let pass = |name: &&&'a str| self.get(name).is_some_and(&wanted);
        self.order.iter().filter(pass).copied().collect()
    }

    /// The component that a key names, where `pick` accepts it.
    pub(super) fn resolve<T>(
        &self,
        source: &Source,
        name: &Spanned<&str>,
        role: &str,
        list: &str,
        pick: impl Fn(Component) -> Option<T>,
    ) -> Result<T, Error> {
        match self.get(name.value) {
            Some(component) => pick(component).ok_or_else(|| {
                let fitting = self.of(|component| pick(component).is_some());
                source
                    .error(
                        name.span.clone(),
                        format!("{role}: `{}` is {}", name.value, component.noun()),
                    )
                    .helped(format!("{list}: {}", fitting.join(", ")))
            }),
            None => {
                let fitting = self.of(|component| pick(component).is_some());
                Err(source
                    .error(
                        name.span.clone(),
                        format!("{role}: there is no `{}`", name.value),
                    )
                    .helped(suggest::help(name.value, list, &fitting)))
            }
        }
    }

    fn body(&self, table: &Reader, key: &str) -> Result<usize, Error> {
        self.resolve(
            table.source,
            &table.text(key)?,
            &format!("`{key}` of {}", table.what),
            "bodies",
            |component| match component {
                Component::Body(body) => Some(body),
                _ => None,
            },
        )
    }

    fn end(&self, table: &Reader, key: &str) -> Result<End, Error> {
        if table.text(key)?.value == "ground" {
            return Ok(End::Ground);
        }
        self.body(table, key).map(End::Body).map_err(|mut error| {
            if let Some(help) = &mut error.help {
                help.push_str(", ground");
            }
            error
        })
    }
}

const TOP: &[&str] = &[
    "format", "name", "body", "spring", "damper", "gravity", "tendon", "actuator", "sensor",
    "effect", "control", "network",
];

/// The whole rig.
pub(super) fn read_rig<'a>(source: &'a Source<'a>, table: &'a dyn TableLike) -> Result<Rig, Error> {
    let root = Reader::root(source, table);
    let expected = format!("a rig begins with `format = \"{FORMAT}\"`");
    if !root.has("format") {
        return Err(source
            .error(None, "the rig lacks `format`")
            .helped(expected));
    }
    let format = root.text("format")?;
    if format.value != FORMAT {
        return Err(source
            .error(format.span, format!("unknown format `{}`", format.value))
            .helped(expected));
    }
    root.allow(TOP)?;
    let name = root.text("name")?.value.to_owned();

    let mut names = Names::default();
    let mut bodies = Vec::new();
    for (index, table) in root.tables("body")?.iter().enumerate() {
        bodies.push(read_body(table, &mut names, index)?);
    }
    if bodies.is_empty() {
        return Err(source
            .error(None, "the rig has no body: nothing could move")
            .helped("add a [[body]] with name, motion and inertia"));
    }
    let mut rig = Rig {
        text: source.text().to_owned(),
        file: source.file().to_owned(),
        name,
        bodies,
        springs: Vec::new(),
        dampers: Vec::new(),
        gravities: Vec::new(),
        tendons: Vec::new(),
        actuators: Vec::new(),
        sensors: Vec::new(),
        effects: Vec::new(),
        control: None,
        network: None,
    };
    for (index, table) in root.tables("spring")?.iter().enumerate() {
        let spring = read_spring(table, &mut names, &rig, index)?;
        rig.springs.push(spring);
    }
    for table in &root.tables("damper")? {
        let damper = read_damper(table, &mut names, &rig)?;
        rig.dampers.push(damper);
    }
    for table in &root.tables("gravity")? {
        rig.gravities.push(read_gravity(table, &mut names)?);
    }
    for (index, table) in root.tables("tendon")?.iter().enumerate() {
        rig.tendons.push(read_tendon(table, &mut names, index)?);
    }
    for table in &root.tables("actuator")? {
        rig.actuators.push(read_actuator(table, &mut names)?);
    }
    for (index, table) in root.tables("sensor")?.iter().enumerate() {
        rig.sensors.push(read_sensor(table, &mut names, index)?);
    }
    rig.effects = read_effects(&root.tables("effect")?, &names, &rig)?;
    rig.control = control::read_control(root.table("control")?, &names, &rig)?;
    rig.network = control::read_network(root.table("network")?)?;
    Ok(rig)
}

fn read_body<'a>(table: &Reader<'a>, names: &mut Names<'a>, index: usize) -> Result<Body, Error> {
    table.allow(&["name", "motion", "inertia", "start", "start_velocity"])?;
    let motions = [("slide", Motion::Slide), ("hinge", Motion::Hinge)];
    Ok(Body {
        name: names.enter(table, Component::Body(index))?,
        motion: table.required_word("motion", &motions)?,
        inertia: table
            .parameter("inertia", Sign::Positive)
            .map_err(|error| {
                if error.message.contains("more than zero") {
                    error.helped("without inertia a force would have no finite acceleration")
                } else {
                    error
                }
            })?,
        start: table.optional_parameter("start", Sign::Any)?,
        start_velocity: table.optional_parameter("start_velocity", Sign::Any)?,
    })
}

/// The ends of a spring or damper: not one body twice, and not a line joined to an axis.
fn read_ends(table: &Reader, names: &Names, rig: &Rig) -> Result<(End, End), Error> {
    let from = names.end(table, "from")?;
    let to = names.end(table, "to")?;
    if from == to {
        return Err(table.error_at(
            "to",
            format!("{}: `from` and `to` are the same", table.what),
        ));
    }
    if let (End::Body(a), End::Body(b)) = (from, to)
        && rig.bodies[a].motion != rig.bodies[b].motion
    {
        return Err(table
            .error_at("to", format!("{} joins a slide to a hinge", table.what))
            .helped("metres and radians do not subtract; a [[tendon]] with arms joins them"));
    }
    Ok((from, to))
}

fn read_spring<'a>(
    table: &Reader<'a>,
    names: &mut Names<'a>,
    rig: &Rig,
    index: usize,
) -> Result<Spring, Error> {
    table.allow(&["name", "from", "to", "stiffness", "rest"])?;
    let name = names.enter(table, Component::Spring(index))?;
    let (from, to) = read_ends(table, names, rig)?;
    Ok(Spring {
        name,
        from,
        to,
        stiffness: table.parameter("stiffness", Sign::NonNegative)?,
        rest: table.parameter_or("rest", Sign::Any, 0.0)?,
    })
}

fn read_damper<'a>(table: &Reader<'a>, names: &mut Names<'a>, rig: &Rig) -> Result<Damper, Error> {
    table.allow(&["name", "from", "to", "damping"])?;
    let name = names.enter(table, Component::Damper)?;
    let (from, to) = read_ends(table, names, rig)?;
    Ok(Damper {
        name,
        from,
        to,
        damping: table.parameter("damping", Sign::NonNegative)?,
    })
}

fn read_gravity<'a>(table: &Reader<'a>, names: &mut Names<'a>) -> Result<Gravity, Error> {
    table.allow(&["name", "body", "amplitude", "zero"])?;
    Ok(Gravity {
        name: names.enter(table, Component::Gravity)?,
        body: names.body(table, "body")?,
        amplitude: table.parameter("amplitude", Sign::Any)?,
        zero: table.parameter_or("zero", Sign::Any, 0.0)?,
    })
}

fn read_tendon<'a>(
    table: &Reader<'a>,
    names: &mut Names<'a>,
    index: usize,
) -> Result<Tendon, Error> {
    table.allow(&[
        "name",
        "path",
        "stiffness",
        "damping",
        "pretension",
        "unilateral",
    ])?;
    let name = names.enter(table, Component::Tendon(index))?;
    let mut path: Vec<(usize, super::Value)> = Vec::new();
    for part in table.tables("path")? {
        let part = part.called(format!("the path of {}", table.what));
        part.allow(&["body", "arm"])?;
        let body = names.body(&part, "body")?;
        if path.iter().any(|&(other, _)| other == body) {
            return Err(part.error_at("body", format!("{} has a body twice", part.what)));
        }
        path.push((body, part.parameter("arm", Sign::NonZero)?));
    }
    if path.is_empty() {
        return Err(table
            .error_at("path", format!("{} has no path", table.what))
            .helped("path = [{ body = \"...\", arm = 0.01 }, ...]"));
    }
    Ok(Tendon {
        name,
        path,
        stiffness: table.parameter("stiffness", Sign::NonNegative)?,
        damping: table.parameter_or("damping", Sign::NonNegative, 0.0)?,
        pretension: table.parameter_or("pretension", Sign::Any, 0.0)?,
        unilateral: table.flag("unilateral")?.unwrap_or(true),
    })
}

fn read_actuator<'a>(table: &Reader<'a>, names: &mut Names<'a>) -> Result<Actuator, Error> {
    table.allow(&[
        "name",
        "drives",
        "input",
        "hold",
        "gain",
        "limit",
        "rate_limit",
        "unit",
    ])?;
    let name = names.enter(table, Component::Actuator)?;
    let role = format!("`drives` of {}", table.what);
    let drives = names.resolve(
        table.source,
        &table.text("drives")?,
        &role,
        "bodies and tendons",
        |component| match component {
            Component::Body(body) => Some(Drives::Body(body)),
            Component::Tendon(tendon) => Some(Drives::Tendon(tendon)),
            _ => None,
        },
    )?;
    let holds = [("zero", Hold::Zero), ("linear", Hold::Linear)];
    Ok(Actuator {
        name,
        drives,
        input: table.text("input")?.value.to_owned(),
        hold: table.word("hold", &holds)?.unwrap_or(Hold::Zero),
        gain: table.parameter("gain", Sign::Any)?,
        limit: read_limit(table)?,
        rate_limit: table.number("rate_limit", Sign::Positive)?,
        column_factor: read_factor(table)?,
        line: table.line("input"),
    })
}

fn read_limit(table: &Reader) -> Result<Option<(f64, f64)>, Error> {
    let Some(limit) = table.numbers("limit", Sign::Any)? else {
        return Ok(None);
    };
    match limit[..] {
        [lower, upper] if lower < upper => Ok(Some((lower, upper))),
        _ => Err(table.error_at(
            "limit",
            format!(
                "`limit` of {}: expected [lower, upper] with lower < upper",
                table.what
            ),
        )),
    }
}

fn read_factor(table: &Reader) -> Result<f64, Error> {
    let Some(unit) = table.optional_text("unit")? else {
        return Ok(1.0);
    };
    unit::factor(unit.value).map_err(|help| {
        table
            .error_at(
                "unit",
                format!("`unit` of {}: unknown unit `{}`", table.what, unit.value),
            )
            .helped(help)
    })
}

fn read_sensor<'a>(
    table: &Reader<'a>,
    names: &mut Names<'a>,
    index: usize,
) -> Result<Sensor, Error> {
    table.allow(&["name", "reads", "signal", "gain", "offset", "unit"])?;
    Ok(Sensor {
        name: names.enter(table, Component::Sensor(index))?,
        reads: read_reads(table, names)?,
        signal: table.text("signal")?.value.to_owned(),
        gain: table.parameter_or("gain", Sign::NonZero, 1.0)?,
        offset: table.parameter_or("offset", Sign::Any, 0.0)?,
        column_factor: read_factor(table)?,
        line: table.line("signal"),
    })
}

/// `BODY.position`, `BODY.velocity` or `TENDON.tension`.
fn read_reads(table: &Reader, names: &Names) -> Result<Reads, Error> {
    let text = table.text("reads")?;
    let forms = "expected BODY.position, BODY.velocity or TENDON.tension";
    let Some((name, quantity)) = text.value.split_once('.') else {
        return Err(table.source.error(
            text.span,
            format!("`reads` of {}: {forms}, found `{}`", table.what, text.value),
        ));
    };
    let quantities = ["position", "velocity", "tension"];
    if !quantities.contains(&quantity) {
        return Err(table
            .source
            .error(
                text.span,
                format!("`reads` of {}: unknown reading `{quantity}`", table.what),
            )
            .helped(suggest::help(quantity, "readings", &quantities)));
    }
    let name = Spanned {
        value: name,
        span: text.span,
    };
    let role = format!("`reads` of {}", table.what);
    let list = if quantity == "tension" {
        "tendons"
    } else {
        "bodies"
    };
    names.resolve(table.source, &name, &role, list, |component| {
        match (component, quantity) {
            (Component::Body(body), "position") => Some(Reads::Position(body)),
            (Component::Body(body), "velocity") => Some(Reads::Velocity(body)),
            (Component::Tendon(tendon), "tension") => Some(Reads::Tension(tendon)),
            _ => None,
        }
    })
}

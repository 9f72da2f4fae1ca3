//! The components of a rig, from their tables.

use super::column::read_factor;
use super::effect_tables::read_effects;
use super::geometry::{
    self, Geometry, Reading, read_hasel, read_magnet, read_magnetometer, read_path, read_waveguide,
    split,
};
use super::laws::{read_applied, read_laws};
use super::names::{Component, Names};
use super::reader::{Source, Spanned, TableReader};
use super::sections::read_names;
use super::signals::read_signals;
use super::{
    Actuator, Body, Damper, Drives, End, FORMAT, Gravity, Hold, MotionColumn, PositionLoop, Reads,
    Rig, Sensor, Spring, Tendon,
};
use crate::effects::Sign;
use crate::error::Error;
use crate::law::LawKind;
use crate::suggest;
use crate::unit::{self, Motion, Quantity};
use toml_edit::TableLike;

const TOP: &[&str] = &[
    "format",
    "name",
    "body",
    "spring",
    "damper",
    "gravity",
    "tendon",
    "actuator",
    "sensor",
    "effect",
    "signal",
    "law",
    "chain",
    "plate",
    "waveguide",
    "magnet",
    "magnetometer",
    "hasel",
    // Read by programs that control (`Rig::read_tables`).
    "control",
    "network",
];

/// The whole rig.
pub(super) fn read_rig<'a>(source: &'a Source<'a>, table: &'a dyn TableLike) -> Result<Rig, Error> {
    let root = TableReader::root(source, table);
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

    let names = read_names(&root)?;
    let bodies: Vec<Body> = each(&root, "body", read_body)?;
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
        signals: Vec::new(),
        laws: read_laws(&root.tables("law")?)?,
        effects: Vec::new(),
        geometry: Geometry::default(),
    };
    // Springs and dampers of the file come before those of the chains, and the bodies of chains and
    // plates before all that may name them.
    let own = [root.tables("chain")?, root.tables("plate")?];
    for table in &own[0] {
        geometry::expand_chain(table, &mut rig)?;
    }
    for table in &own[1] {
        geometry::expand_plate(table, &mut rig)?;
    }
    if rig.bodies.is_empty() {
        return Err(source
            .error(None, "the rig has no body: nothing could move")
            .helped("add a [[body]] with name, motion and inertia"));
    }
    let springs = each(&root, "spring", |table| read_spring(table, &names, &rig))?;
    rig.springs.splice(0..0, springs);
    let dampers = each(&root, "damper", |table| read_damper(table, &names, &rig))?;
    rig.dampers.splice(0..0, dampers);
    rig.gravities = each(&root, "gravity", |table| read_gravity(table, &names))?;
    rig.tendons = each(&root, "tendon", |table| read_tendon(table, &names, &rig))?;
    rig.geometry.waveguides = each(&root, "waveguide", |table| read_waveguide(table, &names))?;
    rig.geometry.magnets = each(&root, "magnet", |table| read_magnet(table, &names))?;
    rig.geometry.magnetometers = each(&root, "magnetometer", read_magnetometer)?;
    rig.geometry.hasels = each(&root, "hasel", |table| read_hasel(table, &names, &rig))?;
    rig.actuators = each(&root, "actuator", |table| {
        read_actuator(table, &names, &rig)
    })?;
    rig.sensors = each(&root, "sensor", |table| read_sensor(table, &names, &rig))?;
    rig.effects = read_effects(&root.tables("effect")?, &names, &rig)?;
    rig.signals = read_signals(&root.tables("signal")?)?;
    Ok(rig)
}

/// Reads every table of a name.
fn each<'a, T>(
    root: &TableReader<'a>,
    name: &'static str,
    read: impl Fn(&TableReader<'a>) -> Result<T, Error>,
) -> Result<Vec<T>, Error> {
    root.tables(name)?.iter().map(read).collect()
}

fn own_name(table: &TableReader) -> Result<String, Error> {
    Ok(table.text("name")?.value.to_owned())
}

fn read_body(table: &TableReader) -> Result<Body, Error> {
    let motions = [("slide", Motion::Slide), ("hinge", Motion::Hinge)];
    let motion_from = read_motion_from(table)?;
    let sign = match motion_from {
        Some(_) => Sign::NonNegative,
        None => Sign::Positive,
    };
    Ok(Body {
        name: own_name(table)?,
        motion: table.required_word("motion", &motions)?,
        inertia: table.parameter("inertia", sign).map_err(|error| {
            if error.message.contains("more than zero") {
                error.helped(
                    "without inertia a force would have no finite acceleration; only a body \
                         with `motion_from` may have none",
                )
            } else {
                error
            }
        })?,
        start: table.optional_parameter("start", Sign::Any)?,
        start_velocity: table.optional_parameter("start_velocity", Sign::Any)?,
        motion_from,
    })
}

/// The column that imposes a body's coordinate, if there is one; it leaves no start to choose.
fn read_motion_from(table: &TableReader) -> Result<Option<MotionColumn>, Error> {
    let Some(column) = table.optional_text("motion_from")? else {
        if table.has("unit") {
            return Err(table
                .error_at(
                    "unit",
                    format!("`unit` of {} belongs to no column", table.what),
                )
                .helped("it is the unit of the column that `motion_from` names"));
        }
        return Ok(None);
    };
    for key in ["start", "start_velocity"] {
        if table.has(key) {
            return Err(table
                .error_at(key, format!("{}: `{key}` beside `motion_from`", table.what))
                .helped("the column says where the body is at every row: leave the key out"));
        }
    }
    Ok(Some(MotionColumn {
        column: column.value.to_owned(),
        column_factor: read_factor(table)?,
        line: table.line("motion_from"),
    }))
}

/// The ends of a spring or damper: not one body twice, and not a line joined to an axis.
fn read_ends(table: &TableReader, names: &Names, rig: &Rig) -> Result<(End, End), Error> {
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

fn read_spring(table: &TableReader, names: &Names, rig: &Rig) -> Result<Spring, Error> {
    let name = own_name(table)?;
    let (from, to) = read_ends(table, names, rig)?;
    let law = read_applied(table, LawKind::Spring, rig.ends_motion(from, to), rig)?;
    Ok(Spring {
        name,
        from,
        to,
        stiffness: match law {
            Some(_) => table.held("stiffness", 0.0),
            None => table.parameter("stiffness", Sign::NonNegative)?,
        },
        rest: table.parameter_or("rest", Sign::Any, 0.0)?,
        law,
    })
}

fn read_damper(table: &TableReader, names: &Names, rig: &Rig) -> Result<Damper, Error> {
    let name = own_name(table)?;
    let (from, to) = read_ends(table, names, rig)?;
    let law = read_applied(table, LawKind::Damper, rig.ends_motion(from, to), rig)?;
    Ok(Damper {
        name,
        from,
        to,
        damping: match law {
            Some(_) => table.held("damping", 0.0),
            None => table.parameter("damping", Sign::NonNegative)?,
        },
        law,
    })
}

fn read_gravity(table: &TableReader, names: &Names) -> Result<Gravity, Error> {
    Ok(Gravity {
        name: own_name(table)?,
        body: names.body(table, "body")?,
        amplitude: table.parameter("amplitude", Sign::Any)?,
        zero: table.parameter_or("zero", Sign::Any, 0.0)?,
    })
}

fn read_tendon(table: &TableReader, names: &Names, rig: &Rig) -> Result<Tendon, Error> {
    let name = own_name(table)?;
    let (path, routes) = read_path(table, names, rig)?;
    Ok(Tendon {
        name,
        path,
        routes,
        stiffness: table.parameter("stiffness", Sign::NonNegative)?,
        damping: table.parameter_or("damping", Sign::NonNegative, 0.0)?,
        pretension: table.parameter_or("pretension", Sign::Any, 0.0)?,
        unilateral: table.flag("unilateral")?.unwrap_or(true),
    })
}

fn read_actuator(table: &TableReader, names: &Names, rig: &Rig) -> Result<Actuator, Error> {
    let name = own_name(table)?;
    let role = format!("`drives` of {}", table.what);
    let drives = names.resolve(
        table.source,
        &table.text("drives")?,
        &role,
        "bodies, tendons and HASEL actuators",
        |component| match component {
            Component::Body(body) => Some(Drives::Body(body)),
            Component::Tendon(tendon) => Some(Drives::Tendon(tendon)),
            Component::Hasel(hasel) => Some(Drives::Hasel(hasel)),
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
        position_loop: read_position_loop(table, drives, rig)?,
        limit: read_limit(table)?,
        rate_limit: table.number("rate_limit", Sign::Positive)?,
        column_factor: read_factor(table)?,
        line: table.line("input"),
    })
}

/// The position loop of an actuator, where its `loop` names one.
fn read_position_loop(
    table: &TableReader,
    drives: Drives,
    rig: &Rig,
) -> Result<Option<PositionLoop>, Error> {
    if table.word("loop", &[("position", ())])?.is_none() {
        let mut of_a_loop = ["dead_band", "effort_limit"].into_iter();
        return match of_a_loop.find(|key| table.has(key)) {
            Some(key) => Err(table
                .error_at(key, format!("`{key}` of {} without a `loop`", table.what))
                .helped("loop = \"position\" closes a position loop in the actuator's firmware")),
            None => Ok(None),
        };
    }
    let Drives::Body(body) = drives else {
        let message = format!("`loop` of {}: it drives no body", table.what);
        return Err(table
            .error_at("loop", message)
            .helped("a position loop holds the coordinate of a body"));
    };
    let coordinate = Quantity::Coordinate.unit(rig.bodies[body].motion);
    let column = table.text("input")?.value;
    let si = match table.optional_text("unit")? {
        Some(unit) => unit::si(unit.value),
        None => unit::of_column(column),
    };
    if si != coordinate {
        let message = format!(
            "`input` of {}: the position loop of `{}` takes {coordinate}, and `{column}` is in {}",
            table.what,
            rig.bodies[body].name,
            if si.is_empty() { "no unit" } else { si },
        );
        return Err(table.error_at("input", message).helped(
            "the column is the commanded position; `unit` converts degrees or millimetres",
        ));
    }
    Ok(Some(PositionLoop {
        dead_band: table.optional_parameter("dead_band", Sign::NonNegative)?,
        effort_limit: table.optional_parameter("effort_limit", Sign::NonNegative)?,
    }))
}

fn read_limit(table: &TableReader) -> Result<Option<(f64, f64)>, Error> {
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

fn read_sensor(table: &TableReader, names: &Names, rig: &Rig) -> Result<Sensor, Error> {
    let reads = read_reads(table, names)?;
    refuse_unknown_effort(table, reads, rig)?;
    Ok(Sensor {
        name: own_name(table)?,
        reads,
        signal: table.text("signal")?.value.to_owned(),
        gain: table.parameter_or("gain", Sign::NonZero, 1.0)?,
        offset: table.parameter_or("offset", Sign::Any, 0.0)?,
        column_factor: read_factor(table)?,
        line: table.line("signal"),
    })
}

/// Refuses the effort of a motion that is not imposed: it follows from the forces then.
fn refuse_unknown_effort(table: &TableReader, reads: Reads, rig: &Rig) -> Result<(), Error> {
    let body = match reads {
        Reads::Effort(body) => Some(body),
        Reads::ActuatorEffort(actuator) => match rig.actuators[actuator].drives {
            Drives::Body(body) => Some(body),
            Drives::Tendon(_) | Drives::Hasel(_) => None,
        },
        _ => return Ok(()),
    };
    let refused = |message: String| table.error_at("reads", message);
    match body {
        None => Err(refused(format!(
            "`reads` of {}: the actuator drives no body",
            table.what
        ))
        .helped("an effort is what a body needs: expected an actuator that drives a body")),
        Some(body) if rig.bodies[body].motion_from.is_none() => {
            let name = &rig.bodies[body].name;
            Err(refused(format!(
                "`reads` of {}: the motion of `{name}` is not imposed",
                table.what
            ))
            .helped(format!(
                "body `{name}` needs `motion_from = \"COLUMN\"`, the column with its coordinate"
            )))
        }
        Some(_) => Ok(()),
    }
}

/// `BODY.position`, `TENDON.tension`, `CHAIN.tip.x`: a component and one of its readings.
fn read_reads(table: &TableReader, names: &Names) -> Result<Reads, Error> {
    let text = table.text("reads")?;
    let role = format!("`reads` of {}", table.what);
    let Some((name, quantity)) = split(text.value, names) else {
        let forms = "expected BODY.position, BODY.velocity, BODY.effort, TENDON.tension or \
                     CHAIN.tip.x";
        let message = format!("{role}: {forms}, found `{}`", text.value);
        return Err(table.source.error(text.span, message));
    };
    let fitting: Vec<&Reading> = Reading::all().filter(|r| r.name == quantity).collect();
    let Some(&first) = fitting.first() else {
        // Of the component that was named, or of anything where the name is not known either.
        let mut known: Vec<&str> = Reading::all()
            .filter(|reading| names.get(name).is_none_or(|c| (reading.of)(c).is_some()))
            .map(|reading| reading.name)
            .collect();
        known.dedup();
        return Err(table
            .source
            .error(text.span, format!("{role}: unknown reading `{quantity}`"))
            .helped(suggest::help(quantity, "readings", &known)));
    };
    let name = Spanned {
        value: name,
        span: text.span,
    };
    names.resolve(table.source, &name, &role, first.list, |component| {
        fitting.iter().find_map(|reading| (reading.of)(component))
    })
}

//! Sections of a rig file and the names in them.

use super::geometry;
use super::names::{Component, Names, Section};
use super::reader::TableReader;
use crate::error::Error;

/// Reads all names of a file before anything else: a component may name one that stands further
/// down.
pub(super) fn read_names<'a>(root: &TableReader<'a>) -> Result<Names<'a>, Error> {
    let mut names = Names::default();
    for (section, keys, component) in SECTIONS.iter().chain(geometry::SECTIONS) {
        for (index, table) in root.tables(section)?.iter().enumerate() {
            table.allow(keys)?;
            names.enter(table, component(index))?;
        }
    }
    enter_generated(root, &mut names)?;
    Ok(names)
}

/// Enters the bodies and springs that chains and plates become; they come after those of the file.
/// Their names hold a dot, which no name in a file may, so that none is taken.
fn enter_generated<'a>(root: &TableReader<'a>, names: &mut Names<'a>) -> Result<(), Error> {
    let mut bodies = root.tables("body")?.len();
    let mut springs = root.tables("spring")?.len();
    let mut add = |name: String, line: usize, count: &mut usize, kind: fn(usize) -> Component| {
        names.enter_generated(name, kind(*count), line);
        *count += 1;
    };
    for table in &root.tables("chain")? {
        let [own_bodies, own_springs] = geometry::chain_names(table)?;
        for name in own_bodies {
            add(name, table.own_line(), &mut bodies, Component::Body);
        }
        for name in own_springs {
            add(name, table.own_line(), &mut springs, Component::Spring);
        }
    }
    for table in &root.tables("plate")? {
        for name in geometry::plate_names(table)? {
            add(name, table.own_line(), &mut bodies, Component::Body);
        }
    }
    Ok(())
}

const SECTIONS: &[Section] = &[
    (
        "body",
        &[
            "name",
            "motion",
            "inertia",
            "start",
            "start_velocity",
            "motion_from",
            "unit",
        ],
        Component::Body,
    ),
    (
        "spring",
        &[
            "name",
            "from",
            "to",
            "stiffness",
            "rest",
            "law",
            "law_length",
            "law_width",
        ],
        Component::Spring,
    ),
    (
        "damper",
        &[
            "name",
            "from",
            "to",
            "damping",
            "law",
            "law_length",
            "law_width",
        ],
        |_| Component::Damper,
    ),
    ("gravity", &["name", "body", "amplitude", "zero"], |_| {
        Component::Gravity
    }),
    (
        "tendon",
        &[
            "name",
            "path",
            "stiffness",
            "damping",
            "pretension",
            "unilateral",
        ],
        Component::Tendon,
    ),
    (
        "actuator",
        &[
            "name",
            "drives",
            "input",
            "hold",
            "gain",
            "loop",
            "dead_band",
            "effort_limit",
            "limit",
            "rate_limit",
            "unit",
        ],
        Component::Actuator,
    ),
    (
        "sensor",
        &["name", "reads", "signal", "gain", "offset", "unit"],
        Component::Sensor,
    ),
];

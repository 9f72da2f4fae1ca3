//! Places of laws in a rig: found by name, given a free law, and written as numbers.

use sinew_sim::rig::{End, Rig, Spring};
use sinew_sim::unit::{Motion, Quantity};
use sinew_sim::{LawKind, Plant, suggest};
use toml_edit::{Array, ArrayOfTables, DocumentMut, InlineTable, Item, Table, TableLike, Value};

use super::LearnOptions;
use crate::error::{Error, Result};
use crate::fit::experiment::Experiment;
use crate::fit::free_run;
use crate::recording::Recording;

/// Part of the stiffness or damping below which a number starts: a bound is no place to start from.
const LEAST: f64 = 1e-6;

/// A spring or a damper whose law is learned.
#[derive(Clone, Debug)]
pub struct Target {
    name: String,
    kind: LawKind,
    index: usize,
    motion: Motion,
}

impl Target {
    /// Name of the component, and of its law.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Spring or damper.
    pub fn kind(&self) -> LawKind {
        self.kind
    }

    /// Unit of the argument: m, rad, m/s or rad/s.
    pub fn unit(&self) -> &'static str {
        let quantity = match self.kind {
            LawKind::Spring => Quantity::Coordinate,
            LawKind::Damper => Quantity::Velocity,
        };
        quantity.unit(self.motion)
    }

    /// Unit of the numbers.
    pub fn number_unit(&self) -> &'static str {
        let quantity = match self.kind {
            LawKind::Spring => Quantity::Stiffness,
            LawKind::Damper => Quantity::Damping,
        };
        quantity.unit(self.motion)
    }

    /// Unit of the force.
    pub fn force_unit(&self) -> &'static str {
        Quantity::Force.unit(self.motion)
    }

    /// Stiffness or damping of a rig without the law.
    pub fn line(&self, rig: &Rig) -> f64 {
        match self.kind {
            LawKind::Spring => rig.springs[self.index].stiffness.value,
            LawKind::Damper => rig.dampers[self.index].damping.value,
        }
    }

    fn ends(&self, rig: &Rig) -> (End, End) {
        match self.kind {
            LawKind::Spring => {
                let Spring { from, to, .. } = rig.springs[self.index];
                (from, to)
            }
            LawKind::Damper => (rig.dampers[self.index].from, rig.dampers[self.index].to),
        }
    }
}

/// The components of these names.
///
/// # Errors
/// `Arguments` for a name that is no spring or damper of the file, that has a law, or comes twice.
pub(super) fn find(rig: &Rig, names: &[String], options: LearnOptions) -> Result<Vec<Target>> {
    let springs = rig.springs.iter().enumerate();
    let springs = springs.map(|(index, it)| (LawKind::Spring, index, &it.name, it.law.is_some()));
    let dampers = rig.dampers.iter().enumerate();
    let dampers = dampers.map(|(index, it)| (LawKind::Damper, index, &it.name, it.law.is_some()));
    // Those of a chain have one number for all of them.
    let known: Vec<_> = springs
        .chain(dampers)
        .filter(|(_, _, name, _)| !name.contains('.'))
        .collect();
    if names.is_empty() {
        return Err(Error::arguments("no place for a law").expected("--at SPRING or --at DAMPER"));
    }
    let mut targets: Vec<Target> = Vec::new();
    for name in names {
        let Some(&(kind, index, _, has_law)) = known.iter().find(|it| it.2 == name) else {
            let list: Vec<&str> = known.iter().map(|it| it.2.as_str()).collect();
            let meant = suggest::nearest(name, list.iter().copied());
            let meant = meant.map_or(String::new(), |meant| format!("did you mean `{meant}`? "));
            return Err(Error::arguments(format!(
                "--at {name}: the rig has no spring and no damper of that name"
            ))
            .help(format!("{meant}springs and dampers: {}", list.join(", "))));
        };
        if targets.iter().any(|target| target.name == *name) {
            return Err(Error::arguments(format!("--at {name} is there twice")));
        }
        if has_law {
            return Err(
                Error::arguments(format!("--at {name}: it has a law already"))
                    .help("give it a stiffness or damping to learn its law anew"),
            );
        }
        if kind == LawKind::Damper && !options.monotone {
            return Err(Error::arguments(format!(
                "--any-slope with --at {name}: a damping that falls might put energy in"
            ))
            .help("friction that falls with the speed is a `stribeck_friction`"));
        }
        let mut target = Target {
            name: name.clone(),
            kind,
            index,
            motion: Motion::Slide,
        };
        let (from, to) = target.ends(rig);
        for end in [from, to] {
            if let End::Body(body) = end {
                target.motion = rig.bodies[body].motion;
            }
        }
        targets.push(target);
    }
    Ok(targets)
}

/// Largest magnitude of each target's extension or rate over free runs of the recordings.
///
/// # Errors
/// `Failed` where a target never moves or the rig cannot be simulated.
pub(super) fn reaches(rig: &Rig, targets: &[Target], recordings: &[Recording]) -> Result<Vec<f64>> {
    let plant = Plant::new(rig)?;
    let bodies = plant.bodies();
    let mut most = vec![0.0f64; targets.len()];
    for recording in recordings {
        let run = free_run(rig, recording)?;
        let experiment = Experiment::new(&plant, recording)?;
        let drive = experiment.drive(&plant, 0..experiment.rows())?;
        let taken = plant.simulate_with(&run.values, &run.start, &drive, &experiment.t, |_, at| {
            let state = at.state();
            for (most, target) in most.iter_mut().zip(targets) {
                let (from, to) = target.ends(rig);
                let at = |end: End| match (end, target.kind) {
                    (End::Ground, _) => 0.0,
                    (End::Body(body), LawKind::Spring) => state[body],
                    (End::Body(body), LawKind::Damper) => state[bodies + body],
                };
                let rest = match target.kind {
                    LawKind::Spring => rig.springs[target.index].rest.value,
                    LawKind::Damper => 0.0,
                };
                *most = most.max((at(to) - at(from) - rest).abs());
            }
        });
        taken.map_err(|error| {
            Error::failed(format!(
                "the rig cannot be simulated over its recordings: {error}"
            ))
        })?;
    }
    for (most, target) in most.iter().zip(targets) {
        if !(*most > 0.0 && most.is_finite()) {
            return Err(Error::failed(format!(
                "`{}` never moves in these recordings: there is nothing to learn from",
                target.name
            )));
        }
    }
    Ok(most)
}

/// The rig with a law of free numbers at each target, all at the straight line.
pub(super) fn with_free_laws(
    rig: &Rig,
    targets: &[Target],
    reaches: &[f64],
    options: LearnOptions,
) -> Result<Rig> {
    let mut document = document(rig)?;
    for (target, reach) in targets.iter().zip(reaches) {
        let component = component(&mut document, target).ok_or_else(|| unwritable(&target.name))?;
        component.remove(target.kind.key());
        component.insert("law", toml_edit::value(&target.name));
        let count = if options.odd {
            options.steps + 1
        } else {
            2 * options.steps + 1
        };
        let line = target.line(rig).max(LEAST);
        let numbers = (0..count).map(|_| {
            let mut free = InlineTable::new();
            free.insert("value", Value::from(line));
            Value::from(free)
        });
        let mut table = Table::new();
        table.decor_mut().set_prefix("\n");
        let motion = match target.motion {
            Motion::Slide => "slide",
            Motion::Hinge => "hinge",
        };
        table.insert("name", toml_edit::value(&target.name));
        table.insert("motion", toml_edit::value(motion));
        table.insert("odd", toml_edit::value(options.odd));
        table.insert("monotone", toml_edit::value(options.monotone));
        table.insert("reach", toml_edit::value(*reach));
        let numbers = numbers.collect::<Array>();
        table.insert(target.kind.key(), toml_edit::value(numbers));
        match document
            .entry("law")
            .or_insert(Item::ArrayOfTables(ArrayOfTables::new()))
        {
            Item::ArrayOfTables(tables) => tables.push(table),
            Item::Value(Value::Array(tables)) => tables.push(table.into_inline_table()),
            _ => return Err(unwritable("a law")),
        }
    }
    Ok(Rig::parse(&document.to_string(), &rig.file)?)
}

/// The rig with every free number of its laws as a bare number.
pub(super) fn as_numbers(rig: &Rig) -> Result<Rig> {
    let mut document = document(rig)?;
    let Some(laws) = document
        .get_mut("law")
        .and_then(Item::as_array_of_tables_mut)
    else {
        return Ok(rig.clone());
    };
    for law in laws.iter_mut() {
        for key in [LawKind::Spring.key(), LawKind::Damper.key()] {
            let Some(numbers) = law.get_mut(key).and_then(Item::as_array_mut) else {
                continue;
            };
            for number in numbers.iter_mut() {
                let value = number.as_inline_table().and_then(|free| free.get("value"));
                if let Some(value) = value.cloned() {
                    let decor = number.decor().clone();
                    *number = value;
                    *number.decor_mut() = decor;
                }
            }
        }
    }
    Ok(Rig::parse(&document.to_string(), &rig.file)?)
}

fn document(rig: &Rig) -> Result<DocumentMut> {
    rig.to_toml().parse().map_err(|_| unwritable("itself"))
}

fn component<'d>(document: &'d mut DocumentMut, target: &Target) -> Option<&'d mut dyn TableLike> {
    match document.get_mut(target.kind.noun())? {
        Item::ArrayOfTables(tables) => Some(tables.get_mut(target.index)? as &mut dyn TableLike),
        Item::Value(Value::Array(tables)) => {
            Some(tables.get_mut(target.index)?.as_inline_table_mut()? as &mut dyn TableLike)
        }
        _ => None,
    }
}

fn unwritable(what: &str) -> Error {
    Error::failed(format!("cannot write `{what}` into this rig"))
}

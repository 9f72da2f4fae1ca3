//! The names of a rig file and what they stand for.

use super::End;
use super::reader::{Source, Spanned, TableReader};
use crate::error::Error;
use crate::suggest;
use std::borrow::Cow;
use std::collections::HashMap;

/// Component that a name in the file belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Component {
    Body(usize),
    Spring(usize),
    Damper,
    Gravity,
    Tendon(usize),
    Actuator(usize),
    Sensor(usize),
    Chain(usize),
    Plate(usize),
    Waveguide(usize),
    Magnet,
    Magnetometer(usize),
    Hasel(usize),
}

impl Component {
    pub(super) fn noun(self) -> &'static str {
        match self {
            Self::Body(_) => "a body",
            Self::Spring(_) => "a spring",
            Self::Damper => "a damper",
            Self::Gravity => "a gravity",
            Self::Tendon(_) => "a tendon",
            Self::Actuator(_) => "an actuator",
            Self::Sensor(_) => "a sensor",
            Self::Chain(_) => "a chain",
            Self::Plate(_) => "a plate",
            Self::Waveguide(_) => "a waveguide",
            Self::Magnet => "a magnet",
            Self::Magnetometer(_) => "a magnetometer",
            Self::Hasel(_) => "a HASEL actuator",
        }
    }
}

/// Every name of the file, with its line: names are unique in the whole file.
#[derive(Default)]
pub(super) struct Names<'a> {
    known: HashMap<Cow<'a, str>, (Component, usize)>,
    order: Vec<Cow<'a, str>>,
}

impl<'a> Names<'a> {
    /// Notes a generated name, which no check of the file concerns.
    pub(super) fn enter_generated(&mut self, name: String, component: Component, line: usize) {
        self.known.insert(name.clone().into(), (component, line));
        self.order.push(name.into());
    }

    pub(super) fn enter(
        &mut self,
        table: &TableReader<'a>,
        component: Component,
    ) -> Result<(), Error> {
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
            .insert(name.value.into(), (component, table.line("name")));
        self.order.push(name.value.into());
        Ok(())
    }

    pub(super) fn get(&self, name: &str) -> Option<Component> {
        self.known.get(name).map(|&(component, _)| component)
    }

    /// The names of the components that pass the filter, in file order.
    pub(super) fn of(&self, wanted: impl Fn(Component) -> bool) -> Vec<&str> {
        let pass = |name: &&str| self.get(name).is_some_and(&wanted);
        self.order.iter().map(Cow::as_ref).filter(pass).collect()
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

    /// The body that a key names.
    pub(super) fn body(&self, table: &TableReader, key: &str) -> Result<usize, Error> {
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

    /// The chain that a key names.
    pub(super) fn chain(&self, table: &TableReader, key: &str) -> Result<usize, Error> {
        self.resolve(
            table.source,
            &table.text(key)?,
            &format!("`{key}` of {}", table.what),
            "chains",
            |component| match component {
                Component::Chain(chain) => Some(chain),
                _ => None,
            },
        )
    }

    /// The plate that a key names.
    pub(super) fn plate(&self, table: &TableReader, key: &str) -> Result<usize, Error> {
        self.resolve(
            table.source,
            &table.text(key)?,
            &format!("`{key}` of {}", table.what),
            "plates",
            |component| match component {
                Component::Plate(plate) => Some(plate),
                _ => None,
            },
        )
    }

    /// The body, or the ground, that a key names.
    pub(super) fn end(&self, table: &TableReader, key: &str) -> Result<End, Error> {
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

/// The named components: their table, its keys, and what a name of theirs stands for.
pub(super) type Section = (
    &'static str,
    &'static [&'static str],
    fn(usize) -> Component,
);

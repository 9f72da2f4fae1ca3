//! Effects put into a rig: where each can sit, and the rig as if it had been written with one more.

use super::{Drives, End, Rig, Site};
use crate::effects::{Kind, Port, Role};
use crate::error::Error;
use crate::suggest;
use toml_edit::{ArrayOfTables, DocumentMut, InlineTable, Item, Table, Value};

impl Kind {
    /// Every place in a rig where this effect could sit and does not yet, in file order. None for a
    /// friction that would follow a load which is always zero.
    pub fn sites(self, rig: &Rig) -> Vec<Site> {
        let mut sites = Vec::new();
        for port in self.description().ports {
            match port {
                Port::Body => sites.extend((0..rig.bodies.len()).map(Site::Body)),
                Port::Spring => sites.extend((0..rig.springs.len()).map(Site::Spring)),
                Port::Tendon => sites.extend((0..rig.tendons.len()).map(Site::Tendon)),
                Port::Actuator => sites.extend((0..rig.actuators.len()).map(Site::Actuator)),
                Port::Sensor => sites.extend((0..rig.sensors.len()).map(Site::Sensor)),
                Port::Pair => sites.extend(rig.pairs()),
            }
        }
        let taken = |site: &Site| {
            (rig.effects.iter()).any(|effect| effect.kind == self && effect.site == *site)
        };
        sites.retain(|site| !taken(site) && (self != Self::LoadDependent || rig.loaded(*site)));
        sites
    }
}

impl Rig {
    /// Pairs of bodies of one motion that no spring joins, the lower index first.
    fn pairs(&self) -> Vec<Site> {
        let bodies = self.bodies.len();
        let joined = |a: usize, b: usize| {
            let (a, b) = (End::Body(a), End::Body(b));
            (self.springs.iter()).any(|s| (s.from, s.to) == (a, b) || (s.from, s.to) == (b, a))
        };
        (0..bodies)
            .flat_map(|a| (a + 1..bodies).map(move |b| (a, b)))
            .filter(|&(a, b)| self.bodies[a].motion == self.bodies[b].motion && !joined(a, b))
            .map(|(a, b)| Site::Pair(a, b))
            .collect()
    }

    /// True where an actuator, a spring or a tendon pulls at a body; always true of a tendon.
    fn loaded(&self, site: Site) -> bool {
        let Site::Body(body) = site else {
            return true;
        };
        (self.actuators.iter()).any(|actuator| actuator.drives == Drives::Body(body))
            || (self.springs.iter())
                .any(|spring| [spring.from, spring.to].contains(&End::Body(body)))
            || (self.tendons.iter()).any(|tendon| tendon.path.iter().any(|part| part.0 == body))
    }

    /// The place of that name (`carriage`, `a+b`) where an effect of this kind can sit or sits.
    ///
    /// # Errors
    /// There is none, with the name that was probably meant.
    pub fn site(&self, kind: Kind, component: &str) -> Result<Site, Error> {
        let mut sites = kind.sites(self);
        sites.extend(
            (self.effects.iter())
                .filter(|e| e.kind == kind)
                .map(|e| e.site),
        );
        let names: Vec<String> = sites.iter().map(|&site| self.site_name(site)).collect();
        let turned = component.split_once('+').map(|(a, b)| format!("{b}+{a}"));
        (names.iter())
            .position(|name| name == component || Some(name) == turned.as_ref())
            .map(|index| sites[index])
            .ok_or_else(|| {
                let names: Vec<&str> = names.iter().map(String::as_str).collect();
                let kind = kind.description().kind;
                Error {
                    file: self.file.clone(),
                    line: None,
                    column: None,
                    message: format!("`{kind}` cannot sit at `{component}` in this rig"),
                    help: Some(suggest::help(component, "it can sit at", &names)),
                }
            })
    }

    /// The rig as if it had been written with one more `[[effect]]`, its parameters free and at
    /// `values` (the order of the description). Text, comments and layout of the rest stay.
    ///
    /// ```
    /// use sinew_sim::{Rig, effects::Kind};
    /// let text = "format = \"sinew-rig/1\"\nname = \"x\"\n[[body]]\nname = \"mass\"\n\
    ///             motion = \"slide\"\ninertia = 1.0\n";
    /// let rig = Rig::parse(text, "x.toml")?;
    /// let site = Kind::Coulomb.sites(&rig)[0];
    /// let more = rig.with_effect(Kind::Coulomb, site, &[0.3])?;
    /// assert!(more.to_toml().ends_with("level = { value = 0.3 }\n"));
    /// assert!(more.with_effect(Kind::Coulomb, site, &[0.3]).is_err()); // it is there
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// Those of [`Rig::parse`]: a value of the wrong sign, a kind twice at a component.
    pub fn with_effect(&self, kind: Kind, site: Site, values: &[f64]) -> Result<Self, Error> {
        self.with_table(kind, self.effect_table(kind, site, values))
    }

    /// The same with an effect whose strengths depend on a signal
    /// (docs/explanation/plant.md, eq. 26): `values` go on with a slope a strength, in the order of
    /// the description.
    ///
    /// # Errors
    /// Those of [`Rig::with_effect`].
    pub fn with_dependent_effect(
        &self,
        kind: Kind,
        site: Site,
        values: &[f64],
        signal: &str,
    ) -> Result<Self, Error> {
        let mut table = self.effect_table(kind, site, values);
        let specs = kind.description().parameters;
        let slopes = values.get(specs.len()..).unwrap_or_default();
        let strengths = specs.iter().filter(|spec| spec.role == Role::Strength);
        for (spec, &slope) in strengths.zip(slopes) {
            let value = table.get_mut(spec.name).and_then(Item::as_inline_table_mut);
            if let Some(value) = value {
                let mut free = InlineTable::new();
                free.insert("value", Value::from(slope));
                value.insert("with", Value::from(signal));
                value.insert("slope", Value::from(free));
            }
        }
        self.with_table(kind, table)
    }

    fn with_table(&self, kind: Kind, table: Table) -> Result<Self, Error> {
        let unwritable = || Error {
            file: self.file.clone(),
            line: None,
            column: None,
            message: format!("cannot write `{}` into this file", kind.description().kind),
            help: None,
        };
        let mut document: DocumentMut = self.text.parse().map_err(|_| unwritable())?;
        let root = document.as_table_mut();
        match root
            .entry("effect")
            .or_insert(Item::ArrayOfTables(ArrayOfTables::new()))
        {
            Item::ArrayOfTables(tables) => tables.push(table),
            Item::Value(Value::Array(tables)) => tables.push(table.into_inline_table()),
            _ => return Err(unwritable()),
        }
        Self::parse(&document.to_string(), &self.file)
    }

    fn effect_table(&self, kind: Kind, site: Site, values: &[f64]) -> Table {
        let description = kind.description();
        let mut table = Table::new();
        table.decor_mut().set_prefix("\n");
        table.insert("kind", toml_edit::value(description.kind));
        table.insert("component", toml_edit::value(self.site_name(site)));
        for (spec, &number) in description.parameters.iter().zip(values) {
            let mut value = Value::from(number);
            if !spec.held {
                let mut free = InlineTable::new();
                free.insert("value", value);
                value = Value::from(free);
            }
            table.insert(spec.name, Item::Value(value));
        }
        table
    }
}

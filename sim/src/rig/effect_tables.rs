//! The `[[effect]]` tables of a rig.

use super::names::{Component, Names};
use super::reader::{Spanned, TableReader};
use super::{EffectTable, Rig, Site};
use crate::effects::{Kind, Port};
use crate::error::Error;
use crate::suggest;

/// Every `[[effect]]`, in file order.
pub(super) fn read_effects(
    tables: &[TableReader],
    names: &Names,
    rig: &Rig,
) -> Result<Vec<EffectTable>, Error> {
    let mut effects: Vec<EffectTable> = Vec::new();
    for table in tables {
        let effect = read_effect(table, names, rig)?;
        let twice = |other: &EffectTable| other.kind == effect.kind && other.site == effect.site;
        if effects.iter().any(twice) {
            return Err(table.error_at(
                "component",
                format!(
                    "`{}` at `{}` is there twice",
                    effect.kind.description().kind,
                    rig.site_name(effect.site)
                ),
            ));
        }
        effects.push(effect);
    }
    Ok(effects)
}

fn read_effect(table: &TableReader, names: &Names, rig: &Rig) -> Result<EffectTable, Error> {
    let kind = read_kind(table)?;
    let description = kind.description();
    let mut keys = vec!["kind", "component"];
    keys.extend(description.parameters.iter().map(|spec| spec.name));
    let table = &table.called(format!("effect `{}`", description.kind));
    table.allow(&keys)?;
    let site = read_site(table, names, description.ports, rig)?;
    let parameters: Result<Vec<_>, Error> = description
        .parameters
        .iter()
        .map(|spec| match spec.default {
            Some(default) => table.parameter_or(spec.name, spec.sign, default),
            None => table.parameter(spec.name, spec.sign),
        })
        .collect();
    let parameters = parameters?;
    table.refuse_dependence(description.family, &parameters)?;
    Ok(EffectTable {
        kind,
        site,
        parameters,
    })
}

/// The component that an effect names, of a sort that it can sit at.
fn read_site(table: &TableReader, names: &Names, ports: &[Port], rig: &Rig) -> Result<Site, Error> {
    let text = table.text("component")?;
    let role = format!("`component` of {}", table.what);
    if ports == [Port::Pair] {
        return read_pair(table, &text, names, &role, rig);
    }
    let at = |port| ports.contains(&port);
    let nouns: Vec<&str> = ports.iter().map(|port| port.noun()).collect();
    let list = format!("it sits at {}", nouns.join(" or "));
    names.resolve(
        table.source,
        &text,
        &role,
        &list,
        |component| match component {
            Component::Body(body) if at(Port::Body) => Some(Site::Body(body)),
            Component::Spring(spring) if at(Port::Spring) => Some(Site::Spring(spring)),
            Component::Tendon(tendon) if at(Port::Tendon) => Some(Site::Tendon(tendon)),
            Component::Actuator(actuator) if at(Port::Actuator) => Some(Site::Actuator(actuator)),
            Component::Sensor(sensor) if at(Port::Sensor) => Some(Site::Sensor(sensor)),
            _ => None,
        },
    )
}

/// Two bodies, `a+b`, both of a line or both of an axis.
fn read_pair(
    table: &TableReader,
    text: &Spanned<&str>,
    names: &Names,
    role: &str,
    rig: &Rig,
) -> Result<Site, Error> {
    let refuse = |message: String| table.source.error(text.span.clone(), message);
    let Some((a, b)) = text.value.split_once('+') else {
        return Err(refuse(format!("{role}: `{}` is not a pair", text.value))
            .helped("expected two bodies, joined by a plus: component = \"a+b\""));
    };
    let body = |name: &str| {
        let name = Spanned {
            value: name,
            span: text.span.clone(),
        };
        names.resolve(
            table.source,
            &name,
            role,
            "bodies",
            |component| match component {
                Component::Body(body) => Some(body),
                _ => None,
            },
        )
    };
    let (a, b) = (body(a.trim())?, body(b.trim())?);
    if a == b {
        return Err(refuse(format!("{role}: a body cannot be joined to itself")));
    }
    if rig.bodies[a].motion != rig.bodies[b].motion {
        return Err(refuse(format!("{role}: joins a slide to a hinge"))
            .helped("metres and radians do not subtract; a [[tendon]] with arms joins them"));
    }
    Ok(Site::Pair(a.min(b), a.max(b)))
}

fn read_kind(table: &TableReader) -> Result<Kind, Error> {
    let text = table.text("kind")?;
    Kind::named(text.value).ok_or_else(|| {
        let names: Vec<&str> = Kind::ALL.iter().map(|k| k.description().kind).collect();
        table
            .source
            .error(
                text.span,
                format!("unknown kind of effect `{}`", text.value),
            )
            .helped(suggest::help(text.value, "kinds", &names))
    })
}

//! The `[[effect]]` tables of a rig.

use super::names::{Component, Names};
use super::reader::Reader;
use super::{EffectTable, Rig, Site};
use crate::effects::{Kind, NOT_SIMULATED, Port};
use crate::error::Error;
use crate::suggest;

/// Every `[[effect]]`, in file order.
pub(super) fn read_effects(
    tables: &[Reader],
    names: &Names,
    rig: &Rig,
) -> Result<Vec<EffectTable>, Error> {
    let mut effects: Vec<EffectTable> = Vec::new();
    for table in tables {
        let effect = read_effect(table, names)?;
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

fn read_effect(table: &Reader, names: &Names) -> Result<EffectTable, Error> {
    let kind = read_kind(table)?;
    let description = kind.description();
    let mut keys = vec!["kind", "component"];
    keys.extend(description.parameters.iter().map(|spec| spec.name));
    let table = &table.called(format!("effect `{}`", description.kind));
    table.allow(&keys)?;
    let at = |port| description.ports.contains(&port);
    let list = match (at(Port::Body), at(Port::Spring)) {
        (true, true) => "it sits at a body or a spring",
        (true, false) => "it sits at a body",
        (false, _) => "it sits at a spring",
    };
    let role = format!("`component` of {}", table.what);
    let site = names.resolve(
        table.source,
        &table.text("component")?,
        &role,
        list,
        |component| match component {
            Component::Body(body) if at(Port::Body) => Some(Site::Body(body)),
            Component::Spring(spring) if at(Port::Spring) => Some(Site::Spring(spring)),
            _ => None,
        },
    )?;
    let parameters: Result<Vec<_>, Error> = description
        .parameters
        .iter()
        .map(|spec| match spec.default {
            Some(default) => table.parameter_or(spec.name, spec.sign, default),
            None => table.parameter(spec.name, spec.sign),
        })
        .collect();
    Ok(EffectTable {
        kind,
        site,
        parameters: parameters?,
    })
}

fn read_kind(table: &Reader) -> Result<Kind, Error> {
    let text = table.text("kind")?;
    if let Some(kind) = Kind::named(text.value) {
        return Ok(kind);
    }
    let simulated: Vec<&str> = Kind::ALL.iter().map(|k| k.description().kind).collect();
    if NOT_SIMULATED.contains(&text.value) {
        return Err(table
            .source
            .error(
                text.span,
                format!("this version does not simulate `{}`", text.value),
            )
            .helped(format!("it simulates: {}", simulated.join(", "))));
    }
    let every: Vec<&str> = simulated.iter().chain(NOT_SIMULATED).copied().collect();
    let help = match suggest::nearest(text.value, every) {
        Some(near) => format!("did you mean `{near}`? this version simulates: "),
        None => "this version simulates: ".to_owned(),
    };
    Err(table
        .source
        .error(
            text.span,
            format!("unknown kind of effect `{}`", text.value),
        )
        .helped(help + &simulated.join(", ")))
}

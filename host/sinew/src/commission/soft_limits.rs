//! Soft limits in the text of a rig, its comments kept.

use sinew_ident::error::{Error, Result};
use sinew_sim::Rig;
use toml_edit::{Array, DocumentMut, Item, Value};

/// Text of the rig with `limit = [lower, upper]` of the actuators that take these columns, SI.
///
/// # Errors
/// A rig that is no TOML, which its reader would have refused.
pub fn written(rig: &Rig, limits: &[(&str, f64, f64)]) -> Result<String> {
    let mut document: DocumentMut = (rig.to_toml().parse())
        .map_err(|e: toml_edit::TomlError| Error::file(&rig.file, e.to_string()))?;
    let tables = document
        .get_mut("actuator")
        .and_then(Item::as_array_of_tables_mut);
    for table in tables.into_iter().flat_map(|tables| tables.iter_mut()) {
        let input = table
            .get("input")
            .and_then(Item::as_str)
            .unwrap_or_default();
        let Some((_, low, high)) = limits.iter().find(|(column, ..)| *column == input) else {
            continue;
        };
        let mut value = Value::Array([*low, *high].into_iter().collect::<Array>());
        if let Some(Item::Value(old)) = table.get("limit") {
            *value.decor_mut() = old.decor().clone();
        }
        table.insert("limit", Item::Value(value));
    }
    Ok(document.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_soft_limit_is_written_and_the_comment_beside_it_stays() {
        let text = "format = \"sinew-rig/1\"\nname = \"x\"\n[[body]]\nname = \"m\"\nmotion = \
                    \"slide\"\ninertia = 1.0\n[[actuator]]\nname = \"a\"\ndrives = \"m\"\ninput = \
                    \"u_N\"\ngain = 1.0\nlimit = [-20.0, 20.0]   # N\n";
        let rig = Rig::parse(text, "x.toml").expect("a rig");
        let written = written(&rig, &[("u_N", -1.5, 2.25)]).expect("it is TOML");
        assert!(
            written.ends_with("limit = [-1.5, 2.25]   # N\n"),
            "{written}"
        );
        let read = Rig::parse(&written, "x.toml").expect("still a rig");
        assert_eq!(read.actuators[0].limit, Some((-1.5, 2.25)));
    }
}

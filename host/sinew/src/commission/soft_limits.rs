//! Soft limits in the text of a rig, its comments kept.

use sinew_ident::error::{Error, Result};
use sinew_sim::Rig;
use toml_edit::{Array, DocumentMut, Item, Value};

/// Text of the rig with `limit = [lower, upper]` of the actuators that take these columns, SI, and
/// without the sensors of the columns `unread`, which its recordings will not have.
///
/// # Errors
/// A rig that is no TOML, which its reader would have refused.
pub fn written(rig: &Rig, limits: &[(&str, f64, f64)], unread: &[String]) -> Result<String> {
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
    let sensors = document
        .get_mut("sensor")
        .and_then(Item::as_array_of_tables_mut);
    if let Some(sensors) = sensors {
        sensors.retain(|table| {
            let signal = table
                .get("signal")
                .and_then(Item::as_str)
                .unwrap_or_default();
            !unread.iter().any(|column| column == signal)
        });
    }
    Ok(document.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::commission::setup::Setup;

    #[test]
    fn a_soft_limit_is_written_and_the_comment_beside_it_stays() {
        let text = "format = \"sinew-rig/1\"\nname = \"x\"\n[[body]]\nname = \"m\"\nmotion = \
                    \"slide\"\ninertia = 1.0\n[[actuator]]\nname = \"a\"\ndrives = \"m\"\ninput = \
                    \"u_N\"\ngain = 1.0\nlimit = [-20.0, 20.0]   # N\n";
        let rig = Rig::parse(text, "x.toml").expect("a rig");
        let written = written(&rig, &[("u_N", -1.5, 2.25)], &[]).expect("it is TOML");
        assert!(
            written.ends_with("limit = [-1.5, 2.25]   # N\n"),
            "{written}"
        );
        let read = Rig::parse(&written, "x.toml").expect("still a rig");
        assert_eq!(read.actuators[0].limit, Some((-1.5, 2.25)));
    }

    #[test]
    fn sensors_that_the_board_does_not_read_are_left_out() {
        let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
        for (name, kept) in [("two-mass-drive", 1), ("tendon", 3), ("hasel", 3)] {
            let path = root.join(format!("rigs/{name}.toml"));
            let setup = Setup::new(Rig::load(&path).expect("the rig ships"), &[]);
            let setup = setup.unwrap_or_else(|error| panic!("{name}: {error}"));
            assert!(
                setup.rig.sensors.len() > kept,
                "{name}: nothing to leave out"
            );
            let text = written(&setup.rig, &[], &setup.unread).expect("it is TOML");
            let rig = crate::rig_file::parse(&text, name).unwrap_or_else(|e| panic!("{e}"));
            let columns: Vec<&str> = rig.sensors.iter().map(|s| s.signal.as_str()).collect();
            let read: Vec<&str> = setup.sensors.iter().map(|s| s.column.as_str()).collect();
            assert_eq!(columns, read, "{name}");
            assert_eq!(columns.len(), kept, "{name}");
        }
    }
}

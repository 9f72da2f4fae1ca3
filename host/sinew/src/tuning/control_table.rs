//! The `[control]` table of a rig file, written after a tuning.

use sinew_ident::error::{Error, Result};
use sinew_model::spec::ControlSpec;
use sinew_sim::Rig;
use toml_edit::{Array, DocumentMut, Item, Table, Value};

use crate::rig_file;

/// The rig with another `[control]` table; its text, comments and other keys stay.
///
/// # Errors
/// A rig whose `[control]` is no table.
pub fn controlled(rig: &Rig, control: &ControlSpec) -> Result<Rig> {
    let refused = |what: String| Error::file(&rig.file, format!("cannot write [control]: {what}"));
    let mut document: DocumentMut = rig
        .to_toml()
        .parse()
        .map_err(|e: toml_edit::TomlError| refused(e.to_string()))?;
    let table = document
        .entry("control")
        .or_insert(Item::Table(Table::new()))
        .as_table_like_mut()
        .ok_or_else(|| refused("it is no table".into()))?;
    let numbers = |values: &[f64]| Value::from(values.iter().copied().collect::<Array>());
    for (key, mut value) in [
        ("horizon", Value::from(control.horizon as i64)),
        (
            "control_horizon",
            Value::from(control.control_horizon as i64),
        ),
        ("tracking_weight", numbers(&control.tracking_weight)),
        ("move_suppression", numbers(&control.move_suppression)),
    ] {
        match table.get_mut(key).and_then(Item::as_value_mut) {
            Some(old) => {
                // What stands before and after the number is the user's.
                *value.decor_mut() = old.decor().clone();
                *old = value;
            }
            None => {
                table.insert(key, Item::Value(value));
            }
        }
    }
    if let Some(value) = &control.value {
        // What the rig says of it already is what the model was given.
        for (key, value) in [
            ("terminal", Value::from("value")),
            ("value_rows", Value::from(value.rows as i64)),
            ("value_ahead", Value::from(value.ahead as i64)),
            ("value_points", Value::from(value.points.len() as i64)),
        ] {
            if !table.contains_key(key) {
                table.insert(key, Item::Value(value));
            }
        }
    }
    Ok(rig_file::parse(&document.to_string(), &rig.file)?)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::rig_file::ControlTable;

    fn checkout(file: &str) -> std::path::PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("../..")
            .join(file)
    }

    #[test]
    fn a_tuned_rig_asks_for_the_cost_to_go_of_its_model() {
        let rig =
            Rig::load(checkout("rigs/mass-spring-damper.toml")).expect("the shipped rig is sound");
        let spec = sinew_model::store::load(&checkout("models/reference-s"))
            .expect("the model is committed");
        let mut control = ControlSpec {
            horizon: 1,
            control_horizon: 1,
            tracking_weight: vec![1.0],
            move_suppression: vec![0.003],
            ..spec.control
        };
        let terminal = |control: &ControlSpec, rig: &Rig| {
            let tuned = controlled(rig, control).expect("the rig has a [control] table");
            let table = ControlTable::read(&tuned).expect("the tables were sound");
            (table.expect("tuning keeps it").terminal, tuned)
        };
        assert_eq!(terminal(&control, &rig).0, None);
        control.value = Some(sinew_model::spec::ValueSpec {
            rows: 2,
            ahead: 5,
            points: vec![vec![0.0], vec![0.1]],
        });
        let (found, tuned) = terminal(&control, &rig);
        let found = found.expect("the model has a cost-to-go");
        assert_eq!(
            (found.rows, found.ahead, found.points),
            (Some(2), Some(5), Some(2))
        );
        let again = terminal(&control, &tuned).1;
        assert_eq!(again.to_toml(), tuned.to_toml(), "nothing to add");
    }

    #[test]
    fn a_tuned_rig_keeps_its_text() {
        let rig =
            Rig::load(checkout("rigs/mass-spring-damper.toml")).expect("the shipped rig is sound");
        let spec = sinew_model::store::load(&checkout("models/reference-s"))
            .expect("the model is committed");
        let control = ControlSpec {
            horizon: 9,
            control_horizon: 2,
            tracking_weight: vec![1.0],
            move_suppression: vec![0.003],
            ..spec.control
        };
        let tuned = controlled(&rig, &control).expect("the rig has a [control] table");
        let table = ControlTable::read(&tuned).expect("the tables were sound");
        let table = table.expect("tuning keeps the [control] table");
        assert_eq!((table.horizon, table.control_horizon), (Some(9), Some(2)));
        assert_eq!(table.move_suppression, Some(vec![0.003]));
        assert_eq!(table.rate_hz, Some(120.0));
        let same = |line: &&str| tuned.to_toml().contains(*line);
        let kept = rig.to_toml().lines().filter(same).count();
        assert_eq!(
            kept,
            rig.to_toml().lines().count() - 2,
            "only two lines are replaced"
        );
    }
}

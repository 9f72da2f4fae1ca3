//! The mended rig: the user's file, comments included, with refitted numbers and what was found.

use toml_edit::DocumentMut;

use super::percent;
use crate::diagnose::Diagnosis;

/// The text of the mended rig; each effect that was found says so above its table.
pub fn mended(diagnosis: &Diagnosis) -> String {
    let text = diagnosis.mended.to_toml();
    let Ok(mut document) = text.parse::<DocumentMut>() else {
        return text.to_owned(); // cannot happen: the rig was read from it
    };
    let Some(tables) = document
        .get_mut("effect")
        .and_then(|item| item.as_array_of_tables_mut())
    else {
        return text.to_owned();
    };
    for effect in &diagnosis.effects {
        let is = |table: &toml_edit::Table, key: &str, value: &str| {
            table.get(key).and_then(|item| item.as_str()) == Some(value)
        };
        let found = tables.iter_mut().find(|table| {
            is(table, "kind", &effect.kind) && is(table, "component", &effect.component)
        });
        if let Some(table) = found {
            let sentence = effect.sentence.replace(['\n', '\r'], " ");
            let sure = percent(effect.confidence);
            let comment = format!("\n# sinew diagnose, {sure} sure: {sentence}\n");
            table.decor_mut().set_prefix(comment);
        }
    }
    document.to_string()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::example;

    #[test]
    fn the_mended_rig_keeps_comments_and_says_what_was_found() {
        let text = mended(&example::carriage());
        assert!(text.contains("# the one in the corner"), "{text}");
        assert!(
            text.contains("value = 95.2, min = 1.0 }   # weighed"),
            "{text}"
        );
        let found = "# sinew diagnose, 99 % sure: ...\n[[effect]]\nkind = \"coulomb_friction\"";
        assert!(text.contains(found), "{text}");
        let rig = sinew_sim::Rig::parse(&text, "mended.toml").expect("every verb reads it");
        assert_eq!(rig.effects.len(), 1);
    }

    #[test]
    fn a_rig_without_findings_is_left_as_it_is() {
        let mut nothing = example::carriage();
        nothing.effects.clear();
        nothing.mended = nothing.refitted.clone();
        assert_eq!(mended(&nothing), nothing.refitted.to_toml());
    }
}

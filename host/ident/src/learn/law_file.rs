//! `sinew-law/1`: a learned law as a file that other rigs take.

use sinew_sim::LawKind;
use sinew_sim::rig::{LAW_FORMAT, LearnedLaw};
use sinew_sim::unit::Motion;
use toml_edit::{Array, Table};

use super::{Learned, Target};

/// Files that a law came from.
#[derive(Clone, Debug, Default)]
pub struct Origin {
    /// Recordings that it was learned from.
    pub fit: Vec<String>,
    /// Recordings that chose its smoothness.
    pub check: Vec<String>,
}

/// The law of a target as the text of a file.
pub fn law_file(learned: &Learned, index: usize, origin: &Origin) -> String {
    let (law, target) = (&learned.laws[index], &learned.targets[index]);
    let (argument, over) = match law.kind {
        LawKind::Spring => ("extension", "the square of the extension"),
        LawKind::Damper => ("rate", "the rate"),
    };
    let mut text = format!(
        "# Law of a {} for `law = \"...\"` of a rig (docs/reference/rig-file.md).\n\
         format = \"{LAW_FORMAT}\"\n\
         name = {}\nmotion = \"{}\"\nodd = {}\nmonotone = {}\n\
         # Largest {argument} that it was learned from, {}.\nreach = {:?}\n\
         # {} at even steps {}; straight over {over} between.\n{} = {}\n",
        law.kind.noun(),
        toml_edit::Value::from(law.name.as_str()),
        motion(law.motion),
        law.odd,
        law.monotone,
        target.unit(),
        law.reach,
        target.number_unit(),
        steps(law),
        law.kind.key(),
        numbers(law),
    );
    text += "\n[learned]\n";
    text += &table(learned, target, origin).to_string();
    text
}

fn motion(motion: Motion) -> &'static str {
    match motion {
        Motion::Slide => "slide",
        Motion::Hinge => "hinge",
    }
}

fn steps(law: &LearnedLaw) -> &'static str {
    if law.odd {
        "from rest to the reach"
    } else {
        "from minus the reach to the reach"
    }
}

fn numbers(law: &LearnedLaw) -> String {
    let numbers: Vec<String> = law.values().iter().map(|k| format!("{k:?}")).collect();
    format!("[{}]", numbers.join(", "))
}

/// The table that says where a law comes from; nothing reads it.
fn table(learned: &Learned, target: &Target, origin: &Origin) -> Table {
    let list = |names: &[String]| toml_edit::value(names.iter().collect::<Array>());
    let mut table = Table::new();
    table.insert("rig", toml_edit::value(&learned.rig.name));
    table.insert("at", toml_edit::value(target.name()));
    table.insert("fit", list(&origin.fit));
    table.insert("check", list(&origin.check));
    table.insert("width", toml_edit::value(learned.width));
    for (straight, law) in &learned.check {
        table.insert(
            &format!("check_rms_{}", law.signal),
            toml_edit::value(law.rms),
        );
        table.insert(
            &format!("check_rms_{}_straight", law.signal),
            toml_edit::value(straight.rms),
        );
    }
    table
}

//! `sinew explain`: the meaning of a name that the program answers with.

use std::path::PathBuf;

use clap::Args;
use sinew_ident::cli::overwrite;
use sinew_ident::cli::said::Said;
use sinew_ident::cli::wrapped;
use sinew_ident::error::{Error, Result};

use crate::explain::{Group, Topic, explain, topics};

/// Column of the text beside a label.
const LABEL: usize = 15;

/// Arguments of `sinew explain`.
#[derive(Args)]
pub struct Arguments {
    /// An effect, verdict, check, status or fault; without it all of them are listed.
    name: Option<String>,
    /// File for the explanation as JSON (sinew-explanation/1); `-` is standard output.
    ///
    /// Without a name it holds a list of all.
    #[arg(long, value_name = "JSON")]
    json: Option<PathBuf>,
}

/// # Errors
/// An unknown name, or a file that cannot be written.
pub fn run(arguments: &Arguments) -> Result<()> {
    overwrite::refuse([], [("--json", arguments.json.as_deref())])?;
    let (text, json) = match &arguments.name {
        Some(name) => {
            let topic = explain(name)?;
            (page(&topic), serde_json::to_string_pretty(&topic))
        }
        None => (list(), serde_json::to_string_pretty(&topics())),
    };
    let said = Said::beside([arguments.json.as_deref()], false);
    match &arguments.json {
        Some(path) => {
            let json = json.map_err(|e| Error::failed(format!("the words are no JSON: {e}")))?;
            sinew_files::write(path, json + "\n")?;
            said.wrote(path);
        }
        None => {
            said.line(text.trim_end());
            if arguments.name.is_none() {
                said.next("sinew explain NAME");
            }
        }
    }
    Ok(())
}

/// All names, group by group.
fn list() -> String {
    let all = topics();
    let mut text = String::new();
    for group in Group::ALL {
        let here = all.iter().filter(|topic| topic.group == group);
        let names: Vec<&str> = here.map(|topic| topic.name).collect();
        text += &format!(
            "{}:\n{}\n",
            group.title(),
            wrapped(&names.join(", "), "  ", "  ")
        );
    }
    text
}

/// One name for a person, in lines of 80 columns.
fn page(topic: &Topic) -> String {
    let mut text = format!("{}: {}\n\n", topic.name, topic.group.title());
    text += &wrapped(topic.meaning, "", "");
    text.push('\n');
    let mut row = |label: &str, words: &str| {
        let first = format!("{label:<LABEL$}");
        text += &wrapped(words, &first, &" ".repeat(LABEL));
    };
    if let Some(law) = &topic.law {
        row("law", law.text);
        row(
            "",
            &format!("eq. {} of docs/explanation/plant.md", law.equation),
        );
        let place = |place: &&str| {
            if place.starts_with(['a', 'e', 'i', 'o', 'u']) {
                format!("an {place}")
            } else {
                format!("a {place}")
            }
        };
        let places: Vec<String> = topic.sits_at.iter().map(place).collect();
        row("sits at", &places.join(", "));
    }
    for parameter in &topic.parameters {
        let (name, unit, meaning) = (parameter.name, &parameter.unit, parameter.meaning);
        row("parameter", &format!("{name} ({unit}): {meaning}"));
    }
    if let Some(motion) = topic.shown_by {
        row("shown by", motion);
    }
    if !topic.confused_with.is_empty() {
        row("confused with", &topic.confused_with.join(", "));
    }
    row("next", topic.next);
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pages_have_eighty_columns_at_most() {
        let pages = topics()
            .iter()
            .map(page)
            .chain([list()])
            .collect::<Vec<_>>();
        assert!(pages.len() > 60);
        for line in pages.iter().flat_map(|page| page.lines()) {
            assert!(
                line.chars().count() <= 80 && line.trim_end() == line,
                "{line}"
            );
        }
    }

    #[test]
    fn a_page_has_law_units_excitation_and_rivals() {
        let text = page(&explain("coulomb_friction").unwrap());
        for words in [
            "F = -level sign(v)",
            "eq. 6",
            "level (N or N m)",
            "reversals",
            "hysteresis",
        ] {
            assert!(text.contains(words), "{words}: {text}");
        }
    }
}

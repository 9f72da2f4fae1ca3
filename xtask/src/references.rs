//! References that a reader follows: links between pages, equations that are cited, heads of
//! decisions.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result, bail};

use xtask::process::root;

use crate::functions;
use crate::prose::{self, Counts};

/// With `--list`, every place that counts against the budgets of prose and code as well.
///
/// # Errors
/// A link of a page leads to no file or heading, a decision is not in the table or has no status,
/// an equation is cited that its page does not have: each by file and line. Or the prose is over
/// its budget.
pub fn check(arguments: &[String]) -> Result<()> {
    let list = match arguments {
        [] => false,
        [flag] if flag == "--list" => true,
        [other, ..] => bail!("unexpected argument '{other}'; there is only --list"),
    };
    let mut wrong = Vec::new();
    let mut counts = Counts::default();
    let mut long_functions = Vec::new();
    for path in tracked("*.md")? {
        let text = fs::read_to_string(root().join(&path))?;
        wrong.extend(dead_links(&path, &text));
        wrong.extend(missing_equations(&path, &text));
        if path.starts_with("docs/") || !path.contains('/') {
            counts.page(&path, &text);
        }
    }
    for path in tracked("*.rs")? {
        let text = fs::read_to_string(root().join(&path))?;
        wrong.extend(missing_equations(&path, &text));
        // Printed by the emitter, whose own comments are counted.
        if !path.starts_with("models/") {
            counts.source(&path, &text);
            long_functions.extend(functions::long(&path, &text));
        }
    }
    for (folder, lines) in [
        ("docs/decisions", &["- Status: ", "- Date: "][..]),
        ("docs/lab", &[]),
    ] {
        let index = format!("{folder}/README.md");
        let table = fs::read_to_string(root().join(&index))?;
        for path in tracked(&format!("{folder}/0*.md"))? {
            let link = path.rsplit('/').next().unwrap_or(&path);
            if !table.contains(&format!("({link})")) {
                wrong.push(format!("{index}: the table lacks {link}"));
            }
            let text = fs::read_to_string(root().join(&path))?;
            wrong.extend(missing_lines(&path, &text, lines));
        }
    }
    let guide = fs::read_to_string(root().join("CONTRIBUTING.md"))?;
    let table = fs::read_to_string(root().join("xtask/src/main.rs"))?;
    wrong.extend(missing_verbs(&guide, names(&table)));
    if list {
        counts.list();
        long_functions.iter().for_each(|place| println!("{place}"));
    }
    let budgets = prose::budgets()?;
    wrong.extend(counts.against(&budgets)?);
    wrong.extend(functions::against(&long_functions, &budgets)?);
    if wrong.is_empty() {
        return Ok(());
    }
    bail!("{}\n{} in all", wrong.join("\n"), wrong.len())
}

/// Names in the table of verbs: what stands behind `name:`.
fn names(table: &str) -> impl Iterator<Item = &str> {
    let entries = table
        .lines()
        .filter_map(|line| line.trim().strip_prefix("name: \""));
    entries.filter_map(|entry| entry.strip_suffix("\","))
}

/// The head of a page: a title, and lines that begin in a given way.
fn missing_lines(path: &str, text: &str, lines: &[&str]) -> Vec<String> {
    let mut wrong = Vec::new();
    if !text.starts_with("# ") {
        wrong.push(format!("{path}:1: no title"));
    }
    let head = || text.lines().take(10);
    for start in lines {
        if !head().any(|line| line.len() > start.len() && line.starts_with(start)) {
            wrong.push(format!("{path}:2: no line '{}'", start.trim_end()));
        }
    }
    wrong
}

/// Verbs without a row in the table of the contributor's guide.
fn missing_verbs<'a>(guide: &str, verbs: impl Iterator<Item = &'a str>) -> Vec<String> {
    let has = |verb: &str| {
        guide.lines().any(|line| {
            let rest = line
                .strip_prefix("| `")
                .and_then(|line| line.strip_prefix(verb));
            rest.is_some_and(|rest| rest.starts_with([' ', '`']))
        })
    };
    verbs
        .filter(|verb| !has(verb))
        .map(|verb| format!("CONTRIBUTING.md: the table lacks the verb {verb}"))
        .collect()
}

/// Files that git knows or would add, relative to the root.
fn tracked(pattern: &str) -> Result<Vec<String>> {
    let mut command = Command::new("git");
    command.args(["ls-files", "--cached", "--others", "--exclude-standard"]);
    let output = command.arg(pattern).current_dir(root()).output();
    let output = output.context("git cannot be run")?;
    Ok(String::from_utf8(output.stdout)?
        .lines()
        .filter(|path| root().join(path).is_file())
        .map(str::to_string)
        .collect())
}

fn dead_links(path: &str, text: &str) -> Vec<String> {
    let folder = root().join(path);
    let folder = folder.parent().unwrap_or(Path::new(""));
    let mut wrong = Vec::new();
    for (number, line) in unfenced(text) {
        for target in line.split("](").skip(1) {
            let Some(target) = target.split(')').next().filter(|t| !t.contains("://")) else {
                continue;
            };
            let (file, heading) = target.split_once('#').unwrap_or((target, ""));
            let file = match file {
                "" => root().join(path),
                file => folder.join(file),
            };
            let found = match heading {
                "" => file.exists(),
                heading => fs::read_to_string(&file).is_ok_and(|t| anchors(&t).contains(heading)),
            };
            if !found {
                wrong.push(format!("{path}:{number}: {target}"));
            }
        }
    }
    wrong
}

/// Lines outside fenced code, numbered from one.
fn unfenced(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let mut fenced = false;
    (1..).zip(text.lines()).filter(move |(_, line)| {
        let fence = line.trim_start().starts_with("```");
        fenced ^= fence;
        !fenced && !fence
    })
}

/// Anchors of a page's headings, as GitHub makes them.
fn anchors(text: &str) -> BTreeSet<String> {
    unfenced(text)
        .filter_map(|(_, line)| line.strip_prefix('#'))
        .map(|heading| {
            let heading = heading.trim_start_matches('#').trim().to_lowercase();
            heading
                .chars()
                .filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_'))
                .map(|c| if c == ' ' { '-' } else { c })
                .collect()
        })
        .collect()
}

/// Citations of the form "PAGE, eq. 7" (or "7 to 9", or "2a and 5") whose page has no such
/// equation. A family, "eq. 10", is there when its first member, (10a), is. Where no page stands
/// beside the number, one of the pages that the file names, or the file itself, has to have it.
fn missing_equations(path: &str, text: &str) -> Vec<String> {
    let mut wrong = Vec::new();
    let named = pages(path, text);
    for (number, line) in (1..).zip(text.lines()) {
        for (at, mark) in line.match_indices("eq. ") {
            let before = line[..at].trim_end_matches([',', ' ', ')']);
            let beside = before.ends_with(".md").then(|| pages(path, before).pop());
            let candidates = match beside.flatten() {
                Some(page) => vec![page],
                None => named.clone(),
            };
            // Another book's equation: no page of ours is named in the file.
            if candidates.is_empty() {
                continue;
            }
            let bodies: Vec<String> = (candidates.iter())
                .map(|page| fs::read_to_string(root().join(page)).unwrap_or_default())
                .collect();
            for label in labels(&line[at + mark.len()..]) {
                let has = |name: &str| {
                    let forms = [format!("({name})"), format!("\\tag{{{name}}}")];
                    bodies
                        .iter()
                        .any(|body| forms.iter().any(|form| body.contains(form)))
                };
                if !has(label) && !has(&format!("{label}a")) {
                    let pages = candidates.join(" or ");
                    wrong.push(format!(
                        "{path}:{number}: {pages} has no equation ({label})"
                    ));
                }
            }
        }
    }
    wrong
}

/// The numbers at the start of a text: `7`, `7 to 9`, `2a and 5`.
fn labels(text: &str) -> Vec<&str> {
    let mut found = Vec::new();
    for word in text.split_whitespace() {
        let label = word.trim_end_matches(|c: char| !c.is_alphanumeric());
        if matches!(label, "to" | "and") {
            continue;
        }
        // T1: the equations of training are numbered so.
        let digits = label.strip_prefix('T').unwrap_or(label);
        if !digits.starts_with(|c: char| c.is_ascii_digit()) {
            break;
        }
        found.push(label);
        if label.len() < word.len() && !word.ends_with(',') {
            break;
        }
    }
    found
}

/// Pages that a text names, in its order, and the page itself: `docs/...` from the root, other
/// names from its folder.
fn pages(path: &str, text: &str) -> Vec<String> {
    let mut found: Vec<String> = Vec::new();
    if path.ends_with(".md") {
        found.push(path.to_string());
    }
    let folder = Path::new(path).parent().unwrap_or(Path::new(""));
    let part = |c: char| c.is_ascii_alphanumeric() || matches!(c, '/' | '.' | '-' | '_');
    for word in text
        .split(|c: char| !part(c))
        .map(|word| word.trim_end_matches('.'))
        .filter(|word| word.ends_with(".md"))
    {
        let page = match word.find("docs/") {
            Some(at) => word[at..].to_string(),
            None => plain(&folder.join(word)),
        };
        if root().join(&page).is_file() {
            found.retain(|known| *known != page);
            found.push(page);
        }
    }
    found
}

/// A path without `..`.
fn plain(path: &Path) -> String {
    let mut parts: Vec<&str> = Vec::new();
    for part in path.iter().filter_map(|part| part.to_str()) {
        match part {
            ".." => drop(parts.pop()),
            _ => parts.push(part),
        }
    }
    parts.join("/")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_equations() {
        assert_eq!(labels("7 to 9) and more"), ["7", "9"]);
        assert_eq!(labels("2a, 5 and T3b. The"), ["2a", "5", "T3b"]);
        assert_eq!(labels("x"), [""; 0]);
    }

    #[test]
    fn an_equation_is_looked_for_where_it_is_said_to_be() {
        let page = "docs/explanation/plant.md";
        // In two parts, or this file would cite them.
        let mark = "eq.";
        let text = format!("/// {page}, {mark} 1 and 9999.");
        assert_eq!(missing_equations("a.rs", &text).len(), 1);
        let text = format!("//! Forces of {page}.\n/// One ({mark} 1), none ({mark} 9999).");
        let wrong = missing_equations("a.rs", &text);
        assert!(
            wrong.len() == 1 && wrong[0].starts_with("a.rs:2: "),
            "{wrong:?}"
        );
    }

    #[test]
    fn a_page_is_named_from_its_folder() {
        let found = pages(
            "docs/reference/mjcf.md",
            "[p](../explanation/plant.md), eq. 1",
        );
        assert_eq!(
            found,
            ["docs/reference/mjcf.md", "docs/explanation/plant.md"]
        );
    }

    #[test]
    fn a_decision_has_a_head() {
        let lines = ["- Status: ", "- Date: "];
        let text = "# 1: A\n\n- Status: accepted\n- Date: 2026-01-01\n";
        assert_eq!(missing_lines("d", text, &lines), [""; 0]);
        assert_eq!(missing_lines("d", "A\n- Status: \n", &lines).len(), 3);
    }

    #[test]
    fn every_verb_has_a_row() {
        let guide = "| `test` | every test |\n| `bench SECTION` | speeds |\n";
        let missing = missing_verbs(guide, ["test", "bench", "tes"].into_iter());
        assert_eq!(missing, ["CONTRIBUTING.md: the table lacks the verb tes"]);
    }
}

//! References that a reader follows: links between pages, and the equations that code cites.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::process::Command;

use anyhow::{Context, Result, bail};

use xtask::process::root;

/// # Errors
/// A link of a page leads to no file or heading, a decision is not in the table, or code cites an equation
/// that its page does not have. Each by file and line.
pub fn check() -> Result<()> {
    let mut wrong = Vec::new();
    for path in tracked("*.md")? {
        wrong.extend(dead_links(&path)?);
    }
    for path in tracked("*.rs")? {
        wrong.extend(missing_equations(&path)?);
    }
    for folder in ["docs/decisions", "docs/lab"] {
        let index = format!("{folder}/README.md");
        let table = fs::read_to_string(root().join(&index))?;
        for path in tracked(&format!("{folder}/0*.md"))? {
            let link = path.rsplit('/').next().unwrap_or(&path);
            if !table.contains(&format!("({link})")) {
                wrong.push(format!("{index}: the table lacks {link}"));
            }
        }
    }
    if wrong.is_empty() {
        return Ok(());
    }
    bail!("references that lead nowhere:\n{}", wrong.join("\n"))
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

fn dead_links(path: &str) -> Result<Vec<String>> {
    let text = fs::read_to_string(root().join(path))?;
    let folder = root().join(path);
    let folder = folder.parent().unwrap_or(Path::new(""));
    let mut wrong = Vec::new();
    for (number, line) in prose(&text) {
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
    Ok(wrong)
}

/// Lines outside fenced code, numbered from one.
fn prose(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let mut fenced = false;
    (1..).zip(text.lines()).filter(move |(_, line)| {
        let fence = line.trim_start().starts_with("```");
        fenced ^= fence;
        !fenced && !fence
    })
}

/// Anchors of a page's headings, as GitHub makes them.
fn anchors(text: &str) -> BTreeSet<String> {
    prose(text)
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

/// Citations of the form "PAGE, eq. 7" (or "7 to 9", or "2a and 5") whose page has no such equation. A
/// family, "eq. 10", is there when its first member, (10a), is.
fn missing_equations(path: &str) -> Result<Vec<String>> {
    const EQUATION: &str = ".md, eq. ";
    let text = fs::read_to_string(root().join(path))?;
    let mut wrong = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        for (at, _) in line.match_indices(EQUATION) {
            let Some(start) = line[..at].rfind("docs/") else {
                continue;
            };
            let page = &line[start..at + ".md".len()];
            let cited = line[at + EQUATION.len()..].split_whitespace();
            let body = fs::read_to_string(root().join(page)).unwrap_or_default();
            for word in cited {
                let label = word.trim_end_matches(|c: char| !c.is_alphanumeric());
                if matches!(label, "to" | "and") {
                    continue;
                }
                if !label.starts_with(|c: char| c.is_ascii_digit()) {
                    break;
                }
                let has = |name: String| {
                    body.contains(&format!("({name})"))
                        || body.contains(&format!("\\tag{{{name}}}"))
                };
                if !has(label.to_string()) && !has(format!("{label}a")) {
                    wrong.push(format!("{path}:{number}: {page} has no equation ({label})"));
                }
                if label.len() < word.len() && !word.ends_with(',') {
                    break;
                }
            }
        }
    }
    Ok(wrong)
}

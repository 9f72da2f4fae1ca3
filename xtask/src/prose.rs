//! Measures of the project's prose: length of sentences and lines, first words of doc comments.
//!
//! Counted of pages: paragraphs and lists. Tables, code, headings, equations and quoted output are
//! not. `docs/lab` holds dated notes that stay as they were written; only its lines count. The
//! budget stands in `tests/budgets.toml` and falls.

use std::fmt::Write;
use std::fs;

use anyhow::{Context, Result};
use xtask::process::root;

/// A sentence with more words is a long one.
const LONG: usize = 40;
/// Columns of a line of prose or of a comment.
const COLUMNS: usize = 100;
/// First words that make a doc comment a relative clause instead of a name.
const OPENINGS: [&str; 6] = ["what", "who", "where", "which", "whether", "how"];
/// A list's entry of two words is no sentence.
const LEAST_WORDS: usize = 4;

/// Counts, and the places of the worst.
#[derive(Debug, Default)]
pub struct Counts {
    sentences: usize,
    words: usize,
    /// Sentences of more than [`LONG`] words, by place.
    long: Vec<String>,
    doc_comments: usize,
    /// Doc comments that open with one of [`OPENINGS`], by place.
    openings: Vec<String>,
    /// Lines of more than [`COLUMNS`] characters, by place.
    wide: Vec<String>,
}

/// A measure of [`Counts`] beside its name in the budget.
struct Measure {
    name: &'static str,
    value: f64,
    places: usize,
}

impl Counts {
    /// Takes a page into account.
    pub fn page(&mut self, path: &str, text: &str) {
        for paragraph in paragraphs(text) {
            if path.starts_with("docs/lab/") {
                break;
            }
            for sentence in sentences(&paragraph.text) {
                let words = sentence.split_whitespace().count();
                if words < LEAST_WORDS {
                    continue;
                }
                self.sentences += 1;
                self.words += words;
                if words > LONG {
                    let start: Vec<&str> = sentence.split_whitespace().take(8).collect();
                    let place = format!("{path}:{}", paragraph.line);
                    self.long
                        .push(format!("{place}: {words} words: {} ...", start.join(" ")));
                }
            }
        }
        for (number, line) in prose_lines(text) {
            self.line(path, number, line);
        }
    }

    /// Takes the comments of a source file into account.
    pub fn source(&mut self, path: &str, text: &str) {
        let mut before = "";
        let mut fenced = false;
        for (number, line) in (1..).zip(text.lines()) {
            let line_start = line.trim_start();
            let mark = ["///", "//!", "//"]
                .into_iter()
                .find(|mark| line_start.starts_with(mark) && !line_start.starts_with("////"))
                .unwrap_or_default();
            let body = line_start.strip_prefix(mark).unwrap_or_default().trim();
            if matches!(mark, "///" | "//!") && before != mark {
                self.doc_comments += 1;
                fenced = false;
                let word: String = (body.chars())
                    .take_while(|c| c.is_alphabetic())
                    .collect::<String>()
                    .to_lowercase();
                if OPENINGS.contains(&word.as_str()) {
                    self.openings.push(format!("{path}:{number}: {body}"));
                }
            }
            fenced ^= body.starts_with("```");
            if !mark.is_empty() && !fenced && !body.starts_with('|') {
                self.line(path, number, line);
            }
            before = mark;
        }
    }

    fn line(&mut self, path: &str, number: usize, line: &str) {
        let columns = line.chars().count();
        // A link or a path that is too long by itself cannot be wrapped.
        let longest = line
            .split_whitespace()
            .map(|word| word.chars().count())
            .max();
        if columns > COLUMNS && longest.unwrap_or(0) < COLUMNS - 20 {
            self.wide
                .push(format!("{path}:{number}: {columns} columns"));
        }
    }

    fn measures(&self) -> [Measure; 4] {
        let part = |some: usize, all: usize| some as f64 / all.max(1) as f64;
        [
            Measure {
                name: "sentence_words_mean",
                value: part(self.words, self.sentences),
                places: 1,
            },
            Measure {
                name: "sentences_over_40_words_percent",
                value: 100.0 * part(self.long.len(), self.sentences),
                places: 1,
            },
            Measure {
                name: "openings_percent",
                value: 100.0 * part(self.openings.len(), self.doc_comments),
                places: 1,
            },
            Measure {
                name: "lines_over_100_columns",
                value: self.wide.len() as f64,
                places: 0,
            },
        ]
    }

    /// Prints every measure beside its budget; the measures that are over it.
    ///
    /// # Errors
    /// The budget lacks a measure.
    pub fn against(&self, budgets: &str) -> Result<Vec<String>> {
        let mut over = Vec::new();
        for Measure {
            name,
            value,
            places,
        } in self.measures()
        {
            let budget = budget(budgets, "prose", name)
                .with_context(|| format!("tests/budgets.toml has no [prose] {name}"))?;
            let scale = 10_f64.powi(i32::try_from(places).unwrap_or(0));
            let rounded = (value * scale).round() / scale;
            let mut line = format!("{name} {rounded:.places$}, budget {budget:.places$}");
            if rounded > budget {
                over.push(format!(
                    "tests/budgets.toml: {line}; --list names the places"
                ));
            } else if rounded < budget {
                let _ = write!(line, ": lower the budget to {rounded:.places$}");
            }
            println!("{line}");
        }
        Ok(over)
    }

    /// Every place that counts against a budget, a line each.
    pub fn list(&self) {
        for place in self.long.iter().chain(&self.openings).chain(&self.wide) {
            println!("{place}");
        }
    }
}

/// The budget's file.
///
/// # Errors
/// It cannot be read.
pub fn budgets() -> Result<String> {
    let path = root().join("tests/budgets.toml");
    fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()))
}

/// A number of a table of the budget's file.
pub fn budget(text: &str, table: &str, name: &str) -> Option<f64> {
    let table = text.split(&format!("[{table}]")).nth(1)?;
    let lines = table.lines().take_while(|line| !line.starts_with('['));
    let mut entries = lines.filter_map(|line| line.split_once('='));
    let (_, value) = entries.find(|(key, _)| key.trim() == name)?;
    value.trim().replace('_', "").parse().ok()
}

struct Paragraph {
    line: usize,
    text: String,
}

/// Lines that hold prose: no fenced or indented code, table, heading, equation, markup or image.
fn prose_lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let mut fenced = false;
    let mut equation = false;
    let mut after_blank = true;
    let mut in_list = false;
    (1..).zip(text.lines()).filter(move |(_, line)| {
        let start = line.trim_start();
        let indent = line.len() - start.len();
        if start.starts_with("```") {
            fenced = !fenced;
            return false;
        }
        // `$$` alone opens and closes; `$$ ... $$` on a line does both.
        if start.starts_with("$$") {
            equation ^= start.matches("$$").count() == 1;
            return false;
        }
        if fenced || equation {
            equation &= !start.ends_with("$$");
            return false;
        }
        if start.is_empty() {
            after_blank = true;
            return true;
        }
        let code = indent >= 4 && after_blank && !in_list;
        if !code {
            after_blank = false;
            in_list = item(start) || (in_list && indent > 0);
        }
        !(code
            || ["#", "|", "<", "!["]
                .iter()
                .any(|mark| start.starts_with(mark)))
    })
}

/// A list's entry begins here.
fn item(line: &str) -> bool {
    let digits = line.bytes().take_while(u8::is_ascii_digit).count();
    line.starts_with("- ")
        || line.starts_with("* ")
        || (digits > 0 && line[digits..].starts_with(". "))
}

fn paragraphs(text: &str) -> Vec<Paragraph> {
    let mut found: Vec<Paragraph> = Vec::new();
    let mut next = 0;
    let mut open = false;
    for (number, line) in prose_lines(text) {
        let line_text = line.trim_start_matches(['>', ' ']).trim_end();
        // A line that was left out, a blank or a new entry ends what came before.
        open &= number == next && !line_text.is_empty() && !item(line_text);
        next = number + 1;
        if line_text.is_empty() {
            continue;
        }
        if !open {
            found.push(Paragraph {
                line: number,
                text: String::new(),
            });
            open = true;
        }
        if let Some(paragraph) = found.last_mut() {
            let mark = if item(line_text) {
                line_text.find(' ').unwrap_or(0)
            } else {
                0
            };
            paragraph.text += line_text[mark..].trim_start();
            paragraph.text.push(' ');
        }
    }
    found
}

/// Sentences of a paragraph; code, mathematics and the target of a link count as part of one word.
fn sentences(paragraph: &str) -> Vec<String> {
    let plain = plain(paragraph);
    let mut found = vec![String::new()];
    let words: Vec<&str> = plain.split_whitespace().collect();
    for (at, word) in words.iter().enumerate() {
        let Some(sentence) = found.last_mut() else {
            break;
        };
        sentence.push_str(word);
        sentence.push(' ');
        let ends = word
            .trim_end_matches([')', '"', '*', '_', '\'', ']'])
            .ends_with(['.', '!', '?']);
        let next = words.get(at + 1).map_or("", |next| {
            next.trim_start_matches(['(', '"', '*', '_', '['])
        });
        let begins = next.starts_with(|c: char| c.is_uppercase() || c == CODE);
        if ends && (begins || next.is_empty()) {
            found.push(String::new());
        }
    }
    found.retain(|sentence| !sentence.trim().is_empty());
    found
}

/// Stands for a span of code or mathematics.
const CODE: char = '\u{1}';

fn plain(text: &str) -> String {
    let mut plain = String::new();
    let mut rest = text;
    while let Some(c) = rest.chars().next() {
        let span = |mark: char| rest[1..].find(mark).map(|end| end + 2);
        match c {
            '`' | '$' => {
                if let Some(length) = span(c) {
                    plain.push(CODE);
                    rest = &rest[length..];
                    continue;
                }
            }
            ']' if rest.starts_with("](") => {
                if let Some(end) = rest.find(')') {
                    rest = &rest[end + 1..];
                    continue;
                }
            }
            _ => {}
        }
        plain.push(c);
        rest = &rest[c.len_utf8()..];
    }
    plain
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_code_headings_and_equations_are_no_prose() {
        let page = "# Of What Is This a Title\n\nOne two three four.\n\n    x = code (1)\n\n| a | table that goes on |\n\n\
                    ```\ncode of five words here\n```\n\n$$\na = b + c + d\n$$\n\n- An entry of five words.\n  And a second one here.\n";
        let mut counts = Counts::default();
        counts.page("docs/x.md", page);
        assert_eq!((counts.sentences, counts.words), (3, 4 + 5 + 5));
    }

    #[test]
    fn a_sentence_ends_before_a_capital() {
        let text = "See eq. 4 and fig. 2 (`a.b`). The next one is `code`, in 1.5 words? Yes it is. `sinew fit` does it.";
        let lengths: Vec<usize> = (sentences(text).iter())
            .map(|sentence| sentence.split_whitespace().count())
            .collect();
        assert_eq!(lengths, [7, 8, 3, 3]);
    }

    #[test]
    fn a_link_counts_as_its_text() {
        assert_eq!(plain("a [b c](d/e.md) f"), "a [b c f");
    }

    #[test]
    fn long_sentences_and_lines_are_found() {
        let mut counts = Counts::default();
        counts.page("docs/x.md", &("word ".repeat(41) + "end."));
        assert_eq!((counts.long.len(), counts.wide.len()), (1, 1));
        counts.page("docs/lab/x.md", &("word ".repeat(41) + "end."));
        assert_eq!((counts.long.len(), counts.wide.len()), (1, 2));
        let address = format!("see [x]({})", "x".repeat(120));
        counts.page("docs/x.md", &address);
        assert_eq!(counts.wide.len(), 2);
    }

    #[test]
    fn a_doc_comment_is_judged_by_its_first_word() {
        let mut counts = Counts::default();
        let source = "//! How it is.\n\n/// Whatever it is.\n/// What goes on.\nfn f() {}\n// Where not a doc.\n/// Gains.\nstruct G;\n";
        counts.source("a.rs", source);
        assert_eq!((counts.doc_comments, counts.openings.len()), (3, 1));
    }

    #[test]
    fn over_the_budget_is_an_error() {
        let mut counts = Counts::default();
        counts.source("a.rs", "/// How.\n\n/// That.");
        let budgets = |openings: &str| {
            format!(
                "[a]\nx = 1\n[prose]\nsentence_words_mean = 18.0\nsentences_over_40_words_percent = 3\n\
                 openings_percent = {openings}\nlines_over_100_columns = 1_000\n[b]\n"
            )
        };
        assert_eq!(counts.against(&budgets("50.0")).expect("complete").len(), 0);
        assert_eq!(counts.against(&budgets("49.9")).expect("complete").len(), 1);
        assert!(counts.against("[prose]\n").is_err());
    }
}

//! Pages of docs/ at 100 columns.

/// Longest line.
const COLUMNS: usize = 100;

/// A page whose paragraphs and list items are filled to 100 columns; tables, headings and empty
/// lines stay as they are.
pub fn wrapped(page: &str) -> String {
    let mut text = String::new();
    let mut open: Option<String> = None;
    for line in page.lines() {
        let item = line.starts_with("- ");
        let alone = line.is_empty() || line.starts_with('|') || line.starts_with('#');
        if (alone || item)
            && let Some(paragraph) = open.take()
        {
            fill(&mut text, &paragraph);
        }
        if alone {
            text.push_str(line);
            text.push('\n');
            continue;
        }
        open = Some(match open {
            Some(paragraph) => format!("{paragraph} {}", line.trim()),
            None => line.to_owned(),
        });
    }
    if let Some(paragraph) = open {
        fill(&mut text, &paragraph);
    }
    text
}

/// Further lines of a list item begin below its first word.
fn fill(text: &mut String, paragraph: &str) {
    let indent = if paragraph.starts_with("- ") {
        "  "
    } else {
        ""
    };
    let mut line = String::new();
    for word in paragraph.split_whitespace() {
        let fits = line.chars().count() + 1 + word.chars().count() <= COLUMNS;
        if line.is_empty() || line == indent {
            line.push_str(word);
        } else if fits {
            line.push(' ');
            line.push_str(word);
        } else {
            text.push_str(&line);
            text.push('\n');
            line = format!("{indent}{word}");
        }
    }
    text.push_str(&line);
    text.push('\n');
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paragraphs_and_items_are_filled_and_tables_are_left() {
        let long = ["word"; 30].join(" ");
        let table = format!("| {long} {long} |");
        let page = format!("# Title\n\n{long}\nand on\n\n{table}\n\n- {long}\n- two\n");
        let filled = wrapped(&page);
        let prose = || filled.lines().filter(|line| !line.starts_with('|'));
        assert!(prose().all(|line| line.len() <= COLUMNS), "{filled}");
        assert!(filled.contains(&table));
        assert!(
            filled.contains("\n- word word")
                && filled.contains("\n  word")
                && filled.ends_with("\n- two\n")
        );
        assert_eq!(
            filled.split_whitespace().collect::<Vec<_>>(),
            page.split_whitespace().collect::<Vec<_>>()
        );
        assert_eq!(wrapped(&filled), filled);
    }
}

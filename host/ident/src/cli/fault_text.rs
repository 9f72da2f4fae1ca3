//! Faults of recordings, for a person.

use super::colour::{self, Stream};
use crate::check::Check;

/// Prints the faults on standard error.
pub(super) fn print(checks: &[Check]) {
    eprint!("{}", colour::shown(&text(checks), Stream::Error));
}

/// The faults for a person, in lines of 80 columns.
pub(super) fn text(checks: &[Check]) -> String {
    let mut text = String::new();
    for check in checks {
        let grade = if check.certain { "error" } else { "warning" };
        let (file, line, kind) = (&check.file, check.line, check.kind);
        text += &format!("{file}:{line}: {grade}: {kind}\n");
        text += &wrapped(&check.sentence, "  ", "  ");
        text += &wrapped(&check.remedy, "  help: ", "        ");
    }
    text
}

/// Words in lines of at most 80 columns.
pub fn wrapped(words: &str, first: &str, further: &str) -> String {
    let (mut text, mut line) = (String::new(), first.to_owned());
    let mut empty = true;
    for word in words.split_whitespace() {
        let width = line.chars().count() + word.chars().count();
        if !empty && width >= 80 {
            text += line.trim_end();
            text.push('\n');
            line = further.to_owned();
        } else if !empty {
            line.push(' ');
        }
        line += word;
        empty = false;
    }
    text + &line + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_have_eighty_columns_at_most() {
        let text = wrapped(&"twelve chars ".repeat(20), "  help: ", "        ");
        assert!(text.lines().count() > 3);
        assert!(
            text.lines().all(|line| line.chars().count() <= 80),
            "{text}"
        );
        assert!(text.lines().skip(1).all(|line| line.starts_with("        twelve")
            || line.starts_with("        chars")));
    }
}

//! Colour of lines for a person: labels and verdict words, where a terminal shows them.
//!
//! The words themselves are the same without colour: what goes to a file or a pipe has no escape,
//! and neither has a terminal with `NO_COLOR`.

use std::borrow::Cow;
use std::ffi::OsString;
use std::io::{stderr, stdout};

use anstream::AutoStream;
use anstyle::{AnsiColor, Style};
use clap::{Args, ColorChoice, ValueEnum};

/// The flag `--color`, which every verb has.
#[derive(Args, Clone, Copy, Debug)]
pub struct Colour {
    /// Colour: auto, always or never; NO_COLOR is never.
    #[arg(
        long,
        global = true,
        value_name = "WHEN",
        value_enum,
        default_value = "auto",
        hide_default_value = true,
        hide_possible_values = true
    )]
    pub color: ColorChoice,
}

/// Standard stream of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stream {
    /// Standard output.
    Output,
    /// Standard error.
    Error,
}

/// Red: what went wrong.
const BAD: Style = AnsiColor::Red.on_default().bold();
/// Yellow: what may be wrong.
const DOUBT: Style = AnsiColor::Yellow.on_default().bold();
/// Green: what is right.
const GOOD: Style = AnsiColor::Green.on_default().bold();
/// Cyan: what to do.
const ADVICE: Style = AnsiColor::Cyan.on_default().bold();

/// Labels at the start of a line, or after its place (`A.csv:12: error: `).
const LABELS: [(&str, Style); 4] = [
    ("error:", BAD),
    ("warning:", DOUBT),
    ("help:", ADVICE),
    ("next:", ADVICE),
];

/// Words that are a verdict; of those in a line the first of this list is coloured.
const VERDICTS: [(&str, Style); 10] = [
    ("does not fit:", BAD),
    ("too slow:", BAD),
    ("fits:", GOOD),
    ("OTHER bits", BAD),
    ("THIS COMPUTER AND THE CHIP DIFFER", BAD),
    ("the same bits", GOOD),
    ("Missing physics:", DOUBT),
    ("no fault found", GOOD),
    ("agrees with its framework", GOOD),
    ("differs from its framework", BAD),
];

/// The choice among a program's arguments, before they are parsed: usage errors have colour too.
/// A word that is no choice is left to the parser.
pub fn asked(arguments: impl IntoIterator<Item = OsString>) -> ColorChoice {
    let mut found = ColorChoice::Auto;
    let mut arguments = arguments.into_iter();
    while let Some(argument) = arguments.next() {
        let Some(text) = argument.to_str() else {
            continue;
        };
        let value = match text.strip_prefix("--color") {
            Some("") => arguments.next().and_then(|word| word.into_string().ok()),
            Some(rest) => rest.strip_prefix('=').map(str::to_owned),
            None if text == "--" => break,
            None => None,
        };
        let choice = value.and_then(|word| ColorChoice::from_str(&word, false).ok());
        found = choice.unwrap_or(found);
    }
    found
}

/// Makes a choice hold for every line of the program.
pub fn choose(choice: ColorChoice) {
    let choice = match choice {
        ColorChoice::Auto => anstream::ColorChoice::Auto,
        ColorChoice::Always => anstream::ColorChoice::Always,
        ColorChoice::Never => anstream::ColorChoice::Never,
    };
    choice.write_global();
}

/// The text as the stream shows it.
pub fn shown(text: &str, on: Stream) -> Cow<'_, str> {
    let choice = match on {
        Stream::Output => AutoStream::choice(&stdout()),
        Stream::Error => AutoStream::choice(&stderr()),
    };
    match choice {
        anstream::ColorChoice::Never => Cow::Borrowed(text),
        _ => Cow::Owned(coloured(text)),
    }
}

/// Prints lines on standard error.
pub fn on_error(text: impl std::fmt::Display) {
    eprintln!("{}", shown(&text.to_string(), Stream::Error));
}

/// The text with colour in every line.
fn coloured(text: &str) -> String {
    let lines = text.split('\n').map(|line| {
        let labels = LABELS.iter().filter_map(|(word, style)| {
            let at = line.find(word)?;
            let before = line.get(..at)?;
            let begins = before.trim().is_empty() || (before.ends_with(": "));
            begins.then_some((at, *word, *style))
        });
        let verdicts = VERDICTS.iter().filter_map(|(word, style)| {
            let at = line.find(word)?;
            let is_word = line
                .get(..at)?
                .chars()
                .last()
                .is_none_or(|c| !c.is_alphanumeric());
            is_word.then_some((at, *word, *style))
        });
        match labels.chain(verdicts).next() {
            Some((at, word, style)) => {
                let (before, rest) = line.split_at(at);
                let after = rest.get(word.len()..).unwrap_or_default();
                format!("{before}{style}{word}{style:#}{after}")
            }
            None => line.to_owned(),
        }
    });
    lines.collect::<Vec<_>>().join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn labels_and_verdicts_are_coloured_and_nothing_else() {
        let red = |word: &str| format!("\u{1b}[1m\u{1b}[31m{word}\u{1b}[0m");
        assert_eq!(
            coloured("error: no rig"),
            format!("{} no rig", red("error:"))
        );
        assert_eq!(
            coloured("A.csv:12: error: hole"),
            format!("A.csv:12: {} hole", red("error:"))
        );
        assert_eq!(
            coloured("qemu  does not fit: 3 B"),
            format!("qemu  {} 3 B", red("does not fit:"))
        );
        assert_eq!(coloured("a\n  next: b\n").matches("\u{1b}[0m").count(), 1);
        for plain in [
            "",
            "the largest error: 3",
            "benefits: 3",
            "free-run error 3 mm",
        ] {
            assert_eq!(coloured(plain), plain);
        }
    }

    #[test]
    fn the_choice_is_read_before_the_arguments_are_parsed() {
        let of = |line: &str| asked(line.split(' ').map(OsString::from));
        assert_eq!(of("sinew fit --color never x"), ColorChoice::Never);
        assert_eq!(of("sinew --color=always fit"), ColorChoice::Always);
        assert_eq!(of("sinew fit --color blue"), ColorChoice::Auto);
        assert_eq!(of("sinew fit -- --color=always"), ColorChoice::Auto);
        assert_eq!(of("sinew fit --color"), ColorChoice::Auto);
    }
}

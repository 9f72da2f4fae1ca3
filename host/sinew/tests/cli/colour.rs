//! Colour: on a terminal and where it is asked for, never in a file or a pipe.

use std::fs::File;
use std::io::Read;
use std::process::Stdio;

use nix::pty::openpty;

use crate::desk::Desk;

const ESCAPE: char = '\u{1b}';
const RED: &str = "\u{1b}[1m\u{1b}[31merror:\u{1b}[0m";

/// Standard error of a refusal, and standard output of a verb that says what comes next.
fn piped(desk: &Desk, flags: &str, no_color: bool) -> [String; 2] {
    let text = |line: String| {
        let mut command = desk.command(&line);
        command.env_remove("NO_COLOR").env("TERM", "xterm-256color");
        if no_color {
            command.env("NO_COLOR", "1");
        }
        let output = command.output().expect("the program starts");
        [output.stderr, output.stdout].map(|bytes| String::from_utf8(bytes).expect("words"))
    };
    let [refused, _] = text(format!("explain no_such_effect {flags}"));
    let [_, said] = text(format!("explain {flags}"));
    [refused, said]
}

/// Standard error of a refusal on a terminal.
fn on_a_terminal(desk: &Desk, flags: &str, no_color: bool) -> String {
    let pty = openpty(None, None).expect("a pseudo-terminal");
    let mut command = desk.command(&format!("explain no_such_effect {flags}"));
    command.env_remove("NO_COLOR").env("TERM", "xterm-256color");
    if no_color {
        command.env("NO_COLOR", "1");
    }
    command.stdin(Stdio::null()).stdout(Stdio::null());
    let mut child = command.stderr(pty.slave).spawn().expect("it starts");
    // The command holds an end of the terminal of its own.
    drop(command);
    let mut bytes = Vec::new();
    // A terminal whose other end is gone gives an error in the place of an end.
    let _ = File::from(pty.master).read_to_end(&mut bytes);
    child.wait().expect("it ends");
    String::from_utf8(bytes).expect("words")
}

#[test]
fn a_pipe_gets_the_same_bytes_without_an_escape() {
    let desk = Desk::new();
    let plain = piped(&desk, "", false);
    assert!(plain[0].starts_with("error: "), "{plain:?}");
    assert!(plain[1].contains("\nnext: sinew explain NAME"), "{plain:?}");
    assert!(!plain.concat().contains(ESCAPE), "{plain:?}");
    assert_eq!(piped(&desk, "--color never", false), plain);
    assert_eq!(piped(&desk, "--color auto", true), plain);

    let always = piped(&desk, "--color always", false);
    assert!(always[0].starts_with(RED), "{always:?}");
    assert!(always[1].contains("next:\u{1b}[0m sinew"), "{always:?}");
    // The words are the same.
    let bare = |text: &str| {
        let mut parts = text.split(ESCAPE);
        let first = parts.next().unwrap_or_default().to_owned();
        let rest = parts.map(|part| part.split_once('m').map_or(part, |(_, rest)| rest));
        first + &rest.collect::<String>()
    };
    assert_eq!(always.map(|text| bare(&text)), plain);
    // A flag is a person's latest word.
    assert!(piped(&desk, "--color always", true)[0].starts_with(RED));
}

#[test]
fn a_terminal_has_colour_unless_no_color_forbids_it() {
    let desk = Desk::new();
    let shown = on_a_terminal(&desk, "", false);
    assert!(shown.starts_with(RED), "{shown:?}");
    for (flags, no_color) in [("", true), ("--color never", false)] {
        let shown = on_a_terminal(&desk, flags, no_color);
        assert!(shown.starts_with("error: "), "{shown:?}");
        assert!(!shown.contains(ESCAPE), "{shown:?}");
    }
}

#[test]
fn usage_errors_have_the_colour_that_was_asked_for() {
    let desk = Desk::new();
    let words = |line: &str| {
        let output = desk.sinew(line);
        assert_eq!(output.status.code(), Some(2));
        String::from_utf8(output.stderr).expect("words")
    };
    assert!(words("fit --color always --nonsense").contains(ESCAPE));
    assert!(!words("fit --nonsense").contains(ESCAPE));
    assert!(words("fit --color blue").contains("always"));
}

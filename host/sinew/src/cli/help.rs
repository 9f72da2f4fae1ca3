//! Help of the program: verbs in groups, and all of it as Markdown for `docs/reference/cli.md`.

use std::fmt::Write;

use clap::{Command, CommandFactory};

use super::Program;

/// Groups of verbs in the order of a project; every visible verb is in one.
const GROUPS: &[(&str, &[&str])] = &[
    (
        "Identify",
        &[
            "convert", "new", "check", "simulate", "settle", "excite", "fit", "learn", "fleet",
            "diagnose", "explain", "mjcf",
        ],
    ),
    ("Train", &["train", "calibrate"]),
    (
        "Control",
        &["build", "plan", "tune", "compare", "faults", "pil"],
    ),
    (
        "Board",
        &[
            "wire",
            "emit",
            "size",
            "flash",
            "commission",
            "record",
            "monitor",
            "adopt",
        ],
    ),
    ("Networks", &["import", "verify"]),
    ("Shell", &["completions"]),
];

/// The command line with its verbs in groups.
pub(super) fn command() -> Command {
    let program = Program::command();
    let list = groups(&program);
    program.help_template(format!(
        "{{about-with-newline}}\n{{usage-heading}} {{usage}}\n{list}\nOptions:\n{{options}}\n\n\
         `sinew <VERB> --help` explains a verb.\n"
    ))
}

/// The groups with one line a verb.
fn groups(program: &Command) -> String {
    let named = GROUPS.iter().flat_map(|(_, names)| *names);
    let width = named.map(|name| name.len()).max();
    let width = width.unwrap_or(0);
    let mut text = String::new();
    // Writing to a String cannot fail, here and below.
    for (group, names) in GROUPS {
        let _ = writeln!(text, "\n{group}:");
        let named = names
            .iter()
            .filter_map(|name| program.find_subcommand(name));
        for verb in named {
            let about = verb.get_about().map(ToString::to_string);
            let about = about.unwrap_or_default();
            let _ = writeln!(text, "  {:<width$}  {about}", verb.get_name());
        }
    }
    text
}

/// The help of every verb as Markdown.
pub(super) fn reference() -> String {
    let mut program = command();
    program.build();
    let mut text = String::from(
        "# Command line\n\nGenerated from the program: `sinew cli-reference`. Do not edit.\n",
    );
    let _ = writeln!(text, "\n```text\n{}```", help(&mut program));
    for (group, names) in GROUPS {
        let _ = writeln!(text, "\n## {group}");
        for name in *names {
            let Some(verb) = program.find_subcommand_mut(name) else {
                continue;
            };
            let _ = writeln!(text, "\n### `sinew {name}`\n\n```text\n{}```", help(verb));
        }
    }
    text
}

/// The long help as plain text, without blanks at the ends of lines.
fn help(command: &mut Command) -> String {
    let mut wide = command
        .clone()
        .mut_args(|argument| argument.hide_env_values(true));
    let text = wide.render_long_help().to_string();
    let lines = text.trim_end().lines().map(str::trim_end);
    lines.map(|line| format!("{line}\n")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_verb_is_in_exactly_one_group() {
        let program = Program::command();
        let mut grouped: Vec<&str> = GROUPS
            .iter()
            .flat_map(|(_, names)| *names)
            .copied()
            .collect();
        grouped.sort_unstable();
        let visible = program.get_subcommands().filter(|verb| !verb.is_hide_set());
        let mut verbs: Vec<&str> = visible.map(Command::get_name).collect();
        verbs.sort_unstable();
        assert_eq!(grouped, verbs);
    }

    #[test]
    fn the_short_help_of_a_flag_is_one_line() {
        const LONGEST: usize = 92;
        for verb in Program::command().get_subcommands() {
            for argument in verb.get_arguments() {
                let help = argument.get_help().map(ToString::to_string);
                let help = help.unwrap_or_default();
                let name = (verb.get_name(), argument.get_id());
                assert!(
                    help.len() <= LONGEST && !help.contains('\n'),
                    "{name:?}: {help}"
                );
            }
        }
    }

    #[test]
    fn the_help_shows_the_groups() {
        let text = command().render_help().to_string();
        for (group, names) in GROUPS {
            assert!(text.contains(&format!("\n{group}:\n")), "{text}");
            for name in *names {
                assert!(text.contains(&format!("\n  {name} ")), "{name}: {text}");
            }
        }
        assert!(reference().contains("### `sinew diagnose`"));
    }
}

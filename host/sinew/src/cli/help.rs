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
            "share", "diagnose", "explain", "mjcf",
        ],
    ),
    ("Train", &["train", "calibrate"]),
    (
        "Control",
        &[
            "build", "plan", "imitate", "tune", "prefer", "compare", "faults", "pil",
        ],
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

/// Examples of the verbs whose own help has none.
const EXAMPLES: &[(&str, &[&str])] = &[
    (
        "convert",
        &[
            "sinew convert run.mcap --list",
            "sinew convert log.mat --column q_rad=log/q --out A.csv",
        ],
    ),
    (
        "new",
        &["sinew new A.csv", "sinew new --mjcf arm.xml --out arm.toml"],
    ),
    (
        "check",
        &["sinew check A.csv B.csv --rig rig.toml --exit-code"],
    ),
    (
        "simulate",
        &["sinew simulate rig.toml --input A.csv --out sim.csv --report sim.html"],
    ),
    (
        "excite",
        &["sinew excite rig.toml --seconds 10 --out excitation.csv"],
    ),
    (
        "plan",
        &["sinew plan rig.toml --goal 'encoder = 0.05 at 0.6 s' --out plan.csv"],
    ),
    (
        "imitate",
        &["sinew imitate rig.toml --demo demo.csv --out policy"],
    ),
    (
        "fit",
        &["sinew fit rig.toml --fit A.csv --test B.csv --out fitted.toml"],
    ),
    (
        "fleet",
        &["sinew fleet rig.toml --fit a.csv --device b=b.csv --device c=c.csv --out fleet.toml"],
    ),
    (
        "diagnose",
        &[
            "sinew diagnose rig.toml --fit A.csv --test B.csv --report report.html",
            "sinew diagnose rig.toml --fit A.csv --json - --quiet --exit-code",
        ],
    ),
    (
        "explain",
        &["sinew explain coulomb_friction", "sinew explain LinkLost"],
    ),
    ("mjcf", &["sinew mjcf fitted.toml --out rig.xml"]),
    (
        "train",
        &["sinew train rig.toml --fit A.csv --test B.csv --out model"],
    ),
    (
        "build",
        &["sinew build rig.toml --fit A.csv --test B.csv --board qemu --out out --diagnose"],
    ),
    (
        "tune",
        &["sinew tune rig.toml model --fit A.csv --out tuned.toml --model-out tuned"],
    ),
    (
        "compare",
        &["sinew compare rig.toml tuned --fit A.csv --out loop --report comparison.html"],
    ),
    (
        "pil",
        &["sinew pil rig.toml tuned --fit A.csv --board qemu --out loop"],
    ),
    (
        "wire",
        &[
            "sinew wire rig.toml --board stm32f446",
            "sinew wire rig.toml --check rig.wiring.toml",
        ],
    ),
    (
        "emit",
        &[
            "sinew emit model --out firmware",
            "sinew emit net.onnx --out crate --weights int8",
        ],
    ),
    ("size", &["sinew size net.onnx --board stm32f446"]),
    (
        "flash",
        &[
            "sinew flash --list",
            "sinew flash --board stm32f446 --model model",
        ],
    ),
    (
        "record",
        &["sinew record --port /dev/ttyACM0 --model model --input excitation.csv --out A.csv"],
    ),
    (
        "import",
        &[
            "sinew import net.keras",
            "sinew import net.onnx --rig rig.toml --fit A.csv --out model",
        ],
    ),
    (
        "verify",
        &["sinew verify net.keras --python .venv/bin/python"],
    ),
    ("completions", &["sinew completions bash"]),
];

/// Short names of flags that mean the same in every verb.
const SHORT: &[(&str, char)] = &[("out", 'o'), ("quiet", 'q')];

/// Verbs that fit nothing: their recordings say how far signals go and how noisy they are.
const RANGES: [&str; 4] = ["tune", "compare", "faults", "pil"];

/// The verbs with their examples and short flags.
fn program() -> Command {
    let mut program = Program::command();
    for (name, lines) in EXAMPLES {
        let title = if lines.len() == 1 {
            "Example"
        } else {
            "Examples"
        };
        let text = format!("{title}:\n  {}", lines.join("\n  "));
        program = program.mut_subcommand(name, |verb| verb.after_long_help(text));
    }
    for name in RANGES {
        program = program.mut_subcommand(name, |verb| {
            verb.mut_arg("fit", |fit| {
                fit.help(
                    "A recording (CSV) with the ranges and the noise of signals; may be repeated",
                )
            })
            .mut_arg("test", |test| {
                test.help("A recording whose motion the loop follows; may be repeated")
            })
        });
    }
    let verbs: Vec<String> = (program.get_subcommands())
        .map(|verb| verb.get_name().to_owned())
        .collect();
    for name in verbs {
        program = program.mut_subcommand(name, |verb| {
            verb.mut_args(|argument| {
                let known = SHORT.iter().find(|(id, _)| argument.get_id() == id);
                match known {
                    Some((_, letter)) => argument.short(*letter),
                    None => argument,
                }
            })
        });
    }
    program
}

/// The command line with its verbs in groups.
pub(super) fn command() -> Command {
    let program = program();
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

    /// Words of a line as a shell splits them, for quotes of one kind, without its comment.
    fn words(line: &str) -> Vec<String> {
        let line = line.split(" #").next().unwrap_or_default();
        let mut words = Vec::new();
        for (k, part) in line.split('\'').enumerate() {
            match k % 2 {
                0 => words.extend(part.split_whitespace().map(str::to_owned)),
                _ => words.push(part.to_owned()),
            }
        }
        words
    }

    #[test]
    fn every_verb_has_examples_that_its_own_flags_allow() {
        let program = command();
        for verb in program.get_subcommands().filter(|verb| !verb.is_hide_set()) {
            let text = verb.get_after_long_help().map(ToString::to_string);
            let text = text.unwrap_or_default();
            let start = format!("sinew {} ", verb.get_name());
            assert!(text.contains(&start), "{} has no example", verb.get_name());
            for line in text
                .lines()
                .filter(|line| line.trim().starts_with("sinew "))
            {
                let parsed = command().try_get_matches_from(words(line));
                assert!(parsed.is_ok(), "{line}\n{}", parsed.unwrap_err());
            }
        }
    }

    #[test]
    fn short_flags_mean_the_same_in_every_verb() {
        let program = command();
        for verb in program.get_subcommands() {
            for argument in verb.get_arguments() {
                let short = argument.get_short().filter(|letter| *letter != 'h');
                let known = SHORT.iter().find(|(id, _)| argument.get_id() == id);
                assert_eq!(
                    short,
                    known.map(|(_, letter)| *letter),
                    "{} {}",
                    verb.get_name(),
                    argument.get_id()
                );
            }
        }
    }

    #[test]
    fn flags_that_verbs_share_mean_the_same() {
        let program = Program::command();
        let mut seen = std::collections::BTreeMap::new();
        for verb in program.get_subcommands().filter(|verb| !verb.is_hide_set()) {
            for argument in verb.get_arguments() {
                let id = argument.get_id().as_str();
                let help = argument.get_help().map(ToString::to_string);
                let help = help.unwrap_or_default();
                let long = argument.get_long_help().map(ToString::to_string);
                let all = long.unwrap_or_else(|| help.clone());
                let is_as_elsewhere = match id {
                    "quiet" => help == "Print warnings and errors alone",
                    "json" => {
                        help.starts_with("File for ") && all.contains("`-` is standard output")
                    }
                    "report" => help.starts_with("File for a page: "),
                    "out" => {
                        help.starts_with("File for ")
                            || help.starts_with("Folder ")
                            || help.starts_with("File of ")
                    }
                    _ => continue,
                };
                assert!(is_as_elsewhere, "{} --{id}: {help}", verb.get_name());
                *seen.entry(id.to_owned()).or_insert(0) += 1;
            }
        }
        assert!(seen["quiet"] > 20 && seen["json"] > 25, "{seen:?}");
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

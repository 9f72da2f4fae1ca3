//! `sinew completions` and `sinew man-pages`: what a shell and `man` know of the command line.

use std::path::PathBuf;

use clap::{Args, Command};
use clap_complete::Shell;
use sinew_ident::error::{Error, Result};

use super::help;

/// Arguments of `sinew completions`.
#[derive(Args)]
pub struct Arguments {
    /// Shell that completes the command line.
    #[arg(value_enum)]
    shell: Shell,
}

/// Arguments of `sinew man-pages`.
#[derive(Args)]
pub struct ManArguments {
    /// Folder for `sinew.1` and a page a verb.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

/// Prints the completion script of a shell.
pub fn run(arguments: &Arguments) {
    print!("{}", script(arguments.shell));
}

/// The completion script of a shell.
fn script(shell: Shell) -> String {
    let mut text = Vec::new();
    clap_complete::generate(shell, &mut help::command(), "sinew", &mut text);
    String::from_utf8_lossy(&text).into_owned()
}

/// Writes a man page of the program and of every visible verb.
///
/// # Errors
/// `Write` where the folder cannot be written.
pub fn man_pages(arguments: &ManArguments) -> Result<()> {
    for (name, page) in pages()? {
        sinew_files::write(arguments.out.join(name), page)?;
    }
    Ok(())
}

/// Names and contents of the man pages.
fn pages() -> Result<Vec<(String, Vec<u8>)>> {
    let mut program = help::command();
    // Gives each verb its full name, `sinew diagnose`.
    program.build();
    let shown = |verb: &&Command| !verb.is_hide_set() && verb.get_name() != "help";
    let verbs = program.get_subcommands().filter(shown);
    let verbs = verbs.map(|verb| (format!("sinew-{}.1", verb.get_name()), verb));
    let all = std::iter::once(("sinew.1".to_owned(), &program));
    let page = |(file, command): (String, &Command)| {
        let mut text = Vec::new();
        let rendered = clap_mangen::Man::new(command.clone()).render(&mut text);
        rendered.map_err(|error| Error::failed(format!("{file}: {error}")))?;
        Ok((file, text))
    };
    all.chain(verbs).map(page).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::ValueEnum;

    #[test]
    fn every_shell_completes_every_verb() {
        for shell in Shell::value_variants() {
            let script = script(*shell);
            for verb in help::command()
                .get_subcommands()
                .filter(|verb| !verb.is_hide_set())
            {
                assert!(
                    script.contains(verb.get_name()),
                    "{shell}: {}",
                    verb.get_name()
                );
            }
            assert!(script.contains("rig-out"), "{shell}: flags are missing");
        }
    }

    #[test]
    fn every_verb_has_a_man_page_with_its_flags() {
        let pages = pages().unwrap();
        let page = |name: &str| {
            let found = pages.iter().find(|(file, _)| file == name);
            let (_, text) = found.unwrap_or_else(|| panic!("{name} is missing"));
            String::from_utf8_lossy(text).replace("\\-", "-")
        };
        for verb in help::command()
            .get_subcommands()
            .filter(|verb| !verb.is_hide_set())
        {
            page(&format!("sinew-{}.1", verb.get_name()));
        }
        let diagnose = page("sinew-diagnose.1");
        assert!(
            diagnose.starts_with(".ie") || diagnose.contains(".TH"),
            "{diagnose}"
        );
        assert!(diagnose.contains("--rig-out") && diagnose.contains("sinew diagnose"));
        assert!(page("sinew.1").contains("diagnose"));
    }
}

//! `cargo xtask tutorials`: the tutorials, executed line by line.
//!
//! Each page of `docs/tutorials` runs in an empty folder that holds a copy of `rigs/`, with `sinew`
//! on the PATH. `docs/tutorials/README.md` documents the conventions of the fenced blocks. The page
//! of the command line is compared with the program as well.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use anyhow::{Context, Result, bail, ensure};

use xtask::process::{self, root};
use xtask::setup::Toolchain;

/// End of an expected line whose rest may vary; alone on a line, any number of lines.
const ANY: &str = "…";

/// A fenced block of a page, with the number of its first line.
#[derive(Debug, PartialEq)]
struct Block {
    line: usize,
    language: String,
    /// Path behind the language: the block is written to this file.
    file: Option<String>,
    text: String,
}

/// Runs every tutorial; `--program PATH` takes a compiled `sinew` instead of building one.
///
/// # Errors
/// A command fails, or an expected line is missing from its output; by page and line.
pub fn run(toolchain: &Toolchain, arguments: &[String]) -> Result<()> {
    let program = match arguments {
        [] => process::program("sinew")?,
        [flag, path] if flag == "--program" => std::path::absolute(path)?,
        _ => bail!("tutorials takes nothing, or --program PATH"),
    };
    let mut pages = Vec::new();
    for entry in fs::read_dir(root().join("docs/tutorials"))? {
        let path = entry?.path();
        let name = path.file_name().unwrap_or_default();
        if path.extension().is_some_and(|e| e == "md") && name != "README.md" {
            pages.push(path);
        }
    }
    pages.sort();
    ensure!(!pages.is_empty(), "docs/tutorials has no page");
    for page in &pages {
        let start = Instant::now();
        follow(toolchain, page, &program)?;
        let name = page.strip_prefix(root()).unwrap_or(page);
        println!("{} [{:.0?}]", name.display(), start.elapsed());
    }
    let reference = fs::read_to_string(root().join("docs/reference/cli.md"))?;
    reference_is_current(&reference, &program)
}

/// Compares the page of the command line with the program, once the page is generated.
fn reference_is_current(page: &str, program: &Path) -> Result<()> {
    if !page.contains("sinew cli-reference") {
        return Ok(());
    }
    let result = Command::new(program).arg("cli-reference").output()?;
    ensure!(
        result.status.success() && result.stdout == page.as_bytes(),
        "docs/reference/cli.md is out of date: sinew cli-reference > docs/reference/cli.md"
    );
    Ok(())
}

/// One page, from its first block to its last.
fn follow(toolchain: &Toolchain, page: &Path, program: &Path) -> Result<()> {
    let folder = std::env::temp_dir()
        .join("sinew-tutorials")
        .join(page.file_stem().unwrap_or_default());
    if folder.exists() {
        fs::remove_dir_all(&folder)?;
    }
    copy(&root().join("rigs"), &folder.join("rigs"))?;
    let folder_of_program = program.parent().context("the program has no folder")?;
    let mut path = vec![folder_of_program.to_path_buf()];
    path.extend(std::env::split_paths(
        &std::env::var_os("PATH").unwrap_or_default(),
    ));

    let mut output: Option<String> = None;
    for block in blocks(&fs::read_to_string(page)?) {
        let place = format!("{}:{}", page.display(), block.line);
        match (block.language.as_str(), &block.file) {
            (_, Some(file)) => {
                let file = folder.join(file);
                fs::create_dir_all(file.parent().unwrap_or(&folder))?;
                fs::write(&file, &block.text)
                    .with_context(|| format!("{place}: cannot write {}", file.display()))?;
            }
            ("sh", None) => {
                let mut command = Command::new("sh");
                command.args(["-e", "-c", &format!("exec 2>&1\n{}", block.text)]);
                command
                    .current_dir(&folder)
                    .env("PATH", std::env::join_paths(&path)?);
                command.env("SINEW_BUILD_DIR", root().join("target/boards"));
                let result = toolchain.equip(&mut command).output()?;
                let text = String::from_utf8_lossy(&result.stdout).into_owned();
                ensure!(
                    result.status.success(),
                    "{place}: {}\n{text}",
                    result.status
                );
                output = Some(text);
            }
            ("text", None) => {
                let Some(output) = output.take() else {
                    continue;
                };
                if let Some(line) = missing(&block.text, &output) {
                    bail!("{place}: not in the output: {line}\n\nThe output was:\n{output}");
                }
            }
            _ => {}
        }
    }
    Ok(())
}

/// First expected line that does not follow in the output, if there is one.
fn missing<'a>(expected: &'a str, output: &str) -> Option<&'a str> {
    let plain = |line: &str| line.split_whitespace().collect::<Vec<_>>().join(" ");
    let mut rest = output.lines().map(plain);
    expected
        .lines()
        .filter(|line| !matches!(line.trim(), "" | ANY))
        .find(|line| {
            let wanted = plain(line);
            let found = match wanted.strip_suffix(ANY) {
                Some(start) => rest.any(|line| line.starts_with(start.trim_end())),
                None => rest.any(|line| line == wanted),
            };
            !found
        })
}

/// Fenced blocks of a page, in order.
fn blocks(page: &str) -> Vec<Block> {
    let mut found: Vec<Block> = Vec::new();
    let mut open = false;
    for (number, line) in (1..).zip(page.lines()) {
        if let Some(info) = line.strip_prefix("```") {
            open = !open;
            if open {
                let (language, file) = info.split_once(' ').unwrap_or((info, ""));
                found.push(Block {
                    line: number,
                    language: language.to_string(),
                    file: (!file.is_empty()).then(|| file.to_string()),
                    text: String::new(),
                });
            }
        } else if let Some(block) = found.last_mut().filter(|_| open) {
            block.text.push_str(line);
            block.text.push('\n');
        }
    }
    found
}

/// A folder and all below it.
fn copy(from: &Path, to: &Path) -> Result<()> {
    fs::create_dir_all(to)?;
    for entry in fs::read_dir(from)? {
        let entry = entry?;
        let target: PathBuf = to.join(entry.file_name());
        if entry.file_type()?.is_dir() {
            copy(&entry.path(), &target)?;
        } else {
            fs::copy(entry.path(), target)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAGE: &str =
        "Text.\n\n```sh\necho a\n```\n\n```rust crate/src/main.rs\nfn main() {}\n```\n";

    #[test]
    fn blocks_have_line_language_and_file() {
        let found = blocks(PAGE);
        assert_eq!(found.len(), 2);
        assert_eq!((found[0].line, found[0].language.as_str()), (3, "sh"));
        assert_eq!(found[0].text, "echo a\n");
        assert_eq!(found[1].file.as_deref(), Some("crate/src/main.rs"));
    }

    #[test]
    fn a_generated_reference_is_compared_with_the_program() {
        // `echo` prints its argument, "cli-reference", and not the page.
        let program = Path::new("echo");
        assert!(reference_is_current("written by hand", program).is_ok());
        assert!(reference_is_current("`sinew cli-reference`", program).is_err());
    }

    #[test]
    fn expected_lines_follow_in_order_and_may_vary_at_their_end() {
        let output = "first 1.0 mm\nskipped\nlast   2\n";
        assert_eq!(missing("first …\n…\nlast 2\n", output), None);
        assert_eq!(missing("last 2\nfirst …\n", output), Some("first …"));
        assert_eq!(missing("last 3\n", output), Some("last 3"));
    }
}

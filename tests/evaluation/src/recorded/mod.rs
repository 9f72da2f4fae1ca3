//! `cargo xtask recorded`: real devices, put to `sinew diagnose`, beside what the literature knows
//! of them.

mod case;
mod prepare;
mod table;

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};

use case::{CASES, Case, Source};
use xtask::process::{self, data_folder, root, target_folder};

/// With names, only those cases; with `--publish`, the table goes to docs/evaluation/devices.md;
/// with `--score`, nothing is asked anew and the page is made of the answers that are there.
///
/// # Errors
/// `sinew` does not build, or a file cannot be read or written. A case that is refused stands in
/// the table.
pub fn run(arguments: &[String]) -> Result<()> {
    let (flags, names): (Vec<&String>, Vec<&String>) = arguments
        .iter()
        .partition(|argument| argument.starts_with('-'));
    let known = ["--publish", "--score"];
    if let Some(flag) = flags.iter().find(|flag| !known.contains(&flag.as_str())) {
        bail!("unexpected argument '{flag}'; there are names of cases, --publish and --score");
    }
    let has = |wanted: &str| flags.iter().any(|flag| *flag == wanted);
    if let Some(name) = names
        .iter()
        .find(|name| CASES.iter().all(|case| case.name != **name))
    {
        let known: Vec<&str> = CASES.iter().map(|case| case.name).collect();
        bail!("there is no case '{name}'; there are {}", known.join(", "));
    }
    let out = root().join("target/recorded");
    fs::create_dir_all(&out).with_context(|| format!("cannot make {}", out.display()))?;
    let mut skipped = 0;
    if !has("--score") {
        process::program("sinew")?;
        for case in CASES {
            let asked = names.is_empty() || names.iter().any(|name| *name == case.name);
            if asked && !ask(case, &data_folder(), &out)? {
                skipped += 1;
            }
        }
    }
    if skipped > 0 {
        println!(
            "SKIPPED: {skipped} of {} cases, whose recordings are not in {}",
            CASES.len(),
            data_folder().display()
        );
    }
    let text = table::page(CASES, &out)?;
    println!("{text}");
    if !has("--publish") {
        return Ok(());
    }
    if skipped > 0 {
        bail!("nothing published: the table would have holes");
    }
    let path = root().join("docs/evaluation/devices.md");
    fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))?;
    println!("wrote {}", path.display());
    Ok(())
}

/// Prepares a case's recordings and diagnoses them; false where they are not here.
fn ask(case: &Case, data: &Path, out: &Path) -> Result<bool> {
    let mut command = std::process::Command::new(target_folder().join("debug/sinew"));
    command.arg("diagnose").arg(root().join(case.rig));
    for (flag, sources) in [
        ("--fit", case.fit),
        ("--check", case.check),
        ("--test", case.test),
    ] {
        for source in sources {
            let Some(path) = prepared(source, data, out)? else {
                println!("SKIPPED: {}: {} is not here", case.name, source.file);
                return Ok(false);
            };
            command.arg(flag).arg(path);
        }
    }
    let file = |ending: &str| out.join(format!("{}.{ending}", case.name));
    // An answer of an earlier run must not stand for this one.
    let _ = fs::remove_file(file("json"));
    command.arg("--json").arg(file("json"));
    command.arg("--report").arg(file("html"));
    command.arg("--rig-out").arg(file("toml"));
    if let Err(error) = process::run(&mut command) {
        println!("{}: {error}", case.name);
    }
    Ok(true)
}

/// The recording as it is, or its prepared copy.
fn prepared(source: &Source, data: &Path, out: &Path) -> Result<Option<PathBuf>> {
    let path = data.join(source.file);
    if !path.is_file() {
        return Ok(None);
    }
    let text =
        fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()))?;
    let Some(text) = prepare::prepare(&text, source.part) else {
        return Ok(Some(path));
    };
    let name = source
        .file
        .replace('/', "-")
        .replace(".csv", source.part.suffix());
    let copy = out.join(name);
    fs::write(&copy, text).with_context(|| format!("cannot write {}", copy.display()))?;
    Ok(Some(copy))
}

//! Prints the crate of every model in a folder in its place:
//! `cargo run -p sinew-model --example regenerate [-- [--check] [MODELS]]`.
//!
//! Without a folder it takes `models/` of the repository. With `--check` it writes nothing and
//! fails if a file differs from what its model prints. `cargo xtask generate` calls it.

use std::error::Error;
use std::path::{Path, PathBuf};

use sinew_model::regenerate::{check_all, write_all};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments: Vec<String> = std::env::args().skip(1).collect();
    let check = arguments.iter().any(|argument| argument == "--check");
    arguments.retain(|argument| argument != "--check");
    let committed = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models");
    let models = match arguments.as_slice() {
        [] => committed(),
        [folder] => PathBuf::from(folder),
        _ => return Err("usage: regenerate [--check] [MODELS]".into()),
    };

    if !check {
        for file in write_all(&models)? {
            println!("wrote {}", file.display());
        }
        return Ok(());
    }
    let stale = check_all(&models)?;
    for file in &stale {
        eprintln!("stale {}", file.display());
    }
    if stale.is_empty() {
        return Ok(());
    }
    Err("print them again: cargo xtask generate".into())
}

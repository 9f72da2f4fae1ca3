//! Imports a trained network, prints its crate, and evaluates it with its derivatives:
//! `cargo run -p sinew-nn --example import [NETWORK [FOLDER]]`.
//!
//! Without arguments it takes `mlp.onnx` beside this file and prints the calls of the crate; with a
//! folder it writes the crate there.

use std::error::Error;
use std::path::{Path, PathBuf};

use sinew_nn::emit::{Options, emit};
use sinew_nn::{evaluate, import, summary};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args_os().skip(1).map(PathBuf::from);
    let path = arguments
        .next()
        .unwrap_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/mlp.onnx"));

    let network = import::read(&path)?;
    println!("{}\n\n{}", network.name, summary::table(&network));

    // The crate depends on nothing; what a firmware calls is in `src/network.rs`.
    let printed = emit(&network, &Options::default())?;
    if let Some(folder) = arguments.next() {
        for file in &printed {
            sinew_files::write_changed(folder.join(&file.path), file.text.as_bytes())?;
        }
        println!("\nwrote {}", folder.display());
    } else {
        println!("\nthe printed crate:");
        for file in &printed {
            println!("  {:<36} {:>6} bytes", file.path, file.text.len());
        }
        let calls = printed.iter().find(|file| file.path == "src/network.rs");
        let calls = calls.map_or("", |file| &file.text);
        for line in calls.lines().filter(|line| line.starts_with("pub fn")) {
            println!("  {line}");
        }
    }

    // The same function in double precision, which the tests hold the printed crate against.
    let x = vec![0.1; network.inputs()];
    let state = vec![0.0; network.state()];
    let call = evaluate::call(&network, &x, &state);
    println!("\ny at 0.1 everywhere: {:.6?}", call.y);
    for (output, row) in evaluate::jacobian(&network, &x, &state).iter().enumerate() {
        println!("derivatives of result {output}: {row:.6?}");
    }
    Ok(())
}

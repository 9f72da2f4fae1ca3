//! Imports a network of the reference problem as a controller model:
//! `cargo run -p sinew-model --example import_reference -- NETWORK PROBLEM OUT [HORIZON [BLOCKS]]`.
//!
//! HORIZON is 10 without it. BLOCKS are lengths of blocks of equal moves, such as `2,2,3,3`;
//! without them every step has a move of its own. OUT is the folder of the model.

use std::error::Error;
use std::fs;
use std::path::Path;

use sinew_model::{reference, store};

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [network, problem, out, settings @ ..] = arguments.as_slice() else {
        return Err("usage: import_reference NETWORK PROBLEM OUT [HORIZON [BLOCKS]]".into());
    };
    let read = |path: &str| fs::read_to_string(path).map_err(|error| format!("{path}: {error}"));
    let count = |text: &str| {
        let number = text.trim().parse::<usize>();
        number.map_err(|_| format!("'{text}' is not a count"))
    };
    let (horizon, blocks) = match settings {
        [] => (10, Vec::new()),
        [horizon] => (count(horizon)?, Vec::new()),
        [horizon, blocks] => {
            let blocks = blocks.split(',').map(count).collect::<Result<_, _>>()?;
            (count(horizon)?, blocks)
        }
        [_, _, other, ..] => return Err(format!("unexpected argument '{other}'").into()),
    };

    let spec = reference::import(&read(network)?, &read(problem)?, horizon, &blocks)?;
    store::save(Path::new(out), &spec)?;
    println!("wrote {out}");
    Ok(())
}

//! `cargo run -p sinew-plan --example plan -- RIG OUT GOAL...`: plans from Rust and writes the
//! recording.
//!
//! ```sh
//! cargo run -p sinew-plan --example plan -- rigs/mass-spring-damper.toml plan.csv \
//!     "encoder = 0.1 at 0.6 s" "mass.velocity = 0 at 0.6 s"
//! ```

use std::path::Path;

use sinew_ident::error::{Error, Result};
use sinew_plan::{Goal, Options, plan};
use sinew_sim::{Plant, Rig};

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [rig, out, goals @ ..] = arguments.as_slice() else {
        return Err(Error::arguments(
            "a rig, a file to write and a goal are missing",
        ));
    };
    let goals = goals.iter().map(|goal| Goal::parse(goal));
    let goals = goals.collect::<Result<Vec<Goal>>>()?;
    let plant = Plant::new(&Rig::load(rig)?)?;
    let options = Options::default();
    let found = plan(
        &plant,
        Path::new(rig),
        &goals,
        None,
        &options,
        &mut |level| {
            println!(
                "mu {:.1e}: cost {:.3e} under the hard laws",
                level.smoothing, level.hard_cost
            );
        },
    )?;
    found.reached(options.tolerance)?;
    for outcome in &found.outcomes {
        println!("{}: {:.6} reached", outcome.goal, outcome.reached);
    }
    println!("{} simulations", found.count.equivalent());
    found.recording(&plant, out)?.write(out)
}

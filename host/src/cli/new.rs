//! `sinew new`.

use crate::error::Result;
use crate::new_rig::{self, NewArgs};

/// # Errors
/// As [`new_rig::run`].
pub fn run(arguments: &NewArgs) -> Result<()> {
    let new = new_rig::run(arguments)?;
    println!("{}", new.path.display());
    if !new.unused.is_empty() {
        println!(
            "columns that the rig does not use: {}",
            new.unused.join(", ")
        );
    }
    for guess in &new.guesses {
        println!("guessed: {guess}");
    }
    println!(
        "next: sinew fit {} --fit {}",
        new.path.display(),
        arguments.recording.display()
    );
    Ok(())
}

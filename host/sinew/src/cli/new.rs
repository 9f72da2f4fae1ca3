//! `sinew new`.

use crate::new_rig::{self, NewArgs};
use sinew_ident::error::Result;

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

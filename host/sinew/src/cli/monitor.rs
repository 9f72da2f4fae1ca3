//! `sinew monitor`: watch and steer a board's own rig.

use std::path::PathBuf;

use clap::Args;

use super::LiveArguments;
use crate::live::monitor::monitor;
use sinew_ident::error::Result;

/// Arguments of `sinew monitor`. While it runs, type: arm, disarm, stop (or Return: emergency
/// stop), r VALUES, limit LOWER UPPER RATE ..., quit.
#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    live: LiveArguments,
    /// Save what is seen (CSV).
    #[arg(long, value_name = "CSV")]
    out: Option<PathBuf>,
    /// End after so many seconds.
    #[arg(long, value_name = "S")]
    seconds: Option<f64>,
}

/// # Errors
/// A board that cannot be reached or is the wrong one; a file that cannot be written.
pub fn run(arguments: &Arguments) -> Result<()> {
    let (mut device, names, identity) = arguments.live.connect(arguments.out.is_some())?;
    let out = arguments.out.as_deref();
    let watched = monitor(&mut device, &names, &identity, out, arguments.seconds)?;
    println!(
        "{} ticks seen, {} lost on the way",
        watched.ticks, watched.lost
    );
    Ok(())
}

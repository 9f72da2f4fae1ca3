//! A board behind a debug probe: flashed, and talked to without a serial port.
//!
//! The work is `sinew-probe`'s, a crate behind the cargo feature `probe`
//! (docs/decisions/0032-probe-rs-as-a-feature.md); here is the table of chips, and what is said to
//! somebody whose program was built without it.

use std::path::Path;

use serde_json::{Value, json};

use crate::device::Device;
use crate::project::image::Sizes;
use crate::project::{Board, Chip};
use sinew_ident::error::{Error, Result};

/// Connection to the board.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Serial number of the probe, where there are several.
    pub select: Option<String>,
    /// Erase and unlock a locked chip.
    pub unlock: bool,
    /// End once flashed; otherwise the log is shown until Ctrl-C.
    pub no_log: bool,
    /// No progress.
    pub quiet: bool,
    /// The board's log goes to standard error.
    pub aside: bool,
}

/// A flashed image for programs, `sinew-flash/1`.
pub fn document(board: Board, chip: &Chip, image: &Path, sizes: Sizes) -> Value {
    json!({
        "format": FORMAT,
        "probes": Value::Null,
        "flashed": {
            "board": board.folder(),
            "chip": chip.name,
            "image": image.display().to_string(),
            "flash_bytes": sizes.flash_bytes,
            "ram_bytes": sizes.ram_bytes,
        },
    })
}

/// The probes that are connected for programs, `sinew-flash/1`.
pub fn listed(probes: &[String]) -> Value {
    json!({ "format": FORMAT, "probes": probes, "flashed": Value::Null })
}

const FORMAT: &str = "sinew-flash/1";

/// The chip of a board that can be flashed.
///
/// # Errors
/// The board is none.
pub fn chip(board: Board) -> Result<&'static Chip> {
    board.chip().ok_or_else(|| {
        Error::arguments(format!("{} is not flashed, it runs here", board.name()))
            .help("boards with a flash: stm32f446, nrf52840")
    })
}

#[cfg(feature = "probe")]
mod with {
    use super::{Chip, Device, Error, Options, Path, Result};
    use sinew_ident::cli::progress::Stage;

    /// A probe's failure as an error of the program.
    fn failed(trouble: sinew_probe::Trouble) -> Error {
        let (message, help) = trouble.told();
        Error::failed(message).help(help)
    }

    fn probed(chip: &Chip) -> sinew_probe::Chip {
        sinew_probe::Chip {
            name: chip.name,
            address: chip.identification.address,
            mask: chip.identification.mask,
            value: chip.identification.value,
        }
    }

    fn asked(options: &Options) -> sinew_probe::Options {
        sinew_probe::Options {
            select: options.select.clone(),
            unlock: options.unlock,
        }
    }

    pub fn ready() -> Result<()> {
        Ok(())
    }

    pub fn list() -> Result<Vec<String>> {
        Ok(sinew_probe::list())
    }

    pub fn flash(
        chip: &Chip,
        image: &Path,
        options: &Options,
        then: &mut dyn FnMut(),
    ) -> Result<()> {
        let stage = Stage::begin(format!("flash {}", chip.name), options.quiet);
        let flashed = || {
            stage.end("flashed and verified");
            then();
        };
        let aside = options.aside;
        let mut tell = |line: &str| match aside {
            true => eprintln!("{line}"),
            false => println!("{line}"),
        };
        let log: Option<&mut dyn FnMut(&str)> = if options.no_log {
            None
        } else {
            Some(&mut tell)
        };
        sinew_probe::flash(&probed(chip), image, &asked(options), flashed, log).map_err(failed)?;
        Ok(())
    }

    pub fn connect(chip: &Chip, options: &Options) -> Result<Device> {
        let (to, from) = sinew_probe::line(&probed(chip), &asked(options)).map_err(failed)?;
        Device::over(to, from)
    }
}

#[cfg(not(feature = "probe"))]
mod with {
    use super::{Chip, Device, Error, Options, Path, Result};

    fn without(what: &str) -> Error {
        Error::failed(format!("{what}: this sinew was built without probe support")).help(
            "cargo install --path host/sinew --features probe; or `cargo run --release` in the board's folder, with probe-rs-tools",
        )
    }

    pub fn ready() -> Result<()> {
        Err(without("flash"))
    }

    pub fn list() -> Result<Vec<String>> {
        Err(without("--list"))
    }

    pub fn flash(_: &Chip, image: &Path, _: &Options, _: &mut dyn FnMut()) -> Result<()> {
        Err(without(&image.display().to_string()))
    }

    pub fn connect(_: &Chip, _: &Options) -> Result<Device> {
        Err(without("--probe"))
    }
}

/// Makes sure that a board can be flashed, before an image is built for it.
///
/// # Errors
/// This program was built without probe support.
pub fn ready() -> Result<()> {
    with::ready()
}

/// The probes that are connected, a line each.
///
/// # Errors
/// This program was built without probe support.
pub fn list() -> Result<Vec<String>> {
    with::list()
}

/// Flashes `image`, calls `then`, and shows the board's log.
///
/// # Errors
/// Whatever stands between this program and the board, as one line; an image that is none.
pub fn flash(chip: &Chip, image: &Path, options: &Options, then: &mut dyn FnMut()) -> Result<()> {
    with::flash(chip, image, options, then)
}

/// Talks to the firmware that runs on a board, through its probe.
///
/// # Errors
/// As [`flash`].
pub fn connect(chip: &Chip, options: &Options) -> Result<Device> {
    with::connect(chip, options)
}

//! An image into a board's flash by way of a debug probe, and the board's log out again.
//!
//! What probe-rs finds is sorted into [`Trouble`], one line each; the library itself is behind the cargo feature
//! `probe` (docs/decisions/0032-probe-rs-as-a-feature.md).

#[cfg(feature = "probe")]
mod probe;

use std::path::Path;

use crate::error::{Error, Result};
use crate::project::{Board, Chip};

/// What stands between an image and a board.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Trouble {
    /// No debug probe is connected.
    NoProbe,
    /// There is one, and this user may not use it.
    NotAllowed {
        /// The probe.
        probe: String,
    },
    /// More than one, and none was chosen.
    Several {
        /// They.
        probes: Vec<String>,
    },
    /// The one that was chosen is not there.
    NotThere {
        /// The choice.
        chosen: String,
        /// What is there.
        probes: Vec<String>,
    },
    /// The probe works and no chip answers.
    NoChip,
    /// Another chip answers.
    OtherChip {
        /// What was expected.
        expected: &'static str,
        /// What its identification register says.
        found: u32,
    },
    /// The chip is read-protected.
    Locked,
    /// Anything else, in probe-rs's words.
    Other(String),
}

impl From<Trouble> for Error {
    fn from(trouble: Trouble) -> Self {
        let list = |probes: &[String]| probes.join("; ");
        let (message, help) = match trouble {
            Trouble::NoProbe => (
                "no debug probe is connected".to_string(),
                "connect the board's debugger socket by USB, with a cable that carries data".to_string(),
            ),
            Trouble::NotAllowed { probe } => (
                format!("{probe} is connected, and you may not use it"),
                "install probe-rs's udev rules (https://probe.rs/docs/getting-started/probe-setup/), then plug it in again"
                    .to_string(),
            ),
            Trouble::Several { probes } => (
                format!("{} debug probes are connected", probes.len()),
                format!("choose one with --select SERIAL: {}", list(&probes)),
            ),
            Trouble::NotThere { chosen, probes } => (
                format!("no debug probe has the serial number {chosen}"),
                format!("connected are: {}", list(&probes)),
            ),
            Trouble::NoChip => (
                "the probe works, and no chip answers".to_string(),
                "is the board powered? On a Nucleo both CN2 jumpers must be on; on an nRF52840 DK switch SW6 to DEFAULT"
                    .to_string(),
            ),
            Trouble::OtherChip { expected, found } => (
                format!("this is no {expected}: its identification register reads {found:#x}"),
                "name the board that it is with --board".to_string(),
            ),
            Trouble::Locked => (
                "the chip is locked against reading".to_string(),
                "--unlock erases the whole chip and unlocks it".to_string(),
            ),
            Trouble::Other(words) => (
                words,
                "unplug the board, plug it in again, and look at its power".to_string(),
            ),
        };
        Self::failed(message).help(help)
    }
}

/// How to flash.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Serial number of the probe, where there are several.
    pub select: Option<String>,
    /// Erase and unlock a locked chip.
    pub unlock: bool,
    /// End once flashed; otherwise the log is shown until Ctrl-C.
    pub no_log: bool,
}

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

/// The probes that are connected, a line each.
///
/// # Errors
/// This program was built without probe support.
#[cfg(feature = "probe")]
pub fn list() -> Result<Vec<String>> {
    Ok(probe::list())
}

/// Flashes `image` and shows the board's log.
///
/// # Errors
/// [`Trouble`], as one line; an image that is none.
#[cfg(feature = "probe")]
pub fn flash(chip: &Chip, image: &Path, options: &Options) -> Result<()> {
    probe::flash(chip, image, options)
}

/// See the version with probe support.
///
/// # Errors
/// Always.
#[cfg(not(feature = "probe"))]
pub fn list() -> Result<Vec<String>> {
    Err(without_support("DIR"))
}

/// See the version with probe support.
///
/// # Errors
/// Always.
#[cfg(not(feature = "probe"))]
pub fn flash(_: &Chip, image: &Path, _: &Options) -> Result<()> {
    Err(without_support(&image.display().to_string()))
}

#[cfg(not(feature = "probe"))]
fn without_support(image: &str) -> Error {
    Error::failed(format!("{image}: this sinew was built without probe support"))
        .help("cargo install --path host --features probe; or `cargo run --release` in the board's folder, with probe-rs-tools")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_trouble_is_one_line_and_one_remedy() {
        let two = || vec!["ST-Link (066A)".to_string(), "J-Link (683)".to_string()];
        let all = [
            Trouble::NoProbe,
            Trouble::NotAllowed {
                probe: "ST-Link (066A)".into(),
            },
            Trouble::Several { probes: two() },
            Trouble::NotThere {
                chosen: "1".into(),
                probes: two(),
            },
            Trouble::NoChip,
            Trouble::OtherChip {
                expected: "STM32F446RETx",
                found: 0x413,
            },
            Trouble::Locked,
            Trouble::Other("the flash could not be erased".into()),
        ];
        let text: Vec<String> = all
            .into_iter()
            .map(|t| Error::from(t).to_string())
            .collect();
        for message in &text {
            assert_eq!(message.lines().count(), 2, "{message}");
        }
        insta::assert_snapshot!(text.join("\n"));
    }
}

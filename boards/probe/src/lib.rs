//! A board behind a debug probe: found, flashed, its log listened to, frames exchanged with it.
//!
//! Errors of probe-rs are sorted into [`Trouble`]. The table of boards is the caller's; here a chip
//! is what it says of itself.

mod attach;
mod flash;
mod line;
mod log;
#[cfg(test)]
mod tests;

pub use attach::list;
pub use flash::flash;
pub use line::{FromBoard, ToBoard, line};

/// A microcontroller, as far as a probe is concerned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Chip {
    /// Its name in probe-rs.
    pub name: &'static str,
    /// Address of the register that says what it is.
    pub address: u64,
    /// The bits of that register that count.
    pub mask: u32,
    /// The two words.
    pub value: u32,
}

/// Access to a board: probe, chip and image.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Serial number of the probe, where there are several.
    pub select: Option<String>,
    /// Erase and unlock a locked chip.
    pub unlock: bool,
}

/// Obstacle between this program and a board.
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
        /// The probes that are connected.
        probes: Vec<String>,
    },
    /// The probe works and no chip answers.
    NoChip,
    /// Another chip answers.
    OtherChip {
        /// The expected chip.
        expected: &'static str,
        /// Content of its identification register.
        found: u32,
    },
    /// The chip is read-protected.
    Locked,
    /// The chip runs, and not our firmware: it has no such channel in its memory.
    NoChannel {
        /// The missing channel.
        channel: &'static str,
    },
    /// Anything else, in probe-rs's words.
    Other(String),
}

impl Trouble {
    /// The problem and its remedy, a line each.
    pub fn told(&self) -> (String, String) {
        let list = |probes: &[String]| probes.join("; ");
        let (message, help) = match self {
            Self::NoProbe => (
                "no debug probe is connected".into(),
                "connect the board's debugger socket by USB, with a cable that carries data".into(),
            ),
            Self::NotAllowed { probe } => (
                format!("{probe} is connected, and you may not use it"),
                "install probe-rs's udev rules (https://probe.rs/docs/getting-started/probe-setup/), then plug it in again"
                    .into(),
            ),
            Self::Several { probes } => (
                format!("{} debug probes are connected", probes.len()),
                format!("choose one with --select SERIAL: {}", list(probes)),
            ),
            Self::NotThere { chosen, probes } => (
                format!("no debug probe has the serial number {chosen}"),
                format!("connected are: {}", list(probes)),
            ),
            Self::NoChip => (
                "the probe works, and no chip answers".into(),
                "is the board powered? On a Nucleo both CN2 jumpers must be on; on an nRF52840 DK switch SW6 to DEFAULT"
                    .into(),
            ),
            Self::OtherChip { expected, found } => (
                format!("this is no {expected}: its identification register reads {found:#x}"),
                "name the board that it is with --board".into(),
            ),
            Self::Locked => (
                "the chip is locked against reading".into(),
                "`sinew flash --unlock` erases the whole chip and unlocks it".into(),
            ),
            Self::NoChannel { channel } => (
                format!("the chip runs a firmware without the channel {channel}"),
                "write this project's firmware into it: sinew flash".into(),
            ),
            Self::Other(words) => (
                words.clone(),
                "unplug the board, plug it in again, and look at its power".into(),
            ),
        };
        (message, help)
    }
}

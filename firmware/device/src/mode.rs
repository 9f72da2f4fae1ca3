//! Operating mode: if anything may move, by whose commands, and the reason if not
//! (docs/reference/protocol.md, "Arming").

use serde::{Deserialize, Serialize};

/// Source and destination of commands, once armed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Drive {
    /// The host sends samples and gets commands; the board's own outputs stay off.
    Host,
    /// The board's sensors, the controller, the board's actuators.
    Rig,
    /// The board's sensors and actuators; the commands are rows that the host has sent.
    Excitation,
}

impl Drive {
    /// The board's own sensors and actuators take part.
    pub const fn is_on_board(self) -> bool {
        matches!(self, Self::Rig | Self::Excitation)
    }
}

/// Operating mode of the firmware. It starts disarmed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Mode {
    /// Commands go to the safe one, within the rate, and stay there.
    Disarmed,
    /// Commands are given.
    Armed(Drive),
    /// Emergency stop: the safe command at once, outputs off, until a Disarm acknowledges it.
    Tripped,
}

/// Why the mode is what it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Cause {
    /// Power came on or the reset button was pressed; nobody has armed it.
    Start,
    /// The watchdog restarted the chip.
    Watchdog,
    /// A fault or panic restarted the chip.
    Fault,
    /// The supply dropped.
    BrownOut,
    /// The host asked.
    Asked,
    /// The host asked for an emergency stop.
    EmergencyStop,
    /// Too many samples were missing in a row.
    SamplesLost,
    /// An output went far beyond the range of training and stayed there.
    Diverged,
    /// An output did not change in one bit while the command moved far.
    Stuck,
    /// Too many steps in a row gave no plan.
    NoPlan,
    /// Too many steps in a row ended after their period.
    Late,
    /// The host was silent for too long.
    LinkLost,
    /// The rows of the excitation ran out.
    Starved,
}

/// The mode and why.
///
/// ```
/// use sinew_device::mode::{Cause, Drive, Mode, State};
///
/// let start = State::disarmed(Cause::Start);
/// assert_eq!(start.drive(), None);
/// let armed = State { mode: Mode::Armed(Drive::Rig), cause: Cause::Asked };
/// assert!(armed.drive().is_some_and(Drive::is_on_board));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct State {
    /// The operating mode.
    pub mode: Mode,
    /// Why.
    pub cause: Cause,
}

impl State {
    /// Disarmed, for that reason.
    pub const fn disarmed(cause: Cause) -> Self {
        let mode = Mode::Disarmed;
        Self { mode, cause }
    }

    /// Source of commands; `None` unless armed.
    pub const fn drive(&self) -> Option<Drive> {
        match self.mode {
            Mode::Armed(drive) => Some(drive),
            Mode::Disarmed | Mode::Tripped => None,
        }
    }
}

//! A rig that the host simulates, behind converters of 12 bits: at each tick its sensors' codes are
//! read, later the duties of its actuators are written. Without the two files there is no rig:
//! every code is 0, which is a missing sample.

use sinew_board_runtime::model::control::NU;
use sinew_board_runtime::wiring::SENSORS;

use core::sync::atomic::{AtomicBool, Ordering};

use crate::semihosting::{Channel, RIG};

/// Full scale of codes and duties.
pub const FULL_SCALE: u16 = 4095;

/// The power stages are forced off, whatever is asked.
static OFF: AtomicBool = AtomicBool::new(false);

/// Turns the power stages off for good. From any context.
pub fn off() {
    OFF.store(true, Ordering::Relaxed);
}

/// The simulated rig's two files.
pub struct Rig {
    channel: Option<Channel>,
    /// Codes were read, and duties are awaited. Duties out of turn, those of an emergency stop
    /// between two ticks, would put every later reading a tick behind.
    is_due: bool,
}

impl Rig {
    /// Opens the files, if they are there.
    pub fn open() -> Self {
        Self {
            channel: Channel::open(RIG).ok(),
            is_due: false,
        }
    }

    /// Codes of the sensors: little-endian 16-bit words from the host.
    pub fn sample(&mut self) -> [u16; SENSORS] {
        let mut codes = [0; SENSORS];
        let mut word = [0; 2];
        self.is_due = true;
        for code in &mut codes {
            let Some(channel) = &mut self.channel else {
                break;
            };
            match channel.read_exact(&mut word) {
                Ok(()) => *code = u16::from_le_bytes(word),
                Err(_) => self.channel = None,
            }
        }
        codes
    }

    /// Duties of the actuators, and behind them whether the power stages are on: little-endian
    /// words, once for each reading of the codes.
    pub fn drive(&mut self, duties: &[u16; NU], live: bool) {
        let live = u16::from(live && !OFF.load(Ordering::Relaxed));
        if !core::mem::take(&mut self.is_due) {
            return;
        }
        let Some(channel) = &mut self.channel else {
            return;
        };
        let mut sent = Ok(());
        for word in duties.iter().chain([&live]) {
            sent = sent.and_then(|()| channel.write(&word.to_le_bytes()));
        }
        if sent.is_err() {
            self.channel = None;
        }
    }
}

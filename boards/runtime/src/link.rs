//! A transport's bytes to messages and back, and what is worth a line in the log.

use defmt::{info, warn};
use sinew_device::protocol::{
    Accumulator, Fed, Identity, MAX_FRAME, Reason, StatusOnWire, ToDevice, ToHost, decode, encode,
};

use crate::stack;

/// One end of a link.
pub struct Link {
    accumulator: Accumulator,
    /// Apart from the accumulator: an answer may go out while a frame is half in.
    outgoing: [u8; MAX_FRAME],
    rejected: u32,
    /// True if the last command was controlled; starts true, so that a bad start is logged.
    controlled: bool,
}

/// Message that a byte completed.
#[expect(
    clippy::large_enum_variant,
    reason = "there is no heap to put the large one in"
)]
pub enum Heard {
    /// Nothing yet.
    Nothing,
    /// A message.
    Message(ToDevice),
    /// A frame that is none; it wants [`Link::refusal`] for an answer.
    Damaged,
}

impl Link {
    /// A link on which nothing has been said.
    #[expect(clippy::new_without_default, reason = "made once a program")]
    pub const fn new() -> Self {
        Self {
            accumulator: Accumulator::new(),
            outgoing: [0; MAX_FRAME],
            rejected: 0,
            controlled: true,
        }
    }

    /// Takes one byte.
    // Not inlined, as `frame`: what decoding and encoding need of the stack is then not in use
    // while the controller computes.
    #[inline(never)]
    pub fn hear(&mut self, byte: u8) -> Heard {
        let message = match self.accumulator.feed(byte) {
            Fed::Nothing => return Heard::Nothing,
            Fed::Frame(frame) => decode(frame).ok(),
            Fed::TooLong => None,
        };
        match message {
            Some(message) => Heard::Message(message),
            None => {
                self.rejected = self.rejected.wrapping_add(1);
                Heard::Damaged
            }
        }
    }

    /// The answer to a damaged frame.
    pub fn refusal(&self) -> ToHost {
        let reason = Reason::Damaged;
        ToHost::Refused { reason }
    }

    /// Adds to an answer what only the board knows, logs what has changed, and encodes it.
    #[inline(never)]
    pub fn frame(&mut self, answer: &mut ToHost) -> &[u8] {
        match answer {
            ToHost::Hello(identity) => started(identity),
            ToHost::Command { seq, status, .. } => {
                let controlled = status.is_controlled();
                if controlled != self.controlled {
                    self.controlled = controlled;
                    warn!("sample {=u32}: {}", *seq, StatusOnWire::from(*status));
                }
            }
            ToHost::Refused { reason } => warn!("refused: {}", *reason),
            ToHost::Done(summary) => {
                summary.frames_rejected = self.rejected;
                summary.stack_high_water_bytes = stack::high_water_bytes();
                info!("stopped: {}", *summary);
            }
            ToHost::State(state) => info!("{}", *state),
            ToHost::Prediction { .. }
            | ToHost::Tuned
            | ToHost::Queued { .. }
            | ToHost::Telemetry(_)
            | ToHost::Health(_)
            | ToHost::Parameters(_) => {}
        }
        // MAX_FRAME holds every answer.
        encode(answer, &mut self.outgoing).unwrap_or_default()
    }
}

fn started(identity: &Identity) {
    info!(
        "model {=u32:08x}: {=u8} inputs, {=u8} outputs, {=u8} channels, {=u32} mHz",
        identity.model, identity.n_u, identity.n_y, identity.n_s, identity.rate_mhz
    );
}

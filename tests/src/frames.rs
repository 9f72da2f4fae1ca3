//! Frames on the host's side of a link.

use std::collections::VecDeque;

use sinew_firmware::protocol::{self, Accumulator, Fed, MAX_FRAME, ToDevice, ToHost};

/// One message as a frame, terminator included.
pub fn encode(message: &ToDevice) -> Vec<u8> {
    let mut buffer = [0; MAX_FRAME];
    protocol::encode(message, &mut buffer)
        .expect("MAX_FRAME holds every message")
        .to_vec()
}

/// Bytes from a device to messages.
#[derive(Default)]
pub struct Decoder {
    accumulator: Accumulator,
    bytes: VecDeque<u8>,
}

impl Decoder {
    /// Takes what has arrived.
    pub fn push(&mut self, bytes: &[u8]) {
        self.bytes.extend(bytes);
    }

    /// The next whole message; `None` until more bytes have come.
    ///
    /// # Errors
    /// A frame is damaged: no transport of these tests loses bytes, so that is a fault.
    pub fn next_message(&mut self) -> Result<Option<ToHost>, String> {
        while let Some(byte) = self.bytes.pop_front() {
            match self.accumulator.feed(byte) {
                Fed::Nothing => {}
                Fed::Frame(frame) => {
                    let length = frame.len();
                    return protocol::decode(frame)
                        .map(Some)
                        .map_err(|error| format!("a damaged frame of {length} bytes: {error:?}"));
                }
                Fed::TooLong => return Err("a frame that is too long".into()),
            }
        }
        Ok(None)
    }
}

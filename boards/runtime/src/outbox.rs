//! Frames on their way out. Control never waits for the link: a frame for which there is no room is
//! dropped whole, and whoever wanted it asks again or sees the gap in the numbers.

use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::pipe::Pipe;
use embedded_io_async::Write;

use crate::probe::ToProbe;

/// Bytes that wait: two of the longest frames, or a quarter of a second of telemetry.
const CAPACITY: usize = 2304;

/// A queue of whole frames.
pub struct Outbox(Pipe<CriticalSectionRawMutex, CAPACITY>);

impl Outbox {
    /// Empty.
    #[expect(clippy::new_without_default, reason = "made once, in a static")]
    pub const fn new() -> Self {
        Self(Pipe::new())
    }

    /// Takes a frame, or drops it and returns `false`.
    #[must_use]
    pub fn send(&self, frame: &[u8]) -> bool {
        if self.0.free_capacity() < frame.len() {
            return false;
        }
        let mut rest = frame;
        // Two turns at most: the ring may wrap once.
        while let Ok(n @ 1..) = self.0.try_write(rest) {
            rest = rest.get(n..).unwrap_or_default();
            if rest.is_empty() {
                break;
            }
        }
        true
    }

    /// Nothing waits.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Hands bytes to the line and to the probe for ever. A line that fails loses what it was
    /// given; the rest goes on.
    pub async fn drain(&self, mut line: impl Write, mut probe: ToProbe) -> ! {
        let mut chunk = [0; 64];
        loop {
            let n = self.0.read(&mut chunk).await;
            let bytes = chunk.get(..n).unwrap_or_default();
            probe.write(bytes);
            if line.write_all(bytes).await.is_ok() {
                // A line that cannot be flushed has lost bytes as well: nothing to do about it
                // here.
                let _ = line.flush().await;
            }
        }
    }
}

//! A second line to the host, through the debug probe: two RTT channels beside the log's. Nothing
//! has to be wired for it, and a board without a serial port has one.
//!
//! Bytes of both lines are heard; every answer goes to both. A probe that does not listen costs
//! nothing but what it would have been told: the channel is full and takes no more.

use core::convert::Infallible;

use embassy_futures::select::{Either, select};
use embassy_time::Timer;
use embedded_io_async::{ErrorType, Read};
use rtt_target::{ChannelMode, DownChannel, UpChannel, rtt_init};

/// Polling period of the host's channel, ms: there is no interrupt for it.
const EVERY_MS: u64 = 1;

/// The probe's line: from the host, to the host.
pub struct Probe {
    /// Bytes from the host.
    pub from: FromProbe,
    /// Bytes to the host.
    pub to: ToProbe,
}

/// Bytes from the host.
pub struct FromProbe(DownChannel);

/// Bytes to the host.
pub struct ToProbe(UpChannel);

/// Sets up the channels; with the feature `log-over-rtt`, the log's among them. Once, before
/// anything is logged.
pub fn start() -> Probe {
    let channels = rtt_init! {
        up: {
            0: { size: 1024, mode: ChannelMode::NoBlockSkip, name: "defmt" }
            1: { size: 1024, mode: ChannelMode::NoBlockTrim, name: "sinew" }
        }
        down: {
            0: { size: 512, name: "sinew" }
        }
    };
    #[cfg(feature = "log-over-rtt")]
    rtt_target::set_defmt_channel(channels.up.0);
    Probe {
        from: FromProbe(channels.down.0),
        to: ToProbe(channels.up.1),
    }
}

impl ToProbe {
    /// Hands bytes over, as many as there is room for. A frame that is cut fails its checksum, and
    /// whoever wanted it asks again or sees the gap in the numbers.
    pub fn write(&mut self, bytes: &[u8]) {
        self.0.write(bytes);
    }
}

impl ErrorType for FromProbe {
    type Error = Infallible;
}

impl Read for FromProbe {
    async fn read(&mut self, into: &mut [u8]) -> Result<usize, Infallible> {
        loop {
            match self.0.read(into) {
                0 => Timer::after_millis(EVERY_MS).await,
                n => return Ok(n),
            }
        }
    }
}

/// A serial line and the probe's, heard as one.
pub struct Both<L> {
    /// The serial line.
    pub serial: L,
    /// The probe's.
    pub probe: FromProbe,
}

impl<L: ErrorType> ErrorType for Both<L> {
    type Error = L::Error;
}

impl<L: Read> Read for Both<L> {
    async fn read(&mut self, into: &mut [u8]) -> Result<usize, L::Error> {
        let mut chunk = [0; 64];
        let room = into.len().min(chunk.len());
        let aside = chunk.get_mut(..room).unwrap_or_default();
        // Neither takes a byte before it is done, so the one that is dropped loses none.
        match select(self.serial.read(into), self.probe.read(aside)).await {
            Either::First(heard) => heard,
            Either::Second(Ok(n)) => {
                for (to, from) in into.iter_mut().zip(chunk.iter().take(n)) {
                    *to = *from;
                }
                Ok(n)
            }
        }
    }
}

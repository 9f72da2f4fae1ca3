//! Frames through the probe instead of a serial port: two RTT channels of the firmware, as a reader
//! and a writer.

use std::io::{self, Read, Write};
use std::sync::mpsc::{Receiver, Sender, TryRecvError, channel};
use std::time::Duration;

use probe_rs::Session;
use probe_rs::rtt::Rtt;

use crate::attach::{attach, chain, channels, sorted};
use crate::{Chip, Options, Trouble};

/// The firmware's channels (boards/runtime/src/probe.rs).
const UP: usize = 1;
/// See [`UP`].
const DOWN: usize = 0;
/// Pause when neither side had anything to say: the firmware looks as often.
const IDLE: Duration = Duration::from_millis(1);

/// Bytes to the board.
pub struct ToBoard(Sender<Vec<u8>>);

/// Bytes from the board; at their end, the probe is gone.
pub struct FromBoard {
    chunks: Receiver<Vec<u8>>,
    rest: Vec<u8>,
}

/// A line to the firmware that runs on `chip`; nothing is flashed, halted or reset.
///
/// # Errors
/// The obstacle, as a [`Trouble`].
pub fn line(chip: &Chip, options: &Options) -> Result<(ToBoard, FromBoard), Trouble> {
    let mut session = attach(chip, options)?;
    let mut core = session.core(0).map_err(|e| sorted(&e))?;
    let mut rtt = channels(&mut core)?;
    drop(core);
    if rtt.up_channel(UP).is_none() || rtt.down_channel(DOWN).is_none() {
        return Err(Trouble::NoChannel { channel: "sinew" });
    }
    let (to_board, from_host) = channel();
    let (to_host, from_board) = channel();
    std::thread::spawn(move || {
        // Whoever reads sees the end of the line and says so; what ended it is of no further use to
        // them.
        let _ = carry(&mut session, &mut rtt, &from_host, &to_host);
    });
    let from = FromBoard {
        chunks: from_board,
        rest: Vec::new(),
    };
    Ok((ToBoard(to_board), from))
}

/// Carries bytes both ways until either end is gone.
fn carry(
    session: &mut Session,
    rtt: &mut Rtt,
    from_host: &Receiver<Vec<u8>>,
    to_host: &Sender<Vec<u8>>,
) -> Result<(), Trouble> {
    let other = |error: &dyn std::error::Error| Trouble::Other(chain(error));
    let lost = || Trouble::NoChannel { channel: "sinew" };
    let mut core = session.core(0).map_err(|e| sorted(&e))?;
    let mut pending: Vec<u8> = Vec::new();
    let mut buffer = [0; 1024];
    loop {
        let up = rtt.up_channel(UP).ok_or_else(lost)?;
        let n = up.read(&mut core, &mut buffer).map_err(|e| other(&e))?;
        if n > 0 {
            let bytes = buffer.get(..n).unwrap_or_default().to_vec();
            to_host.send(bytes).map_err(|e| other(&e))?;
        }
        loop {
            match from_host.try_recv() {
                Ok(bytes) => pending.extend(bytes),
                Err(TryRecvError::Empty) => break,
                Err(TryRecvError::Disconnected) => return Ok(()),
            }
        }
        let mut written = 0;
        if !pending.is_empty() {
            let down = rtt.down_channel(DOWN).ok_or_else(lost)?;
            written = down.write(&mut core, &pending).map_err(|e| other(&e))?;
            pending.drain(..written);
        }
        if n == 0 && written == 0 {
            std::thread::sleep(IDLE);
        }
    }
}

impl Write for ToBoard {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let sent = self.0.send(bytes.to_vec());
        sent.map_err(|_| io::Error::from(io::ErrorKind::BrokenPipe))?;
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Read for FromBoard {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        if self.rest.is_empty() {
            let Ok(chunk) = self.chunks.recv() else {
                return Ok(0);
            };
            self.rest = chunk;
        }
        let n = self.rest.len().min(into.len());
        for (to, from) in into.iter_mut().zip(self.rest.drain(..n)) {
            *to = from;
        }
        Ok(n)
    }
}

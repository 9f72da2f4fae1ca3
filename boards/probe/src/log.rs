//! The board's log: defmt frames over RTT.

use std::path::Path;
use std::time::Duration;

use defmt_decoder::{DecodeError, Table};
use probe_rs::Session;

use crate::Trouble;
use crate::attach::{chain, channels, sorted};

/// The channel that defmt writes to.
const LOG: usize = 0;

/// Hands the log on, a line at a time, until the board is gone.
pub(crate) fn listen(
    session: &mut Session,
    image: &Path,
    tell: &mut dyn FnMut(&str),
) -> Result<(), Trouble> {
    let file = |what: String| Trouble::Other(format!("{}: {what}", image.display()));
    let data = std::fs::read(image).map_err(|e| file(e.to_string()))?;
    let table = Table::parse(&data).map_err(|e| file(format!("log strings: {e}")))?;
    let table = table.ok_or_else(|| file("no log strings".into()))?;
    let mut decoder = table.new_stream_decoder();
    let mut core = session.core(0).map_err(|e| sorted(&e))?;
    let mut rtt = channels(&mut core)?;
    let mut buffer = [0; 1024];
    loop {
        let channel = rtt.up_channel(LOG);
        let channel = channel.ok_or(Trouble::NoChannel { channel: "defmt" })?;
        let read = channel.read(&mut core, &mut buffer);
        let n = read.map_err(|e| Trouble::Other(chain(&e)))?;
        decoder.received(buffer.get(..n).unwrap_or_default());
        loop {
            match decoder.decode() {
                Ok(frame) => tell(&frame.display(true).to_string()),
                Err(DecodeError::UnexpectedEof) => break,
                Err(DecodeError::Malformed) if table.encoding().can_recover() => {}
                Err(DecodeError::Malformed) => {
                    return Err(Trouble::Other("the log is damaged".into()));
                }
            }
        }
        if n == 0 {
            std::thread::sleep(Duration::from_millis(20));
        }
    }
}

//! The host's side of two RTT channels (SEGGER UM08001, "Real-Time Transfer"), of a board whose
//! memory can be had: a line to the firmware without a serial port. On a real board probe-rs does
//! this.

use std::io::{self, ErrorKind, Read, Write};
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::time::Duration;

use object::{Object, ObjectSymbol};

use crate::gdb::{Gdb, Halted};

/// Bytes of the control block before its channels, and of a channel: name, buffer, size, write,
/// read, flags.
const HEADER: u32 = 24;
const CHANNEL: u32 = 24;
/// Start of the control block once the firmware has made its channels (UM08001, "RTT control
/// block").
const READY: &[u8; 16] = b"SEGGER RTT\0\0\0\0\0\0";
/// The firmware's channels (boards/runtime/src/probe.rs).
const UP: u32 = 1;
const DOWN: u32 = 0;

/// Address at which the linker put the control block of `image`.
///
/// # Errors
/// It is no image, or has none.
pub fn control_block(image: &Path) -> io::Result<u32> {
    let data = std::fs::read(image)?;
    let file = object::File::parse(&*data).map_err(io::Error::other)?;
    let symbol = file.symbols().find(|s| s.name() == Ok("_SEGGER_RTT"));
    symbol
        .map(|symbol| symbol.address() as u32)
        .ok_or_else(|| io::Error::other("the image has no RTT control block"))
}

/// Carries bytes between the returned stream and the channels, until either is gone.
///
/// # Errors
/// The stream cannot be made.
pub fn line(mut gdb: Gdb, block: u32) -> io::Result<UnixStream> {
    let (ours, theirs) = UnixStream::pair()?;
    ours.set_nonblocking(true)?;
    std::thread::spawn(move || {
        let mut pending = Vec::new();
        while exchange(&mut gdb, block, &ours, &mut pending).is_ok() {
            std::thread::sleep(Duration::from_millis(1));
        }
    });
    Ok(theirs)
}

fn exchange(
    gdb: &mut Gdb,
    block: u32,
    mut ours: &UnixStream,
    pending: &mut Vec<u8>,
) -> io::Result<()> {
    let mut chunk = [0; 256];
    match ours.read(&mut chunk) {
        Ok(0) => return Err(ErrorKind::UnexpectedEof.into()),
        Ok(n) => pending.extend(&chunk[..n]),
        Err(error) if error.kind() == ErrorKind::WouldBlock => {}
        Err(error) => return Err(error),
    }
    let mut halted = gdb.halt()?;
    if halted.read(block, READY.len() as u32)? != READY {
        return Ok(());
    }
    let counts = halted.words(block + 16, 2)?;
    let up = block + HEADER + UP * CHANNEL;
    let down = block + HEADER + (counts[0] + DOWN) * CHANNEL;
    let heard = take(&mut halted, up)?;
    let given = give(&mut halted, down, pending)?;
    drop(halted);
    pending.drain(..given);
    ours.write_all(&heard)
}

/// Bytes that the board has written and nobody has read.
fn take(halted: &mut Halted<'_>, channel: u32) -> io::Result<Vec<u8>> {
    let [_, buffer, size, write, read, _] = words(halted, channel)?;
    if write == read {
        return Ok(Vec::new());
    }
    let mut bytes = Vec::new();
    let end = if write > read { write } else { size };
    bytes.extend(halted.read(buffer + read, end - read)?);
    if write < read && write > 0 {
        bytes.extend(halted.read(buffer, write)?);
    }
    halted.write(channel + 16, &write.to_le_bytes())?;
    Ok(bytes)
}

/// Gives the board as much as it has room for: how much that was.
fn give(halted: &mut Halted<'_>, channel: u32, bytes: &[u8]) -> io::Result<usize> {
    let [_, buffer, size, mut write, read, _] = words(halted, channel)?;
    let mut given = 0;
    for byte in bytes {
        let next = (write + 1) % size;
        if next == read {
            break;
        }
        halted.write(buffer + write, &[*byte])?;
        write = next;
        given += 1;
    }
    halted.write(channel + 12, &write.to_le_bytes())?;
    Ok(given)
}

fn words(halted: &mut Halted<'_>, channel: u32) -> io::Result<[u32; 6]> {
    let words = halted.words(channel, 6)?;
    words.try_into().map_err(|_| io::Error::other("six words"))
}

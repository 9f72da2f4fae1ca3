//! The controller as a program of this machine: the session that runs on a chip, with standard
//! input and output for a link. Its commands are those of the chip, bit by bit, which the tests
//! hold it to.
//!
//! Ends with status 0 after Stop, 2 when a pipe breaks, 3 at the end of the input without a Stop,
//! as the images in QEMU do.

use std::io::{self, Read, Write};
use std::process::ExitCode;

use sinew_device::clock::Clock;

/// Steps are not timed here: this machine's time says nothing about a chip's.
struct NoClock;

impl Clock for NoClock {
    fn ticks(&self) -> u32 {
        0
    }
}

/// Answers until Stop (true) or the end of the input (false).
fn serve(mut input: impl Read, mut output: impl Write) -> io::Result<bool> {
    let mut session = model::session();
    let mut chunk = [0; 4096];
    loop {
        let n = input.read(&mut chunk)?;
        let bytes = chunk.get(..n).unwrap_or_default();
        if bytes.is_empty() {
            return Ok(false);
        }
        let mut outcome = Ok(());
        session.receive(bytes, &NoClock, |frame| {
            if outcome.is_ok() {
                outcome = output.write_all(frame);
            }
        });
        outcome?;
        output.flush()?;
        if session.is_stopped() {
            return Ok(true);
        }
    }
}

fn main() -> ExitCode {
    match serve(io::stdin().lock(), io::stdout().lock()) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::from(3),
        Err(error) => {
            eprintln!("sinew-board-host: {error}");
            ExitCode::from(2)
        }
    }
}

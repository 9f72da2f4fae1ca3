//! The lockstep channel: two files of the host, by ARM semihosting. The core stands inside the call until
//! the host has answered, so virtual time stands still and no other task runs.

use core::ffi::CStr;

use ::semihosting::fs::File;
use ::semihosting::io::{self, Read, Write};

/// Frames from the host, in QEMU's working directory: a FIFO, or a link to `/dev/stdin`.
const TO_DEVICE: &CStr = c"to_device";
/// Frames to the host: a FIFO, or a link to `/dev/fd/3` (run.sh).
const TO_HOST: &CStr = c"to_host";

/// Both directions, open.
pub struct Channel {
    from_host: File,
    to_host: File,
}

impl Channel {
    /// Opens both files. With FIFOs this waits for the other end, in this order: the host has to open
    /// `to_device` for writing, then `to_host` for reading.
    ///
    /// # Errors
    /// The host's `errno`: there is no such file.
    pub fn open() -> io::Result<Self> {
        Ok(Self {
            from_host: File::open(TO_DEVICE)?,
            to_host: File::create(TO_HOST)?,
        })
    }

    /// Waits for bytes and returns how many came, at most `buffer.len()`; 0 when the host has closed its
    /// end.
    ///
    /// # Errors
    /// The host's `errno`.
    pub fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.from_host.read(buffer)
    }

    /// Writes everything.
    ///
    /// # Errors
    /// The host's `errno`: it has closed its end.
    pub fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.to_host.write_all(bytes)
    }
}

/// Ends QEMU with this exit status.
pub fn exit(code: ExitCode) -> ! {
    ::semihosting::process::exit(code as i32)
}

/// Exit status of QEMU, hence of a run.
#[derive(Clone, Copy)]
pub enum ExitCode {
    /// The host said Stop and got its Done.
    Stopped = 0,
    /// A channel file could not be opened, read or written.
    Channel = 2,
    /// The host closed its end without saying Stop.
    HostGone = 3,
    /// A fault, a panic included.
    HardFault = 101,
    /// An exception or interrupt that nothing handles.
    Unhandled = 102,
}

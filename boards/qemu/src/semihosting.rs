//! Pairs of files of the host, by ARM semihosting. The core stands inside the call until the host
//! has answered, so virtual time stands still and no other task runs.

use core::ffi::CStr;

use ::semihosting::fs::File;
use ::semihosting::io::{self, Read, Write};

/// The lockstep link in QEMU's working directory: frames from the host (a FIFO, or a link to
/// `/dev/stdin`) and to it (a FIFO, or a link to `/dev/fd/3`: run.sh).
pub const LINK: [&CStr; 2] = [c"to_device", c"to_host"];
/// A rig that the host simulates: codes of its sensors, duties for its actuators.
pub const RIG: [&CStr; 2] = [c"sensors", c"actuators"];

/// Both directions, open.
pub struct Channel {
    from_host: File,
    to_host: File,
}

impl Channel {
    /// Opens both files. With FIFOs this waits for the other end, in this order: the host has to
    /// open the first for writing, then the second for reading.
    ///
    /// # Errors
    /// The host's `errno`: there is no such file.
    pub fn open([from_host, to_host]: [&CStr; 2]) -> io::Result<Self> {
        let from_host = File::open(from_host)?;
        // After the first: where that is absent, this one is not created.
        let to_host = File::create(to_host)?;
        Ok(Self { from_host, to_host })
    }

    /// Waits for bytes and returns how many came, at most `buffer.len()`; 0 when the host has
    /// closed its end.
    ///
    /// # Errors
    /// The host's `errno`.
    pub fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.from_host.read(buffer)
    }

    /// Waits until `buffer` is full.
    ///
    /// # Errors
    /// The host's `errno`, or it has closed its end.
    pub fn read_exact(&mut self, buffer: &mut [u8]) -> io::Result<()> {
        self.from_host.read_exact(buffer)
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
    /// A check of the board itself does not hold.
    CheckFailed = 4,
    /// A fault, a panic included.
    HardFault = 101,
    /// An exception or interrupt that nothing handles.
    Unhandled = 102,
}

/// Reads the start of a file of the host: how many bytes, or `None` if it cannot be had.
pub fn read_file(path: &CStr, buffer: &mut [u8]) -> Option<usize> {
    File::open(path).ok()?.read(buffer).ok()
}

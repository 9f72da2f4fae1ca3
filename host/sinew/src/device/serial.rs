//! A device behind QEMU's serial line, in real time: the board's `free` image.

use std::io::ErrorKind;
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, Instant};

use super::{Device, Guarded, PATIENCE, Workplace, emulator, own_folder};
use sinew_ident::error::{Error, Result};

/// An instruction takes 32 ns of virtual time, and virtual time waits for real time
/// (boards/qemu/README.md).
const REAL_TIME: &str = "shift=5,sleep=on";

impl Device {
    /// Starts `image` in QEMU in real time, frames over its first UART. `runner` as in
    /// [`Device::qemu`].
    ///
    /// # Errors
    /// QEMU cannot be started or does not connect its serial line.
    pub fn serial(runner: &Path, image: &Path) -> Result<Self> {
        Self::serial_in(own_folder()?, runner, image)
    }

    /// As [`Device::serial`], with files that the firmware is to find in its working folder: a
    /// simulated rig's, a fault on order (boards/qemu/README.md).
    ///
    /// # Errors
    /// As [`Device::serial`].
    pub fn serial_in(folder: Workplace, runner: &Path, image: &Path) -> Result<Self> {
        let socket = folder.path().join("uart");
        // This end listens before QEMU starts, so neither can miss the other.
        let listener = UnixListener::bind(&socket).map_err(|e| Error::write(&socket, e))?;
        let mut command = emulator(runner, image, &folder)?;
        command
            .env("ICOUNT", REAL_TIME)
            .env("SERIAL", format!("unix:{}", socket.display()))
            .stdin(Stdio::null())
            .stdout(Stdio::null());
        let mut device = Self::start(folder, command)?;
        let line = device.accept(&listener)?;
        let other = line
            .try_clone()
            .map_err(|e| Error::failed(format!("the serial line: {e}")))?;
        device.connect(other, line);
        Ok(device)
    }

    fn accept(&mut self, listener: &UnixListener) -> Result<UnixStream> {
        let failed = |e: std::io::Error| Error::failed(format!("the serial line: {e}"));
        listener.set_nonblocking(true).map_err(failed)?;
        let deadline = Instant::now() + PATIENCE;
        loop {
            match listener.accept() {
                Ok((line, _)) => {
                    line.set_nonblocking(false).map_err(failed)?;
                    return Ok(line);
                }
                Err(error) if error.kind() != ErrorKind::WouldBlock => return Err(failed(error)),
                Err(_) => {}
            }
            let ended = self.child.as_mut().map(Guarded::try_wait).transpose();
            if let Some(status) = ended.map_err(failed)?.flatten() {
                return Err(Error::failed(format!(
                    "QEMU ended before its serial line opened ({status})"
                )));
            }
            if Instant::now() > deadline {
                return Err(Error::failed("QEMU does not open its serial line"));
            }
            std::thread::sleep(Duration::from_millis(5));
        }
    }
}

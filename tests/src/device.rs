//! A controller to talk to: an image in QEMU or the host's own build of the same session. Each is a child
//! process; frames go over its two pipes, or over QEMU's serial line.

use std::io::{Error, ErrorKind, Read, Result as IoResult, Write};
use std::os::unix::fs::symlink;
use std::os::unix::net::UnixListener;
use std::path::Path;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use sinew_firmware::protocol::{ToDevice, ToHost};
use tempfile::TempDir;

use crate::frames::{Decoder, encode};
use crate::image::board_folder;

/// Longest wait for one frame. A step takes milliseconds, and a busy machine is given its time.
const PATIENCE: Duration = Duration::from_secs(60);

/// A running controller. Dropping it ends the process.
pub struct Device {
    child: Child,
    to_device: Option<Box<dyn Write>>,
    from_device: Receiver<Vec<u8>>,
    decoder: Decoder,
    folder: TempDir,
}

/// How a device ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct End {
    /// Exit status; `None` where a signal ended the process.
    pub status: Option<i32>,
    /// The undecoded defmt log; empty for the host's build.
    pub log: Vec<u8>,
}

impl Device {
    /// Starts an image in QEMU, in lockstep: virtual time stands still while the core waits for a frame.
    ///
    /// # Errors
    /// QEMU or its working directory could not be had.
    pub fn qemu(image: &Path) -> IoResult<Self> {
        let folder = tempfile::tempdir()?;
        // The firmware's two channel files are this process's pipes (boards/qemu/run.sh).
        symlink("/dev/stdin", folder.path().join("to_device"))?;
        symlink("/dev/fd/3", folder.path().join("to_host"))?;
        let mut command = Command::new(board_folder("qemu").join("run.sh"));
        command.arg(image).env("LOG", folder.path().join("log"));
        Self::on_pipes(command, folder)
    }

    /// Starts the host's build of the same session.
    ///
    /// # Errors
    /// It could not be started.
    pub fn host(program: &Path) -> IoResult<Self> {
        Self::on_pipes(Command::new(program), tempfile::tempdir()?)
    }

    /// Starts an image in QEMU in real time, frames over its first UART.
    ///
    /// # Errors
    /// QEMU could not be started or does not connect its serial line.
    pub fn serial(image: &Path) -> IoResult<Self> {
        let folder = tempfile::tempdir()?;
        let socket = folder.path().join("uart");
        // This end listens before QEMU starts, so neither can miss the other.
        let listener = UnixListener::bind(&socket)?;
        listener.set_nonblocking(true)?;
        let child = Command::new(board_folder("qemu").join("run.sh"))
            .arg(image)
            .env("LOG", folder.path().join("log"))
            .env("ICOUNT", "shift=5,sleep=on")
            .env("SERIAL", format!("unix:{}", socket.display()))
            .current_dir(folder.path())
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .spawn()?;
        // Made at once, so that an early return ends the child.
        let mut device = Self::around(child, folder);
        let deadline = Instant::now() + PATIENCE;
        let line = loop {
            match listener.accept() {
                Ok((line, _)) => break line,
                Err(error) if error.kind() != ErrorKind::WouldBlock => return Err(error),
                Err(_) if Instant::now() > deadline => {
                    return Err(Error::new(ErrorKind::TimedOut, "no serial line from QEMU"));
                }
                Err(_) => std::thread::sleep(Duration::from_millis(5)),
            }
        };
        line.set_nonblocking(false)?;
        device.connect(line.try_clone()?, line);
        Ok(device)
    }

    fn on_pipes(mut command: Command, folder: TempDir) -> IoResult<Self> {
        let mut child = command
            .current_dir(folder.path())
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()?;
        let (input, output) = (child.stdin.take(), child.stdout.take());
        let mut device = Self::around(child, folder);
        match (input, output) {
            (Some(input), Some(output)) => device.connect(input, output),
            _ => return Err(Error::other("the child has no pipes")),
        }
        Ok(device)
    }

    fn around(child: Child, folder: TempDir) -> Self {
        Self {
            child,
            to_device: None,
            from_device: channel().1,
            decoder: Decoder::default(),
            folder,
        }
    }

    fn connect(&mut self, to: impl Write + 'static, mut from: impl Read + Send + 'static) {
        let (chunks, from_device) = channel();
        // A thread of its own, so that a device that has gone silent is noticed.
        std::thread::spawn(move || {
            let mut chunk = [0; 4096];
            while let Ok(n @ 1..) = from.read(&mut chunk) {
                if chunks.send(chunk[..n].to_vec()).is_err() {
                    break;
                }
            }
        });
        self.to_device = Some(Box::new(to));
        self.from_device = from_device;
    }

    /// Sends one frame.
    ///
    /// # Errors
    /// The device is gone.
    pub fn send(&mut self, message: &ToDevice) -> Result<(), String> {
        self.send_bytes(&encode(message))
    }

    /// Sends bytes that need not be a frame.
    ///
    /// # Errors
    /// The device is gone.
    pub fn send_bytes(&mut self, bytes: &[u8]) -> Result<(), String> {
        let Some(pipe) = &mut self.to_device else {
            return Err("the pipe to the device is closed".into());
        };
        pipe.write_all(bytes)
            .and_then(|()| pipe.flush())
            .map_err(|error| format!("cannot send: {error}"))
    }

    /// The next frame from the device.
    ///
    /// # Errors
    /// It ended, stayed silent, or sent something that is no frame.
    pub fn receive(&mut self) -> Result<ToHost, String> {
        loop {
            if let Some(message) = self.decoder.next_message()? {
                return Ok(message);
            }
            match self.from_device.recv_timeout(PATIENCE) {
                Ok(chunk) => self.decoder.push(&chunk),
                Err(RecvTimeoutError::Timeout) => {
                    return Err(format!("silent for {} s", PATIENCE.as_secs()));
                }
                Err(RecvTimeoutError::Disconnected) => {
                    return Err(format!("the device ended: {}", self.wait()?));
                }
            }
        }
    }

    /// One question, one answer.
    ///
    /// # Errors
    /// As [`Device::send`] and [`Device::receive`].
    pub fn ask(&mut self, message: &ToDevice) -> Result<ToHost, String> {
        self.send(message)?;
        self.receive()
    }

    /// Hangs up and waits for the end of a device that notices that, or was told to stop.
    ///
    /// # Errors
    /// It does not end (and is killed), or its log cannot be read.
    pub fn finish(mut self) -> Result<End, String> {
        self.to_device = None;
        let status = self.wait()?;
        let log = self.folder.path().join("log");
        let log = if log.exists() {
            std::fs::read(&log).map_err(|error| format!("{}: {error}", log.display()))?
        } else {
            Vec::new()
        };
        Ok(End {
            status: status.code(),
            log,
        })
    }

    fn wait(&mut self) -> Result<ExitStatus, String> {
        let deadline = Instant::now() + PATIENCE;
        loop {
            match self.child.try_wait().map_err(|error| error.to_string())? {
                Some(status) => return Ok(status),
                None if Instant::now() > deadline => return Err("the device does not end".into()),
                None => std::thread::sleep(Duration::from_millis(5)),
            }
        }
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        // Both fail only when the process has ended already.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

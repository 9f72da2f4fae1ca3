//! A controller to talk to: an image in QEMU or this computer's build of the same session, each a
//! child process with frames on its two pipes, or on QEMU's serial line.

mod children;
mod log;
mod serial;

use std::collections::VecDeque;
use std::io::{Read, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

pub use children::{AllKilled, Guarded, Workplace, kill_all};
pub use log::decode_log;
use sinew_firmware::protocol::{
    Accumulator, Fed, Identity, MAX_FRAME, PROTOCOL, Summary, ToDevice, ToHost, decode, encode,
};

use crate::error::{Error, Result};

/// Longest wait for one frame. A step takes milliseconds, and a busy machine is given its time.
const PATIENCE: Duration = Duration::from_secs(60);

/// A running controller. Dropping it ends the process.
pub struct Device {
    child: Guarded,
    to_device: Option<Box<dyn Write + Send>>,
    from_device: Receiver<Vec<u8>>,
    accumulator: Accumulator,
    waiting: VecDeque<ToHost>,
    // After the child, which works in it.
    folder: Workplace,
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
    /// Starts `image` in QEMU, in lockstep: virtual time stands still while the core waits for a
    /// frame. `runner` is the board's `run.sh`, the one place that holds the machine's options.
    ///
    /// # Errors
    /// QEMU is not installed or its working folder cannot be made.
    pub fn qemu(runner: &Path, image: &Path) -> Result<Self> {
        let folder = own_folder()?;
        channels(&folder).map_err(|e| Error::write(folder.path(), e))?;
        let command = emulator(runner, image, &folder)?;
        Self::on_pipes(folder, command)
    }

    /// Starts this computer's build of the same session.
    ///
    /// # Errors
    /// It cannot be started.
    pub fn host(program: &Path) -> Result<Self> {
        Self::on_pipes(own_folder()?, Command::new(program))
    }

    fn on_pipes(folder: Workplace, mut command: Command) -> Result<Self> {
        command.stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut device = Self::start(folder, command)?;
        if let (Some(to), Some(from)) = (device.child.stdin(), device.child.stdout()) {
            device.connect(to, from);
        }
        Ok(device)
    }

    /// Starts the process; nothing can be said to it yet.
    fn start(folder: Workplace, mut command: Command) -> Result<Self> {
        command.current_dir(folder.path());
        let child = Guarded::spawn(&mut command).map_err(|e| {
            Error::failed(format!(
                "{:?} cannot be started: {e}",
                command.get_program()
            ))
        })?;
        Ok(Self {
            child,
            to_device: None,
            from_device: channel().1,
            accumulator: Accumulator::new(),
            waiting: VecDeque::new(),
            folder,
        })
    }

    fn connect(&mut self, to: impl Write + Send + 'static, mut from: impl Read + Send + 'static) {
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

    /// Process number.
    pub fn process(&self) -> u32 {
        self.child.id()
    }

    /// Sends one frame.
    ///
    /// # Errors
    /// The device is gone.
    pub fn send(&mut self, message: &ToDevice) -> Result<()> {
        let mut buffer = [0; MAX_FRAME];
        let frame = encode(message, &mut buffer)
            .ok_or_else(|| Error::failed("the message is longer than a frame can be"))?;
        self.send_bytes(frame)
    }

    /// Sends bytes that need not be a frame.
    ///
    /// # Errors
    /// The device is gone.
    pub fn send_bytes(&mut self, bytes: &[u8]) -> Result<()> {
        let Some(pipe) = &mut self.to_device else {
            return Err(Error::failed("the device was told to end"));
        };
        pipe.write_all(bytes)
            .and_then(|()| pipe.flush())
            .map_err(|e| Error::failed(format!("the device does not take frames: {e}")))
    }

    /// The next frame from the device.
    ///
    /// # Errors
    /// It ended, stayed silent, or sent something that is no frame.
    pub fn receive(&mut self) -> Result<ToHost> {
        loop {
            if let Some(message) = self.waiting.pop_front() {
                return Ok(message);
            }
            match self.from_device.recv_timeout(PATIENCE) {
                Ok(chunk) => self.take(&chunk)?,
                Err(RecvTimeoutError::Timeout) => {
                    return Err(Error::failed(format!(
                        "the device was silent for {PATIENCE:?}"
                    )));
                }
                Err(RecvTimeoutError::Disconnected) => {
                    let how = match self.child.wait() {
                        Ok(status) => status.to_string(),
                        Err(error) => error.to_string(),
                    };
                    return Err(Error::failed(format!("the device ended by itself ({how})")));
                }
            }
        }
    }

    fn take(&mut self, chunk: &[u8]) -> Result<()> {
        for byte in chunk {
            match self.accumulator.feed(*byte) {
                Fed::Nothing => {}
                Fed::Frame(frame) => {
                    let message = decode(frame).map_err(|e| {
                        Error::failed(format!("a damaged frame from the device ({e:?})"))
                    })?;
                    self.waiting.push_back(message);
                }
                Fed::TooLong => return Err(Error::failed("a frame from the device has no end")),
            }
        }
        Ok(())
    }

    /// One question, one answer.
    ///
    /// # Errors
    /// As [`Device::send`] and [`Device::receive`]; a refusal is an error as well.
    pub fn ask(&mut self, message: &ToDevice) -> Result<ToHost> {
        self.send(message)?;
        match self.receive()? {
            ToHost::Refused { reason } => Err(Error::failed(format!(
                "the device refused a frame: {reason:?}"
            ))),
            answer => Ok(answer),
        }
    }

    /// Who it is; refuses a device of another protocol version or, where `model` is given, another
    /// model.
    ///
    /// # Errors
    /// No answer, or the wrong device.
    pub fn hello(&mut self, model: Option<u32>) -> Result<Identity> {
        let ToHost::Hello(identity) = self.ask(&ToDevice::Hello)? else {
            return Err(Error::failed("the device does not say who it is"));
        };
        if identity.protocol != PROTOCOL {
            return Err(Error::failed(format!(
                "the device speaks protocol {}, this program {PROTOCOL}; build its firmware again",
                identity.protocol
            )));
        }
        match model {
            Some(hash) if hash != identity.model => Err(Error::failed(format!(
                "the device carries model {:08x}, not {hash:08x}; build its firmware again",
                identity.model
            ))),
            _ => Ok(identity),
        }
    }

    /// Ends the run: its figures, and how the process ended.
    ///
    /// # Errors
    /// The device does not answer or does not end.
    pub fn finish(mut self) -> Result<(Summary, End)> {
        let ToHost::Done(summary) = self.ask(&ToDevice::Stop)? else {
            return Err(Error::failed("the device does not answer to Stop"));
        };
        Ok((summary, self.end()?))
    }

    /// Closes the pipe to the device and waits for its end. A device that does not end is killed.
    ///
    /// # Errors
    /// It had to be killed, or its log cannot be read.
    pub fn end(mut self) -> Result<End> {
        self.to_device = None;
        let deadline = Instant::now() + PATIENCE;
        let status = loop {
            match self
                .child
                .try_wait()
                .map_err(|e| Error::failed(format!("the device: {e}")))?
            {
                Some(status) => break status,
                None if Instant::now() > deadline => {
                    return Err(Error::failed(
                        "the device does not end although its pipe is closed",
                    ));
                }
                None => std::thread::sleep(Duration::from_millis(2)),
            }
        };
        let path = self.folder.path().join(LOG);
        let log = match path.exists() {
            true => std::fs::read(&path).map_err(|e| Error::read(&path, e))?,
            false => Vec::new(),
        };
        Ok(End {
            status: status.code(),
            log,
        })
    }
}

/// The log's file in a device's working folder.
const LOG: &str = "log";

/// QEMU by way of the board's `run.sh`, which is to run in `folder`.
fn emulator(runner: &Path, image: &Path, folder: &Workplace) -> Result<Command> {
    if let Err(error) = Command::new("qemu-system-arm").arg("--version").output() {
        return Err(
            Error::failed(format!("qemu-system-arm cannot be run: {error}"))
                .help("apt-get install --no-install-recommends qemu-system-arm"),
        );
    }
    // The child has a working folder of its own.
    let absolute = |path: &Path| std::path::absolute(path).map_err(|e| Error::read(path, e));
    let mut command = Command::new("sh");
    command
        .arg(absolute(runner)?)
        .arg(absolute(image)?)
        .env("LOG", folder.path().join(LOG));
    Ok(command)
}

fn own_folder() -> Result<Workplace> {
    Workplace::new().map_err(|e| Error::write(std::env::temp_dir(), e))
}

/// Makes the firmware's two channel files in `folder` the pipes of the process (boards/qemu/run.sh).
fn channels(folder: &Workplace) -> std::io::Result<()> {
    std::os::unix::fs::symlink("/dev/stdin", folder.path().join("to_device"))?;
    std::os::unix::fs::symlink("/dev/fd/3", folder.path().join("to_host"))
}

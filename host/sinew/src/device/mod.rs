//! A controller to talk to: an image in QEMU or this computer's build of the same session, each a
//! child process with frames on its two pipes or on QEMU's serial line; or a board behind a serial
//! port.

mod children;
mod log;
mod port;
mod serial;

use std::collections::VecDeque;
use std::io::{Read, Write};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

pub use children::{AllKilled, Guarded, Workplace, kill_all};
pub use log::decode_log;
use sinew_device::mode::Drive;
use sinew_device::protocol::{
    Accumulator, Fed, Identity, MAX_FRAME, PROTOCOL, Summary, Telemetry, ToDevice, ToHost, decode,
    encode,
};

use sinew_ident::error::{Error, Result};

/// Longest wait for one frame. A step takes milliseconds, and a busy machine is given its time.
const PATIENCE: Duration = Duration::from_secs(60);

/// A running controller. Dropping it ends the process, where it is one.
pub struct Device {
    child: Option<Guarded>,
    to_device: Option<Box<dyn Write + Send>>,
    from_device: Receiver<Vec<u8>>,
    accumulator: Accumulator,
    waiting: VecDeque<ToHost>,
    telemetry: VecDeque<Telemetry>,
    /// A real line damages frames now and then: counted, and whoever waits for them asks again.
    damaged: Option<u32>,
    // After the child, which works in it.
    folder: Option<Workplace>,
}

/// End of a device.
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
        if let Some(child) = &mut device.child
            && let (Some(to), Some(from)) = (child.stdin(), child.stdout())
        {
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
        Ok(Self::new(Some(child), Some(folder)))
    }

    fn new(child: Option<Guarded>, folder: Option<Workplace>) -> Self {
        Self {
            child,
            to_device: None,
            from_device: channel().1,
            accumulator: Accumulator::new(),
            waiting: VecDeque::new(),
            telemetry: VecDeque::new(),
            damaged: None,
            folder,
        }
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

    /// Process number; 0 for a board, which is none.
    pub fn process(&self) -> u32 {
        self.child.as_ref().map_or(0, Guarded::id)
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
                    let how = match self.child.as_mut().map(Guarded::wait) {
                        Some(Ok(status)) => status.to_string(),
                        Some(Err(error)) => error.to_string(),
                        None => return Err(Error::failed("the port was closed at the other end")),
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
                Fed::Frame(frame) => match (decode(frame), &mut self.damaged) {
                    (Ok(ToHost::Telemetry(telemetry)), _) => self.telemetry.push_back(telemetry),
                    (Ok(message), _) => self.waiting.push_back(message),
                    (Err(_), Some(damaged)) => *damaged += 1,
                    (Err(e), None) => {
                        let what = format!("a damaged frame from the device ({e:?})");
                        return Err(Error::failed(what));
                    }
                },
                Fed::TooLong => match &mut self.damaged {
                    Some(damaged) => *damaged += 1,
                    None => return Err(Error::failed("a frame from the device has no end")),
                },
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

    /// Identity of the device; refuses one of another protocol version or, where `model` is given,
    /// another model.
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

    /// Lets commands be given to samples of this end: the plant is here, the board's own outputs
    /// stay off.
    ///
    /// # Errors
    /// The device refuses: it is armed already, or an emergency stop waits to be acknowledged.
    pub fn arm(&mut self) -> Result<()> {
        let (drive, blend_steps) = (Drive::Host, 0);
        match self.ask(&ToDevice::Arm { drive, blend_steps })? {
            ToHost::State(_) => Ok(()),
            other => Err(Error::failed(format!("Arm was answered by {other:?}"))),
        }
    }

    /// Ends the run: its figures, and how the process ended.
    ///
    /// # Errors
    /// The device does not answer or does not end.
    pub fn finish(mut self) -> Result<(Summary, End)> {
        self.send(&ToDevice::Stop)?;
        loop {
            match self.receive()? {
                ToHost::Done(summary) => return Ok((summary, self.end()?)),
                // Ticks of a board that paces itself go on until it has heard.
                ToHost::Command { .. } => {}
                _ => return Err(Error::failed("the device does not answer to Stop")),
            }
        }
    }

    /// Closes the pipe to the device and waits for its end. A device that does not end is killed.
    ///
    /// # Errors
    /// It had to be killed, or its log cannot be read.
    pub fn end(mut self) -> Result<End> {
        self.to_device = None;
        let deadline = Instant::now() + PATIENCE;
        let Some(child) = &mut self.child else {
            let (status, log) = (None, Vec::new());
            return Ok(End { status, log });
        };
        let status = loop {
            match child
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
        let path = self.folder.as_ref().map(|folder| folder.path().join(LOG));
        let log = match path.filter(|path| path.exists()) {
            Some(path) => std::fs::read(&path).map_err(|e| Error::read(&path, e))?,
            None => Vec::new(),
        };
        Ok(End {
            status: status.code(),
            log,
        })
    }
}

/// The log's file in a device's working folder.
const LOG: &str = "log";

/// Makes sure that QEMU can be started.
///
/// # Errors
/// It cannot.
pub fn has_qemu() -> Result<()> {
    match Command::new("qemu-system-arm").arg("--version").output() {
        Ok(_) => Ok(()),
        Err(error) => Err(
            Error::failed(format!("qemu-system-arm cannot be run: {error}"))
                .help("apt-get install --no-install-recommends qemu-system-arm"),
        ),
    }
}

/// QEMU by way of the board's `run.sh`, which is to run in `folder`.
fn emulator(runner: &Path, image: &Path, folder: &Workplace) -> Result<Command> {
    has_qemu()?;
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

/// Makes the firmware's two channel files in `folder` the pipes of the process
/// (boards/qemu/run.sh).
fn channels(folder: &Workplace) -> std::io::Result<()> {
    std::os::unix::fs::symlink("/dev/stdin", folder.path().join("to_device"))?;
    std::os::unix::fs::symlink("/dev/fd/3", folder.path().join("to_host"))
}

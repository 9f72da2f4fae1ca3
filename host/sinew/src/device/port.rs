//! A board behind a serial port of this computer, or behind a Unix socket, which is how QEMU shows
//! its own.

use std::fs::{File, OpenOptions};
use std::io::{Read, Write};
use std::os::unix::fs::{FileTypeExt, OpenOptionsExt};
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::time::{Duration, Instant};

use nix::fcntl::OFlag;
use nix::sys::termios::{self, BaudRate, ControlFlags, FlushArg, SetArg, SpecialCharacterIndices};
use sinew_device::mode::{Mode, State};
use sinew_device::protocol::{Telemetry, ToDevice, ToHost};

use super::Device;
use sinew_ident::error::{Error, Result};

/// Longest wait for an answer of a board: a few periods of the slowest rate, and the way there
/// and back.
const ANSWER: Duration = Duration::from_secs(1);
/// Attempts at a question: a real line loses one now and then.
const ATTEMPTS: usize = 3;

impl Device {
    /// Opens `path`, a serial port or a socket. What was on the line before is thrown away.
    ///
    /// # Errors
    /// There is no such port, or it may not be used; the message says what to do.
    pub fn port(path: &Path) -> Result<Self> {
        let failed = |e: std::io::Error| no_port(path, &e);
        let kind = std::fs::metadata(path).map_err(failed)?;
        if kind.file_type().is_socket() {
            let line = UnixStream::connect(path).map_err(failed)?;
            Self::over(line.try_clone().map_err(failed)?, line)
        } else {
            let line = open_serial(path).map_err(failed)?;
            Self::over(line.try_clone().map_err(failed)?, line)
        }
    }

    /// Talks over any line that may lose frames. What was on it before is thrown away.
    ///
    /// # Errors
    /// The line is gone.
    pub fn over(to: impl Write + Send + 'static, from: impl Read + Send + 'static) -> Result<Self> {
        let mut device = Self::new(None, None);
        device.damaged = Some(0);
        device.connect(to, from);
        device.drain(Duration::from_millis(100))?;
        Ok(device)
    }

    /// As [`Device::ask`], for a line that may lose frames: asked again when no answer comes.
    /// Answers to earlier questions, a Hello of a board that has just started among them, are
    /// passed over.
    ///
    /// # Errors
    /// No answer, or a refusal.
    pub fn insist(
        &mut self,
        question: &ToDevice,
        is_answer: impl Fn(&ToHost) -> bool,
    ) -> Result<ToHost> {
        for _ in 0..ATTEMPTS {
            self.send(question)?;
            let until = Instant::now() + ANSWER;
            while let Some(answer) = self.answer(until)? {
                match answer {
                    ToHost::Refused { reason } => {
                        return Err(Error::failed(format!(
                            "the device refused: {reason:?}, to {question:?}"
                        )));
                    }
                    answer if is_answer(&answer) => return Ok(answer),
                    _ => {}
                }
            }
        }
        Err(Error::failed("the board does not answer")
            .help("is it on, does it run this project's firmware (sinew flash), is this its port?"))
    }

    /// Emergency stop: sent until the board says that it has stopped. Answers to earlier questions,
    /// refusals among them, are passed over.
    ///
    /// # Errors
    /// The board does not say so.
    pub fn emergency_stop(&mut self) -> Result<State> {
        for _ in 0..ATTEMPTS {
            self.send(&ToDevice::EmergencyStop)?;
            let until = Instant::now() + ANSWER;
            while let Some(answer) = self.answer(until)? {
                match answer {
                    ToHost::State(state) if state.mode == Mode::Tripped => return Ok(state),
                    _ => {}
                }
            }
        }
        Err(
            Error::failed("the board does not confirm the emergency stop")
                .help("switch the power stages off by hand"),
        )
    }

    /// The next answer, if one comes before `until`. Telemetry is put aside
    /// ([`Device::telemetry`]).
    ///
    /// # Errors
    /// The line is gone.
    pub fn answer(&mut self, until: Instant) -> Result<Option<ToHost>> {
        loop {
            if let Some(answer) = self.waiting.pop_front() {
                return Ok(Some(answer));
            }
            if !self.listen(until)? {
                return Ok(None);
            }
        }
    }

    /// The next telemetry frame, if one comes before `until`. Answers are put aside.
    ///
    /// # Errors
    /// The line is gone.
    pub fn telemetry(&mut self, until: Instant) -> Result<Option<Telemetry>> {
        loop {
            if let Some(telemetry) = self.telemetry.pop_front() {
                return Ok(Some(telemetry));
            }
            if !self.listen(until)? {
                return Ok(None);
            }
        }
    }

    /// Frames from the device that were damaged on the way.
    pub fn damaged(&self) -> u32 {
        self.damaged.unwrap_or(0)
    }

    /// Takes what arrives first; `false`: nothing did, in time.
    fn listen(&mut self, until: Instant) -> Result<bool> {
        use std::sync::mpsc::RecvTimeoutError;
        let wait = until.saturating_duration_since(Instant::now());
        match self.from_device.recv_timeout(wait) {
            Ok(chunk) => self.take(&chunk).map(|()| true),
            Err(RecvTimeoutError::Timeout) => Ok(false),
            Err(RecvTimeoutError::Disconnected) => {
                Err(Error::failed("the port was closed at the other end"))
            }
        }
    }

    fn drain(&mut self, quiet: Duration) -> Result<()> {
        // The board may be in the middle of a frame: this ends whatever it takes for one of ours.
        self.send_bytes(&[0])?;
        let until = Instant::now() + quiet;
        while self.listen(until)? {}
        self.waiting.clear();
        self.telemetry.clear();
        self.damaged = Some(0);
        Ok(())
    }
}

/// Opens a serial port: 921,600 bits a second, 8 data bits, no parity, 1 stop bit, no flow control,
/// and no byte that the terminal driver touches.
fn open_serial(path: &Path) -> std::io::Result<File> {
    // Not this process's terminal: a Ctrl-C is the user's alone.
    let flags = OFlag::O_NOCTTY.bits();
    let line = OpenOptions::new()
        .read(true)
        .write(true)
        .custom_flags(flags)
        .open(path)?;
    let mut settings = termios::tcgetattr(&line)?;
    termios::cfmakeraw(&mut settings);
    termios::cfsetspeed(&mut settings, BaudRate::B921600)?;
    settings.control_flags |= ControlFlags::CREAD | ControlFlags::CLOCAL;
    settings.control_flags &= !(ControlFlags::CSTOPB | ControlFlags::CRTSCTS);
    // A read waits for a byte, however long.
    settings.control_chars[SpecialCharacterIndices::VMIN as usize] = 1;
    settings.control_chars[SpecialCharacterIndices::VTIME as usize] = 0;
    termios::tcsetattr(&line, SetArg::TCSANOW, &settings)?;
    termios::tcflush(&line, FlushArg::TCIOFLUSH)?;
    Ok(line)
}

/// Serial ports that a board's debugger or adapter may have made.
fn serial_ports() -> Vec<String> {
    let entries = std::fs::read_dir("/dev").into_iter().flatten().flatten();
    let names = entries.map(|entry| entry.file_name().to_string_lossy().into_owned());
    let mut ports: Vec<String> = names
        .filter(|name| {
            ["ttyACM", "ttyUSB", "cu.usb"]
                .iter()
                .any(|start| name.starts_with(start))
        })
        .map(|name| format!("/dev/{name}"))
        .collect();
    ports.sort();
    ports
}

fn no_port(path: &Path, error: &std::io::Error) -> Error {
    let found = serial_ports();
    let help = match error.kind() {
        std::io::ErrorKind::PermissionDenied => {
            "add yourself to the group that owns it (sudo usermod -aG dialout $USER) and log in again"
                .to_string()
        }
        _ if found.is_empty() => "no serial port is there: plug the board in".to_string(),
        _ => format!("serial ports here: {}", found.join(", ")),
    };
    Error::arguments(format!(
        "{}: the port cannot be opened: {error}",
        path.display()
    ))
    .help(help)
}

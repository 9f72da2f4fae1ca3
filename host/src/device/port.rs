//! A board behind a serial port of this computer, or behind a Unix socket, which is how QEMU shows its own.

use std::io::{Read, Write};
use std::os::unix::fs::FileTypeExt;
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::time::{Duration, Instant};

use serialport::TTYPort;
use sinew_firmware::protocol::{Telemetry, ToDevice, ToHost};

use super::Device;
use crate::error::{Error, Result};

/// What every board sets its line to.
const BAUD: u32 = 921_600;
/// How long a board may take for an answer: a few periods of the slowest rate, and the way there and back.
const ANSWER: Duration = Duration::from_secs(1);
/// How often a question is asked: a real line loses one now and then.
const ATTEMPTS: usize = 3;

impl Device {
    /// Opens `path`, a serial port or a socket. What was on the line before is thrown away.
    ///
    /// # Errors
    /// There is no such port, or it may not be used; the message says what to do.
    pub fn port(path: &Path) -> Result<Self> {
        let kind = std::fs::metadata(path).map_err(|e| no_port(path, &e))?;
        let mut device = Self::new(None, None);
        device.damaged = Some(0);
        if kind.file_type().is_socket() {
            let line = UnixStream::connect(path).map_err(|e| no_port(path, &e))?;
            let other = line.try_clone().map_err(|e| no_port(path, &e))?;
            device.connect(other, line);
        } else {
            let line = serialport::new(path.to_string_lossy(), BAUD)
                .timeout(Duration::from_millis(100))
                .open_native()
                .map_err(|e| no_port(path, &e.into()))?;
            let other = line
                .try_clone_native()
                .map_err(|e| no_port(path, &e.into()))?;
            device.connect(other, Patient(line));
        }
        device.drain(Duration::from_millis(100))?;
        Ok(device)
    }

    /// As [`Device::ask`], for a line that may lose frames: asked again when no answer comes. Answers to
    /// earlier questions, a Hello of a board that has just started among them, are passed over.
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

    /// The next answer, if one comes before `until`. Telemetry is put aside ([`Device::telemetry`]).
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

/// A serial port whose silence is no error.
struct Patient(TTYPort);

impl Read for Patient {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        loop {
            match self.0.read(buffer) {
                Err(error) if error.kind() == std::io::ErrorKind::TimedOut => {}
                other => return other,
            }
        }
    }
}

impl Write for Patient {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.0.flush()
    }
}

fn no_port(path: &Path, error: &std::io::Error) -> Error {
    let found: Vec<String> = serialport::available_ports()
        .unwrap_or_default()
        .into_iter()
        .map(|port| port.port_name)
        .collect();
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

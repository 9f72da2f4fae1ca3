//! A board in QEMU as a person has it on the desk: a serial port to it, and a rig behind its
//! converters that this end simulates.

use std::fs::{File, OpenOptions};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use nix::sys::stat::Mode;
use sinew::device::{Device, Guarded, Workplace, decode_log};
use sinew::project::{Board, board_folder};
use sinew_ident::error::{Error, Result};

use crate::gdb::Gdb;
use crate::image;
use crate::reference::{INPUT_LIMIT, INPUTS, OUTPUTS, Plant};
use crate::rtt::{self, control_block};

/// Full scale of the board's converters (boards/qemu/src/rig.rs).
pub const FULL_SCALE: u16 = 4095;

/// One tick as the rig saw it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tick {
    /// Outputs, before the converter.
    pub y: [f64; OUTPUTS],
    /// Commands, behind the converter.
    pub u: [f64; INPUTS],
    /// Power stages on.
    pub live: bool,
}

/// The board and its rig.
pub struct Desk {
    child: Guarded,
    folder: Workplace,
    image: PathBuf,
    ticks: Arc<Mutex<Vec<Tick>>>,
}

/// Codes of outputs as the model's range has them (boards/runtime/src/wiring.rs): -1 to 1.
pub fn codes(y: [f64; OUTPUTS]) -> [u16; OUTPUTS] {
    y.map(|y| {
        ((y + 1.0) / 2.0 * f64::from(FULL_SCALE))
            .round()
            .clamp(0.0, f64::from(FULL_SCALE)) as u16
    })
}

impl Desk {
    /// Starts the board; `sensors` turns the tick's number and the rig's outputs into converter
    /// codes, and `inject` is a fault on order (boards/qemu/src/inject.rs).
    ///
    /// # Errors
    /// The image does not build, QEMU does not start.
    pub fn start(
        sensors: impl FnMut(usize, [f64; OUTPUTS]) -> [u16; OUTPUTS] + Send + 'static,
        inject: Option<&str>,
    ) -> Result<Self> {
        let image = image::build(Board::Qemu)?
            .free
            .ok_or_else(|| Error::failed("there is no free-running image"))?;
        let failed = |e: std::io::Error| Error::failed(format!("the bench: {e}"));
        let folder = Workplace::new().map_err(failed)?;
        let at = |name: &str| folder.path().join(name);
        for name in ["sensors", "actuators"] {
            nix::unistd::mkfifo(&at(name), Mode::S_IRWXU).map_err(|e| failed(e.into()))?;
        }
        if let Some(order) = inject {
            std::fs::write(at("inject"), order).map_err(failed)?;
        }
        let ticks = Arc::new(Mutex::new(Vec::new()));
        let (to, from, seen) = (at("sensors"), at("actuators"), ticks.clone());
        // Ends when QEMU does: its ends of the FIFOs are closed then.
        std::thread::spawn(move || run_rig(&to, &from, sensors, &seen));
        let mut command = Command::new("sh");
        command
            .arg(board_folder(&image::root(), Board::Qemu).join("run.sh"))
            .arg(&image)
            .arg("-gdb")
            .arg(format!("unix:{},server=on,wait=off", at("gdb").display()))
            .env("LOG", at("log"))
            .env("ICOUNT", "shift=5,sleep=on")
            .env(
                "SERIAL",
                format!("unix:{},server=on,wait=off", at("port").display()),
            )
            .current_dir(folder.path())
            .stdin(Stdio::null())
            .stdout(Stdio::null());
        let child = Guarded::spawn(&mut command).map_err(failed)?;
        Ok(Self {
            child,
            folder,
            image,
            ticks,
        })
    }

    /// The board's serial port.
    ///
    /// # Errors
    /// It does not appear.
    pub fn port(&self) -> Result<PathBuf> {
        self.socket("port")
    }

    fn socket(&self, name: &str) -> Result<PathBuf> {
        let socket = self.folder.path().join(name);
        let patience = Instant::now() + Duration::from_secs(30);
        while !socket.exists() {
            if Instant::now() > patience {
                return Err(Error::failed(format!("QEMU does not open its {name}")));
            }
            std::thread::sleep(Duration::from_millis(10));
        }
        Ok(socket)
    }

    /// Opens the port, as `sinew record --port` does.
    ///
    /// # Errors
    /// It cannot be opened.
    pub fn connect(&self) -> Result<Device> {
        let port = self.port()?;
        patiently(|| Device::port(&port))
    }

    /// Talks to the board through its memory, as `sinew record --probe` does.
    ///
    /// # Errors
    /// The image has no channels, or QEMU does not show its memory.
    pub fn probe(&self) -> Result<Device> {
        let failed = |e: std::io::Error| Error::failed(format!("the board's memory: {e}"));
        let block = control_block(&self.image).map_err(failed)?;
        let socket = self.socket("gdb")?;
        let gdb = patiently(|| Gdb::connect(&socket)).map_err(failed)?;
        let line = rtt::line(gdb, block).map_err(failed)?;
        Device::over(line.try_clone().map_err(failed)?, line)
    }

    /// Ticks that the rig has seen so far.
    pub fn ticks(&self) -> Vec<Tick> {
        self.ticks
            .lock()
            .map(|ticks| ticks.clone())
            .unwrap_or_default()
    }

    /// Ends the board: its log.
    ///
    /// # Errors
    /// The log cannot be read.
    pub fn log(self) -> Result<String> {
        let path = self.folder.path().join("log");
        drop(self.child);
        let log = std::fs::read(&path).map_err(|e| Error::read(&path, e))?;
        decode_log(&self.image, &log)
    }
}

/// Result of `connect`, once it gives something: a socket is there a moment before somebody
/// listens on it.
fn patiently<T, E>(
    mut connect: impl FnMut() -> std::result::Result<T, E>,
) -> std::result::Result<T, E> {
    let patience = Instant::now() + Duration::from_secs(10);
    loop {
        match connect() {
            Err(_) if Instant::now() < patience => std::thread::sleep(Duration::from_millis(10)),
            connected => return connected,
        }
    }
}

/// The rig of the reference problem behind converters, tick by tick, until the board is gone.
fn run_rig(
    to_board: &Path,
    from_board: &Path,
    mut sensors: impl FnMut(usize, [f64; OUTPUTS]) -> [u16; OUTPUTS],
    ticks: &Mutex<Vec<Tick>>,
) {
    // In the order in which the board opens its ends.
    let Ok(mut to) = OpenOptions::new().write(true).open(to_board) else {
        return;
    };
    let Ok(mut from) = File::open(from_board) else {
        return;
    };
    let mut plant = Plant::default();
    for k in 0.. {
        let y = plant.outputs();
        for code in sensors(k, y) {
            if to.write_all(&code.to_le_bytes()).is_err() {
                return;
            }
        }
        let mut words = [0; 2 * (INPUTS + 1)];
        if from.read_exact(&mut words).is_err() {
            return;
        }
        let (words, _) = words.as_chunks::<2>();
        let live = words
            .last()
            .is_some_and(|word| u16::from_le_bytes(*word) == 1);
        let limit = f64::from(INPUT_LIMIT);
        let u = std::array::from_fn(|i| {
            f64::from(u16::from_le_bytes(words[i])) / f64::from(FULL_SCALE) * 2.0 * limit - limit
        });
        plant.advance(if live { u } else { [0.0; INPUTS] });
        if let Ok(mut ticks) = ticks.lock() {
            ticks.push(Tick { y, u, live });
        }
    }
}

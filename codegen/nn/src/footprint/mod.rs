//! Footprint of a network on a board, before anything is flashed: flash, RAM, stack, instructions.
//!
//! The printed crate is compiled and linked for the target, and run in QEMU, which counts
//! instructions and stack.

mod board;
pub mod chip;
pub mod probe;

use std::path::Path;

use object::{Object, ObjectSection, SectionFlags, SectionKind};

use crate::emit::{Options, Weights, emit};
use crate::summary::thousands;
use crate::{BuildError, Network, target};
use sinew_files::FileError;

pub use board::{BOARDS, Board};
pub use chip::CYCLES_PER_INSTRUCTION;

/// Cost of one function.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cost {
    /// Code, weights and initial values, with what they call.
    pub flash_bytes: u64,
    /// State.
    pub ram_bytes: u64,
    /// Deepest stack of a call; none without QEMU.
    pub stack_bytes: Option<u64>,
    /// Instructions of a call; none without QEMU.
    pub instructions: Option<u64>,
}

/// Footprint of a network.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Footprint {
    /// `predict` alone.
    pub predict: Cost,
    /// `predict` and `predict_with_jacobian` in one image; instructions and stack are those of the
    /// latter.
    pub jacobian: Cost,
    /// Share of the flash that holds weights.
    pub weight_bytes: u64,
}

/// Compiles the network in `folder`, which is kept for the next time, and runs it.
///
/// ```no_run
/// use sinew_nn::emit::Options;
/// use sinew_nn::{footprint, import};
///
/// let network = import::read("examples/mlp.onnx".as_ref())?;
/// let footprint = footprint::measure(&network, &Options::default(), "target/footprint".as_ref())?;
/// println!("{} bytes of flash", footprint.predict.flash_bytes);
/// # Ok::<(), sinew_nn::BuildError>(())
/// ```
///
/// # Errors
/// [`BuildError`]. Without QEMU there are no instructions and no stack, which is no error.
pub fn measure(
    network: &Network,
    options: &Options,
    folder: &Path,
) -> Result<Footprint, BuildError> {
    let [predict, jacobian] = memory(network, options, folder)?;
    let image = probe::build(folder)?;
    let said = probe::run(&image).ok();
    let cost = |name: &str, (flash_bytes, ram_bytes)| {
        let line = said.as_ref().and_then(|said| {
            said.lines().find_map(|line| {
                line.strip_prefix("cost ")?
                    .strip_prefix(name)?
                    .strip_prefix(' ')
            })
        });
        let mut numbers = line.unwrap_or("").split(' ').map(|word| word.parse().ok());
        Cost {
            flash_bytes,
            ram_bytes,
            instructions: numbers.next().flatten(),
            stack_bytes: numbers.next().flatten(),
        }
    };
    Ok(Footprint {
        predict: cost("predict", predict),
        jacobian: cost("jacobian", jacobian),
        weight_bytes: network
            .folded()
            .weight_bytes(options.weights == Weights::Int8) as u64,
    })
}

/// Flash and RAM of `predict` alone, and of `predict` and `predict_with_jacobian`: compiled and
/// linked in `folder`, with nothing else in the image.
///
/// # Errors
/// [`BuildError`].
pub fn memory(
    network: &Network,
    options: &Options,
    folder: &Path,
) -> Result<[(u64, u64); 2], BuildError> {
    for file in emit(network, options)? {
        let path = folder.join("network").join(file.path);
        sinew_files::write_changed(&path, file.text.as_bytes())?;
    }
    probe::write_workspace(network, folder)?;
    target::build(folder, "bare")?;
    let release = folder.join("target").join(target::TARGET).join("release");
    Ok([
        sections(&release.join("predict"))?,
        sections(&release.join("jacobian"))?,
    ])
}

/// Bytes of an image in flash and in RAM.
///
/// # Errors
/// [`BuildError::File`], or [`BuildError::Image`] if it is no ELF file.
pub fn sections(path: &Path) -> Result<(u64, u64), BuildError> {
    let data = std::fs::read(path).map_err(|error| FileError::read(path, error))?;
    let file = object::File::parse(&*data).map_err(|error| BuildError::Image {
        file: path.into(),
        error,
    })?;
    let (mut flash, mut ram) = (0, 0);
    for section in file.sections() {
        let SectionFlags::Elf { sh_flags, .. } = section.flags() else {
            continue;
        };
        // Unwinding tables are in no image that is flashed.
        let name = section.name().unwrap_or("");
        if sh_flags.0 & object::elf::SHF_ALLOC.0 == 0 || name.starts_with(".ARM.ex") {
            continue;
        }
        let writable = sh_flags.0 & object::elf::SHF_WRITE.0 != 0;
        if writable {
            ram += section.size();
        }
        if section.kind() != SectionKind::UninitializedData {
            flash += section.size();
        }
    }
    Ok((flash, ram))
}

/// The figures for one board, as a table.
#[must_use]
pub fn table(network: &Network, footprint: &Footprint, board: &Board) -> String {
    let mut text = format!(
        "{} on {}\n\n{:<24} {:>10} {:>10} {:>10} {:>14} {:>12}\n",
        network.name, board.name, "", "flash, B", "RAM, B", "stack, B", "instructions", "time, us"
    );
    let number = |n: Option<u64>| n.map_or("-".into(), |n| thousands(n as usize));
    for (name, cost) in [
        ("predict", &footprint.predict),
        ("with jacobian", &footprint.jacobian),
    ] {
        let time = match (cost.instructions, board.chip) {
            (Some(n), Some(chip)) => {
                let cycles = n as f64 * CYCLES_PER_INSTRUCTION;
                format!("{:.1}", cycles / f64::from(chip.clock_hz) * 1e6)
            }
            _ => "-".into(),
        };
        text += &format!(
            "{name:<24} {:>10} {:>10} {:>10} {:>14} {time:>12}\n",
            thousands(cost.flash_bytes as usize),
            thousands(cost.ram_bytes as usize),
            number(cost.stack_bytes),
            number(cost.instructions),
        );
    }
    let share = |part: u64, whole: u64| 100.0 * part as f64 / whole as f64;
    text += &format!(
        "\nOf the flash, {} B are weights. `predict` takes {:.2} % of the board's flash and, with its stack,\n{:.2} % of its RAM.",
        thousands(footprint.weight_bytes as usize),
        share(footprint.predict.flash_bytes, board.flash_bytes.into()),
        share(
            footprint.predict.ram_bytes + footprint.predict.stack_bytes.unwrap_or(0),
            board.ram_bytes.into()
        ),
    );
    text += if footprint.predict.instructions.is_none() {
        " Instructions and stack need QEMU (cargo xtask setup).\n"
    } else if board.chip.is_some() {
        " Flash, RAM, stack and instructions are measured on the linked\nimage in QEMU; time is an estimate at 1.7 cycles an instruction, measured on no board.\n"
    } else {
        " QEMU counts instructions and knows no time.\n"
    };
    text
}

//! Footprint of a network on a board, before anything is flashed: flash, RAM, stack, instructions.
//!
//! The printed crate is compiled and linked for the target, and run in QEMU, which counts
//! instructions and stack.

mod board;
pub mod chip;
mod cost;
mod fit;
mod layers;
pub mod probe;
mod sources;
mod table;

use std::path::Path;

use object::{Object, ObjectSection, SectionFlags, SectionKind};

use crate::emit::{Options, Weights};
use crate::{BuildError, Network, target};
use sinew_files::FileError;

pub use board::{BOARDS, Board};
pub use chip::CYCLES_PER_INSTRUCTION;
pub use cost::{Cost, Footprint};
pub use fit::Fit;
pub use layers::{Layer, layer_table, layers};
use sources::{linked, write};
pub use table::table;

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
    let image = linked(probe::build(folder))?;
    let said = image.and_then(|image| probe::run(&image).ok());
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
    write(network, options, folder)?;
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

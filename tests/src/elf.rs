//! What an image takes, read from the linked file.

use std::path::Path;

use object::elf::{SHF_ALLOC, SHF_WRITE};
use object::{Object, ObjectSection, SectionFlags, SectionKind};

/// Bytes by the memory they occupy.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Footprint {
    /// Programmed into flash: vectors, code, constants, and the initial values of `.data`.
    pub flash: u64,
    /// Statics in RAM: `.data`, `.bss`, `.uninit`. The stack comes on top.
    pub ram: u64,
}

/// Reads the sections that the linker placed in memory.
///
/// # Errors
/// The file cannot be read or is no ELF.
pub fn footprint(image: &Path) -> Result<Footprint, String> {
    let say = |error: &dyn std::fmt::Display| format!("{}: {error}", image.display());
    let bytes = std::fs::read(image).map_err(|error| say(&error))?;
    let file = object::File::parse(&*bytes).map_err(|error| say(&error))?;

    let mut footprint = Footprint { flash: 0, ram: 0 };
    for section in file.sections() {
        let SectionFlags::Elf { sh_flags, .. } = section.flags() else {
            continue;
        };
        if sh_flags.0 & SHF_ALLOC.0 == 0 {
            continue;
        }
        let stored = section.kind() != SectionKind::UninitializedData;
        let writable = sh_flags.0 & SHF_WRITE.0 != 0;
        if stored {
            footprint.flash += section.size();
        }
        if writable {
            footprint.ram += section.size();
        }
    }
    Ok(footprint)
}

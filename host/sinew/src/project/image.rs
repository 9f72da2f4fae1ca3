//! Resources of a linked image: flash and RAM by section, and whether it has a heap.

use std::path::Path;

use object::{Object, ObjectSection, ObjectSymbol, SectionFlags, SectionKind};
use serde::{Deserialize, Serialize};

use sinew_ident::error::{Error, Result};

/// Start of RAM on every Cortex-M (ARMv7-M Architecture Reference Manual, B3.1).
const RAM: std::ops::Range<u64> = 0x2000_0000..0x4000_0000;

/// Bytes of a linked image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Sizes {
    /// Vector table, code, constants and the initial values of `.data`.
    pub flash_bytes: u64,
    /// `.data`, `.bss` and `.uninit`; the stack is measured while running.
    pub ram_bytes: u64,
    /// 0 unless an allocator is linked, else the number of its symbols: there is no fixed size to
    /// give.
    pub heap_bytes: u64,
}

/// Reads the sizes of the ELF file at `path`.
///
/// # Errors
/// [`Error`] when the file cannot be read or is not an ELF file.
pub fn sizes(path: &Path) -> Result<Sizes> {
    let data = std::fs::read(path).map_err(|e| Error::read(path, e))?;
    let file = object::File::parse(&*data)
        .map_err(|e| Error::file(path, format!("not an image: {e}")).expected("an ELF file"))?;
    let (mut flash_bytes, mut ram_bytes) = (0, 0);
    for section in file.sections() {
        let SectionFlags::Elf { sh_flags, .. } = section.flags() else {
            continue;
        };
        if sh_flags.0 & object::elf::SHF_ALLOC.0 == 0 {
            continue;
        }
        let in_ram = RAM.contains(&section.address());
        let has_contents = section.kind() != SectionKind::UninitializedData;
        if in_ram {
            ram_bytes += section.size();
        }
        if has_contents {
            flash_bytes += section.size();
        }
    }
    let allocator = file.symbols().filter(|s| {
        s.name()
            .is_ok_and(|n| n.contains("__rust_alloc") || n == "malloc" || n == "_sbrk")
    });
    Ok(Sizes {
        flash_bytes,
        ram_bytes,
        heap_bytes: allocator.count() as u64,
    })
}

//! Puts the linker script where the linker looks.

use std::{env, fs, io, path::PathBuf};

fn main() -> io::Result<()> {
    let out = env::var_os("OUT_DIR").ok_or_else(|| io::Error::other("cargo sets OUT_DIR"))?;
    let out = PathBuf::from(out);
    // QEMU's board, as for the programs that count. It is not called memory.x there: the linker
    // would find it twice.
    let memory = "../../boards/step/memory-qemu.x";
    fs::copy(memory, out.join("memory.x"))?;
    println!("cargo:rerun-if-changed={memory}");
    println!("cargo:rustc-link-search={}", out.display());
    Ok(())
}

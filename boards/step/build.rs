//! Puts the linker scripts, and a peer to count, where the linker looks.

use std::{env, fs, io, path::PathBuf};

fn main() -> io::Result<()> {
    let out = env::var_os("OUT_DIR").ok_or_else(|| io::Error::other("cargo sets OUT_DIR"))?;
    let out = PathBuf::from(out);
    // Feature `cycles` is for a real part. Neither is called memory.x: the linker would find that
    // here first.
    let memory = match env::var_os("CARGO_FEATURE_CYCLES") {
        Some(_) => "../stm32f446/memory.x",
        None => "memory-qemu.x",
    };
    fs::copy(memory, out.join("memory.x"))?;
    println!("cargo:rerun-if-changed={memory}");
    // What a device crate gives cortex-m-rt: names of interrupt handlers, of which there are none.
    fs::write(out.join("device.x"), "")?;
    println!("cargo:rustc-link-search={}", out.display());
    // Feature `peer`: the archive with other people's step or prediction.
    println!("cargo:rerun-if-env-changed=SINEW_PEER");
    if let Ok(archive) = env::var("SINEW_PEER") {
        println!("cargo:rustc-link-arg-bins={archive}");
    }
    Ok(())
}

//! Writes what every case gives to the file `to_host`, as little-endian words.

#![no_std]
#![no_main]

use semihosting::fs::File;
use semihosting::io::Write;
use semihosting::process;

#[cortex_m_rt::entry]
fn main() -> ! {
    let Ok(mut to_host) = File::create(c"to_host") else {
        process::exit(2)
    };
    sinew_vectors::every(|value| {
        if to_host.write_all(&value.to_le_bytes()).is_err() {
            process::exit(2)
        }
    });
    process::exit(0)
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    process::exit(101)
}

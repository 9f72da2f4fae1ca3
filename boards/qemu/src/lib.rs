//! QEMU's mps2-an386 as a board: clocks, a serial line, a time base, two host files. No mathematics.
//!
//! A program of `src/bin` is a transport and a pace; what a frame means, `sinew_firmware::session` knows.

#![no_std]

use defmt_semihosting as _;
use panic_probe as _;

pub mod executor;
pub mod link;
pub mod newest;
pub mod pac;
pub mod program;
pub mod semihosting;
pub mod stack;
pub mod time;
pub mod uart;

use semihosting::ExitCode;

// Log times in microseconds of virtual time.
defmt::timestamp!("{=u64:us}", embassy_time::Instant::now().as_micros());

/// panic-probe ends in an undefined instruction, hence here.
#[cortex_m_rt::exception]
unsafe fn HardFault(_frame: &cortex_m_rt::ExceptionFrame) -> ! {
    semihosting::exit(ExitCode::HardFault)
}

#[cortex_m_rt::exception]
unsafe fn DefaultHandler(number: i16) -> ! {
    defmt::error!("nothing handles interrupt {=i16}", number);
    semihosting::exit(ExitCode::Unhandled)
}

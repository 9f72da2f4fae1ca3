//! QEMU's mps2-an386 as a board: clocks, a serial line, a time base, host files for a link and for
//! a rig. No mathematics.
//!
//! A program of `src/bin` is a transport and a pace; what boards share is `sinew_board_runtime`,
//! what a frame means, `sinew_device::session` knows.

#![no_std]

use defmt_semihosting as _;
use panic_probe as _;

pub mod executor;
pub mod inject;
pub mod machine;
pub mod pac;
pub mod program;
pub mod rig;
pub mod semihosting;
pub mod time;
pub mod uart;

use semihosting::ExitCode;
use sinew_board_runtime::restart;
use sinew_device::mode::Cause;

// Log times in microseconds of virtual time.
defmt::timestamp!("{=u64:us}", embassy_time::Instant::now().as_micros());

/// panic-probe ends in an undefined instruction, hence here.
#[cortex_m_rt::exception]
unsafe fn HardFault(_frame: &cortex_m_rt::ExceptionFrame) -> ! {
    if machine::restarts() {
        machine::restart(Cause::Fault)
    }
    semihosting::exit(ExitCode::HardFault)
}

/// First bite of the watchdog; the second, after as long again, resets the machine.
#[cortex_m_rt::exception]
unsafe fn NonMaskableInt() {
    rig::off();
    restart::leave(Cause::Watchdog);
    // It stays pending until the reset, and this handler with it.
}

#[cortex_m_rt::exception]
unsafe fn DefaultHandler(number: i16) -> ! {
    defmt::error!("nothing handles interrupt {=i16}", number);
    semihosting::exit(ExitCode::Unhandled)
}

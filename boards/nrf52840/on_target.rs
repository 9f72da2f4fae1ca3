//! Checks of an nRF52840 DK itself: `cargo test --release` in this folder, with the board
//! connected. probe-rs flashes them once and resets the board before each
//! (docs/how-to/port-a-board.md).

#![no_std]
#![no_main]

use sinew_board_runtime::checks::Cycles;
use sinew_device::for_each_check;

/// The core's, whatever the crystal.
const CLOCK_HZ: u32 = 64_000_000;

/// Starts the clocks as the controller has them, and the counter.
fn start() {
    let _ = embassy_nrf::init(embassy_nrf::config::Config::default());
    Cycles::start();
}

macro_rules! tests {
    ($($name:ident)*) => {
        #[embedded_test::tests]
        mod tests {
            $(
                #[test]
                fn $name() -> sinew_device::checks::CheckOutcome {
                    super::start();
                    let make = || subject(super::Cycles, super::CLOCK_HZ);
                    sinew_device::checks::$name(make, golden())
                }
            )*
            use sinew_board_runtime::checks::{golden, subject};
        }
    };
}

for_each_check!(tests);

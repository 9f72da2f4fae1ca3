//! Counts instructions of the parts of a filter in QEMU: ours, or those that nalgebra and micromath
//! make, by the feature that is on.
//!
//! The filter is that of the demo: two states, a disturbance, four parameters. Writes to the file
//! `to_host`, as little-endian words: for each part its ticks, then those of two reads of the
//! counter with nothing between. A result goes behind each, as bits, so that a host can compare
//! what was computed.

#![no_std]
#![no_main]

#[path = "../../../boards/step/src/timer.rs"]
mod timer;
#[path = "../../../boards/step/src/vectors.rs"]
mod vectors;

#[cfg(feature = "micromath")]
#[path = "micromath.rs"]
mod parts;
#[cfg(feature = "nalgebra")]
#[path = "nalgebra.rs"]
mod parts;
#[cfg(feature = "ours")]
#[path = "ours.rs"]
mod parts;

use core::hint::black_box;

use semihosting::fs::File;
use semihosting::io::Write;
use semihosting::process;
use timer::ticks;

/// States.
pub const NX: usize = 2;
/// All that is estimated.
pub const NZ: usize = 7;
/// Channels of the measurement model, and its states: eleven fibres of a tendon platform.
pub const CHANNELS: usize = 11;
/// See [`CHANNELS`].
pub const CHANNEL_STATES: usize = 8;
/// Hidden units of the network.
pub const UNITS: usize = 14;
/// Variance of the reading.
pub const NOISE: f32 = 1e-4;

/// Rows of the transition's derivatives.
pub const F: [[f32; NZ]; NX] = [
    [1.0, 8.3e-3, 1e-4, -2e-4, 3e-4, 1e-4, -1e-4],
    [-0.3, 0.97, 7e-3, -2e-2, 3e-2, 1e-2, -1e-2],
];
/// Variances of a period's noise.
pub const Q: [f32; NX] = [1e-6, 1e-4];
/// Variances at the start.
pub const START: [f32; NZ] = [1.0, 1e-4, 1e-4, 1.0, 1.0, 1.0, 1.0];
/// Derivatives of the reading.
pub const H: [f32; NZ] = [1.0, 0.0, 0.0, 0.1, 0.0, 0.0, 0.0];

/// Number `i` of a sequence that looks like nothing: entries of matrices.
pub fn entry(i: usize) -> f32 {
    (i * 7919 % 1000) as f32 * 2e-3 - 1.0
}

/// Ticks of two reads of the counter around `run`, and what came of it.
#[inline(always)]
fn counted<T>(run: impl FnOnce() -> T) -> (u32, T) {
    let start = ticks();
    let result = black_box(run());
    (ticks().wrapping_sub(start), result)
}

#[cortex_m_rt::entry]
fn main() -> ! {
    timer::start();
    let Ok(mut to_host) = File::create(c"to_host") else {
        process::exit(2)
    };
    let mut say = |(ticks, value): (u32, f32)| {
        for word in [ticks, value.to_bits()] {
            if to_host.write_all(&word.to_le_bytes()).is_err() {
                process::exit(2)
            }
        }
    };
    parts::count(&mut say);
    say(counted(|| 0.0));
    process::exit(0)
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    process::exit(101)
}

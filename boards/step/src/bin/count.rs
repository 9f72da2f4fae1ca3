//! Counts the instructions of control steps in QEMU, in lockstep with a host that closes the loop.
//!
//! By semihosting, as in `boards/qemu`: raw little-endian 32-bit words instead of frames, so that
//! the image is small and the step is most of it. Starts with a hello of shapes; for each question
//! (y, s, reference rows) answers ticks, status, iterations, cost, u, plan; at the end of the file
//! answers the stack's high-water mark and ends with status 0.

#![no_std]
#![no_main]

#[allow(
    dead_code,
    reason = "shared with the boards, which watch it while they run"
)]
#[path = "../../../runtime/src/stack.rs"]
mod stack;
#[path = "../timer.rs"]
mod timer;
#[path = "../vectors.rs"]
mod vectors;

use model::control::{DECISIONS, HORIZON, HORIZONS, MEASURED, NU, NY};
use semihosting::fs::File;
use semihosting::io::{Read, Write};
use semihosting::process;
use timer::ticks;

const QUESTION: usize = NY + MEASURED + HORIZON * NY;

#[cortex_m_rt::entry]
fn main() -> ! {
    stack::paint();
    timer::start();
    let (Ok(mut from_host), Ok(mut to_host)) = (File::open(c"to_device"), File::create(c"to_host"))
    else {
        process::exit(2)
    };
    let mut say = |words: &[u32]| {
        for word in words {
            if to_host.write_all(&word.to_le_bytes()).is_err() {
                process::exit(2)
            }
        }
    };
    let shapes = [NU, NY, MEASURED, HORIZON, HORIZONS.length.len()];
    say(&shapes.map(|n| n as u32));
    say(&HORIZONS.length.map(u32::from));
    let mut words = [0.0_f32; QUESTION];
    loop {
        for word in &mut words {
            let mut bytes = [0; 4];
            let mut had = 0;
            while let Some(rest @ [_, ..]) = bytes.get_mut(had..) {
                match from_host.read(rest) {
                    Ok(0) => {
                        say(&[stack::high_water_bytes()]);
                        process::exit(0)
                    }
                    Ok(n) => had += n,
                    Err(_) => process::exit(2),
                }
            }
            *word = f32::from_le_bytes(bytes);
        }
        let (y, reference) = words.split_at_checked(NY + MEASURED).unwrap_or_default();
        let mut u = [0.0; NU];
        let start = ticks();
        let (status, iterations, cost, plan) = step(y, reference, &mut u);
        let spent = ticks().wrapping_sub(start);
        say(&[spent, status, iterations, cost.to_bits()]);
        say(&u.map(f32::to_bits));
        say(&plan.map(f32::to_bits));
    }
}

#[cfg(feature = "step")]
#[inline(always)]
fn step(y: &[f32], reference: &[f32], u: &mut [f32; NU]) -> (u32, u32, f32, [f32; DECISIONS]) {
    // SAFETY: the slices have the lengths that the step reads, and nothing else calls it.
    unsafe { sinew_step::sinew_mpc_step(y.as_ptr(), reference.as_ptr(), u.as_mut_ptr()) };
    let (iterations, cost, plan) = sinew_step::last_plan();
    let status = sinew_step::sinew_mpc_last_status();
    (status, iterations.into(), cost, plan)
}

#[cfg(feature = "peer")]
#[inline(always)]
fn step(y: &[f32], reference: &[f32], u: &mut [f32; NU]) -> (u32, u32, f32, [f32; DECISIONS]) {
    unsafe extern "C" {
        fn peer_step(y: *const f32, reference: *const f32, u: *mut f32);
    }
    // SAFETY: the peer was printed for these shapes, and nothing else calls it.
    unsafe { peer_step(y.as_ptr(), reference.as_ptr(), u.as_mut_ptr()) };
    (0, 0, 0.0, [0.0; DECISIONS])
}

#[cfg(not(any(feature = "step", feature = "peer")))]
#[inline(always)]
fn step(y: &[f32], reference: &[f32], _: &mut [f32; NU]) -> (u32, u32, f32, [f32; DECISIONS]) {
    core::hint::black_box((y, reference));
    (0, 0, 0.0, [0.0; DECISIONS])
}

/// A panic that the step could reach would link this; the bench looks for it.
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    process::exit(101)
}

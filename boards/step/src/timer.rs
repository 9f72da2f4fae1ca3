//! The counter of QEMU's mps2-an386: its CMSDK timer 0, 25 MHz, counting down.

const TIMER: *mut u32 = 0x4000_0000 as *mut u32;

/// Starts it. Nobody else uses it.
pub fn start() {
    // SAFETY: registers reload, value and control of a timer that nobody else uses.
    unsafe {
        TIMER.add(2).write_volatile(u32::MAX);
        TIMER.add(1).write_volatile(u32::MAX);
        TIMER.write_volatile(1);
    }
}

/// Counts up, wraps at 32 bits.
#[inline(always)]
pub fn ticks() -> u32 {
    // SAFETY: a register that may be read at any time.
    !unsafe { TIMER.add(1).read_volatile() }
}

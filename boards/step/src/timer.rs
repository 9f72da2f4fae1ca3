//! Counter of a step's cost: instructions in QEMU, cycles on a real part (feature `cycles`).

pub use counter::{start, ticks};

/// QEMU's mps2-an386: its CMSDK timer 0, 25 MHz, counting down. Virtual time is instructions, so it
/// counts those.
#[cfg(not(feature = "cycles"))]
mod counter {
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
}

/// The cycle counter of the core's debug unit (Armv7-M Architecture Reference Manual, C1.8.8). QEMU
/// has none.
#[cfg(feature = "cycles")]
mod counter {
    use cortex_m::Peripherals;
    use cortex_m::peripheral::DWT;

    /// Starts it. Nobody else takes the core's peripherals; if one had, every count would be
    /// nought.
    pub fn start() {
        if let Some(mut core) = Peripherals::take() {
            core.DCB.enable_trace();
            core.DWT.enable_cycle_counter();
        }
    }

    /// Counts up, wraps at 32 bits: 25 s at 168 MHz.
    #[inline(always)]
    pub fn ticks() -> u32 {
        DWT::cycle_count()
    }
}

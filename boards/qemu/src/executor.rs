//! embassy's executor on a run loop that sleeps with WFI.
//!
//! The stock thread executor sleeps with WFE, which QEMU treats as a no-op on M profile: the
//! emulated core would spin, and under `-icount` every spin would count.

use core::sync::atomic::{AtomicBool, Ordering};

use embassy_executor::{Spawner, raw};

/// Set when a task has become ready. Starts true: nothing has been polled yet.
static READY: AtomicBool = AtomicBool::new(true);

/// embassy calls this whenever a task wakes, from an interrupt or not.
#[unsafe(export_name = "__pender")]
fn pender(_context: *mut ()) {
    READY.store(true, Ordering::Release);
}

/// Thread-mode executor. One per program.
pub struct Executor {
    inner: raw::Executor,
}

impl Executor {
    /// An executor with no task.
    #[expect(clippy::new_without_default, reason = "made once, in a static cell")]
    pub fn new() -> Self {
        Self {
            inner: raw::Executor::new(core::ptr::null_mut()),
        }
    }

    /// Lets `init` spawn the first tasks, then runs them for ever.
    pub fn run(&'static mut self, init: impl FnOnce(Spawner)) -> ! {
        init(self.inner.spawner());
        loop {
            READY.store(false, Ordering::Release);
            // SAFETY: called from this loop only, never from a task or an interrupt.
            unsafe { self.inner.poll() };
            // With interrupts off nothing slips in between the question and the sleep; a pending
            // interrupt ends WFI all the same, and runs when they are on again.
            cortex_m::interrupt::disable();
            if !READY.load(Ordering::Acquire) {
                cortex_m::asm::wfi();
            }
            // SAFETY: no critical section is open here.
            unsafe { cortex_m::interrupt::enable() };
        }
    }
}

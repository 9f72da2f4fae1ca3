//! The subject of `sinew_device::checks` on a board: its model's session, and its model's golden
//! vectors.

use model::control::{IDENTITY, Session};
use model::golden::GOLDEN;
use sinew_device::checks::{Golden, Subject};
use sinew_device::clock::Clock;

/// The core's cycle counter, for boards that have one.
pub struct Cycles;

impl Cycles {
    /// Starts it. Before anything else runs.
    pub fn start() {
        // SAFETY: nothing else runs yet, and only the counter is touched.
        let mut core = unsafe { cortex_m::Peripherals::steal() };
        core.DCB.enable_trace();
        core.DWT.enable_cycle_counter();
    }
}

impl Clock for Cycles {
    fn ticks(&self) -> u32 {
        cortex_m::peripheral::DWT::cycle_count()
    }
}

/// A session that has heard nothing yet, timed by a counter of so many counts a second (0: it does
/// not count time).
pub fn subject<C: Clock>(clock: C, counts_per_second: u32) -> Subject<Session, C> {
    let period = u64::from(counts_per_second) * 1000 / u64::from(IDENTITY.rate_mhz.max(1));
    Subject {
        session: model::session(),
        clock,
        period_ticks: u32::try_from(period).unwrap_or(u32::MAX),
    }
}

/// The vectors that came with the model and those that were drawn.
pub fn golden() -> impl Iterator<Item = Golden> {
    GOLDEN.iter().map(|golden| {
        let jacobian = golden.jacobian.iter().flatten();
        Golden::new(
            &golden.x,
            golden.y.iter().map(|v| *v as f32),
            jacobian.map(|v| *v as f32),
        )
    })
}

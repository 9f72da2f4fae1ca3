//! The tick that paces control: a hardware timer's interrupt tells it, the control task waits for
//! it.

use core::cell::Cell;
use core::num::NonZeroU64;

use embassy_sync::blocking_mutex::Mutex;
use embassy_sync::blocking_mutex::raw::CriticalSectionRawMutex;
use embassy_sync::signal::Signal;

/// One pace. Times are the timer's own, counted from its start: exact multiples of the period.
pub struct Pacer {
    signal: Signal<CriticalSectionRawMutex, u64>,
    counts: Mutex<CriticalSectionRawMutex, Cell<u64>>,
    /// Counts of the timer in one period, and in one second. Not zero by its type: a division that
    /// could panic would bring its message and the checkout's path into the image.
    per_period: u32,
    per_second: NonZeroU64,
}

impl Pacer {
    /// A pace of `rate_mhz` steps per 1000 seconds on a timer that counts `per_second`; the period
    /// is rounded to the nearest count. A zero of either is taken as one.
    pub const fn new(rate_mhz: u32, per_second: u32) -> Self {
        let rate = if rate_mhz == 0 { 1 } else { rate_mhz as u64 };
        let counts = (per_second as u64 * 1000 + rate / 2) / rate;
        Self {
            signal: Signal::new(),
            counts: Mutex::new(Cell::new(0)),
            per_period: if counts > u32::MAX as u64 {
                u32::MAX
            } else {
                counts as u32
            },
            per_second: match NonZeroU64::new(per_second as u64) {
                Some(per_second) => per_second,
                None => NonZeroU64::MIN,
            },
        }
    }

    /// Counts of the timer in one period: what it is to be reloaded with.
    pub const fn per_period(&self) -> u32 {
        self.per_period
    }

    /// The timer's interrupt.
    pub fn on_timer(&self) {
        let counts = self.counts.lock(|counts| {
            counts.set(counts.get() + u64::from(self.per_period));
            counts.get()
        });
        let seconds = counts / self.per_second;
        let rest = counts % self.per_second;
        self.signal
            .signal(seconds * 1_000_000 + rest * 1_000_000 / self.per_second);
    }

    /// Waits for a tick: microseconds since the timer's start, rounded down. A tick that nobody
    /// waited for is kept; of two, the later.
    pub async fn tick(&self) -> u64 {
        self.signal.wait().await
    }

    /// The next tick has come already: what was done since the last one took longer than the
    /// period.
    pub fn is_due(&self) -> bool {
        self.signal.signaled()
    }
}

//! embassy's time driver. TIMER0 runs freely at 25 MHz and its wrap interrupt extends it to 64
//! bits; one half of the dual timer, in one-shot mode, is the alarm. Tick rate 1 MHz: embassy-time
//! has no 25 MHz.

use core::cell::RefCell;
use core::sync::atomic::{AtomicU32, Ordering};
use core::task::Waker;

use critical_section::{CriticalSection, Mutex};
use embassy_time::Duration;
use embassy_time_driver::{Driver, TICK_HZ};
use embassy_time_queue_utils::Queue;

use sinew_device::clock::Clock;

use crate::pac::{self, Interrupt};

const COUNTS_PER_TICK: u64 = pac::CLOCK_HZ as u64 / TICK_HZ;
const TIMER_ENABLE: u32 = 1 << 0;
const TIMER_INTERRUPT: u32 = 1 << 3;
/// One-shot, 32 bits, interrupt, enable.
const ALARM_ARMED: u32 = 1 << 0 | 1 << 1 | 1 << 5 | 1 << 7;
/// Farthest alarm in counts (86 s). A later one is armed again when this has passed.
const ALARM_REACH: u64 = 1 << 31;

struct TimeDriver {
    /// Count of wraps of TIMER0, one every 172 s: 23,000 years in 32 bits.
    wraps: AtomicU32,
    queue: Mutex<RefCell<Queue>>,
}

embassy_time_driver::time_driver_impl!(static DRIVER: TimeDriver = TimeDriver {
    wraps: AtomicU32::new(0),
    queue: Mutex::new(RefCell::new(Queue::new())),
});

/// Starts the time base. Before this call time stands at an arbitrary value.
pub fn init() {
    let timer = pac::timer0();
    timer.reload.write(u32::MAX);
    timer.value.write(u32::MAX);
    timer.control.write(TIMER_ENABLE | TIMER_INTERRUPT);
    pac::dual_timer().control.write(0);
    pac::unmask(Interrupt::Timer0);
    pac::unmask(Interrupt::DualTimer);
}

/// Counts of the 25 MHz time base since `init`, modulo 2^32. Two loads: cheap enough to bracket a
/// step.
#[inline(always)]
pub fn counts() -> u32 {
    !pac::timer0().value.read()
}

/// Clock of a session's step times: raw counts, 40 ns each.
pub struct Counter;

impl Clock for Counter {
    #[inline(always)]
    fn ticks(&self) -> u32 {
        counts()
    }
}

/// Period of a rate given in steps per 1000 seconds, to the nearest microsecond (at 120 Hz: 40
/// parts in a million too fast, as much as an ordinary crystal is off).
pub const fn period(rate_mhz: u32) -> Duration {
    let rate = if rate_mhz == 0 { 1 } else { rate_mhz as u64 };
    Duration::from_micros((1_000_000_000 + rate / 2) / rate)
}

impl TimeDriver {
    fn counts64(&self, _: CriticalSection) -> u64 {
        let mut wraps = self.wraps.load(Ordering::Relaxed);
        let mut low = counts();
        if pac::timer0().interrupt.read() & 1 != 0 {
            // Wrapped, and the interrupt waits for this critical section to end. The first read may
            // have been taken before the wrap; this one was not.
            low = counts();
            wraps = wraps.wrapping_add(1);
        }
        u64::from(wraps) << 32 | u64::from(low)
    }

    /// Arms the alarm for tick `at`. False when that has passed already.
    fn arm(&self, cs: CriticalSection, at: u64) -> bool {
        let alarm = pac::dual_timer();
        alarm.control.write(0);
        alarm.clear.write(1);
        if at == u64::MAX {
            return true;
        }
        let due = at.saturating_mul(COUNTS_PER_TICK);
        let ahead = due.saturating_sub(self.counts64(cs)).min(ALARM_REACH);
        if ahead == 0 {
            return false;
        }
        alarm.load.write(ahead as u32);
        alarm.control.write(ALARM_ARMED);
        true
    }

    /// Wakes what is due and arms the alarm for the next. Ends because every turn takes at least
    /// one expired entry from the queue.
    fn serve(&self, cs: CriticalSection) {
        let mut queue = self.queue.borrow(cs).borrow_mut();
        loop {
            let next = queue.next_expiration(self.counts64(cs) / COUNTS_PER_TICK);
            if self.arm(cs, next) {
                break;
            }
        }
    }
}

impl Driver for TimeDriver {
    fn now(&self) -> u64 {
        critical_section::with(|cs| self.counts64(cs)) / COUNTS_PER_TICK
    }

    fn schedule_wake(&self, at: u64, waker: &Waker) {
        critical_section::with(|cs| {
            let sooner = self.queue.borrow(cs).borrow_mut().schedule_wake(at, waker);
            if sooner {
                self.serve(cs);
            }
        });
    }
}

#[unsafe(no_mangle)]
extern "C" fn TIMER0() {
    pac::timer0().interrupt.write(1);
    DRIVER.wraps.fetch_add(1, Ordering::Relaxed);
}

#[unsafe(no_mangle)]
extern "C" fn DUALTIMER() {
    critical_section::with(|cs| DRIVER.serve(cs));
}

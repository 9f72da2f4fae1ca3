//! The board of the program `free`: a timer that paces, a watchdog that bites, a simulated rig.

use core::sync::atomic::{AtomicBool, Ordering};

use embassy_futures::yield_now;
use sinew_board_runtime::model::IDENTITY;
use sinew_board_runtime::model::control::NU;
use sinew_board_runtime::outbox::Outbox;
use sinew_board_runtime::pacer::Pacer;
use sinew_board_runtime::wiring::SENSORS;
use sinew_board_runtime::{Board, restart, stack};
use sinew_device::clock::Clock;
use sinew_device::mode::Cause;

use crate::inject::Inject;
use crate::pac::{self, Interrupt};
use crate::rig::{self, Rig};
use crate::semihosting::{ExitCode, exit};
use crate::time::counts;
use crate::uart;

/// Frames on their way to the UART.
pub static OUTBOX: Outbox = Outbox::new();
/// Timer 1 at the model's rate.
pub static PACER: Pacer = Pacer::new(IDENTITY.rate_mhz, pac::CLOCK_HZ);

/// Time to the watchdog's first bite and from there to the reset.
const WATCHDOG_COUNTS: u32 = pac::CLOCK_HZ / 4;
/// Ticks of silence after which the host is taken for gone: 30 s.
const HOST_GONE_TICKS: u32 = IDENTITY.rate_mhz.div_ceil(1000) * 30;
/// Least stack that should ever have been left.
const STACK_RESERVE_BYTES: u32 = 2048;

static RESTARTS: AtomicBool = AtomicBool::new(false);

/// A fault restarts the machine, as on a board, instead of ending QEMU.
pub fn restarts() -> bool {
    RESTARTS.load(Ordering::Relaxed)
}

/// Outputs off and a fresh start that knows why.
pub fn restart(cause: Cause) -> ! {
    rig::off();
    restart::leave(cause);
    cortex_m::peripheral::SCB::sys_reset()
}

/// The machine as a board.
pub struct Machine {
    rig: Rig,
    inject: Option<Inject>,
    tick: u32,
    stack_said: bool,
}

impl Machine {
    /// Starts timer and watchdog. Why the machine starts anew is for the session to know.
    pub fn start() -> (Self, Option<Cause>) {
        RESTARTS.store(true, Ordering::Relaxed);
        let cause = restart::take();
        let machine = Self {
            rig: Rig::open(),
            // What went wrong once is not to go wrong after every restart.
            inject: if cause.is_none() {
                Inject::read()
            } else {
                None
            },
            tick: 0,
            stack_said: false,
        };
        let watchdog = pac::watchdog();
        watchdog.load.write(WATCHDOG_COUNTS);
        watchdog.control.write(0b11);
        let timer = pac::timer1();
        timer.reload.write(PACER.per_period() - 1);
        timer.value.write(PACER.per_period() - 1);
        timer.control.write(0b1001);
        pac::unmask(Interrupt::Timer1);
        (machine, cause)
    }
}

#[unsafe(no_mangle)]
extern "C" fn TIMER1() {
    pac::timer1().interrupt.write(1);
    PACER.on_timer();
}

impl Clock for Machine {
    #[inline(always)]
    fn ticks(&self) -> u32 {
        counts()
    }
}

impl Board for Machine {
    const CODE_FULL: u16 = rig::FULL_SCALE;
    const DUTY_FULL: u16 = rig::FULL_SCALE;

    async fn sample(&mut self) -> [u16; SENSORS] {
        self.tick = self.tick.wrapping_add(1);
        if let Some(inject) = &self.inject {
            inject.tick(self.tick);
        }
        self.rig.sample()
    }

    fn drive(&mut self, duties: &[u16; NU], live: bool) {
        self.rig.drive(duties, live);
    }

    fn feed(&mut self) {
        pac::watchdog().clear.write(1);
        if !self.stack_said && self.tick.is_multiple_of(128) {
            let left = stack::never_used_bytes();
            if left < STACK_RESERVE_BYTES {
                defmt::error!("only {=u32} bytes of stack were never used", left);
                self.stack_said = true;
            }
        }
    }

    fn silent(&mut self, ticks: u32) {
        if ticks > HOST_GONE_TICKS {
            defmt::warn!("the line is silent");
            exit(ExitCode::HostGone)
        }
    }

    async fn stopped(&mut self) {
        while !OUTBOX.is_empty() || uart::is_sending() {
            yield_now().await;
        }
        exit(ExitCode::Stopped)
    }
}

//! When something breaks: outputs off first, then a restart that knows why.

use embassy_nrf::pac::power::vals::Threshold;
use embassy_nrf::{interrupt, pac};
use sinew_board_runtime::restart;
use sinew_device::mode::Cause;

/// Of port 1: D4, high while the power stages may drive. Pull it down on your board.
const ENABLE_PIN: usize = 5;

/// Power stages off. From any context; five registers, nothing that could fail.
pub fn outputs_off() {
    pac::P1.outclr().write(|w| w.set_pin(ENABLE_PIN, true));
    for unit in [pac::PWM0, pac::PWM1, pac::PWM2, pac::PWM3] {
        unit.tasks_stop().write_value(1);
    }
}

/// Why the chip has started, for the session.
pub fn cause() -> Cause {
    let reasons = pac::POWER.resetreas().read();
    // Written as 1 they clear.
    pac::POWER.resetreas().write_value(reasons);
    let left = restart::take();
    if reasons.dog() {
        return Cause::Watchdog;
    }
    left.unwrap_or(Cause::Start)
}

/// Lets the supply's comparator warn below 2.7 V (PS v1.7, 5.3.2), well above the brown-out reset.
pub fn watch_supply() {
    pac::POWER.pofcon().write(|w| {
        w.set_pof(true);
        w.set_threshold(Threshold::V27);
    });
    pac::POWER.intenset().write(|w| w.set_pofwarn(true));
    // SAFETY: no critical section relies on this interrupt being masked.
    unsafe { cortex_m::peripheral::NVIC::unmask(interrupt::CLOCK_POWER) };
}

#[interrupt]
fn CLOCK_POWER() {
    if pac::POWER.events_pofwarn().read() != 0 {
        restart_with(Cause::BrownOut)
    }
}

/// 61 us are left until the reset (PS v1.7, 6.36): enough for five registers.
#[interrupt]
fn WDT() {
    outputs_off();
}

fn restart_with(cause: Cause) -> ! {
    outputs_off();
    restart::leave(cause);
    cortex_m::peripheral::SCB::sys_reset()
}

/// Panics end here as well: panic-probe logs and executes an undefined instruction.
#[cortex_m_rt::exception]
unsafe fn HardFault(_frame: &cortex_m_rt::ExceptionFrame) -> ! {
    restart_with(Cause::Fault)
}

#[cortex_m_rt::exception]
unsafe fn DefaultHandler(_number: i16) -> ! {
    restart_with(Cause::Fault)
}

//! When something breaks: outputs off first, then a restart that knows why.

use embassy_stm32::interrupt;
use embassy_stm32::pac;
use sinew_board_runtime::restart;
use sinew_device::mode::Cause;

/// Of port B: D4, high while the power stages may drive. Pull it down on your board.
const ENABLE_PIN: usize = 5;

/// Power stages off. From any context; five registers, nothing that could fail.
pub fn outputs_off() {
    pac::GPIOB.bsrr().write(|w| w.set_br(ENABLE_PIN, true));
    // Main output enable of timers 1 and 8: their pins go to their idle level (RM0390, 17.3.11).
    // Timers 3 and 4 have none: each channel is switched off. A timer without a clock ignores it.
    pac::TIM1.bdtr().modify(|w| w.set_moe(false));
    pac::TIM8.bdtr().modify(|w| w.set_moe(false));
    pac::TIM3.ccer().write(|_| ());
    pac::TIM4.ccer().write(|_| ());
}

/// Why the chip has started, for the session.
pub fn cause() -> Cause {
    let flags = pac::RCC.csr().read();
    pac::RCC.csr().modify(|w| w.set_rmvf(true));
    let left = restart::take();
    if flags.wdgrstf() {
        return Cause::Watchdog;
    }
    left.unwrap_or(Cause::Start)
}

/// Lets the supply's supervisor warn below 2.9 V (RM0390, 5.2.2): line 16 of the EXTI.
pub fn watch_supply() {
    pac::RCC.apb1enr().modify(|w| w.set_pwren(true));
    pac::PWR.cr1().modify(|w| {
        w.set_pls(0b111);
        w.set_pvde(true);
    });
    pac::EXTI.rtsr(0).modify(|w| w.set_line(16, true));
    pac::EXTI.imr(0).modify(|w| w.set_line(16, true));
    // SAFETY: no critical section relies on this interrupt being masked.
    unsafe { cortex_m::peripheral::NVIC::unmask(interrupt::PVD) };
}

#[interrupt]
fn PVD() {
    restart_with(Cause::BrownOut)
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

//! The board's own parts: line, pace, watchdog, ENABLE. The rig's pins are in [`crate::pins`].

use embassy_stm32::adc::Adc;
use embassy_stm32::gpio::{Level, Output, Speed};
use embassy_stm32::peripherals::{ADC1, IWDG, TIM2, USART2};
use embassy_stm32::timer::low_level::Timer;
use embassy_stm32::usart::{
    BufferedInterruptHandler, BufferedUart, BufferedUartRx, BufferedUartTx,
};
use embassy_stm32::wdg::IndependentWatchdog;
use embassy_stm32::{Peripherals, bind_interrupts, interrupt, pac, usart};
use sinew_board_runtime::Board;
use sinew_board_runtime::model::IDENTITY;
use sinew_board_runtime::model::control::NU;
use sinew_board_runtime::pacer::Pacer;
use sinew_board_runtime::wiring::SENSORS;
use sinew_device::clock::Clock;
use static_cell::ConstStaticCell;

use crate::clocks::APB1_TIMER_HZ;
use crate::drivers::{PWM_COUNTS, Wired};
use crate::fault;
use crate::pins::{ACTUATORS_WIRED, SENSORS_WIRED, wired};

const _: () = {
    assert!(
        SENSORS <= SENSORS_WIRED,
        "the model has more sensors than are wired (src/pins.rs)"
    );
    assert!(
        NU <= ACTUATORS_WIRED,
        "the model has more actuators than are wired (src/pins.rs)"
    );
};

/// Timer 2 at the model's rate.
pub static PACER: Pacer = Pacer::new(IDENTITY.rate_mhz, APB1_TIMER_HZ);

/// The ST-Link passes it on (UM1724, 6.8).
const BAUD: u32 = 921_600;
/// The watchdog's patience: several periods of any sensible rate, and short for a rig.
const WATCHDOG_US: u32 = 250_000;

/// Two of the longest frames: the reader may be one control step late.
static RECEIVED: ConstStaticCell<[u8; 2048]> = ConstStaticCell::new([0; 2048]);
static TO_SEND: ConstStaticCell<[u8; 256]> = ConstStaticCell::new([0; 256]);

bind_interrupts!(struct Interrupts {
    USART2 => BufferedInterruptHandler<USART2>;
});

/// The board.
pub struct Nucleo {
    adc: Adc<'static, ADC1>,
    wired: Wired,
    enable: Output<'static>,
    watchdog: IndependentWatchdog<'static, IWDG>,
    _pace: Timer<'static, TIM2>,
}

impl Nucleo {
    /// Claims pins and starts drivers, timer and watchdog; outputs off. `None`: the serial line's
    /// rate cannot be had.
    pub fn start(
        p: Peripherals,
    ) -> Option<(Self, BufferedUartTx<'static>, BufferedUartRx<'static>)> {
        // First of all, before anything else has a chance to fail.
        let enable = Output::new(p.PB5, Level::Low, Speed::Low);
        count_cycles();
        fault::watch_supply();

        let mut line = usart::Config::default();
        line.baudrate = BAUD;
        let line = BufferedUart::new(
            p.USART2,
            p.PA3,
            p.PA2,
            TO_SEND.take(),
            RECEIVED.take(),
            Interrupts,
            line,
        );
        let (transmitter, receiver) = line.ok()?.split();

        let wired = wired!(p);
        let mut watchdog = IndependentWatchdog::new(p.IWDG, WATCHDOG_US);
        watchdog.unleash();
        let board = Self {
            adc: Adc::new(p.ADC1),
            wired,
            enable,
            watchdog,
            _pace: pace(p.TIM2),
        };
        Some((board, transmitter, receiver))
    }
}

/// The core's cycle counter, which times the steps.
fn count_cycles() {
    if let Some(mut core) = cortex_m::Peripherals::take() {
        core.DCB.enable_trace();
        core.DWT.enable_cycle_counter();
    }
}

/// Timer 2, 32 bits, interrupting once a period.
fn pace(timer: embassy_stm32::Peri<'static, TIM2>) -> Timer<'static, TIM2> {
    let timer = Timer::new(timer);
    pac::TIM2.psc().write_value(0);
    pac::TIM2.arr().write_value(PACER.per_period() - 1);
    timer.generate_update_event();
    timer.clear_update_interrupt();
    timer.enable_update_interrupt(true);
    // SAFETY: no critical section relies on this interrupt being masked.
    unsafe { cortex_m::peripheral::NVIC::unmask(interrupt::TIM2) };
    timer.start();
    timer
}

#[interrupt]
fn TIM2() {
    pac::TIM2.sr().modify(|w| w.set_uif(false));
    PACER.on_timer();
}

impl Clock for Nucleo {
    #[inline(always)]
    fn ticks(&self) -> u32 {
        cortex_m::peripheral::DWT::cycle_count()
    }
}

impl Board for Nucleo {
    const CODE_FULL: u16 = 4095;
    const DUTY_FULL: u16 = PWM_COUNTS;

    async fn sample(&mut self) -> [u16; SENSORS] {
        let mut raw = [0; SENSORS];
        for (raw, sensor) in raw.iter_mut().zip(&mut self.wired.sensors) {
            *raw = sensor.read(&mut self.adc);
        }
        raw
    }

    fn drive(&mut self, duties: &[u16; NU], live: bool) {
        for (actuator, duty) in self.wired.actuators.iter_mut().zip(duties) {
            actuator.drive(*duty, live);
        }
        self.enable
            .set_level(if live { Level::High } else { Level::Low });
    }

    fn feed(&mut self) {
        self.watchdog.pet();
    }
}

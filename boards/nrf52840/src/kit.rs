//! Pins and drivers. The table is in README.md.

use embassy_nrf::buffered_uarte::{
    BufferedUarte, BufferedUarteRx, BufferedUarteTx, InterruptHandler,
};
use embassy_nrf::gpio::{Level, Output, OutputDrive};
use embassy_nrf::peripherals::UARTE0;
use embassy_nrf::pwm::{DutyCycle, Prescaler, SimpleConfig, SimplePwm};
use embassy_nrf::saadc::{self, ChannelConfig, Input, Saadc};
use embassy_nrf::uarte::{self, Baudrate};
use embassy_nrf::wdt::{self, Watchdog, WatchdogHandle};
use embassy_nrf::{Peripherals, bind_interrupts, interrupt, pac};
use sinew_board_runtime::Board;
use sinew_board_runtime::model::IDENTITY;
use sinew_board_runtime::model::control::NU;
use sinew_board_runtime::pacer::Pacer;
use sinew_board_runtime::wiring::SENSORS;
use sinew_device::clock::Clock;
use static_cell::ConstStaticCell;

use crate::fault;

/// Analogue inputs: A0 to A5.
const ANALOGUE_INPUTS: usize = 6;
/// Outputs of one PWM unit.
const PWM_OUTPUTS: usize = 4;
const _: () = {
    assert!(
        SENSORS <= ANALOGUE_INPUTS,
        "this board measures six signals"
    );
    assert!(NU <= PWM_OUTPUTS, "this board drives four actuators");
};

/// Timer 1, without its prescaler.
const TIMER_HZ: u32 = 16_000_000;
/// Timer 1 at the model's rate.
pub static PACER: Pacer = Pacer::new(IDENTITY.rate_mhz, TIMER_HZ);

/// 16 MHz / 1600 = 10 kHz.
const PWM_COUNTS: u16 = 1_600;
/// The watchdog's patience, of 32,768 Hz: 250 ms.
const WATCHDOG_COUNTS: u32 = 8_192;

/// Two of the longest frames: the reader may be one control step late. An even length (the driver's
/// DMA fills it by halves).
static RECEIVED: ConstStaticCell<[u8; 2048]> = ConstStaticCell::new([0; 2048]);
static TO_SEND: ConstStaticCell<[u8; 256]> = ConstStaticCell::new([0; 256]);

bind_interrupts!(struct Interrupts {
    UARTE0 => InterruptHandler<UARTE0>;
    SAADC => saadc::InterruptHandler;
});

/// The board.
pub struct Kit {
    adc: Saadc<'static, ANALOGUE_INPUTS>,
    pwm: SimplePwm<'static>,
    enable: Output<'static>,
    watchdog: WatchdogHandle,
}

impl Kit {
    /// Claims pins and starts drivers, timer and watchdog; outputs off. `None`: the watchdog runs
    /// already, with other settings, which only a power cycle changes.
    pub fn start(
        p: Peripherals,
    ) -> Option<(Self, BufferedUarteTx<'static>, BufferedUarteRx<'static>)> {
        // First of all, before anything else has a chance to fail.
        let enable = Output::new(p.P1_05, Level::Low, OutputDrive::Standard);
        count_cycles();
        fault::watch_supply();

        let mut line = uarte::Config::default();
        line.baudrate = Baudrate::Baud921600;
        let line = BufferedUarte::new(
            p.UARTE0,
            p.TIMER2,
            p.PPI_CH0,
            p.PPI_CH1,
            p.PPI_GROUP0,
            p.P0_08,
            p.P0_06,
            Interrupts,
            line,
            RECEIVED.take(),
            TO_SEND.take(),
        );
        let (receiver, transmitter) = line.split();

        let mut config = SimpleConfig::default();
        config.max_duty = PWM_COUNTS;
        config.prescaler = Prescaler::Div1;
        let pwm = SimplePwm::new_4ch(p.PWM0, p.P1_10, p.P1_11, p.P1_12, p.P1_13, &config);

        // Single-ended, a sixth of the input against 0.6 V: full scale is 3.6 V.
        let adc = Saadc::new(
            p.SAADC,
            Interrupts,
            saadc::Config::default(),
            [
                ChannelConfig::single_ended(p.P0_03.degrade_saadc()),
                ChannelConfig::single_ended(p.P0_04.degrade_saadc()),
                ChannelConfig::single_ended(p.P0_28.degrade_saadc()),
                ChannelConfig::single_ended(p.P0_29.degrade_saadc()),
                ChannelConfig::single_ended(p.P0_30.degrade_saadc()),
                ChannelConfig::single_ended(p.P0_31.degrade_saadc()),
            ],
        );

        let mut config = wdt::Config::default();
        config.timeout_ticks = WATCHDOG_COUNTS;
        // A core that a debugger has stopped is to stay stopped.
        config.action_during_debug_halt = wdt::HaltConfig::Pause;
        let (_, [watchdog]) = Watchdog::try_new(p.WDT, config).ok()?;
        // SAFETY: no critical section relies on this interrupt being masked.
        unsafe { cortex_m::peripheral::NVIC::unmask(interrupt::WDT) };

        pace();
        let board = Self {
            adc,
            pwm,
            enable,
            watchdog,
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

/// Timer 1, 32 bits, interrupting once a period and starting over by itself.
fn pace() {
    let timer = pac::TIMER1;
    timer
        .bitmode()
        .write(|w| w.set_bitmode(pac::timer::vals::Bitmode::_32bit));
    timer.prescaler().write(|w| w.set_prescaler(0));
    timer.cc(0).write_value(PACER.per_period());
    timer.shorts().write(|w| w.set_compare_clear(0, true));
    timer.intenset().write(|w| w.set_compare(0, true));
    // SAFETY: no critical section relies on this interrupt being masked.
    unsafe { cortex_m::peripheral::NVIC::unmask(interrupt::TIMER1) };
    timer.tasks_start().write_value(1);
}

#[interrupt]
fn TIMER1() {
    pac::TIMER1.events_compare(0).write_value(0);
    PACER.on_timer();
}

impl Clock for Kit {
    #[inline(always)]
    fn ticks(&self) -> u32 {
        cortex_m::peripheral::DWT::cycle_count()
    }
}

impl Board for Kit {
    /// The converter gives 12 bits of 3.6 V; a supply of 3.3 V is 3754 of them, and what a sensor
    /// that runs on it calls full scale.
    const CODE_FULL: u16 = 3754;
    const DUTY_FULL: u16 = PWM_COUNTS;

    /// By DMA, about 12 us a channel.
    async fn sample(&mut self) -> [u16; SENSORS] {
        let mut all = [0; ANALOGUE_INPUTS];
        self.adc.sample(&mut all).await;
        let mut codes = [0; SENSORS];
        for (code, measured) in codes.iter_mut().zip(all) {
            // Noise around zero may be negative.
            *code = u16::try_from(measured).unwrap_or(0);
        }
        codes
    }

    fn drive(&mut self, duties: &[u16; NU], live: bool) {
        // Inverted: high while the counter is below the duty.
        let mut all = [const { DutyCycle::inverted(0) }; PWM_OUTPUTS];
        for (all, duty) in all.iter_mut().zip(duties) {
            *all = DutyCycle::inverted(*duty);
        }
        self.pwm.set_all_duties(all);
        self.enable
            .set_level(if live { Level::High } else { Level::Low });
    }

    fn feed(&mut self) {
        self.watchdog.pet();
    }
}

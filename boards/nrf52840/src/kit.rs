//! The board's own parts: line, pace, watchdog, ENABLE. The rig's pins are in [`crate::pins`].

use embassy_nrf::buffered_uarte::{
    BufferedUarte, BufferedUarteRx, BufferedUarteTx, InterruptHandler,
};
use embassy_nrf::gpio::{Level, Output, OutputDrive};
use embassy_nrf::peripherals::UARTE0;
use embassy_nrf::pwm::SimplePwm;
use embassy_nrf::saadc::{self, Saadc};
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

use crate::drivers::{Actuator, Decoder, PWM_COUNTS, Sensor, UNITS, load};
use crate::fault;
use crate::pins::{ACTUATORS_WIRED, ANALOGUE_WIRED, SENSORS_WIRED, wired};

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

/// Timer 1, without its prescaler.
const TIMER_HZ: u32 = 16_000_000;
/// Timer 1 at the model's rate.
pub static PACER: Pacer = Pacer::new(IDENTITY.rate_mhz, TIMER_HZ);

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
    adc: Saadc<'static, ANALOGUE_WIRED>,
    decoder: Option<Decoder>,
    sensors: [Sensor; SENSORS_WIRED],
    actuators: [Actuator; ACTUATORS_WIRED],
    units: [Option<SimplePwm<'static>>; UNITS],
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

        let wired = wired!(p);
        let adc = Saadc::new(
            p.SAADC,
            Interrupts,
            saadc::Config::default(),
            wired.analogue,
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
            decoder: wired.decoder,
            sensors: wired.sensors,
            actuators: wired.actuators,
            units: wired.units,
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
        let mut codes = [0; ANALOGUE_WIRED];
        // Without an input it would never end.
        if !codes.is_empty() {
            self.adc.sample(&mut codes).await;
        }
        let mut raw = [0; SENSORS];
        for (raw, sensor) in raw.iter_mut().zip(&self.sensors) {
            *raw = match sensor {
                // Noise around zero may be negative.
                Sensor::Analogue(k) => codes
                    .get(*k)
                    .map_or(0, |code| u16::try_from(*code).unwrap_or(0)),
                Sensor::Encoder => self.decoder.as_mut().map_or(0, Decoder::count),
            };
        }
        raw
    }

    fn drive(&mut self, duties: &[u16; NU], live: bool) {
        for (actuator, duty) in self.actuators.iter_mut().zip(duties) {
            actuator.set(*duty, live);
        }
        load(&self.units);
        self.enable
            .set_level(if live { Level::High } else { Level::Low });
    }

    fn feed(&mut self) {
        self.watchdog.pet();
    }
}

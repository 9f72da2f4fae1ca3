//! The controller on an nRF52840 DK: frames over the J-Link's virtual serial port, log over RTT.
//!
//! The rig's pins are in [`pins`], their drivers in [`drivers`], the board's own parts in [`kit`],
//! and the end of a broken program in [`fault`]; the rest is `sinew_board_runtime`.

#![no_std]
#![no_main]

mod drivers;
mod fault;
mod kit;
mod pins;

use panic_probe as _;

use embassy_executor::Spawner;
use embassy_nrf::buffered_uarte::BufferedUarteTx;
use embassy_nrf::config::{Config, HfclkSource};
use sinew_board_runtime::outbox::Outbox;
use sinew_board_runtime::probe::{self, Both, ToProbe};
use sinew_board_runtime::serve::Desk;
use sinew_board_runtime::{serve, start};

use kit::{Kit, PACER};

static OUTBOX: Outbox = Outbox::new();

defmt::timestamp!("{=u64:us}", embassy_time::Instant::now().as_micros());

#[embassy_executor::main]
async fn main(spawner: Spawner) {
    let parts = start();
    let probe = probe::start();
    let mut config = Config::default();
    // The crystal: the internal oscillator is off by up to 8 % (PS v1.7, 5.4.5.3), and the pace
    // with it.
    config.hfclk_source = HfclkSource::ExternalXtal;
    let peripherals = embassy_nrf::init(config);
    parts.session.note_restart(fault::cause());
    let Some((board, transmitter, receiver)) = Kit::start(peripherals) else {
        defmt::error!("the watchdog runs with another period: switch the board off and on");
        return;
    };
    // Fails only when the task's one slot is taken, and nothing has run yet.
    if let Ok(task) = transmit(transmitter, probe.to) {
        spawner.spawn(task);
    }
    let desk = Desk {
        board,
        pacer: &PACER,
        session: parts.session,
        link: parts.link,
        outbox: &OUTBOX,
    };
    let line = Both {
        serial: receiver,
        probe: probe.from,
    };
    serve(desk, line).await
}

#[embassy_executor::task]
async fn transmit(line: BufferedUarteTx<'static>, probe: ToProbe) {
    OUTBOX.drain(line, probe).await
}

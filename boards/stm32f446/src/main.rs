//! The controller on a Nucleo-F446RE: frames over the ST-Link's virtual serial port, log over RTT.
//!
//! The rig's pins are in [`pins`], their drivers in [`drivers`], the board's own parts in
//! [`nucleo`], and the end of a broken program in [`fault`]; the rest is `sinew_board_runtime`.

#![no_std]
#![no_main]

mod clocks;
mod drivers;
mod fault;
mod nucleo;
mod pins;

use panic_probe as _;

use embassy_executor::Spawner;
use embassy_stm32::usart::BufferedUartTx;
use sinew_board_runtime::outbox::Outbox;
use sinew_board_runtime::probe::{self, Both, ToProbe};
use sinew_board_runtime::serve::Desk;
use sinew_board_runtime::{serve, start};

use nucleo::{Nucleo, PACER};

static OUTBOX: Outbox = Outbox::new();

defmt::timestamp!("{=u64:us}", embassy_time::Instant::now().as_micros());

#[embassy_executor::main]
async fn main(spawner: Spawner) {
    let parts = start();
    let probe = probe::start();
    let peripherals = embassy_stm32::init(clocks::config());
    parts.session.note_restart(fault::cause());
    let Some((board, transmitter, receiver)) = Nucleo::start(peripherals) else {
        defmt::error!("the serial line refuses its rate");
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
async fn transmit(line: BufferedUartTx<'static>, probe: ToProbe) {
    OUTBOX.drain(line, probe).await
}

//! The controller running free: frames over the serial line, ticks from a timer, in real time.
//!
//! Armed for a host, every tick answers the newest sample that has arrived; where none has, the
//! controller predicts it. Otherwise every tick reads and drives the rig that the host simulates
//! (`src/rig.rs`).
//!
//! Ends with status 0 after Stop, and with 3 when the line has been silent for long: a host that
//! was killed leaves no QEMU behind. A real board goes to its safe command and waits.

#![no_std]
#![no_main]

use sinew_board_qemu::machine::{Machine, OUTBOX, PACER};
use sinew_board_qemu::uart::{self, Receiver, Transmitter};
use sinew_board_qemu::{bind_uart, program};
use sinew_board_runtime::probe::{self, Both, FromProbe, ToProbe};
use sinew_board_runtime::serve::Desk;
use sinew_board_runtime::{Parts, serve};

bind_uart!();

#[cortex_m_rt::entry]
fn main() -> ! {
    let (executor, parts) = program::start();
    let probe = probe::start();
    executor.run(|spawner| {
        let (receiver, transmitter) = uart::init();
        // Fails only when a task's one slot is taken, and nothing has run yet.
        if let (Ok(control), Ok(transmit)) = (
            control(parts, receiver, probe.from),
            transmit(transmitter, probe.to),
        ) {
            spawner.spawn(control);
            spawner.spawn(transmit);
        }
    })
}

#[embassy_executor::task]
async fn control(parts: Parts, serial: Receiver, probe: FromProbe) {
    let (board, cause) = Machine::start();
    if let Some(cause) = cause {
        parts.session.note_restart(cause);
    }
    let desk = Desk {
        board,
        pacer: &PACER,
        session: parts.session,
        link: parts.link,
        outbox: &OUTBOX,
    };
    serve(desk, Both { serial, probe }).await
}

#[embassy_executor::task]
async fn transmit(line: Transmitter, probe: ToProbe) {
    OUTBOX.drain(line, probe).await
}

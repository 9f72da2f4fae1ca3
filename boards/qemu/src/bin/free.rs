//! The controller running free: frames over the serial line, steps paced by a ticker in real time.
//!
//! At every tick the newest sample that has arrived is answered; where none has, the controller predicts
//! it. Says Hello first: bytes sent before the line is up would wait for QEMU's next wake-up.
//!
//! Ends with status 0 after Stop, and with 3 when the line has been silent for long: a host that was killed
//! leaves no QEMU behind. A real board would go to its safe command and wait.

#![no_std]
#![no_main]

use embassy_futures::select::{Either, select};
use embassy_time::{Duration, Instant, Ticker};
use model::control::Session;
use sinew_board_qemu::link::{Heard, Link};
use sinew_board_qemu::newest::Newest;
use sinew_board_qemu::semihosting::{ExitCode, exit};
use sinew_board_qemu::time::{self, Counter};
use sinew_board_qemu::{program, uart};
use sinew_firmware::protocol::{ToDevice, ToHost};

/// Longest silence on the line before the host is taken for gone.
const SILENCE: Duration = Duration::from_secs(30);

sinew_board_qemu::bind_uart!();

#[cortex_m_rt::entry]
fn main() -> ! {
    let parts = program::start();
    parts.executor.run(|spawner| {
        // Fails only when the task's one slot is taken, and nothing has run yet.
        if let Ok(task) = control(parts.session, parts.link) {
            spawner.spawn(task);
        }
    })
}

#[embassy_executor::task]
async fn control(session: &'static mut Session, link: &'static mut Link) {
    let (mut receiver, mut transmitter) = uart::init();
    let mut newest = Newest::new();
    let mut chunk = [0; 64];

    let mut hello = ToHost::Hello(*session.identity());
    transmitter.write(link.frame(&mut hello)).await;

    let period = time::period(session.identity().rate_mhz);
    let mut ticker = Ticker::every(period);
    let mut due = Instant::now() + period;
    let mut heard = Instant::now();
    loop {
        match select(ticker.next(), receiver.read(&mut chunk)).await {
            Either::First(()) => {
                due += period;
                if heard.elapsed() > SILENCE {
                    defmt::warn!("the line is silent");
                    exit(ExitCode::HostGone)
                }
                let Some(sample) = newest.take() else {
                    continue;
                };
                let mut answer = session.answer(sample, &Counter);
                if Instant::now() > due {
                    session.note_deadline_miss();
                }
                transmitter.write(link.frame(&mut answer)).await;
            }
            Either::Second(n) => {
                heard = Instant::now();
                for byte in chunk.get(..n).unwrap_or_default() {
                    let mut answer = match link.hear(*byte) {
                        Heard::Nothing => continue,
                        Heard::Message(sample @ ToDevice::Sample { .. }) => {
                            newest.put(sample);
                            continue;
                        }
                        Heard::Message(message) => {
                            if message == ToDevice::Reset {
                                newest = Newest::new();
                            }
                            session.answer(&message, &Counter)
                        }
                        Heard::Damaged => link.refusal(),
                    };
                    transmitter.write(link.frame(&mut answer)).await;
                    if session.is_stopped() {
                        transmitter.flush().await;
                        exit(ExitCode::Stopped)
                    }
                }
            }
        }
    }
}

//! The controller in lockstep with its host: frames over two files by semihosting, one tick of the
//! control period for each sample. The same frames give the same commands after the same
//! instructions.
//!
//! Ends with status 0 after Stop, 2 when the files cannot be had, 3 when the host has closed its
//! end.

#![no_std]
#![no_main]

use embassy_time::{Instant, Ticker};
use sinew_board_qemu::program;
use sinew_board_qemu::semihosting::{Channel, ExitCode, LINK, exit};
use sinew_board_qemu::time::{self, Counter};
use sinew_board_runtime::link::{Heard, Link};
use sinew_board_runtime::model::control::Session;

#[cortex_m_rt::entry]
fn main() -> ! {
    let (executor, parts) = program::start();
    executor.run(|spawner| {
        // Fails only when the task's one slot is taken, and nothing has run yet.
        if let Ok(task) = control(parts.session, parts.link) {
            spawner.spawn(task);
        }
    })
}

#[embassy_executor::task]
async fn control(session: &'static mut Session, link: &'static mut Link) {
    let Ok(mut channel) = Channel::open(LINK) else {
        defmt::error!("to_device or to_host cannot be opened");
        exit(ExitCode::Channel)
    };
    let mut chunk = [0; 256];

    let period = time::period(session.identity().rate_mhz);
    let mut ticker = Ticker::every(period);
    let mut due = Instant::now() + period;
    loop {
        let bytes = match channel.read(&mut chunk) {
            Ok(0) => {
                defmt::warn!("the host has closed its end");
                exit(ExitCode::HostGone)
            }
            Ok(n) => chunk.get(..n).unwrap_or_default(),
            Err(_) => exit(ExitCode::Channel),
        };
        for byte in bytes {
            let steps = session.summary().steps;
            let mut answer = match link.hear(*byte) {
                Heard::Nothing => continue,
                Heard::Message(message) => session.answer(&message, &Counter),
                Heard::Damaged => link.refusal(),
            };
            if channel.write(link.frame(&mut answer)).is_err() {
                exit(ExitCode::Channel)
            }
            if session.is_stopped() {
                exit(ExitCode::Stopped)
            }
            if session.summary().steps != steps {
                if Instant::now() > due {
                    session.note_deadline_miss();
                }
                due += period;
                ticker.next().await;
            }
        }
    }
}

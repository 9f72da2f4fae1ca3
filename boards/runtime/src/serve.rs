//! The control task: ticks on one side, the link on the other.

use core::future::ready;

use embassy_futures::select::{Either, select};
use embassy_futures::yield_now;
use embedded_io_async::Read;
use model::control::{NU, Session};
use sinew_device::clock::Clock;
use sinew_device::mode::{Cause, Drive, Mode};
use sinew_device::protocol::{ToDevice, ToHost};

use crate::link::{Heard, Link};
use crate::newest::Newest;
use crate::outbox::Outbox;
use crate::pacer::Pacer;
use crate::wiring::{self, Readings, SENSORS};

/// Seconds without a byte from the host after which its own rig is disarmed.
pub const SILENCE_S: u32 = 2;

/// Clocks, pins and drivers of one board.
pub trait Board: Clock {
    /// Largest code of the analogue inputs.
    const CODE_FULL: u16;
    /// Largest duty of the outputs.
    const DUTY_FULL: u16;

    /// Reads every sensor, a converter's code or an encoder's counter: outputs first, then
    /// channels, in the model's order.
    async fn sample(&mut self) -> [u16; SENSORS];

    /// Sets the outputs; with `live` false the power stages are off, whatever the duties are.
    fn drive(&mut self, duties: &[u16; NU], live: bool);

    /// Feeds the watchdog. Called once a tick, when all of its work is done.
    fn feed(&mut self);

    /// The host has been silent for that many ticks.
    fn silent(&mut self, _ticks: u32) {}

    /// The host said Stop and its answer is on the way. A board goes on; a program in QEMU ends.
    async fn stopped(&mut self) {}
}

/// Everything the task works with.
pub struct Desk<'a, B> {
    /// The board.
    pub board: B,
    /// Its tick.
    pub pacer: &'static Pacer,
    /// The controller.
    pub session: &'a mut Session,
    /// Frames in and out.
    pub link: &'a mut Link,
    /// Bytes out.
    pub outbox: &'static Outbox,
}

/// Controls and answers for ever. Says Hello first.
pub async fn serve<B: Board>(mut desk: Desk<'_, B>, mut line: impl Read) -> ! {
    let silence = desk.session.identity().rate_mhz.div_ceil(1000) * SILENCE_S;
    let mut newest = Newest::new();
    let mut readings = Readings::new();
    let mut chunk = [0; 64];
    let mut quiet: u32 = 0;

    let mut hello = ToHost::Hello(*desk.session.identity());
    desk.send(&mut hello);
    loop {
        match select(desk.pacer.tick(), line.read(&mut chunk)).await {
            Either::First(at_us) => {
                quiet = quiet.saturating_add(1);
                let on_board = desk.session.state().drive().is_some_and(Drive::is_on_board);
                if on_board && quiet > silence {
                    desk.session.disarm(Cause::LinkLost);
                }
                desk.board.silent(quiet);
                desk.tick(at_us, &mut newest, &mut readings).await;
                if desk.pacer.is_due() {
                    desk.session.note_deadline_miss();
                }
                desk.board.feed();
                // Steps that take longer than their period must not shut the host out: the next
                // tick is due already, and would always win, over the line here and over the task
                // that empties the outbox.
                yield_now().await;
                // Asked once. Not by `poll_once`: a line that waits for time needs the task's own
                // waker.
                if let Either::First(heard) = select(line.read(&mut chunk), ready(())).await {
                    quiet = 0;
                    desk.listen(heard, &chunk, &mut newest).await;
                }
            }
            Either::Second(heard) => {
                quiet = 0;
                desk.listen(heard, &chunk, &mut newest).await;
            }
        }
    }
}

impl<B: Board> Desk<'_, B> {
    async fn tick(&mut self, at_us: u64, newest: &mut Newest, readings: &mut Readings) {
        if self.session.state().mode == Mode::Armed(Drive::Host) {
            if let Some(sample) = newest.take() {
                let mut answer = self.session.answer(sample, &self.board);
                self.send(&mut answer);
            }
            return;
        }
        let raw = self.board.sample().await;
        let (y, s) = readings.measured(&raw, B::CODE_FULL);
        let (outputs, telemetry) = self.session.tick(at_us, &y, &s, &self.board);
        self.board
            .drive(&wiring::duties(&outputs.u, B::DUTY_FULL), outputs.live);
        if let Some(mut telemetry) = telemetry
            && !self.send(&mut telemetry)
        {
            self.session.note_dropped();
        }
    }

    async fn listen<E>(&mut self, heard: Result<usize, E>, chunk: &[u8], newest: &mut Newest) {
        // Overrun, noise: the frame it belonged to fails its checksum.
        let Ok(n) = heard else { return };
        for byte in chunk.get(..n).unwrap_or_default() {
            self.hear(*byte, newest).await;
        }
    }

    async fn hear(&mut self, byte: u8, newest: &mut Newest) {
        let mut answer = match self.link.hear(byte) {
            Heard::Nothing => return,
            Heard::Message(sample @ ToDevice::Sample { .. })
                if self.session.state().mode == Mode::Armed(Drive::Host) =>
            {
                // Answered at the next tick.
                newest.put(sample);
                return;
            }
            Heard::Message(message) => {
                if matches!(message, ToDevice::Reset | ToDevice::Arm { .. }) {
                    *newest = Newest::new();
                }
                self.session.answer(&message, &self.board)
            }
            Heard::Damaged => self.link.refusal(),
        };
        if self.session.state().mode == Mode::Tripped {
            // Not at the next tick: now.
            let safe = *self.session.applied();
            self.board
                .drive(&wiring::duties(&safe, B::DUTY_FULL), false);
        }
        self.send(&mut answer);
        if self.session.is_stopped() {
            self.board.stopped().await;
            self.session.reopen();
        }
    }

    fn send(&mut self, answer: &mut ToHost) -> bool {
        self.outbox.send(self.link.frame(answer))
    }
}

//! The session on the board's own sensors and actuators: one call a tick of the board's timer.

use heapless::{Deque, Vec};

use super::{EXCITATION_ROWS, LoopSession, preview, refused};
use crate::clock::Clock;
use crate::mode::{Cause, Drive, Mode};
use crate::protocol::{Reason, Telemetry, ToHost};
use sinew_mpc::PredictiveLoop;
use sinew_mpc::controller::Step;

/// Output of the board's pins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outputs<const NU: usize> {
    /// Command, physical units.
    pub u: [f32; NU],
    /// The power stages are enabled; otherwise off, whatever `u` is.
    pub live: bool,
}

/// State that only the board's own rig needs.
pub(super) struct Own<const NU: usize, const NY: usize, const N: usize> {
    tick: u32,
    /// r(k+1) .. r(k+N); `None`: nobody has asked for anything since arming.
    reference: Option<[[f32; NY]; N]>,
    rows: Deque<(u32, [f32; NU]), EXCITATION_ROWS>,
    /// Number of the next row to take.
    next_row: u32,
    /// A row has been applied since arming.
    playing: bool,
    /// Ticks without a row in a row.
    starved: u16,
    live: bool,
    every: u16,
    dropped: u32,
}

impl<const NU: usize, const NY: usize, const N: usize> Own<NU, NY, N> {
    pub(super) const fn new() -> Self {
        Self {
            tick: 0,
            reference: None,
            rows: Deque::new(),
            next_row: 0,
            playing: false,
            starved: 0,
            live: false,
            every: 0,
            dropped: 0,
        }
    }

    pub(super) fn arm(&mut self, drive: Drive) {
        if drive != Drive::Excitation {
            self.disarm();
        }
        self.live = drive.is_on_board();
        self.playing = false;
        self.starved = 0;
        self.reference = None;
    }

    /// Outputs stay live until the safe command is reached.
    pub(super) fn disarm(&mut self) {
        self.rows.clear();
        self.next_row = 0;
    }

    pub(super) fn emergency_stop(&mut self) {
        self.disarm();
        self.live = false;
    }
}

impl<
    C: PredictiveLoop<NU, NY, NS, N>,
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const N: usize,
> LoopSession<C, NU, NY, NS, N>
{
    /// One tick: what the sensors say (NaN: missing) at `at_us` of the board's clock, and what the
    /// outputs are to be. Inside the limits whatever comes in; the safe command unless armed.
    pub fn tick(
        &mut self,
        at_us: u64,
        y: &[f32; NY],
        s: &[f32; NS],
        clock: &impl Clock,
    ) -> (Outputs<NU>, Option<ToHost>) {
        let missed = self.controller.missed();
        let start = clock.ticks();
        let known;
        let y = if C::SENSED {
            known = self.controller.outputs(y, s);
            &known
        } else {
            y
        };
        let (step, row, reference) = self.own_step(y, s);
        let ticks = clock.ticks().wrapping_sub(start);
        if self.state.drive().is_some() {
            self.judge(y, &step);
        }
        self.count(missed);
        let safe = self.controller.limits().safe;
        if self.state.drive().is_none() && step.u == safe {
            self.own.live = false;
        }
        self.own.tick = self.own.tick.wrapping_add(1);
        let outputs = Outputs {
            u: step.u,
            live: self.own.live,
        };
        let due = self.own.tick.checked_rem(self.own.every.into()) == Some(0);
        let telemetry = due.then(|| self.telemetry(at_us, y, s, &step, row, &reference, ticks));
        (outputs, telemetry)
    }

    /// The step that the mode asks for, the excitation's row behind it, and r(k+1).
    fn own_step(&mut self, y: &[f32; NY], s: &[f32; NS]) -> (Step<NU>, Option<u32>, [f32; NY]) {
        match self.state.mode {
            Mode::Armed(Drive::Rig) => {
                if self.own.reference.is_none() && y.iter().all(|y| y.is_finite()) {
                    // Nobody has asked for anything: stay here.
                    self.own.reference = Some([*y; N]);
                }
                let mut reference = self.own.reference.unwrap_or([[f32::NAN; NY]; N]);
                if let Some(rows) = &mut self.own.reference {
                    rows.copy_within(1.., 0);
                }
                self.transfer.apply(y, &mut reference);
                let first = reference.first().copied().unwrap_or(*y);
                (self.controller.step(y, s, &reference), None, first)
            }
            Mode::Armed(Drive::Excitation) => {
                let row = self.own.rows.pop_front();
                match row {
                    Some(_) => (self.own.playing, self.own.starved) = (true, 0),
                    None if self.own.playing => {
                        self.own.starved = self.own.starved.saturating_add(1);
                    }
                    None => {}
                }
                let command = row.map_or(*self.controller.applied(), |(_, u)| u);
                let step = self.controller.open_loop(y, s, Some(&command));
                if self.own.starved > self.controller.max_missing_samples() {
                    self.disarm(Cause::Starved);
                }
                (step, row.map(|(number, _)| number), [f32::NAN; NY])
            }
            Mode::Armed(Drive::Host) | Mode::Disarmed | Mode::Tripped => {
                (self.controller.open_loop(y, s, None), None, [f32::NAN; NY])
            }
        }
    }

    #[expect(clippy::too_many_arguments, reason = "a frame has that many fields")]
    #[inline(never)]
    fn telemetry(
        &self,
        at_us: u64,
        y: &[f32; NY],
        s: &[f32; NS],
        step: &Step<NU>,
        row: Option<u32>,
        reference: &[f32; NY],
        ticks: u32,
    ) -> ToHost {
        let estimate = self.controller.estimate();
        ToHost::Telemetry(Telemetry {
            tick: self.own.tick,
            at_us,
            state: self.state,
            row,
            y: Vec::from_slice(y).unwrap_or_default(),
            s: Vec::from_slice(s.get(..usize::from(self.identity.n_s)).unwrap_or(s))
                .unwrap_or_default(),
            u: Vec::from_slice(&step.u).unwrap_or_default(),
            reference: Vec::from_slice(reference).unwrap_or_default(),
            estimate: Vec::from_slice(&estimate).unwrap_or_default(),
            disturbance: Vec::from_slice(self.controller.disturbance()).unwrap_or_default(),
            status: step.status,
            iterations: step.iterations,
            ticks,
            deadline_misses: self.summary.deadline_misses,
            dropped: self.own.dropped,
        })
    }

    /// The board had no room for a telemetry frame.
    pub const fn note_dropped(&mut self) {
        self.own.dropped = self.own.dropped.wrapping_add(1);
    }

    #[inline(never)]
    pub(super) fn follow(&mut self, rows: &[f32]) -> ToHost {
        let Some(reference) = preview(rows) else {
            return refused(Reason::Shape);
        };
        if !rows.iter().all(|value| value.is_finite()) {
            return refused(Reason::Settings);
        }
        if self.state.mode != Mode::Armed(Drive::Rig) {
            return refused(Reason::Mode);
        }
        self.own.reference = Some(reference);
        ToHost::Tuned
    }

    #[inline(never)]
    pub(super) fn excite(&mut self, row: u32, u: &[f32]) -> ToHost {
        let Ok(u) = u.try_into() else {
            return refused(Reason::Shape);
        };
        let values: &[f32; NU] = &u;
        if !values.iter().all(|value| value.is_finite()) {
            return refused(Reason::Settings);
        }
        // Rows may wait before the arming that plays them.
        if !matches!(
            self.state.mode,
            Mode::Disarmed | Mode::Armed(Drive::Excitation)
        ) {
            return refused(Reason::Mode);
        }
        if row > self.own.next_row {
            return refused(Reason::Order);
        }
        // One that was taken before is answered again: its answer may have been lost.
        if row == self.own.next_row {
            if self.own.rows.push_back((row, u)).is_err() {
                return refused(Reason::Full);
            }
            self.own.next_row = row.wrapping_add(1);
        }
        let room = EXCITATION_ROWS - self.own.rows.len();
        ToHost::Queued {
            row,
            room: room as u16,
        }
    }

    pub(super) const fn stream(&mut self, every: u16) -> ToHost {
        self.own.every = every;
        ToHost::State(self.state)
    }
}

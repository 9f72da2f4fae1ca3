//! Frame in, frame out: a pure state machine around the control loop. Boards move bytes, this answers.

use heapless::Vec;

use crate::control_loop::{ControlLoop, Settings};
use crate::model::{Jacobian, Model};
use crate::network::unflatten;
use crate::protocol::{
    Accumulator, Fed, Identity, MAX_JACOBIAN, MAX_REGRESSOR, Reason, Summary, ToDevice, ToHost,
    decode, encode,
};

/// A free-running counter of the board, cycles or ticks, that wraps at 32 bits.
pub trait Clock {
    /// The count now.
    fn ticks(&self) -> u32;
}

/// One controller at one link. Counts since it was made; a [`ToDevice::Reset`] does not clear counts.
pub struct Session<
    M,
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
    const N: usize,
    const NB: usize,
    const NV: usize,
> {
    controller: ControlLoop<M, NU, NY, NS, ND, DD, N, NB, NV>,
    identity: Identity,
    accumulator: Accumulator,
    summary: Summary,
    stopped: bool,
}

impl<
    M: Model<NU, NY, NS, ND, DD>,
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
    const N: usize,
    const NB: usize,
    const NV: usize,
> Session<M, NU, NY, NS, ND, DD, N, NB, NV>
{
    /// A session that has heard nothing yet.
    pub const fn new(
        controller: ControlLoop<M, NU, NY, NS, ND, DD, N, NB, NV>,
        identity: Identity,
    ) -> Self {
        const {
            use crate::protocol::{MAX_CHANNELS, MAX_PREVIEW, MAX_SIGNALS};
            assert!(NU <= MAX_SIGNALS && NY <= MAX_SIGNALS && NS <= MAX_CHANNELS);
            assert!(NY <= MAX_PREVIEW && NU * ND + NY * DD + NS <= MAX_REGRESSOR);
        }
        Self {
            controller,
            identity,
            accumulator: Accumulator::new(),
            summary: Summary {
                steps: 0,
                deadline_misses: 0,
                missed_samples: 0,
                stack_high_water_bytes: 0,
                frames_rejected: 0,
            },
            stopped: false,
        }
    }

    /// Takes any number of bytes; for every whole frame among them calls `reply` with one answer, an
    /// encoded frame. Damaged frames are counted and answered by [`ToHost::Refused`].
    pub fn receive(&mut self, bytes: &[u8], clock: &impl Clock, mut reply: impl FnMut(&[u8])) {
        for byte in bytes {
            let message = match self.accumulator.feed(*byte) {
                Fed::Nothing => continue,
                Fed::Frame(frame) => decode(frame).ok(),
                Fed::TooLong => None,
            };
            let answer = match message {
                Some(message) => self.answer(&message, clock),
                None => {
                    self.summary.frames_rejected = self.summary.frames_rejected.wrapping_add(1);
                    refused(Reason::Damaged)
                }
            };
            if let Some(frame) = encode(&answer, self.accumulator.scratch()) {
                reply(frame);
            }
        }
    }

    /// The answer to one message.
    #[inline(never)]
    pub fn answer(&mut self, message: &ToDevice, clock: &impl Clock) -> ToHost {
        if self.stopped && !matches!(message, ToDevice::Stop | ToDevice::Hello) {
            return refused(Reason::Stopped);
        }
        match message {
            ToDevice::Hello => ToHost::Hello(self.identity),
            ToDevice::Sample {
                seq,
                y,
                s,
                reference,
            } => self.sample(*seq, y, s, reference, clock),
            ToDevice::Tune {
                tracking_weight,
                move_suppression,
                disturbance_gain,
                iterations,
            } => self.tune(
                tracking_weight,
                move_suppression,
                *disturbance_gain,
                *iterations,
            ),
            ToDevice::Probe { x } => self.probe(x),
            ToDevice::Reset => {
                self.controller.reset();
                ToHost::Tuned
            }
            ToDevice::Stop => {
                self.stopped = true;
                ToHost::Done(self.summary())
            }
        }
    }

    fn sample(
        &mut self,
        seq: u32,
        y: &[f32],
        s: &[f32],
        rows: &[f32],
        clock: &impl Clock,
    ) -> ToHost {
        let (Ok(y), Ok(s)) = (y.try_into(), s.try_into()) else {
            return refused(Reason::Shape);
        };
        let (rows, rest) = rows.as_chunks::<NY>();
        let Some(last) = rows.last() else {
            return refused(Reason::Shape);
        };
        if !rest.is_empty() || rows.len() > N {
            return refused(Reason::Shape);
        }
        let mut reference = [*last; N];
        for (place, row) in reference.iter_mut().zip(rows) {
            *place = *row;
        }
        let missed = self.controller.estimator().missed();
        let start = clock.ticks();
        let step = self.controller.step(y, s, &reference);
        let ticks = clock.ticks().wrapping_sub(start);
        self.summary.steps = self.summary.steps.wrapping_add(1);
        let missed = self.controller.estimator().missed().wrapping_sub(missed);
        self.summary.missed_samples = self.summary.missed_samples.wrapping_add(missed);
        ToHost::Command {
            seq,
            u: Vec::from_slice(&step.u).unwrap_or_default(),
            status: step.status,
            iterations: step.iterations,
            cost: step.cost,
            ticks,
            bridged: step.bridged,
        }
    }

    fn tune(
        &mut self,
        tracking_weight: &[f32],
        move_suppression: &[f32],
        disturbance_gain: f32,
        iterations: u8,
    ) -> ToHost {
        let (Ok(tracking_weight), Ok(move_suppression)) =
            (tracking_weight.try_into(), move_suppression.try_into())
        else {
            return refused(Reason::Shape);
        };
        let settings = Settings {
            tracking_weight,
            move_suppression,
            disturbance_gain,
            iterations,
            gap_limit: self.controller.settings().gap_limit,
        };
        if !settings.is_valid() {
            return refused(Reason::Settings);
        }
        *self.controller.settings_mut() = settings;
        ToHost::Tuned
    }

    fn probe(&self, x: &[f32]) -> ToHost {
        let Some(regressor) = unflatten::<NU, NY, NS, ND, DD>(x) else {
            return refused(Reason::Shape);
        };
        let (mut trace, mut jacobian) = (M::TRACE, Jacobian::ZERO);
        let model = self.controller.model();
        let y = model.predict(&regressor, &mut trace);
        model.jacobian(&trace, &mut jacobian);
        let mut flat = Vec::new();
        if NY * (NU * ND + NY * DD) <= MAX_JACOBIAN {
            for r in 0..NY {
                let inputs = jacobian.u.iter().filter_map(|lag| lag.get(r)).flatten();
                let outputs = jacobian.y.iter().filter_map(|lag| lag.get(r)).flatten();
                for derivative in inputs.chain(outputs) {
                    // Room was checked; `extend` would leave a panic in the image.
                    let _ = flat.push(*derivative);
                }
            }
        }
        ToHost::Prediction {
            y: Vec::from_slice(&y).unwrap_or_default(),
            jacobian: flat,
        }
    }

    /// The board saw a step end after its period.
    pub fn note_deadline_miss(&mut self) {
        self.summary.deadline_misses = self.summary.deadline_misses.wrapping_add(1);
    }

    /// The board measured its stack; the deepest value is kept and reported at [`ToDevice::Stop`].
    pub fn note_stack(&mut self, high_water_bytes: u32) {
        if high_water_bytes > self.summary.stack_high_water_bytes {
            self.summary.stack_high_water_bytes = high_water_bytes;
        }
    }

    /// [`ToDevice::Stop`] has come.
    pub const fn is_stopped(&self) -> bool {
        self.stopped
    }

    /// The counts so far.
    pub const fn summary(&self) -> Summary {
        self.summary
    }

    /// Who this is.
    pub const fn identity(&self) -> &Identity {
        &self.identity
    }

    /// The controller.
    pub const fn controller(&self) -> &ControlLoop<M, NU, NY, NS, ND, DD, N, NB, NV> {
        &self.controller
    }

    /// The controller, to be changed.
    pub const fn controller_mut(&mut self) -> &mut ControlLoop<M, NU, NY, NS, ND, DD, N, NB, NV> {
        &mut self.controller
    }
}

const fn refused(reason: Reason) -> ToHost {
    ToHost::Refused { reason }
}

//! Frame in, frame out: a pure state machine around the control loop. Boards move bytes, this
//! answers.

mod rig;

use heapless::Vec;

pub use rig::Outputs;

use crate::bumpless::BumplessTransfer;
use crate::clock::Clock;
use crate::mode::{Cause, Drive, Mode, State};
use crate::protocol::{
    Accumulator, Fed, Health, Identity, MAX_JACOBIAN, MAX_REGRESSOR, PROTOCOL, Parameters, Reason,
    Summary, ToDevice, ToHost, decode, encode,
};
use crate::supervisor::Supervisor;
use sinew_mpc::channel_watch::LeftOut;
use sinew_mpc::controller::{ControlLoop, Step};
use sinew_mpc::limits::Limits;
use sinew_mpc::{CostTerm, PredictiveLoop};

/// Rows of an excitation that wait for their tick: a quarter of a second at 120 Hz.
pub const EXCITATION_ROWS: usize = 32;

/// One controller at one link. Counts since it was made; a [`ToDevice::Reset`] does not clear
/// counts.
///
/// ```
/// use sinew_device::clock::Clock;
/// use sinew_device::mode::Drive;
/// use sinew_device::protocol::{ToDevice, ToHost};
/// use sinew_device::session::Session;
/// use sinew_mpc::{Limits, Model, Propagate, Settings, Tuning};
///
/// sinew_mpc::controller! {
///     model: Lag,
///     inputs: 1,
///     outputs: 1,
///     channels: 0,
///     past_inputs: 1,
///     past_outputs: 1,
///     horizon: 10,
///     move_blocks: 2,
/// }
/// # struct Lag;
/// # impl Model<INPUTS, OUTPUTS, CHANNELS, PAST_INPUTS, PAST_OUTPUTS> for Lag {
/// #     type Trace = ();
/// #     const TRACE: () = ();
/// #     fn predict(&self, x: &Regressor, _: &mut ()) -> [f32; OUTPUTS] {
/// #         [0.9 * x.y[0][0] + 0.1 * x.u[0][0]]
/// #     }
/// #     fn jacobian(&self, _: &(), jacobian: &mut Jacobian) {
/// #         jacobian.y[0][0][0] = 0.9;
/// #         jacobian.u[0][0][0] = 0.1;
/// #     }
/// # }
/// # impl Propagate<INPUTS, OUTPUTS, CHANNELS, PAST_INPUTS, PAST_OUTPUTS> for Lag {}
/// # impl Tuning for Lag {}
/// struct Ticks;
///
/// impl Clock for Ticks {
///     fn ticks(&self) -> u32 {
///         0
///     }
/// }
///
/// let limits = Limits { lower: [-1.0], upper: [1.0], rate: [0.5], safe: [0.0] };
/// let settings = Settings {
///     tracking_weight: [1.0],
///     move_suppression: [0.01],
///     disturbance_gain: 0.5,
///     iterations: 2,
///     max_missing_samples: 5,
/// };
/// let horizons = Horizons::new(1, [1, 2]);
/// let controller = Controller::new(Lag, Scaling::IDENTITY, limits, settings, horizons);
/// // The model's hash, 100 steps per second, 3 steps that are decided.
/// let identity = Session::<Lag, 1, 1, 0, 1, 1, 10, 2, 2>::identity_of(0, 100_000, 3);
/// let mut session = Session::new(controller, identity);
/// session.answer(&ToDevice::Arm { drive: Drive::Host, blend_steps: 0 }, &Ticks);
/// let sample = ToDevice::Sample {
///     seq: 1,
///     y: [0.0].into_iter().collect(),
///     s: [].into_iter().collect(),
///     reference: [0.5].into_iter().collect(),
/// };
/// let ToHost::Command { u, .. } = session.answer(&sample, &Ticks) else {
///     panic!("a sample of these shapes is answered by a command");
/// };
/// assert!(u[0] > 0.0 && u[0] <= 0.5);
/// ```
pub type Session<
    M,
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
    const N: usize,
    const NB: usize,
    const NV: usize,
> = LoopSession<ControlLoop<M, NU, NY, NS, ND, DD, N, NB, NV>, NU, NY, NS, N>;

/// A session of any [`PredictiveLoop`]; [`Session`] is that of a [`ControlLoop`].
pub struct LoopSession<C, const NU: usize, const NY: usize, const NS: usize, const N: usize> {
    controller: C,
    identity: Identity,
    accumulator: Accumulator,
    summary: Summary,
    stopped: bool,
    state: State,
    supervisor: Supervisor<NU, NY>,
    transfer: BumplessTransfer<NY>,
    /// The model's own limits: those in force may be narrower.
    widest: Limits<NU>,
    own: rig::Own<NU, NY, N>,
}

impl<
    M: CostTerm<NU, NY, NS, ND, DD>,
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
    /// Identity of this controller: the shapes are its own. `model`: hash of the model and its
    /// control problem; `rate_mhz`: steps per 1000 seconds; `control_horizon`: steps that are
    /// decided.
    pub const fn identity_of(model: u32, rate_mhz: u32, control_horizon: u8) -> Identity {
        const {
            assert!(NU < 256 && NY < 256 && NS < 256 && ND < 256 && DD < 256 && N < 256);
        }
        Identity {
            protocol: PROTOCOL,
            model,
            n_u: NU as u8,
            n_y: NY as u8,
            n_s: NS as u8,
            past_inputs: ND as u8,
            past_outputs: DD as u8,
            horizon: N as u8,
            control_horizon,
            rate_mhz,
        }
    }

    /// A session that has heard nothing yet.
    pub const fn new(
        controller: ControlLoop<M, NU, NY, NS, ND, DD, N, NB, NV>,
        identity: Identity,
    ) -> Self {
        let widest = *controller.limits();
        Self::within(controller, widest, identity)
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
    /// Outputs that a board reads: none where channels say them.
    pub const OUTPUTS_READ: usize = if C::SENSED { 0 } else { NY };

    /// A session that has heard nothing yet; `widest`: the limits that the controller was made
    /// with.
    pub const fn within(controller: C, widest: Limits<NU>, identity: Identity) -> Self {
        const {
            use crate::protocol::{MAX_CHANNELS, MAX_PREVIEW, MAX_SIGNALS};
            assert!(NU <= MAX_SIGNALS && NY <= MAX_SIGNALS);
            // What a network remembers is in no frame.
            assert!(NS <= MAX_CHANNELS || C::HIDDEN_CHANNELS);
            assert!(NY <= MAX_PREVIEW && C::POINT <= MAX_REGRESSOR);
            assert!(C::PARAMETERS <= MAX_SIGNALS);
        }
        Self {
            widest,
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
            state: State::disarmed(Cause::Start),
            supervisor: Supervisor::new(),
            transfer: BumplessTransfer::NONE,
            own: rig::Own::new(),
        }
    }

    /// Takes any number of bytes; for every whole frame among them calls `reply` with one answer,
    /// an encoded frame. Damaged frames are counted and answered by [`ToHost::Refused`].
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
                self.supervisor = Supervisor::new();
                ToHost::Tuned
            }
            ToDevice::Stop => {
                self.disarm(Cause::Asked);
                self.stopped = true;
                ToHost::Done(self.summary())
            }
            ToDevice::Arm { drive, blend_steps } => self.arm(*drive, *blend_steps),
            ToDevice::Disarm => {
                self.disarm(Cause::Asked);
                ToHost::State(self.state)
            }
            ToDevice::EmergencyStop => {
                self.emergency_stop();
                ToHost::State(self.state)
            }
            ToDevice::Limit { lower, upper, rate } => self.limit(lower, upper, rate),
            ToDevice::Follow { reference } => self.follow(reference),
            ToDevice::Excite { row, u } => self.excite(*row, u),
            ToDevice::Stream { every } => self.stream(*every),
            ToDevice::Health if C::WATCHES => {
                let LeftOut { channels, times } = self.controller.left_out();
                ToHost::Health(Health {
                    left_out: channels,
                    times,
                })
            }
            ToDevice::Health => refused(Reason::Judges),
            ToDevice::Parameters if C::PARAMETERS > 0 => self.parameters(),
            ToDevice::Parameters => refused(Reason::Parameters),
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
        let (Ok(y), Some(s)) = (y.try_into(), self.channels(s)) else {
            return refused(Reason::Shape);
        };
        let s = &s;
        let Some(mut reference) = preview(rows) else {
            return refused(Reason::Shape);
        };
        if self.state.drive().is_some_and(Drive::is_on_board) {
            return refused(Reason::Mode);
        }
        let known;
        let (y, sensing) = if C::SENSED {
            let start = clock.ticks();
            known = self.controller.outputs(y, s);
            (&known, clock.ticks().wrapping_sub(start))
        } else {
            (y, 0)
        };
        let missed = self.controller.missed();
        let (step, ticks) = match self.state.mode {
            Mode::Armed(_) => {
                self.transfer.apply(y, &mut reference);
                let start = clock.ticks();
                let step = self.controller.step(y, s, &reference);
                let ticks = clock.ticks().wrapping_sub(start);
                self.judge(y, &step);
                (step, ticks.wrapping_add(sensing))
            }
            Mode::Disarmed | Mode::Tripped => (self.controller.open_loop(y, s, None), 0),
        };
        self.count(missed);
        ToHost::Command {
            seq,
            u: Vec::from_slice(&step.u).unwrap_or_default(),
            status: step.status,
            iterations: step.iterations,
            cost: step.cost,
            ticks,
            predicted: step.predicted,
        }
    }

    /// The channels of a frame; those that nobody measures are missing in it.
    #[inline(always)]
    fn channels(&self, s: &[f32]) -> Option<[f32; NS]> {
        if !C::HIDDEN_CHANNELS {
            return s.try_into().ok();
        }
        let mut channels = [f32::NAN; NS];
        for (place, value) in channels.iter_mut().zip(s) {
            *place = *value;
        }
        (s.len() == usize::from(self.identity.n_s)).then_some(channels)
    }

    /// Counts a step and the samples that were missed in it; `missed` before it.
    fn count(&mut self, missed: u32) {
        self.summary.steps = self.summary.steps.wrapping_add(1);
        let missed = self.controller.missed().wrapping_sub(missed);
        self.summary.missed_samples = self.summary.missed_samples.wrapping_add(missed);
    }

    /// Ends control where an armed step shows that it should.
    fn judge(&mut self, y: &[f32; NY], step: &Step<NU>) {
        let (y, u) = self.controller.to_model(y, &step.u);
        let max_missing_samples = self.controller.max_missing_samples();
        let Some(cause) = self
            .supervisor
            .check(&y, &u, step.status, max_missing_samples)
        else {
            return;
        };
        // A host that is late moves nothing: the command ramps to the safe one while samples are
        // missing, and goes on with them.
        let is_of_host = self.state.drive() == Some(Drive::Host);
        if !(is_of_host && matches!(cause, Cause::SamplesLost | Cause::Late)) {
            self.disarm(cause);
        }
    }

    // These are not inlined into `answer`: their locals would lie on the stack under a control
    // step.
    #[inline(never)]
    fn arm(&mut self, drive: Drive, blend_steps: u16) -> ToHost {
        if self.state.mode != Mode::Disarmed {
            return refused(Reason::Mode);
        }
        self.supervisor = Supervisor::new();
        self.transfer = BumplessTransfer::over(blend_steps);
        self.state = State {
            mode: Mode::Armed(drive),
            cause: Cause::Asked,
        };
        self.own.arm(drive);
        if drive == Drive::Host {
            // Until now the board's own sensors were looked at.
            self.controller.reset();
        }
        ToHost::State(self.state)
    }

    /// Ramp to the safe command. An emergency stop that is acknowledged ends here too.
    pub fn disarm(&mut self, cause: Cause) {
        self.state = State::disarmed(cause);
        self.own.disarm();
    }

    #[inline(never)]
    fn emergency_stop(&mut self) {
        self.controller.emergency_stop();
        self.own.emergency_stop();
        self.state = State {
            mode: Mode::Tripped,
            cause: Cause::EmergencyStop,
        };
    }

    #[inline(never)]
    fn limit(&mut self, lower: &[f32], upper: &[f32], rate: &[f32]) -> ToHost {
        let (Ok(lower), Ok(upper), Ok(rate)) =
            (lower.try_into(), upper.try_into(), rate.try_into())
        else {
            return refused(Reason::Shape);
        };
        let limits = Limits {
            lower,
            upper,
            rate,
            safe: self.widest.safe,
        };
        if self.controller.set_limits(limits, &self.widest) {
            ToHost::Tuned
        } else {
            refused(Reason::Limits)
        }
    }

    #[inline(never)]
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
        if !self.controller.tune(
            tracking_weight,
            move_suppression,
            disturbance_gain,
            iterations,
        ) {
            return refused(Reason::Settings);
        }
        ToHost::Tuned
    }

    #[inline(never)]
    fn parameters(&self) -> ToHost {
        let mut known = Parameters::default();
        for i in 0..C::PARAMETERS {
            let (theta, variance) = self.controller.parameter(i);
            // There is room: `within` has counted them.
            let _ = known.theta.push(theta);
            let _ = known.variance.push(variance);
        }
        ToHost::Parameters(known)
    }

    #[inline(never)]
    fn probe(&self, x: &[f32]) -> ToHost {
        let (mut prediction, mut derivatives) = (Vec::new(), Vec::new());
        let known = self.controller.probe(
            x,
            &mut |value| {
                let _ = prediction.push(value);
            },
            &mut |value| {
                // All of them or none; `extend` would leave a panic in the image.
                if C::DERIVATIVES <= MAX_JACOBIAN {
                    let _ = derivatives.push(value);
                }
            },
        );
        if !known {
            return refused(Reason::Shape);
        }
        ToHost::Prediction {
            y: prediction,
            jacobian: derivatives,
        }
    }

    /// The board saw a step end after its period.
    pub fn note_deadline_miss(&mut self) {
        self.summary.deadline_misses = self.summary.deadline_misses.wrapping_add(1);
        self.supervisor.note_late();
    }

    /// The board knows why it starts anew. Before anything is armed.
    pub const fn note_restart(&mut self, cause: Cause) {
        self.state = State::disarmed(cause);
    }

    /// The mode and why.
    pub const fn state(&self) -> State {
        self.state
    }

    /// After [`ToDevice::Stop`]: ready for another run, disarmed. For boards that go on; a program
    /// ends.
    pub const fn reopen(&mut self) {
        self.stopped = false;
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

    /// Identity of this controller.
    pub const fn identity(&self) -> &Identity {
        &self.identity
    }

    /// The command applied last.
    pub fn applied(&self) -> &[f32; NU] {
        self.controller.applied()
    }

    /// The controller.
    pub const fn controller(&self) -> &C {
        &self.controller
    }

    /// The controller, to be changed.
    pub const fn controller_mut(&mut self) -> &mut C {
        &mut self.controller
    }
}

/// Rows r(k+1) .. of a frame, the last one held to the horizon; `None` where they are not whole or
/// too many.
fn preview<const NY: usize, const N: usize>(rows: &[f32]) -> Option<[[f32; NY]; N]> {
    let mut reference = [*rows.last_chunk()?; N];
    let mut rest = rows;
    for place in &mut reference {
        let Some((row, after)) = rest.split_first_chunk() else {
            break;
        };
        *place = *row;
        rest = after;
    }
    rest.is_empty().then_some(reference)
}

const fn refused(reason: Reason) -> ToHost {
    ToHost::Refused { reason }
}

//! Self-test of a device, without a host: one list of checks for this computer, QEMU and
//! boards, whatever the model (boards/qemu/src/bin/checks.rs, boards/stm32f446/on_target.rs). A
//! controller does not link them.
//!
//! That a board's commands have the bits of this computer's needs a host: `sinew pil` compares
//! them.

use heapless::Vec;

use crate::clock::Clock;
use crate::mode::Drive;
use crate::protocol::{Identity, MAX_FRAME, Reason, ToDevice, ToHost, decode, encode};
use crate::session::LoopSession;
use sinew_mpc::limits::Limits;
use sinew_mpc::{Parts, PredictiveLoop};

/// The name of every check of this module, handed to the macro `$each`.
#[macro_export]
macro_rules! for_each_check {
    ($each:ident) => {
        $each! {
            it_says_who_it_is
            the_network_is_that_of_double_precision
            its_derivatives_are_those_of_double_precision
            nothing_moves_before_it_is_armed
            commands_stay_inside_the_limits_whatever_comes_in
            the_same_samples_give_the_same_commands
            a_damaged_frame_changes_nothing
            a_step_ends_within_its_period
        }
    };
}

/// Largest error of an output or a derivative, of the largest of its vector.
const TOLERANCE: f32 = 1e-5;
/// Steps of the checks that run the controller.
const STEPS: u32 = 60;

/// One vector of the model's own (`golden.rs` of a generated model), rounded to what the chip
/// computes with.
pub struct Golden {
    /// Regressor, flattened.
    pub x: Vec<f32, { crate::protocol::MAX_REGRESSOR }>,
    /// y(k+1).
    pub y: Vec<f32, { crate::protocol::MAX_SIGNALS }>,
    /// A row for each output, a column for each value of `x`.
    pub jacobian: Vec<f32, { 2 * crate::protocol::MAX_JACOBIAN }>,
}

impl Golden {
    /// A vector of a generated model, its numbers rounded by the caller. Longer ones than a frame
    /// carries are cut, and fail.
    pub fn new(
        x: &[f32],
        y: impl Iterator<Item = f32>,
        jacobian: impl Iterator<Item = f32>,
    ) -> Self {
        let mut golden = Self {
            x: Vec::from_slice(x).unwrap_or_default(),
            y: Vec::new(),
            jacobian: Vec::new(),
        };
        for value in y {
            let _ = golden.y.push(value);
        }
        for value in jacobian {
            let _ = golden.jacobian.push(value);
        }
        golden
    }
}

/// Device under test: a session that has heard nothing yet, and the numbers that it is held
/// against.
pub struct Subject<S, C> {
    /// The session.
    pub session: S,
    /// Its board's counter.
    pub clock: C,
    /// Ticks of that counter in a control period; 0 where it does not count time.
    pub period_ticks: u32,
}

/// A session, whatever its shapes: the checks ask and read answers, as a host does.
pub trait Device {
    /// The answer to one message.
    fn ask(&mut self, question: &ToDevice, clock: &impl Clock) -> ToHost;
    /// As `Session::receive`.
    fn hear(&mut self, bytes: &[u8], clock: &impl Clock, reply: impl FnMut(&[u8]));
    /// Identity of the device.
    fn who(&self) -> Identity;
    /// Inside its limits, box and rate, as far as the last command says.
    fn holds(&self, u: &[f32]) -> bool;
}

impl<
    C: PredictiveLoop<NU, NY, NS, N>,
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const N: usize,
> Device for LoopSession<C, NU, NY, NS, N>
{
    fn ask(&mut self, question: &ToDevice, clock: &impl Clock) -> ToHost {
        self.answer(question, clock)
    }

    fn hear(&mut self, bytes: &[u8], clock: &impl Clock, reply: impl FnMut(&[u8])) {
        self.receive(bytes, clock, reply);
    }

    fn who(&self) -> Identity {
        *self.identity()
    }

    fn holds(&self, u: &[f32]) -> bool {
        let limits: &Limits<NU> = self.controller().limits();
        u.try_into().is_ok_and(|u: &[f32; NU]| limits.contain(u))
    }
}

/// Failure that a check found.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Wrong {
    /// Another answer was expected.
    Answer,
    /// A value is off by this part of the largest.
    Off(f32),
    /// There was nothing to compare.
    Nothing,
    /// A command outside the limits, or that is no number.
    Command(f32),
    /// Two runs that should be one.
    Differs,
    /// A step of so many ticks.
    Late(u32),
}

/// The outcome of a check.
pub type CheckOutcome = Result<(), Wrong>;

/// Uniform in -1 to 1, the same everywhere (xorshift; Marsaglia 2003).
pub struct Random(pub u32);

impl Random {
    /// The next number.
    pub fn draw(&mut self) -> f32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 17;
        self.0 ^= self.0 << 5;
        (self.0 >> 8) as f32 / 8_388_608.0 - 1.0
    }

    /// Now and then what no sensor should give.
    fn hostile(&mut self) -> f32 {
        let value = self.draw();
        match self.0 % 16 {
            0 => f32::NAN,
            1 => f32::INFINITY,
            2 => -1e30,
            3 => f32::from_bits(self.0),
            _ => value,
        }
    }
}

impl<S: Device, C: Clock> Subject<S, C> {
    fn ask(&mut self, question: &ToDevice) -> ToHost {
        self.session.ask(question, &self.clock)
    }

    fn arm(&mut self) -> CheckOutcome {
        let (drive, blend_steps) = (Drive::Host, 0);
        match self.ask(&ToDevice::Arm { drive, blend_steps }) {
            ToHost::State(_) => Ok(()),
            _ => Err(Wrong::Answer),
        }
    }

    /// A sample with every value from `next`.
    fn sample(&self, seq: u32, mut next: impl FnMut() -> f32) -> ToDevice {
        let who = self.session.who();
        let (outputs, channels) = (usize::from(who.n_y), usize::from(who.n_s));
        ToDevice::Sample {
            seq,
            y: (0..outputs).map(|_| next()).collect(),
            s: (0..channels).map(|_| next()).collect(),
            reference: (0..outputs).map(|_| next()).collect(),
        }
    }

    /// Commands of [`STEPS`] steps, folded into one number, and the longest step.
    fn run(&mut self, next: fn(&mut Random) -> f32) -> Result<(u32, u32), Wrong> {
        let mut random = Random(0x9E37_79B9);
        let (mut sum, mut longest) = (0_u32, 0);
        for seq in 0..STEPS {
            let question = self.sample(seq, || next(&mut random));
            let ToHost::Command { u, ticks, .. } = self.ask(&question) else {
                return Err(Wrong::Answer);
            };
            if !self.session.holds(&u) {
                return Err(Wrong::Command(u.first().copied().unwrap_or(f32::NAN)));
            }
            for u in &u {
                sum = sum.rotate_left(5) ^ u.to_bits();
            }
            longest = longest.max(ticks);
        }
        Ok((sum, longest))
    }
}

/// Protocol and shapes.
///
/// # Errors
/// [`Wrong::Answer`].
pub fn it_says_who_it_is<S: Device, C: Clock>(
    make: impl Fn() -> Subject<S, C>,
    _golden: impl Iterator<Item = Golden>,
) -> CheckOutcome {
    let mut subject = make();
    let who = subject.session.who();
    let said = subject.ask(&ToDevice::Hello);
    if said == ToHost::Hello(who) && who.protocol == crate::protocol::PROTOCOL {
        Ok(())
    } else {
        Err(Wrong::Answer)
    }
}

/// Compares what the network answers with golden vectors, by a choice of what to compare.
fn against<S: Device, C: Clock>(
    mut subject: Subject<S, C>,
    golden: impl Iterator<Item = Golden>,
    chosen: impl Fn(&Golden, &ToHost, &Identity) -> CheckOutcome,
) -> CheckOutcome {
    let mut compared = false;
    let who = subject.session.who();
    for vector in golden {
        let x = vector.x.clone();
        let answer = subject.ask(&ToDevice::Probe { x });
        chosen(&vector, &answer, &who)?;
        compared = true;
    }
    if compared {
        Ok(())
    } else {
        Err(Wrong::Nothing)
    }
}

/// Every value within [`TOLERANCE`] of the largest expected.
fn near<'a>(found: impl Iterator<Item = &'a f32>, expected: &[f32], largest: f32) -> CheckOutcome {
    let mut count = 0;
    for (found, expected) in found.zip(expected) {
        let off = (found - expected).abs() / largest;
        // A NaN is not near.
        if !(off <= TOLERANCE) {
            return Err(Wrong::Off(off));
        }
        count += 1;
    }
    if count == expected.len() {
        Ok(())
    } else {
        Err(Wrong::Answer)
    }
}

fn largest(values: &[f32]) -> f32 {
    let most = |most: f32, value: &f32| {
        if value.abs() > most {
            value.abs()
        } else {
            most
        }
    };
    values.iter().fold(f32::MIN_POSITIVE, most)
}

/// Outputs against golden vectors.
///
/// # Errors
/// By how much, or that there are none.
pub fn the_network_is_that_of_double_precision<S: Device, C: Clock>(
    make: impl Fn() -> Subject<S, C>,
    golden: impl Iterator<Item = Golden>,
) -> CheckOutcome {
    against(make(), golden, |golden, answer, _| match answer {
        ToHost::Prediction { y, .. } => near(y.iter(), &golden.y, largest(&golden.y)),
        _ => Err(Wrong::Answer),
    })
}

/// Derivatives against golden vectors, those by channels apart: no host asks for them.
///
/// # Errors
/// By how much, or that there are none.
pub fn its_derivatives_are_those_of_double_precision<S: Device, C: Clock>(
    make: impl Fn() -> Subject<S, C>,
    golden: impl Iterator<Item = Golden>,
) -> CheckOutcome {
    against(make(), golden, |golden, answer, who| {
        let ToHost::Prediction { jacobian, .. } = answer else {
            return Err(Wrong::Answer);
        };
        let width = golden.x.len();
        let size = largest(&golden.jacobian);
        let of_lags = |n, past| usize::from(n) * usize::from(past);
        // What is predicted is the outputs, or all of a state.
        let of_outputs = golden.y.len() * usize::from(who.past_outputs);
        let columns = of_lags(who.n_u, who.past_inputs) + of_outputs;
        let columns = columns.max(1);
        let rows = golden.jacobian.chunks(width.max(1));
        // More derivatives than a frame carries are not sent.
        if jacobian.is_empty() && golden.y.len() * columns > crate::protocol::MAX_JACOBIAN {
            return Ok(());
        }
        let mut compared = 0;
        for (found, expected) in jacobian.chunks(columns).zip(rows) {
            near(
                found.iter(),
                expected.get(..columns).unwrap_or_default(),
                size,
            )?;
            compared += 1;
        }
        if compared == golden.y.len() {
            Ok(())
        } else {
            Err(Wrong::Answer)
        }
    })
}

/// Samples of a host are answered by the safe command until it arms.
///
/// # Errors
/// A command that moves.
pub fn nothing_moves_before_it_is_armed<S: Device, C: Clock>(
    make: impl Fn() -> Subject<S, C>,
    _golden: impl Iterator<Item = Golden>,
) -> CheckOutcome {
    let mut subject = make();
    let mut random = Random(7);
    let mut first = None;
    for seq in 0..STEPS {
        let question = subject.sample(seq, || random.draw());
        let ToHost::Command { u, .. } = subject.ask(&question) else {
            return Err(Wrong::Answer);
        };
        let before = first.get_or_insert(u.clone());
        if *before != u {
            return Err(Wrong::Command(u.first().copied().unwrap_or(f32::NAN)));
        }
    }
    Ok(())
}

/// Numbers and what is none.
///
/// # Errors
/// The command that was outside.
pub fn commands_stay_inside_the_limits_whatever_comes_in<S: Device, C: Clock>(
    make: impl Fn() -> Subject<S, C>,
    _golden: impl Iterator<Item = Golden>,
) -> CheckOutcome {
    let mut subject = make();
    subject.arm()?;
    subject.run(Random::hostile).map(|_| ())
}

/// Two sessions, one answer.
///
/// # Errors
/// They differ.
pub fn the_same_samples_give_the_same_commands<S: Device, C: Clock>(
    make: impl Fn() -> Subject<S, C>,
    _golden: impl Iterator<Item = Golden>,
) -> CheckOutcome {
    let mut sums = [0; 2];
    for sum in &mut sums {
        let mut subject = make();
        subject.arm()?;
        *sum = subject.run(Random::draw)?.0;
    }
    match sums {
        [a, b] if a == b => Ok(()),
        _ => Err(Wrong::Differs),
    }
}

/// Every bit of a frame, turned.
///
/// # Errors
/// A frame that was taken.
pub fn a_damaged_frame_changes_nothing<S: Device, C: Clock>(
    make: impl Fn() -> Subject<S, C>,
    _golden: impl Iterator<Item = Golden>,
) -> CheckOutcome {
    let mut subject = make();
    let mut buffer = [0; MAX_FRAME];
    let (drive, blend_steps) = (Drive::Host, 0);
    let frame = encode(&ToDevice::Arm { drive, blend_steps }, &mut buffer);
    let frame: Vec<u8, 64> = frame
        .and_then(|frame| Vec::from_slice(frame).ok())
        .ok_or(Wrong::Answer)?;
    for bit in 0..8 * frame.len() {
        let mut damaged = frame.clone();
        if let Some(byte) = damaged.get_mut(bit / 8) {
            *byte ^= 1 << (bit % 8);
        }
        let mut taken = false;
        let mut judge = |answer: &[u8]| {
            let mut answer: Vec<u8, MAX_FRAME> = Vec::from_slice(answer).unwrap_or_default();
            // Without the zero at its end.
            answer.pop();
            let refused = ToHost::Refused {
                reason: Reason::Damaged,
            };
            taken |= decode::<ToHost>(&mut answer) != Ok(refused);
        };
        subject.session.hear(&damaged, &subject.clock, &mut judge);
        // Ends what a turned bit may have left open.
        subject.session.hear(&[0], &subject.clock, &mut judge);
        if taken {
            return Err(Wrong::Answer);
        }
    }
    Ok(())
}

/// Random samples and references, which ask more of the optimisation than a trajectory does.
///
/// # Errors
/// The longest step.
pub fn a_step_ends_within_its_period<S: Device, C: Clock>(
    make: impl Fn() -> Subject<S, C>,
    _golden: impl Iterator<Item = Golden>,
) -> CheckOutcome {
    let mut subject = make();
    subject.arm()?;
    let (_, longest) = subject.run(Random::draw)?;
    match subject.period_ticks {
        0 => Ok(()),
        period if longest <= period => Ok(()),
        _ => Err(Wrong::Late(longest)),
    }
}

/// Duration of control steps, in ticks of a board's counter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Ticks {
    /// Steps measured.
    pub steps: u32,
    /// Of one step, in the mean.
    pub mean: u32,
    /// Of the longest seen.
    pub longest: u32,
    /// No step can take more: what surrounds the optimisation, and each of its parts at its
    /// longest, as often as the const parameters allow (`Work::most`) and the model's budget.
    pub bound: u32,
    /// The longest of each part of an optimisation.
    pub parts: Parts,
}

/// Times `steps` control steps at random states with random references, and the parts of an
/// optimisation.
pub fn times<
    C: PredictiveLoop<NU, NY, NS, N>,
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const N: usize,
>(
    control: &mut C,
    steps: u32,
    clock: &impl Clock,
) -> Ticks {
    let mut random = Random(0x9E37_79B9);
    let mut parts = Parts::default();
    let (mut sum, mut longest, mut around) = (0_u64, 0, 0);
    for k in 0..steps {
        // Every fourth state is a jump from one that is not remembered.
        if k % 4 == 0 {
            control.reset();
        }
        let mut drawn = || 1.2 * random.draw();
        let (y, s) = (
            core::array::from_fn(|_| drawn()),
            core::array::from_fn(|_| drawn()),
        );
        let (y, s) = control.to_physical(&y, &s);
        let reference = core::array::from_fn(|_| {
            let row = core::array::from_fn(|_| drawn());
            control.to_physical(&row, &[0.0; NS]).0
        });
        let start = clock.ticks();
        let _ = control.step(&y, &s, &reference);
        let stepped = clock.ticks();
        // A reference that is none leaves out the optimisation, and nothing else.
        let _ = control.step(&y, &s, &[[f32::NAN; NY]; N]);
        let passed = clock.ticks().wrapping_sub(stepped);
        let spent = stepped.wrapping_sub(start);
        sum += u64::from(spent);
        longest = longest.max(spent);
        around = around.max(passed);
        parts = parts.or_more(control.parts(&mut drawn, || clock.ticks()));
    }
    let by_iterations = parts.bound(&control.most_work());
    let bound = match control.budget() {
        Some(budget) => by_iterations.min(budget.bound(&parts)),
        None => by_iterations,
    };
    Ticks {
        steps,
        mean: u32::try_from(sum / u64::from(steps.max(1))).unwrap_or(u32::MAX),
        longest,
        bound: bound.saturating_add(around),
        parts,
    }
}

//! The forces on the bodies, and the rates of internal states (docs/explanation/plant.md, eq. 1 to
//! 17).

use super::input_signal::InputSignal;
use super::motion::Motion;
use super::shapes::Seen;
use super::topology::{Followed, Friction, Memory, Spring, Tendon, Topology};
use crate::effects::{
    At, creep_rate, curve, dead_band, hysteresis_rate, presliding_rate, press, warming_rate,
};
use crate::rig::Reads;
use crate::scalar::Scalar;

/// Positions and velocities, the ground's zeros last, and internal states.
#[derive(Clone, Debug)]
pub(crate) struct State<S> {
    pub(crate) q: Vec<S>,
    pub(crate) v: Vec<S>,
    pub(crate) z: Vec<S>,
}

impl<S: Scalar> State<S> {
    pub(crate) fn rest(topology: &Topology) -> Self {
        let bodies = topology.bodies.len();
        Self {
            q: vec![S::ZERO; bodies + 1],
            v: vec![S::ZERO; bodies + 1],
            z: vec![S::ZERO; topology.internal.len()],
        }
    }
}

/// Everything that forces depend on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Point<'a, S> {
    pub(crate) values: &'a [S],
    pub(crate) state: &'a State<S>,
    /// One entry a line.
    pub(crate) input_signals: &'a [InputSignal<S>],
    /// Seconds into the sample interval.
    pub(crate) tau: S,
    /// Imposed motions, on which positions and velocities in `state` are.
    pub(crate) motions: &'a [Motion],
    /// One entry a switch.
    pub(crate) branches: &'a [i8],
    /// Parameter of the central path; 0: hard laws.
    pub(crate) smoothing: f64,
}

/// Forces, rates and loads at a point.
#[derive(Clone, Debug)]
pub(crate) struct Forces<S> {
    /// One entry a body, and the ground's.
    pub(crate) force: Vec<S>,
    /// Rates of the internal states that have one.
    pub(crate) rate: Vec<S>,
    /// Loads that friction follows.
    pub(crate) load: Vec<S>,
}

impl<S: Scalar> Forces<S> {
    pub(crate) fn new(topology: &Topology) -> Self {
        Self {
            force: vec![S::ZERO; topology.bodies.len() + 1],
            rate: vec![S::ZERO; topology.rated],
            load: vec![S::ZERO; topology.follows],
        }
    }

    pub(crate) fn copy_from(&mut self, other: &Self) {
        self.force.copy_from_slice(&other.force);
        self.rate.copy_from_slice(&other.rate);
        self.load.copy_from_slice(&other.load);
    }
}

/// The central path of `force (force - x) = gap`: what a contact that cannot pull answers with
/// where it would with `x`; max(0, x) for a gap of 0 (eq. 23b).
#[inline]
fn smoothed<S: Scalar>(x: S, gap: S) -> S {
    (x + (x * x + gap * 4.0).sqrt()) * 0.5
}

/// A size that makes no sensor_signal below zero, clipped there; its derivative goes on.
#[inline]
pub(crate) fn not_below_zero<S: Scalar>(x: S) -> S {
    if x.value() < 0.0 { x - x.value() } else { x }
}

impl Spring {
    /// Extension beyond the rest (eq. 2).
    #[inline]
    pub(crate) fn extension<S: Scalar>(&self, values: &[S], state: &State<S>) -> S {
        let extension = state.q[self.to] - state.q[self.from];
        match self.rest {
            Some(rest) => extension - values[rest],
            None => extension,
        }
    }

    #[inline]
    pub(crate) fn speed<S: Scalar>(&self, state: &State<S>) -> S {
        state.v[self.to] - state.v[self.from]
    }

    /// Force on `to`; rates of its internal states go to `rate`.
    #[inline]
    fn pull<S: Scalar>(&self, at: &Point<S>, rate: &mut [S]) -> S {
        let values = at.values;
        let mut extension = self.extension(values, at.state);
        if let Some(gap) = self.gap {
            let width = not_below_zero(values[gap.slot]);
            extension = dead_band(extension, width, at.branches[gap.switch]);
        }
        let mut pull = match &self.curve {
            None => -(values[self.stiffness] * extension),
            Some(curve) => -curve.resistance(values, extension),
        };
        if !self.laws.is_empty() {
            let at = At {
                position: extension,
                velocity: self.speed(at.state),
                direction: 0.0,
                motion: self.motion,
            };
            for law in &self.laws {
                pull += law.kind.force(&values[law.slot..], &at);
            }
        }
        for memory in &self.memory {
            let speed = self.speed(at.state);
            match *memory {
                Memory::Hysteresis {
                    slot,
                    state,
                    direction,
                    side,
                } => {
                    let z = at.state.z[state];
                    let sign = |switch: usize| f64::from(at.branches[switch]);
                    pull -= values[slot] * z;
                    rate[state] =
                        hysteresis_rate(&values[slot..], z, speed, sign(direction), sign(side));
                }
                Memory::Creep { slot, state } => {
                    let z = at.state.z[state];
                    pull -= z;
                    rate[state] = creep_rate(&values[slot..], z, speed);
                }
                Memory::Plastic {
                    slot,
                    state,
                    switch,
                } => {
                    pull -= values[slot] * at.state.z[state];
                    let yields = at.branches[switch] != 0;
                    rate[state] = if yields { S::ZERO } else { speed };
                }
            }
        }
        pull
    }
}

impl Tendon {
    /// Rate of its path's length (eq. 4).
    #[inline]
    pub(crate) fn speed<S: Scalar>(&self, at: &Point<S>) -> S {
        let mut rate = S::ZERO;
        for &(body, arm) in &self.path {
            rate += at.values[arm] * at.state.v[body];
        }
        rate
    }

    /// Its elastic force, N: without damper, play and whether it can push (eq. 4, 13c).
    #[inline]
    pub(crate) fn elastic<S: Scalar>(&self, topology: &Topology, at: &Point<S>) -> S {
        let values = at.values;
        let mut stretch = S::ZERO;
        for &(body, arm) in &self.path {
            stretch += values[arm] * at.state.q[body];
        }
        for &line in &self.lines {
            stretch -= topology.through(line, at);
        }
        if let Some(slack) = self.slack {
            stretch -= values[slack];
        }
        values[self.pretension] + values[self.stiffness] * stretch
    }

    /// Width of its dead band as a force, N.
    #[inline]
    pub(crate) fn band<S: Scalar>(&self, values: &[S]) -> S {
        match self.gap {
            Some(gap) => not_below_zero(values[gap.slot]) * values[self.stiffness],
            None => S::ZERO,
        }
    }

    /// Tension as if it could push, N, on the taut side of its play where it has one.
    #[inline]
    pub(crate) fn free_tension<S: Scalar>(&self, topology: &Topology, at: &Point<S>) -> S {
        let mut tension = self.elastic(topology, at);
        if self.gap.is_some() {
            tension -= self.band(at.values) * 0.5;
        }
        tension + at.values[self.damping] * self.speed(at)
    }

    /// Tension, N (eq. 4, 13).
    #[inline]
    pub(crate) fn tension<S: Scalar>(&self, topology: &Topology, at: &Point<S>) -> S {
        if let Some(switch) = self.unilateral {
            if at.smoothing > 0.0 {
                let gap = at.values[self.stiffness].abs() * at.smoothing;
                return smoothed(self.free_tension(topology, at), gap);
            }
            if at.branches[switch] == 0 {
                return S::ZERO;
            }
        }
        match self.gap.map(|gap| at.branches[gap.switch]) {
            None | Some(1) => self.free_tension(topology, at),
            Some(-1) if self.unilateral.is_none() => {
                self.free_tension(topology, at) + self.band(at.values)
            }
            Some(_) => S::ZERO,
        }
    }
}

impl Topology {
    /// Gain times input of a line, or times what its position loop makes of it (eq. 5, 5b).
    #[inline]
    pub(crate) fn through<S: Scalar>(&self, line: usize, at: &Point<S>) -> S {
        let described = &self.lines[line];
        let input = at.input_signals[line].at(at.tau);
        let Some(servo) = described.servo else {
            return at.values[described.gain] * input;
        };
        if let Some(limit) = servo.limit
            && at.branches[limit.switch] != 0
        {
            let most = not_below_zero(at.values[limit.slot]);
            return most * f64::from(at.branches[limit.switch]);
        }
        let mut error = input - at.state.q[servo.body];
        if let Some(gap) = servo.dead_band {
            let width = not_below_zero(at.values[gap.slot]) * 2.0;
            error = dead_band(error, width, at.branches[gap.switch]);
        }
        at.values[described.gain] * error
    }

    /// Difference between the input of a line and the coordinate that its position loop holds.
    #[inline]
    pub(crate) fn loop_error<S: Scalar>(&self, line: usize, at: &Point<S>) -> S {
        let body = self.lines[line].servo.map(|servo| servo.body);
        let held = body.map_or(S::ZERO, |body| at.state.q[body]);
        at.input_signals[line].at(at.tau) - held
    }

    /// Force of the position loop of a line as if it had no limit, on the side of its dead band
    /// where it is.
    #[inline]
    pub(crate) fn free_loop<S: Scalar>(&self, line: usize, at: &Point<S>) -> S {
        let described = &self.lines[line];
        let mut error = self.loop_error(line, at);
        if let Some(gap) = described.servo.and_then(|servo| servo.dead_band) {
            let half = not_below_zero(at.values[gap.slot]);
            error = if error.value() > half.value() {
                error - half
            } else if error.value() < -half.value() {
                error + half
            } else {
                S::ZERO
            };
        }
        at.values[described.gain] * error
    }

    /// Every force on every body but dry friction, the rates of internal states, and the loads that
    /// friction follows.
    #[inline]
    pub(crate) fn forces<S: Scalar>(&self, at: &Point<S>, out: &mut Forces<S>) {
        let Forces { force, rate, load } = out;
        let values = at.values;
        force.fill(S::ZERO);
        for spring in &self.springs {
            let pull = spring.pull(at, rate);
            force[spring.to] += pull;
            force[spring.from] -= pull;
        }
        for tendon in &self.tendons {
            let tension = tendon.tension(self, at);
            for &(body, arm) in &tendon.path {
                force[body] -= values[arm] * tension;
            }
        }
        for hasel in &self.hasels {
            rate[hasel.charge] = hasel.act(self, at, force);
        }
        if self.follows > 0 {
            self.loads(at, force, load);
        }
        for damper in &self.dampers {
            let speed = at.state.v[damper.to] - at.state.v[damper.from];
            let pull = match &damper.curve {
                None => values[damper.damping] * speed,
                Some(curve) => curve.resistance(values, speed),
            };
            force[damper.to] -= pull;
            force[damper.from] += pull;
        }
        for friction in &self.presliding {
            let (body, p) = (friction.body, &values[friction.slot..]);
            let share = at.state.z[friction.state];
            let direction = f64::from(at.branches[friction.direction]);
            force[body] -= p[0] * share;
            rate[friction.state] = presliding_rate(p, share, at.state.v[body], direction);
        }
        for friction in &self.frictions {
            for warming in &friction.warming {
                let direction = f64::from(at.branches[warming.direction]);
                rate[warming.state] = warming_rate(
                    &values[warming.slot..],
                    at.state.z[warming.state],
                    at.state.v[friction.body()],
                    direction,
                );
            }
        }
        for motor in &self.motors {
            force[motor.body] += self.through(motor.line, at);
        }
        for load in &self.loads {
            let here = At {
                position: at.state.q[load.body],
                velocity: at.state.v[load.body],
                direction: 0.0,
                motion: load.motion,
            };
            force[load.body] += load.law.kind.force(&values[load.law.slot..], &here);
        }
        for stop in &self.stops {
            if at.smoothing > 0.0 {
                force[stop.body] += self.smoothed_stop(stop.body, stop.slot, at);
            } else if at.branches[stop.switch] == 1 {
                let (depth, rate) = self.depth(stop.body, stop.slot, at);
                let p = &values[stop.slot..];
                force[stop.body] -= p[3] * press(p[1], p[2], depth, rate);
            }
        }
    }

    /// Depth in a stop and its rate (eq. 13a).
    #[inline]
    pub(crate) fn depth<S: Scalar>(&self, body: usize, slot: usize, at: &Point<S>) -> (S, S) {
        let p = &at.values[slot..];
        (p[3] * (at.state.q[body] - p[0]), p[3] * at.state.v[body])
    }

    /// A stop on the central path: its depth is that of eq. 23b, and its damper fades in with it.
    fn smoothed_stop<S: Scalar>(&self, body: usize, slot: usize, at: &Point<S>) -> S {
        let (depth, rate) = self.depth(body, slot, at);
        let p = &at.values[slot..];
        let gap = S::constant(at.smoothing) / (p[1].abs() + f64::MIN_POSITIVE);
        let soft = smoothed(depth, gap);
        let share = soft / (soft * 2.0 - depth);
        let free = press(p[1], p[2] * share, soft, rate);
        -(p[3] * smoothed(free, p[1].abs() * at.smoothing))
    }

    /// Loads of friction; `pulls` are the forces of springs and tendons.
    fn loads<S: Scalar>(&self, at: &Point<S>, pulls: &[S], load: &mut [S]) {
        for follow in self.frictions.iter().flat_map(|f| &f.follows) {
            load[follow.index] = match follow.load {
                Followed::Tension(tendon) => self.tendons[tendon].tension(self, at),
                Followed::Pulls(body) => pulls[body],
                Followed::Motors(body) => (self.motors.iter())
                    .filter(|motor| motor.body == body)
                    .fold(S::ZERO, |sum, motor| sum + self.through(motor.line, at)),
            };
        }
    }

    /// A sensor's reading after its curvature, before lag, gain and offset (eq. 17a).
    #[inline]
    pub(crate) fn reading<S: Scalar>(&self, sensor: usize, at: &Point<S>) -> S {
        self.reading_beside(sensor, at, &mut None)
    }

    /// The same in the state in which another sensor was `seen`.
    fn reading_beside<S: Scalar>(&self, sensor: usize, at: &Point<S>, seen: &mut Seen<S>) -> S {
        let sensor = &self.sensors[sensor];
        let reading = match sensor.reads {
            Reads::Position(body) => at.state.q[body],
            Reads::Velocity(body) => at.state.v[body],
            Reads::Effort(body) => self.effort(body, None, at),
            Reads::ActuatorEffort(line) => self.actuator_effort(line, at),
            Reads::Tension(tendon) => self.tendons[tendon].tension(self, at),
            Reads::Shape(shape) => self.shapes.read(shape, at.values, &at.state.q, seen),
            Reads::Hasel(hasel, reading) => self.hasels[hasel].read(reading, at),
        };
        match sensor.curvature {
            Some(slot) => curve(&at.values[slot..], reading),
            None => reading,
        }
    }

    /// The signal of one sensor, SI.
    pub(crate) fn signal<S: Scalar>(&self, index: usize, at: &Point<S>) -> S {
        self.signal_beside(index, at, &mut None)
    }

    /// Every sensor's signal, SI, added to `out`: what several read components of is found once.
    pub(crate) fn signals<S: Scalar>(&self, at: &Point<S>, out: &mut Vec<S>) {
        let mut seen = None;
        out.extend((0..self.sensors.len()).map(|index| self.signal_beside(index, at, &mut seen)));
    }

    fn signal_beside<S: Scalar>(&self, index: usize, at: &Point<S>, seen: &mut Seen<S>) -> S {
        let sensor = &self.sensors[index];
        let reading = match sensor.lag {
            Some((_, state)) => at.state.z[state],
            None => self.reading_beside(index, at, seen),
        };
        at.values[sensor.gain] * reading + at.values[sensor.offset]
    }
}

impl Friction {
    /// Arm of an entry of the path.
    #[inline]
    pub(crate) fn arm<S: Scalar>(values: &[S], slot: Option<usize>) -> S {
        slot.map_or(S::constant(1.0), |slot| values[slot])
    }

    /// Velocity along its path.
    #[inline]
    pub(crate) fn speed<S: Scalar>(&self, values: &[S], state: &State<S>) -> S {
        if let [(body, None)] = self.path[..] {
            return state.v[body];
        }
        let mut speed = S::ZERO;
        for &(body, arm) in &self.path {
            speed += Self::arm(values, arm) * state.v[body];
        }
        speed
    }

    /// Level of the friction that follows loads (eq. 9).
    #[inline]
    fn following<S: Scalar>(&self, values: &[S], load: &[S], branches: &[i8]) -> S {
        let mut level = S::ZERO;
        for follow in &self.follows {
            let load = load[follow.index] * f64::from(branches[follow.switch]);
            let own = values[follow.coefficient] * load;
            level += match follow.arm {
                Some(arm) => own * values[arm].abs(),
                None => own,
            };
        }
        level
    }

    /// Level of the friction that has warmed (eq. 9c).
    #[inline]
    fn warmed<S: Scalar>(&self, values: &[S], state: &State<S>) -> S {
        let mut level = S::ZERO;
        for warming in &self.warming {
            level += values[warming.slot] * (-state.z[warming.state]).exp();
        }
        level
    }

    /// Friction along its path while it slides in `direction` (+1 or -1).
    #[inline]
    pub(crate) fn force<S: Scalar>(&self, at: &Point<S>, load: &[S], direction: f64) -> S {
        let mut force = S::ZERO;
        if !self.laws.is_empty() {
            let here = At {
                position: at.state.q[self.body()],
                velocity: at.state.v[self.body()],
                direction,
                motion: self.motion,
            };
            for law in &self.laws {
                force += law.kind.force(&at.values[law.slot..], &here);
            }
        }
        if !self.follows.is_empty() {
            force -= self.following(at.values, load, at.branches) * direction;
        }
        if !self.warming.is_empty() {
            force -= self.warmed(at.values, at.state) * direction;
        }
        force
    }

    /// Friction along its path on the central path of its limits (eq. 23a).
    pub(crate) fn smoothed<S: Scalar>(&self, at: &Point<S>, load: &[S]) -> S {
        let speed = self.speed(at.values, at.state);
        let direction = if speed.value() < 0.0 { -1.0 } else { 1.0 };
        let level = self.force(at, load, direction) * -direction;
        let power = speed * level;
        let size = (power * power + at.smoothing * at.smoothing).sqrt() + at.smoothing;
        -(power * level.abs() / size)
    }

    /// Hold at rest: the largest opposed force in the directions (+, -).
    #[inline]
    pub(crate) fn hold<S: Scalar>(
        &self,
        values: &[S],
        state: &State<S>,
        load: &[S],
        branches: &[i8],
    ) -> [S; 2] {
        let mut hold = [S::ZERO; 2];
        for law in &self.laws {
            let [forward, backward] = law.kind.hold(&values[law.slot..]);
            hold[0] += forward;
            hold[1] += backward;
        }
        if !self.follows.is_empty() {
            let level = self.following(values, load, branches);
            hold[0] += level;
            hold[1] += level;
        }
        if !self.warming.is_empty() {
            let level = self.warmed(values, state);
            hold[0] += level;
            hold[1] += level;
        }
        hold
    }
}

//! One sub-step, with whatever stops, breaks away, turns or touches on it.

use super::dynamics::{Dynamics, Mode, Modes, Scratch, Start};
use super::event::{self, Event, Probe};
use super::{Report, rate, sticking};
use crate::plant::forces::{Forces, Point, State};
use crate::plant::topology::Topology;
use crate::plant::wave::Wave;
use crate::scalar::Scalar;
use std::ops::{Add, Mul};

/// Everything that a sub-step works in; allocated once a simulation.
#[derive(Clone, Debug)]
pub(super) struct Substep<S> {
    pub(super) dynamics: Dynamics<S>,
    pub(super) state: State<S>,
    /// What the actuators take: one entry a line.
    pub(super) waves: Vec<Wave<S>>,
    modes: Modes,
    first: Forces<S>,
    last: Forces<S>,
    scratch: Scratch<S>,
    plain: Plain,
}

/// The same without derivatives, for the search of events.
#[derive(Clone, Debug)]
struct Plain {
    dynamics: Dynamics<f64>,
    state: State<f64>,
    waves: Vec<Wave<f64>>,
    first: Forces<f64>,
    last: Forces<f64>,
    scratch: Scratch<f64>,
}

/// Whether a resting body is held, or which way it starts (eq. 6): held while the other force stays
/// within what friction can oppose.
pub(super) fn decide(force: f64, [forward, backward]: [f64; 2]) -> Mode {
    match (force > forward, force < -backward) {
        (false, false) => Mode::Stick,
        (true, false) => Mode::Slide(1.0),
        (false, true) => Mode::Slide(-1.0),
        // Only a negative friction, which a fit may try, pushes out of rest both ways.
        (true, true) if 2.0 * force >= forward - backward => Mode::Slide(1.0),
        (true, true) => Mode::Slide(-1.0),
    }
}

fn plain_into<S: Scalar>(to: &mut [f64], from: &[S]) {
    for (to, from) in to.iter_mut().zip(from) {
        *to = from.value();
    }
}

impl Plain {
    fn take_state<S: Scalar>(&mut self, state: &State<S>) {
        plain_into(&mut self.state.q, &state.q);
        plain_into(&mut self.state.v, &state.v);
        plain_into(&mut self.state.z, &state.z);
    }

    fn take<S: Scalar>(&mut self, state: &State<S>, waves: &[Wave<S>], first: &Forces<S>) {
        self.take_state(state);
        for (to, from) in self.waves.iter_mut().zip(waves) {
            *to = from.plain();
        }
        plain_into(&mut self.first.force, &first.force);
        plain_into(&mut self.first.rate, &first.rate);
        plain_into(&mut self.first.load, &first.load);
    }
}

impl<S: Scalar> Substep<S> {
    pub(super) fn new(topology: &Topology, values: &[S], smoothing: f64) -> Self {
        let dynamics = Dynamics::new(topology, values, smoothing);
        Self {
            plain: Plain {
                dynamics: dynamics.plain(topology),
                state: State::rest(topology),
                waves: vec![Wave::ZERO; topology.lines.len()],
                first: Forces::new(topology),
                last: Forces::new(topology),
                scratch: Scratch::new(topology),
            },
            dynamics,
            state: State::rest(topology),
            waves: vec![Wave::ZERO; topology.lines.len()],
            modes: Modes {
                friction: vec![Mode::Stick; topology.frictions.len()],
                branches: vec![0; topology.switches.len()],
            },
            first: Forces::new(topology),
            last: Forces::new(topology),
            scratch: Scratch::new(topology),
        }
    }

    /// A bound on the fastest rate within the next `ahead` seconds, 1/s, and the body where it sits; with
    /// the stops that may be met in that time, or without stops.
    pub(super) fn rate(&mut self, topology: &Topology, ahead: f64, stops: bool) -> (f64, usize) {
        self.plain.take_state(&self.state);
        let values = &self.plain.dynamics.values;
        let smoothing = self.dynamics.smoothing;
        rate::bound(topology, values, &self.plain.state, ahead, stops, smoothing)
    }

    /// Where the state stands, for sensors: branches are those of the state.
    pub(super) fn refresh(&mut self, topology: &Topology, tau: S) {
        if !topology.switches.is_empty() {
            self.settle_branches(topology, tau);
        }
    }

    /// Everything that forces depend on, now.
    pub(super) fn point(&self, tau: S) -> Point<'_, S> {
        Point {
            values: &self.dynamics.values,
            state: &self.state,
            waves: &self.waves,
            tau,
            branches: &self.modes.branches,
            smoothing: self.dynamics.smoothing,
        }
    }

    /// Advances the state by `h`, of the value `length`, beginning `tau` into the sample interval.
    pub(super) fn advance<T>(
        &mut self,
        topology: &Topology,
        tau: S,
        h: T,
        length: f64,
        report: &mut Report,
    ) where
        T: Copy + Mul<f64, Output = T>,
        S: Mul<T, Output = S> + Add<T, Output = S>,
    {
        self.settle(topology, tau);
        let start = Start {
            state: &self.state,
            forces: &self.first,
            waves: &self.waves,
            tau,
            modes: &self.modes,
        };
        self.dynamics.step(topology, &start, h, &mut self.scratch);
        if topology.frictions.is_empty() && topology.switches.is_empty() {
            std::mem::swap(&mut self.state, &mut self.scratch.end);
            return;
        }
        match self.earliest(topology, tau, tau + h, length) {
            None => std::mem::swap(&mut self.state, &mut self.scratch.end),
            Some(event) => self.through(topology, event, tau, S::ZERO + h, report),
        }
    }

    /// The modes at the beginning of a sub-step follow from the state: what moves slides its way, what
    /// rests is held or starts, each law is on the branch where the state is.
    fn settle(&mut self, topology: &Topology, tau: S) {
        if !topology.switches.is_empty() {
            self.settle_branches(topology, tau);
        }
        self.other_forces(topology, tau);
        if !topology.frictions.is_empty() && self.dynamics.smoothing == 0.0 {
            self.settle_frictions(topology, tau, None);
        }
    }

    fn settle_branches(&mut self, topology: &Topology, tau: S) {
        let at = Point {
            values: &self.dynamics.values,
            state: &self.state,
            waves: &self.waves,
            tau,
            branches: &[],
            smoothing: self.dynamics.smoothing,
        };
        topology.settle_branches(at, &mut self.modes.branches, &mut self.first);
    }

    fn other_forces(&mut self, topology: &Topology, tau: S) {
        let at = Point {
            values: &self.dynamics.values,
            state: &self.state,
            waves: &self.waves,
            tau,
            branches: &self.modes.branches,
            smoothing: self.dynamics.smoothing,
        };
        topology.forces(&at, &mut self.first);
    }

    /// Who slides and who rests, from the state and the other forces there; `stopped` is at rest
    /// whatever rounding says.
    fn settle_frictions(&mut self, topology: &Topology, tau: S, stopped: Option<usize>) {
        if topology.coupled {
            return self.settle_together(topology, tau, stopped);
        }
        for (index, friction) in topology.frictions.iter().enumerate() {
            let body = friction.body();
            let speed = self.state.v[body].value();
            if speed != 0.0 {
                self.modes.friction[index] = Mode::Slide(speed.signum());
                continue;
            }
            let values = &self.dynamics.values;
            let hold = friction.hold(values, &self.first.load, &self.modes.branches);
            let mode = decide(self.first.force[body].value(), hold.map(S::value));
            if mode == Mode::Stick {
                // A body that is held rests whatever its parameters: not even its derivatives move.
                self.state.v[body] = S::ZERO;
            }
            self.modes.friction[index] = mode;
        }
    }

    /// As `settle_frictions`, where what one path holds changes what another has to.
    fn settle_together(&mut self, topology: &Topology, tau: S, stopped: Option<usize>) {
        let values = &self.dynamics.values;
        let mut resting = Vec::new();
        for (index, friction) in topology.frictions.iter().enumerate() {
            if stopped == Some(index) || sticking::at_rest(friction, values, &self.state) {
                resting.push(index);
            } else {
                let speed = friction.speed(values, &self.state).value();
                self.modes.friction[index] = Mode::Slide(speed.signum());
            }
        }
        if resting.is_empty() {
            return;
        }
        self.plain.take(&self.state, &self.waves, &self.first);
        let plain = &self.plain;
        let at = Point {
            values: &plain.dynamics.values,
            state: &plain.state,
            waves: &plain.waves,
            tau: tau.value(),
            branches: &self.modes.branches,
            smoothing: self.dynamics.smoothing,
        };
        sticking::choose(
            &plain.dynamics,
            topology,
            &at,
            &resting,
            &mut self.modes.friction,
            &plain.first.force,
            &plain.first.load,
        );
        let modes = &self.modes.friction;
        sticking::project(&self.dynamics, topology, modes, &mut self.state);
    }

    /// The first event on the step that was just tried, if there is one: which, and when.
    fn earliest(&mut self, topology: &Topology, tau: S, end: S, h: f64) -> Option<(Event, f64)> {
        let smooth = self.dynamics.smoothing > 0.0;
        let rests = !smooth && self.modes.friction.contains(&Mode::Stick);
        if rests || topology.follows > 0 {
            let at = Point {
                values: &self.dynamics.values,
                state: &self.scratch.end,
                waves: &self.waves,
                tau: end,
                branches: &self.modes.branches,
                smoothing: self.dynamics.smoothing,
            };
            topology.forces(&at, &mut self.last);
        }
        let mut earliest: Option<(Event, f64)> = None;
        let rubbing = if smooth { 0 } else { topology.frictions.len() };
        let frictions = (0..rubbing).map(Event::Friction);
        let switches = (0..topology.switches.len()).map(Event::Switch);
        if rests {
            let at = Point {
                values: &self.dynamics.values,
                state: &self.scratch.end,
                waves: &self.waves,
                tau: end,
                branches: &self.modes.branches,
                smoothing: self.dynamics.smoothing,
            };
            let modes = &self.modes.friction;
            let held = &mut self.scratch.last;
            self.dynamics
                .accelerate(topology, &at, modes, &mut self.last, held);
        }
        for event in frictions.chain(switches) {
            let suspect = match event {
                Event::Friction(index) => self.suspect_friction(topology, index, h),
                Event::Switch(index) if smooth && topology.switches[index].smoothed() => None,
                Event::Switch(index) => {
                    let at = Point {
                        values: &self.dynamics.values,
                        state: &self.scratch.end,
                        waves: &self.waves,
                        tau: end,
                        branches: &self.modes.branches,
                        smoothing: self.dynamics.smoothing,
                    };
                    let margin = topology.margin(index, &at, &self.last.load);
                    (margin.value() < 0.0).then_some(h)
                }
            };
            let Some(within) = suspect else {
                continue;
            };
            // A later event than one already found needs no locating; it will be met again.
            let at = self.probe(topology, tau).locate(event, within);
            if let Some(t) = at
                && earliest.is_none_or(|(_, other)| t < other)
            {
                earliest = Some((event, t));
            }
        }
        earliest
    }

    /// Whether the tried step left a mode of friction, and by when at the latest.
    fn suspect_friction(&self, topology: &Topology, index: usize, h: f64) -> Option<f64> {
        let friction = &topology.frictions[index];
        match self.modes.friction[index] {
            Mode::Slide(direction) => {
                let values = &self.dynamics.values;
                let speed = |state: &State<S>| direction * friction.speed(values, state).value();
                let (start, end) = (speed(&self.state), speed(&self.scratch.end));
                if end < 0.0 {
                    return Some(h);
                }
                let [(body, None)] = friction.path[..] else {
                    return None;
                };
                if start == 0.0 {
                    // It has just been let go: a dip now would be a rounding error of the decision.
                    return None;
                }
                let (slope_start, slope_end) = self.scratch.accelerations(body);
                let slope = |a: f64| direction * a * h;
                event::dip(start, end, slope(slope_start), slope(slope_end)).map(|s| s * h)
            }
            Mode::Stick => {
                if self.scratch.middle[index].margin().value() < 0.0 {
                    Some(0.5 * h)
                } else {
                    (self.scratch.last[index].margin().value() < 0.0).then_some(h)
                }
            }
        }
    }

    fn probe<'a>(&'a mut self, topology: &'a Topology, tau: S) -> Probe<'a> {
        self.plain.take(&self.state, &self.waves, &self.first);
        let Plain {
            dynamics,
            state,
            waves,
            first,
            last,
            scratch,
        } = &mut self.plain;
        Probe {
            topology,
            dynamics,
            start: Start {
                state,
                forces: first,
                waves,
                tau: tau.value(),
                modes: &self.modes,
            },
            scratch,
            forces: last,
        }
    }

    /// Goes through the first event and all that follow it on the sub-step.
    #[cold]
    fn through(
        &mut self,
        topology: &Topology,
        first: (Event, f64),
        mut tau: S,
        h: S,
        report: &mut Report,
    ) {
        // More events than this on a sub-step means chatter below its resolution.
        let most = 8 + 4 * (topology.frictions.len() + topology.switches.len());
        let mut left = h;
        let mut next = first;
        for _ in 0..most {
            let (event, at) = next;
            match event {
                Event::Friction(_) => report.events += 1,
                Event::Switch(_) => report.kinks += 1,
            }
            let t = self.reach(topology, event, at, tau, left.value());
            tau += t;
            left -= t;
            self.switch(topology, event, tau);
            if left.value() <= 0.0 {
                return;
            }
            self.step(topology, tau, left);
            match self.earliest(topology, tau, tau + left, left.value()) {
                None => {
                    std::mem::swap(&mut self.state, &mut self.scratch.end);
                    return;
                }
                Some(event) => next = event,
            }
        }
        self.fall_back(topology);
        report.fallbacks += 1;
    }

    fn step(&mut self, topology: &Topology, tau: S, h: S) {
        let start = Start {
            state: &self.state,
            forces: &self.first,
            waves: &self.waves,
            tau,
            modes: &self.modes,
        };
        self.dynamics.step(topology, &start, h, &mut self.scratch);
    }

    /// Steps to an event and returns how long that took, derivatives included: with margin g(t) the
    /// time that solves g = 0 moves by -dg/g' (one Newton step in the scalar's own arithmetic).
    fn reach(&mut self, topology: &Topology, event: Event, at: f64, tau: S, step: f64) -> S {
        if at <= 0.0 {
            return S::ZERO;
        }
        let mut t = S::constant(at);
        self.step(topology, tau, t);
        let start = Start {
            state: &self.state,
            forces: &self.first,
            waves: &self.waves,
            tau,
            modes: &self.modes,
        };
        let margin = event::margin(
            &self.dynamics,
            topology,
            event,
            &start,
            tau + t,
            &mut self.scratch,
            &mut self.last,
        );
        let slope = self.probe(topology, tau).slope(event, at, step);
        let correction = margin * (1.0 / slope);
        // The value is found already; a grazing event (slope near zero) has no derivative to give.
        if correction.value().abs() <= 1e-6 * step {
            t -= correction;
            self.step(topology, tau, t);
        }
        std::mem::swap(&mut self.state, &mut self.scratch.end);
        t
    }

    /// What becomes of the mode whose end was reached.
    fn switch(&mut self, topology: &Topology, event: Event, tau: S) {
        match event {
            Event::Switch(index) => {
                let at = self.point(tau);
                let branch = topology.next_branch(index, &at);
                self.modes.branches[index] = branch;
                self.other_forces(topology, tau);
                // A jump may let go of what rests; what slides goes on.
                let smooth = self.dynamics.smoothing > 0.0;
                if !smooth && self.modes.friction.contains(&Mode::Stick) {
                    self.settle_frictions(topology, tau, None);
                }
            }
            Event::Friction(index) => {
                let friction = &topology.frictions[index];
                if let Mode::Slide(_) = self.modes.friction[index] {
                    if let [(body, None)] = friction.path[..] {
                        // What the search left of the speed is rounding; the forces below see none.
                        self.state.v[body] = S::ZERO;
                    }
                    self.other_forces(topology, tau);
                    self.settle_frictions(topology, tau, Some(index));
                    return;
                }
                self.other_forces(topology, tau);
                let at = Point {
                    values: &self.dynamics.values,
                    state: &self.state,
                    waves: &self.waves,
                    tau,
                    branches: &self.modes.branches,
                    smoothing: self.dynamics.smoothing,
                };
                self.last.copy_from(&self.first);
                let modes = &self.modes.friction;
                let held = &mut self.scratch.last;
                self.dynamics
                    .accelerate(topology, &at, modes, &mut self.last, held);
                let held = held[index];
                let ahead =
                    (held.hold[0] - held.force).value() <= (held.force + held.hold[1]).value();
                self.modes.friction[index] = Mode::Slide(if ahead { 1.0 } else { -1.0 });
            }
        }
    }

    /// The end of a sub-step with too many events: the state that modes held give, and at rest every
    /// body that would have turned round. It takes energy out, never adds any.
    fn fall_back(&mut self, topology: &Topology) {
        std::mem::swap(&mut self.state, &mut self.scratch.end);
        for (friction, mode) in topology.frictions.iter().zip(&self.modes.friction) {
            let [(body, None)] = friction.path[..] else {
                continue;
            };
            let speed = self.state.v[body].value();
            if matches!(mode, Mode::Slide(direction) if direction * speed < 0.0) {
                self.state.v[body] = S::ZERO;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Mode, decide};

    #[test]
    fn rest_is_kept_up_to_the_level_and_left_beyond_it() {
        let hold = [2.0, 3.0];
        assert_eq!(decide(2.0, hold), Mode::Stick);
        assert_eq!(decide(-3.0, hold), Mode::Stick);
        assert_eq!(decide(2.0 + 1e-15, hold), Mode::Slide(1.0));
        assert_eq!(decide(-3.0 - 1e-15, hold), Mode::Slide(-1.0));
    }

    #[test]
    fn a_negative_level_leaves_rest_with_the_force() {
        assert_eq!(decide(0.5, [-1.0, -1.0]), Mode::Slide(1.0));
        assert_eq!(decide(-0.5, [-1.0, -1.0]), Mode::Slide(-1.0));
    }
}

//! One sub-step, cut at every event on it (docs/plant.md, eq. 16).

use super::dynamics::{Dynamics, Mode, Scratch};
use super::event::{self, Probe};
use super::{Report, rate};
use crate::plant::topology::{Inputs, State, Topology};
use crate::scalar::Scalar;

/// Everything that a sub-step works in; allocated once a simulation.
#[derive(Clone, Debug)]
pub(super) struct Substep<S> {
    pub(super) dynamics: Dynamics<S>,
    pub(super) plain: Dynamics<f64>,
    pub(super) state: State<S>,
    pub(super) inputs: Inputs<S>,
    /// Where the sub-step began, to begin it again.
    begun: State<S>,
    /// Whether each unilateral tendon was slack there.
    slack: Vec<bool>,
    modes: Vec<Mode>,
    first: Vec<S>,
    last: Vec<S>,
    scratch: Scratch<S>,
    plain_state: State<f64>,
    plain_inputs: Inputs<f64>,
    plain_first: Vec<f64>,
    plain_force: Vec<f64>,
    plain_scratch: Scratch<f64>,
}

/// Parts of a sub-step on which a tendon goes slack or taut.
const KINK_PARTS: usize = 16;

/// Whether a resting body is held, or which way it starts (eq. 6): held while the other force stays
/// within what friction can oppose.
fn decide(force: f64, [forward, backward]: [f64; 2]) -> Mode {
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

impl<S: Scalar> Substep<S> {
    pub(super) fn new(topology: &Topology, values: &[S]) -> Self {
        let (bodies, frictions) = (topology.bodies.len(), topology.frictions.len());
        let dynamics = Dynamics::new(topology, values);
        Self {
            plain: dynamics.plain(topology),
            dynamics,
            state: State::rest(bodies),
            inputs: Inputs::zero(topology.inputs),
            begun: State::rest(bodies),
            slack: vec![false; topology.unilateral.len()],
            modes: vec![Mode::Stick; frictions],
            first: vec![S::ZERO; bodies + 1],
            last: vec![S::ZERO; bodies + 1],
            scratch: Scratch::new(bodies, frictions),
            plain_state: State::rest(bodies),
            plain_inputs: Inputs::zero(topology.inputs),
            plain_first: vec![0.0; bodies + 1],
            plain_force: vec![0.0; bodies + 1],
            plain_scratch: Scratch::new(bodies, frictions),
        }
    }

    /// A bound on the fastest rate within the next `ahead` seconds, 1/s, and the body where it sits.
    pub(super) fn rate(&mut self, topology: &Topology, ahead: f64) -> (f64, usize) {
        plain_into(&mut self.plain_state.q, &self.state.q);
        plain_into(&mut self.plain_state.v, &self.state.v);
        rate::bound(topology, &self.plain.values, &self.plain_state, ahead)
    }

    /// Advances the state by `h`, beginning `tau` into the sample interval.
    pub(super) fn advance(&mut self, topology: &Topology, tau: f64, h: f64, report: &mut Report) {
        if topology.unilateral.is_empty() {
            return self.part(topology, tau, h, report);
        }
        self.begun.q.copy_from_slice(&self.state.q);
        self.begun.v.copy_from_slice(&self.state.v);
        let before = *report;
        self.watch_tendons(topology, tau, true);
        self.part(topology, tau, h, report);
        if !self.watch_tendons(topology, tau + h, false) {
            return;
        }
        // A tendon went slack or taut on the way: its tension has a kink there, across which a step
        // is only of third order. Taken again in small parts, all but one of them are smooth.
        std::mem::swap(&mut self.state, &mut self.begun);
        *report = before;
        report.kinks += 1;
        let part = h / KINK_PARTS as f64;
        for index in 0..KINK_PARTS {
            self.part(topology, tau + index as f64 * part, part, report);
        }
    }

    /// Notes which tendons are slack (`note`), or says whether one has changed since.
    fn watch_tendons(&mut self, topology: &Topology, tau: f64, note: bool) -> bool {
        let mut changed = false;
        for (slack, &index) in self.slack.iter_mut().zip(&topology.unilateral) {
            let tendon = &topology.tendons[index];
            let values = &self.dynamics.values;
            let tau = S::constant(tau);
            let tension = tendon.tension(values, &self.state, &self.inputs, tau);
            let now = tension.value() <= 0.0;
            changed |= now != *slack;
            if note {
                *slack = now;
            }
        }
        changed
    }

    /// A sub-step, or a part of one.
    fn part(&mut self, topology: &Topology, tau: f64, h: f64, report: &mut Report) {
        let tau = S::constant(tau);
        self.other_forces(topology, tau);
        self.settle(topology);
        self.dynamics.step(
            topology,
            &self.inputs,
            &self.modes,
            &self.state,
            &self.first,
            tau,
            h,
            &mut self.scratch,
        );
        if topology.frictions.is_empty() {
            std::mem::swap(&mut self.state, &mut self.scratch.end);
            return;
        }
        match self.earliest(topology, tau, h) {
            None => std::mem::swap(&mut self.state, &mut self.scratch.end),
            Some(event) => self.through(topology, event, tau, h, report),
        }
    }

    fn other_forces(&mut self, topology: &Topology, tau: S) {
        topology.forces(
            &self.dynamics.values,
            &self.state,
            &self.inputs,
            tau,
            &mut self.first,
        );
    }

    /// The modes at the beginning of a sub-step follow from the state: what moves slides its way, what
    /// rests is held or starts.
    fn settle(&mut self, topology: &Topology) {
        for index in 0..topology.frictions.len() {
            let speed = self.state.v[topology.frictions[index].body].value();
            if speed == 0.0 {
                self.settle_at_rest(topology, index);
            } else {
                self.modes[index] = Mode::Slide(speed.signum());
            }
        }
    }

    fn settle_at_rest(&mut self, topology: &Topology, index: usize) {
        let friction = &topology.frictions[index];
        let hold = friction.hold(&self.plain.values);
        let mode = decide(self.first[friction.body].value(), hold);
        if mode == Mode::Stick {
            // A body that is held rests whatever its parameters: not even its derivatives move.
            self.state.v[friction.body] = S::ZERO;
        }
        self.modes[index] = mode;
    }

    /// The first event on the step that was just tried, if there is one: which friction, and when.
    fn earliest(&mut self, topology: &Topology, tau: S, h: f64) -> Option<(usize, f64)> {
        if self.modes.contains(&Mode::Stick) {
            topology.forces(
                &self.dynamics.values,
                &self.scratch.end,
                &self.inputs,
                tau + h,
                &mut self.last,
            );
        }
        let mut earliest: Option<(usize, f64)> = None;
        for index in 0..topology.frictions.len() {
            let Some(within) = self.suspect(topology, index, h) else {
                continue;
            };
            // A later event than one already found needs no locating; it will be met again.
            let event = self.probe(topology, tau).locate(index, within);
            if let Some(t) = event
                && earliest.is_none_or(|(_, other)| t < other)
            {
                earliest = Some((index, t));
            }
        }
        earliest
    }

    /// Whether the tried step left a mode, and by when at the latest.
    fn suspect(&self, topology: &Topology, index: usize, h: f64) -> Option<f64> {
        let friction = &topology.frictions[index];
        let body = friction.body;
        match self.modes[index] {
            Mode::Slide(direction) => {
                let start = direction * self.state.v[body].value();
                let end = direction * self.scratch.end.v[body].value();
                if end < 0.0 {
                    return Some(h);
                }
                if start == 0.0 {
                    // It has just been let go: a dip now would be a rounding error of the decision.
                    return None;
                }
                let (slope_start, slope_end) = self.scratch.accelerations(body);
                let slope = |a: f64| direction * a * h;
                event::dip(start, end, slope(slope_start), slope(slope_end)).map(|s| s * h)
            }
            Mode::Stick => {
                let hold = friction.hold(&self.plain.values);
                let left = |force: S| decide(force.value(), hold) != Mode::Stick;
                if left(self.scratch.middle[index]) {
                    Some(0.5 * h)
                } else {
                    left(self.last[body]).then_some(h)
                }
            }
        }
    }

    fn probe<'a>(&'a mut self, topology: &'a Topology, tau: S) -> Probe<'a> {
        plain_into(&mut self.plain_state.q, &self.state.q);
        plain_into(&mut self.plain_state.v, &self.state.v);
        plain_into(&mut self.plain_inputs.held, &self.inputs.held);
        plain_into(&mut self.plain_inputs.slope, &self.inputs.slope);
        plain_into(&mut self.plain_first, &self.first);
        Probe {
            topology,
            dynamics: &self.plain,
            inputs: &self.plain_inputs,
            modes: &self.modes,
            from: &self.plain_state,
            first: &self.plain_first,
            tau: tau.value(),
            scratch: &mut self.plain_scratch,
            force: &mut self.plain_force,
        }
    }

    /// Goes through the first event and all that follow it on the sub-step.
    #[cold]
    fn through(
        &mut self,
        topology: &Topology,
        first: (usize, f64),
        mut tau: S,
        h: f64,
        report: &mut Report,
    ) {
        // More events than this on a sub-step means chatter below its resolution.
        let most = 8 + 4 * topology.frictions.len();
        let mut left = S::constant(h);
        let mut event = first;
        for _ in 0..most {
            report.events += 1;
            let (index, at) = event;
            let t = self.reach(topology, index, at, tau, left.value());
            tau += t;
            left -= t;
            self.switch(topology, index, tau);
            if left.value() <= 0.0 {
                return;
            }
            self.step(topology, tau, left);
            match self.earliest(topology, tau, left.value()) {
                None => {
                    std::mem::swap(&mut self.state, &mut self.scratch.end);
                    return;
                }
                Some(next) => event = next,
            }
        }
        self.fall_back(topology);
        report.fallbacks += 1;
    }

    fn step(&mut self, topology: &Topology, tau: S, h: S) {
        self.dynamics.step(
            topology,
            &self.inputs,
            &self.modes,
            &self.state,
            &self.first,
            tau,
            h,
            &mut self.scratch,
        );
    }

    /// Steps to an event and returns how long that took, derivatives included: with margin g(t) the
    /// time that solves g = 0 moves by -dg/g' (one Newton step in the scalar's own arithmetic).
    fn reach(&mut self, topology: &Topology, index: usize, at: f64, tau: S, step: f64) -> S {
        if at <= 0.0 {
            return S::ZERO;
        }
        let mut t = S::constant(at);
        self.step(topology, tau, t);
        let friction = &topology.frictions[index];
        let margin = match self.modes[index] {
            Mode::Slide(direction) => self.scratch.end.v[friction.body] * direction,
            Mode::Stick => {
                topology.forces(
                    &self.dynamics.values,
                    &self.scratch.end,
                    &self.inputs,
                    tau + t,
                    &mut self.last,
                );
                let [forward, backward] = friction.hold(&self.dynamics.values);
                let force = self.last[friction.body];
                (forward - force).min(force + backward)
            }
        };
        let slope = self.probe(topology, tau).slope(index, at, step);
        let correction = margin * (1.0 / slope);
        // The value is found already; a grazing event (slope near zero) has no derivative to give.
        if correction.value().abs() <= 1e-6 * step {
            t -= correction;
            self.step(topology, tau, t);
        }
        std::mem::swap(&mut self.state, &mut self.scratch.end);
        t
    }

    /// What becomes of the body whose event was reached.
    fn switch(&mut self, topology: &Topology, index: usize, tau: S) {
        let friction = &topology.frictions[index];
        let sliding = matches!(self.modes[index], Mode::Slide(_));
        if sliding {
            // What the search left of the speed is rounding; the forces below see none.
            self.state.v[friction.body] = S::ZERO;
        }
        self.other_forces(topology, tau);
        if sliding {
            self.settle_at_rest(topology, index);
            return;
        }
        let [forward, backward] = friction.hold(&self.plain.values);
        let force = self.first[friction.body].value();
        let ahead = forward - force <= force + backward;
        self.modes[index] = Mode::Slide(if ahead { 1.0 } else { -1.0 });
    }

    /// The end of a sub-step with too many events: the state that modes held give, and at rest every
    /// body that would have turned round. It takes energy out, never adds any.
    fn fall_back(&mut self, topology: &Topology) {
        std::mem::swap(&mut self.state, &mut self.scratch.end);
        for (friction, mode) in topology.frictions.iter().zip(&self.modes) {
            let speed = self.state.v[friction.body].value();
            if matches!(mode, Mode::Slide(direction) if direction * speed < 0.0) {
                self.state.v[friction.body] = S::ZERO;
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

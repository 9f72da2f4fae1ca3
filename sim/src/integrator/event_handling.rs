//! Event handling: steps to each event of a sub-step, changes the mode that ends there, and goes
//! on.

use super::event::{self, Event};
use super::modes::Mode;
use super::runge_kutta::Start;
use super::substep::Substep;
use super::{sticking, stiction_set};
use crate::plant::topology::Topology;
use crate::scalar::Scalar;
use crate::settings::IntegrationReport;

impl<S: Scalar> Substep<S> {
    /// Goes through the first event and all that follow it on the sub-step.
    #[cold]
    pub(super) fn handle_events(
        &mut self,
        topology: &Topology,
        first: (Event, f64),
        mut tau: S,
        h: S,
        report: &mut IntegrationReport,
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
            let t = self.step_to_event(topology, event, at, tau, left.value());
            tau += t;
            left -= t;
            self.change_mode(topology, event, tau);
            if left.value() <= 0.0 {
                return;
            }
            self.step(topology, tau, left);
            match self.first_event(topology, tau, tau + left, left.value()) {
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

    /// Steps to an event and returns how long that took, derivatives included: with margin g(t) the
    /// time that solves g = 0 moves by -dg/g' (one Newton step in the scalar's own arithmetic).
    fn step_to_event(
        &mut self,
        topology: &Topology,
        event: Event,
        at: f64,
        tau: S,
        step: f64,
    ) -> S {
        if at <= 0.0 {
            return S::ZERO;
        }
        let mut t = S::constant(at);
        self.step(topology, tau, t);
        let start = Start::new(
            &self.state,
            &self.first,
            &self.input_signals,
            tau,
            &self.modes,
        );
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

    /// Changes the mode whose end was reached.
    fn change_mode(&mut self, topology: &Topology, event: Event, tau: S) {
        match event {
            Event::Switch(index) => {
                let at = self.point(tau);
                let branch = topology.next_branch(index, &at);
                self.modes.branches[index] = branch;
                self.other_forces(topology, tau);
                // A jump may let go of what rests; what slides goes on.
                let smooth = self.dynamics.smoothing > 0.0;
                if !smooth && self.modes.friction.contains(&Mode::Stick) {
                    self.initialise_frictions(topology, tau, None);
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
                    self.initialise_frictions(topology, tau, Some(index));
                    return;
                }
                self.other_forces(topology, tau);
                let at =
                    self.dynamics
                        .at(&self.state, &self.input_signals, tau, &self.modes.branches);
                self.last.copy_from(&self.first);
                let modes = &self.modes.friction;
                let held = &mut self.scratch.last;
                self.dynamics
                    .accelerate(topology, &at, modes, &mut self.last, held);
                let held = held[index];
                let ahead =
                    (held.hold[0] - held.force).value() <= (held.force + held.hold[1]).value();
                let direction = if ahead { 1.0 } else { -1.0 };
                let modes = &mut self.modes.friction;
                if topology.coupled {
                    stiction_set::break_away(
                        &self.plain.dynamics,
                        topology,
                        modes,
                        index,
                        direction,
                    );
                } else {
                    modes[index] = Mode::Slide(direction);
                }
            }
        }
    }

    /// The end of a sub-step with too many events: the state that modes held give, and at rest
    /// everything that would have turned round. It takes energy out, never adds any.
    fn fall_back(&mut self, topology: &Topology) {
        std::mem::swap(&mut self.state, &mut self.scratch.end);
        let values = &self.dynamics.values;
        for (friction, mode) in topology.frictions.iter().zip(&mut self.modes.friction) {
            let speed = friction.speed(values, &self.state).value();
            if !matches!(mode, Mode::Slide(direction) if *direction * speed < 0.0) {
                continue;
            }
            match friction.path[..] {
                [(body, None)] => self.state.v[body] = S::ZERO,
                _ => *mode = Mode::Stick,
            }
        }
        if topology.coupled {
            let modes = &self.modes.friction;
            sticking::project(&self.dynamics, topology, modes, &mut self.state);
        }
    }
}

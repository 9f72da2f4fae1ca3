//! Event location: the first event on a sub-step.

use super::event::{self, Event, Probe};
use super::modes::Mode;
use super::plain::{Plain, plain_state};
use super::runge_kutta::Start;
use super::substep::Substep;
use crate::plant::forces::State;
use crate::plant::topology::Topology;
use crate::scalar::Scalar;

impl<S: Scalar> Substep<S> {
    /// The first event on the step that was just tried, if there is one: which, and when.
    pub(super) fn first_event(
        &mut self,
        topology: &Topology,
        tau: S,
        end: S,
        h: f64,
    ) -> Option<(Event, f64)> {
        let smooth = self.dynamics.smoothing > 0.0;
        let rests = !smooth && self.modes.friction.contains(&Mode::Stick);
        self.evaluate_end(topology, end.value(), rests);
        let mut earliest: Option<(Event, f64)> = None;
        let rubbing = if smooth { 0 } else { topology.frictions.len() };
        let frictions = (0..rubbing).map(Event::Friction);
        let switches = (0..topology.switches.len()).map(Event::Switch);
        for event in frictions.chain(switches) {
            let interval = match event {
                Event::Friction(index) => self.friction_event_bound(topology, index, h),
                Event::Switch(index) if smooth && topology.switches[index].smoothed() => None,
                Event::Switch(index) => {
                    let Plain {
                        dynamics,
                        input_signals,
                        end: there,
                        ..
                    } = &self.plain;
                    let at = dynamics.at(
                        &there.state,
                        input_signals,
                        end.value(),
                        &self.modes.branches,
                    );
                    (topology.margin(index, &at, &there.forces.load) < 0.0).then_some(h)
                }
            };
            let Some(within) = interval else {
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

    /// Evaluates the end of the tried step without derivatives: its state, and the forces there
    /// if something rests or a law follows them.
    fn evaluate_end(&mut self, topology: &Topology, tau: f64, rests: bool) {
        if !rests && topology.switches.is_empty() {
            return;
        }
        self.plain.take_waves(&self.input_signals);
        let Plain {
            dynamics,
            input_signals,
            end,
            ..
        } = &mut self.plain;
        plain_state(&mut end.state, &self.scratch.end);
        if !rests && topology.follows == 0 {
            return;
        }
        let at = dynamics.at(&end.state, input_signals, tau, &self.modes.branches);
        topology.forces(&at, &mut end.forces);
        if rests {
            let modes = &self.modes.friction;
            dynamics.accelerate(topology, &at, modes, &mut end.forces, &mut end.held);
        }
    }

    /// Latest time by which the tried step left a mode of friction, if it did.
    fn friction_event_bound(&self, topology: &Topology, index: usize, h: f64) -> Option<f64> {
        let friction = &topology.frictions[index];
        if friction.passive {
            return None;
        }
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
            Mode::Yield(_) => None,
            Mode::Stick => {
                if self.scratch.middle[index].margin().value() < 0.0 {
                    Some(0.5 * h)
                } else {
                    (self.plain.end.held[index].margin() < 0.0).then_some(h)
                }
            }
        }
    }

    pub(super) fn probe<'a>(&'a mut self, topology: &'a Topology, tau: S) -> Probe<'a> {
        self.plain
            .take(&self.state, &self.input_signals, &self.first);
        let Plain {
            dynamics,
            state,
            input_signals,
            first,
            last,
            scratch,
            ..
        } = &mut self.plain;
        Probe {
            topology,
            dynamics,
            start: Start {
                state,
                forces: first,
                input_signals,
                tau: tau.value(),
                modes: &self.modes,
            },
            scratch,
            forces: last,
        }
    }
}

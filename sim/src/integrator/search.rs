//! Where on a sub-step a mode ends first.

use super::dynamics::{Dynamics, Mode, Scratch, Start};
use super::event::{self, Event, Probe};
use super::substep::Substep;
use crate::plant::forces::{Forces, State};
use crate::plant::topology::Topology;
use crate::plant::wave::Wave;
use crate::scalar::Scalar;

/// The same without derivatives, for the search of events.
#[derive(Clone, Debug)]
pub(super) struct Plain {
    pub(super) dynamics: Dynamics<f64>,
    pub(super) state: State<f64>,
    pub(super) waves: Vec<Wave<f64>>,
    pub(super) first: Forces<f64>,
    last: Forces<f64>,
    scratch: Scratch<f64>,
}

fn plain_into<S: Scalar>(to: &mut [f64], from: &[S]) {
    for (to, from) in to.iter_mut().zip(from) {
        *to = from.value();
    }
}

impl Plain {
    pub(super) fn new(topology: &Topology, dynamics: Dynamics<f64>) -> Self {
        Self {
            dynamics,
            state: State::rest(topology),
            waves: vec![Wave::ZERO; topology.lines.len()],
            first: Forces::new(topology),
            last: Forces::new(topology),
            scratch: Scratch::new(topology),
        }
    }

    pub(super) fn take_state<S: Scalar>(&mut self, state: &State<S>) {
        plain_into(&mut self.state.q, &state.q);
        plain_into(&mut self.state.v, &state.v);
        plain_into(&mut self.state.z, &state.z);
    }

    pub(super) fn take<S: Scalar>(
        &mut self,
        state: &State<S>,
        waves: &[Wave<S>],
        first: &Forces<S>,
    ) {
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
    /// The first event on the step that was just tried, if there is one: which, and when.
    pub(super) fn earliest(
        &mut self,
        topology: &Topology,
        tau: S,
        end: S,
        h: f64,
    ) -> Option<(Event, f64)> {
        let smooth = self.dynamics.smoothing > 0.0;
        let rests = !smooth && self.modes.friction.contains(&Mode::Stick);
        if rests || topology.follows > 0 {
            let at = self
                .dynamics
                .at(&self.scratch.end, &self.waves, end, &self.modes.branches);
            topology.forces(&at, &mut self.last);
        }
        let mut earliest: Option<(Event, f64)> = None;
        let rubbing = if smooth { 0 } else { topology.frictions.len() };
        let frictions = (0..rubbing).map(Event::Friction);
        let switches = (0..topology.switches.len()).map(Event::Switch);
        if rests {
            let at = self
                .dynamics
                .at(&self.scratch.end, &self.waves, end, &self.modes.branches);
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
                    let at =
                        self.dynamics
                            .at(&self.scratch.end, &self.waves, end, &self.modes.branches);
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

    pub(super) fn probe<'a>(&'a mut self, topology: &'a Topology, tau: S) -> Probe<'a> {
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
}

//! Where on a sub-step a mode ends first.

use super::dynamics::{Dynamics, Held, Mode, Scratch, Start};
use super::event::{self, Event, Probe};
use super::substep::Substep;
use crate::plant::forces::{Forces, State};
use crate::plant::topology::Topology;
use crate::plant::wave::Wave;
use crate::scalar::Scalar;

/// The same without derivatives, for everything that asks for a branch or a sign.
#[derive(Clone, Debug)]
pub(super) struct Plain {
    pub(super) dynamics: Dynamics<f64>,
    pub(super) state: State<f64>,
    pub(super) waves: Vec<Wave<f64>>,
    pub(super) first: Forces<f64>,
    last: Forces<f64>,
    scratch: Scratch<f64>,
    end: End,
}

/// The end of a step that was tried.
#[derive(Clone, Debug)]
struct End {
    state: State<f64>,
    forces: Forces<f64>,
    held: Vec<Held<f64>>,
}

fn plain_into<S: Scalar>(to: &mut [f64], from: &[S]) {
    for (to, from) in to.iter_mut().zip(from) {
        *to = from.value();
    }
}

fn plain_state<S: Scalar>(to: &mut State<f64>, from: &State<S>) {
    plain_into(&mut to.q, &from.q);
    plain_into(&mut to.v, &from.v);
    plain_into(&mut to.z, &from.z);
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
            end: End {
                state: State::rest(topology),
                forces: Forces::new(topology),
                held: vec![Held::NOTHING; topology.frictions.len()],
            },
        }
    }

    pub(super) fn take_state<S: Scalar>(&mut self, state: &State<S>) {
        plain_state(&mut self.state, state);
    }

    pub(super) fn take_waves<S: Scalar>(&mut self, waves: &[Wave<S>]) {
        for (to, from) in self.waves.iter_mut().zip(waves) {
            *to = from.plain();
        }
    }

    pub(super) fn take<S: Scalar>(
        &mut self,
        state: &State<S>,
        waves: &[Wave<S>],
        first: &Forces<S>,
    ) {
        self.take_state(state);
        self.take_waves(waves);
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
        self.look_at_end(topology, end.value(), rests);
        let mut earliest: Option<(Event, f64)> = None;
        let rubbing = if smooth { 0 } else { topology.frictions.len() };
        let frictions = (0..rubbing).map(Event::Friction);
        let switches = (0..topology.switches.len()).map(Event::Switch);
        for event in frictions.chain(switches) {
            let suspect = match event {
                Event::Friction(index) => self.suspect_friction(topology, index, h),
                Event::Switch(index) if smooth && topology.switches[index].smoothed() => None,
                Event::Switch(index) => {
                    let Plain {
                        dynamics,
                        waves,
                        end: there,
                        ..
                    } = &self.plain;
                    let at = dynamics.at(&there.state, waves, end.value(), &self.modes.branches);
                    (topology.margin(index, &at, &there.forces.load) < 0.0).then_some(h)
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

    /// What the events of the tried step are seen by: the state at its end, without derivatives, and the forces there
    /// where something rests or a law follows them.
    fn look_at_end(&mut self, topology: &Topology, tau: f64, rests: bool) {
        if !rests && topology.switches.is_empty() {
            return;
        }
        self.plain.take_waves(&self.waves);
        let Plain {
            dynamics,
            waves,
            end,
            ..
        } = &mut self.plain;
        plain_state(&mut end.state, &self.scratch.end);
        if !rests && topology.follows == 0 {
            return;
        }
        let at = dynamics.at(&end.state, waves, tau, &self.modes.branches);
        topology.forces(&at, &mut end.forces);
        if rests {
            let modes = &self.modes.friction;
            dynamics.accelerate(topology, &at, modes, &mut end.forces, &mut end.held);
        }
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
        self.plain.take(&self.state, &self.waves, &self.first);
        let Plain {
            dynamics,
            state,
            waves,
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
                waves,
                tau: tau.value(),
                modes: &self.modes,
            },
            scratch,
            forces: last,
        }
    }
}

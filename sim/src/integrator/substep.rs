//! One sub-step: modes from the state (`initial_modes`), a step with modes held (`runge_kutta`),
//! the place on it where a mode ends (`event_location`), and what follows (`event_handling`).

use super::dynamics::Dynamics;
use super::modes::{Mode, Modes};
use super::plain::Plain;
use super::rate;
use super::runge_kutta::{Scratch, Start};
use crate::plant::forces::{Forces, Point, State};
use crate::plant::input_signal::InputSignal;
use crate::plant::topology::Topology;
use crate::scalar::Scalar;
use crate::settings::IntegrationReport;
use std::ops::{Add, Mul};

/// Everything that a sub-step works in; allocated once a simulation.
#[derive(Clone, Debug)]
pub(super) struct Substep<S> {
    pub(super) dynamics: Dynamics<S>,
    pub(super) state: State<S>,
    /// Inputs of the actuators, one entry an actuator.
    pub(super) input_signals: Vec<InputSignal<S>>,
    pub(super) modes: Modes,
    /// Forces at the beginning of the sub-step.
    pub(super) first: Forces<S>,
    /// Forces wherever they were asked for last.
    pub(super) last: Forces<S>,
    pub(super) scratch: Scratch<S>,
    pub(super) plain: Plain,
}

impl<S: Scalar> Substep<S> {
    pub(super) fn new(topology: &Topology, values: &[S], smoothing: f64) -> Self {
        let dynamics = Dynamics::new(topology, values, smoothing);
        Self {
            plain: Plain::new(topology, dynamics.plain(topology)),
            dynamics,
            state: State::rest(topology),
            input_signals: vec![InputSignal::ZERO; topology.lines.len()],
            modes: Modes {
                friction: vec![Mode::Stick; topology.frictions.len()],
                branches: vec![0; topology.switches.len()],
            },
            first: Forces::new(topology),
            last: Forces::new(topology),
            scratch: Scratch::new(topology),
        }
    }

    /// A bound on the fastest rate within the next `ahead` seconds, 1/s, and the body where it
    /// sits; with the stops that may be met in that time, or without stops.
    pub(super) fn rate(&mut self, topology: &Topology, ahead: f64, stops: bool) -> (f64, usize) {
        self.plain.take_state(&self.state);
        let values = &self.plain.dynamics.values;
        let smoothing = self.dynamics.smoothing;
        rate::bound(topology, values, &self.plain.state, ahead, stops, smoothing)
    }

    /// Forgets who rests: a state that was put here says so by its velocities.
    pub(super) fn forget(&mut self) {
        self.modes.friction.fill(Mode::Slide(1.0));
    }

    /// Sets the branches to those of the state, for sensors.
    pub(super) fn refresh(&mut self, topology: &Topology, tau: S) {
        if !topology.switches.is_empty() {
            self.initialise_branches(topology, tau);
        }
    }

    /// Everything that forces depend on, now.
    pub(super) fn point(&self, tau: S) -> Point<'_, S> {
        self.dynamics
            .at(&self.state, &self.input_signals, tau, &self.modes.branches)
    }

    /// Advances the state by `h`, of the value `length`, beginning `tau` into the sample interval.
    pub(super) fn advance<T>(
        &mut self,
        topology: &Topology,
        tau: S,
        h: T,
        length: f64,
        report: &mut IntegrationReport,
    ) where
        T: Copy + Mul<f64, Output = T>,
        S: Mul<T, Output = S> + Add<T, Output = S>,
    {
        self.initialise_modes(topology, tau);
        let start = Start::new(
            &self.state,
            &self.first,
            &self.input_signals,
            tau,
            &self.modes,
        );
        self.dynamics.step(topology, &start, h, &mut self.scratch);
        if topology.frictions.is_empty() && topology.switches.is_empty() {
            std::mem::swap(&mut self.state, &mut self.scratch.end);
            return;
        }
        match self.first_event(topology, tau, tau + h, length) {
            None => std::mem::swap(&mut self.state, &mut self.scratch.end),
            Some(event) => self.handle_events(topology, event, tau, S::ZERO + h, report),
        }
    }

    pub(super) fn step(&mut self, topology: &Topology, tau: S, h: S) {
        let start = Start::new(
            &self.state,
            &self.first,
            &self.input_signals,
            tau,
            &self.modes,
        );
        self.dynamics.step(topology, &start, h, &mut self.scratch);
    }
}

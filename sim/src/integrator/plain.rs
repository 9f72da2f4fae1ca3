//! Room for a step without derivatives: branches and signs ask for values alone.

use super::dynamics::Dynamics;
use super::modes::Held;
use super::runge_kutta::Scratch;
use crate::plant::forces::{Forces, State};
use crate::plant::input_signal::InputSignal;
use crate::plant::topology::Topology;
use crate::scalar::Scalar;

/// The same without derivatives, for everything that asks for a branch or a sign.
#[derive(Clone, Debug)]
pub(super) struct Plain {
    pub(super) dynamics: Dynamics<f64>,
    pub(super) state: State<f64>,
    pub(super) input_signals: Vec<InputSignal<f64>>,
    pub(super) first: Forces<f64>,
    pub(super) last: Forces<f64>,
    pub(super) scratch: Scratch<f64>,
    pub(super) end: End,
}

/// The end of a step that was tried.
#[derive(Clone, Debug)]
pub(super) struct End {
    pub(super) state: State<f64>,
    pub(super) forces: Forces<f64>,
    pub(super) held: Vec<Held<f64>>,
}

fn plain_into<S: Scalar>(to: &mut [f64], from: &[S]) {
    for (to, from) in to.iter_mut().zip(from) {
        *to = from.value();
    }
}

pub(super) fn plain_state<S: Scalar>(to: &mut State<f64>, from: &State<S>) {
    plain_into(&mut to.q, &from.q);
    plain_into(&mut to.v, &from.v);
    plain_into(&mut to.z, &from.z);
}

impl Plain {
    pub(super) fn new(topology: &Topology, dynamics: Dynamics<f64>) -> Self {
        Self {
            dynamics,
            state: State::rest(topology),
            input_signals: vec![InputSignal::ZERO; topology.lines.len()],
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

    pub(super) fn take_waves<S: Scalar>(&mut self, input_signals: &[InputSignal<S>]) {
        for (to, from) in self.input_signals.iter_mut().zip(input_signals) {
            *to = from.plain();
        }
    }

    pub(super) fn take<S: Scalar>(
        &mut self,
        state: &State<S>,
        input_signals: &[InputSignal<S>],
        first: &Forces<S>,
    ) {
        self.take_state(state);
        self.take_waves(input_signals);
        plain_into(&mut self.first.force, &first.force);
        plain_into(&mut self.first.rate, &first.rate);
        plain_into(&mut self.first.load, &first.load);
    }
}

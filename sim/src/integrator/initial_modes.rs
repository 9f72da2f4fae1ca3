//! Mode initialisation at the beginning of a sub-step: sliding, sticking, and the branch of each
//! law.

use super::modes::{Mode, decide};
use super::plain::Plain;
use super::substep::Substep;
use super::{sticking, stiction_set};
use crate::plant::topology::Topology;
use crate::scalar::Scalar;

impl<S: Scalar> Substep<S> {
    /// The modes at the beginning of a sub-step follow from the state: what moves slides its way,
    /// what rests is held or starts, each law is on the branch where the state is.
    pub(super) fn initialise_modes(&mut self, topology: &Topology, tau: S) {
        if !topology.switches.is_empty() {
            self.initialise_branches(topology, tau);
        }
        self.other_forces(topology, tau);
        if !topology.frictions.is_empty() && self.dynamics.smoothing == 0.0 {
            self.initialise_frictions(topology, tau, None);
        }
    }

    pub(super) fn initialise_branches(&mut self, topology: &Topology, tau: S) {
        // A branch asks for signs, not for derivatives.
        self.plain.take_state(&self.state);
        self.plain.take_waves(&self.input_signals);
        let Plain {
            dynamics,
            state,
            input_signals,
            first,
            ..
        } = &mut self.plain;
        let at = dynamics.at(state, input_signals, tau.value(), &[]);
        topology.initialise_branches(at, &mut self.modes.branches, first);
    }

    pub(super) fn other_forces(&mut self, topology: &Topology, tau: S) {
        let at = self
            .dynamics
            .at(&self.state, &self.input_signals, tau, &self.modes.branches);
        topology.forces(&at, &mut self.first);
    }

    /// Initialises the friction modes from the state and the other forces there; `stopped` is at
    /// rest whatever rounding says.
    pub(super) fn initialise_frictions(
        &mut self,
        topology: &Topology,
        tau: S,
        stopped: Option<usize>,
    ) {
        if topology.coupled {
            return self.initialise_coupled(topology, tau, stopped);
        }
        for (index, friction) in topology.frictions.iter().enumerate() {
            let body = friction.body();
            let speed = self.state.v[body].value();
            if speed != 0.0 {
                self.modes.friction[index] = Mode::Slide(speed.signum());
                continue;
            }
            let values = &self.dynamics.values;
            let hold = friction.hold(values, &self.state, &self.first.load, &self.modes.branches);
            let mode = decide(self.first.force[body].value(), hold.map(S::value));
            if mode == Mode::Stick {
                // A body that is held rests whatever its parameters: not even its derivatives move.
                self.state.v[body] = S::ZERO;
            }
            self.modes.friction[index] = mode;
        }
    }

    /// As `initialise_frictions`, where what one path holds changes what another has to.
    fn initialise_coupled(&mut self, topology: &Topology, tau: S, stopped: Option<usize>) {
        let values = &self.dynamics.values;
        let mut resting = Vec::new();
        for (index, friction) in topology.frictions.iter().enumerate() {
            // What rested does until it is overcome, whatever rounding left of its velocity.
            let rested = !matches!(self.modes.friction[index], Mode::Slide(_));
            if rested
                || stopped == Some(index)
                || stiction_set::at_rest(friction, values, &self.state)
            {
                resting.push(index);
            }
        }
        if !resting.is_empty() {
            stiction_set::add_dependent(&self.plain.dynamics, topology, &mut resting);
        }
        for (index, friction) in topology.frictions.iter().enumerate() {
            if !resting.contains(&index) {
                let speed = friction.speed(values, &self.state).value();
                self.modes.friction[index] = Mode::Slide(speed.signum());
            }
        }
        if resting.is_empty() {
            return;
        }
        self.plain
            .take(&self.state, &self.input_signals, &self.first);
        let plain = &self.plain;
        let branches = &self.modes.branches;
        let at = (plain.dynamics).at(&plain.state, &plain.input_signals, tau.value(), branches);
        stiction_set::choose(
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
}

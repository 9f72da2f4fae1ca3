//! Forces of a plant at rest, as a function of the positions alone.

use super::SEEDS;
use crate::dual::Dual;
use crate::integrator::input_chain::InputChain;
use crate::plant::Plant;
use crate::plant::forces::{Forces, Point, State, not_below_zero};
use crate::plant::input_signal::InputSignal;
use crate::plant::topology::{Friction, Topology};
use crate::scalar::Scalar;

/// Edge of the interval of rests that a component with memory leaves; the direction is +1 or -1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Edge {
    /// A dry friction, about to give way to a force in the direction.
    Friction { index: usize, direction: f64 },
    /// The internal state of a hysteresis, of a plastic branch or of a friction that yields before
    /// it slips, at its largest after motion in one direction.
    Saturated { state: usize, value: f64 },
    /// The play of an actuator, at the end that the direction names.
    Play {
        line: usize,
        slot: usize,
        direction: f64,
    },
}

/// Forces of a plant at rest under constant inputs.
pub(super) struct Balance<'a, S> {
    topology: &'a Topology,
    values: Vec<S>,
    input_signals: Vec<InputSignal<S>>,
    edge: Option<Edge>,
    state: State<S>,
    branches: Vec<i8>,
    forces: Forces<S>,
    /// Evaluations so far.
    pub(super) evaluations: usize,
}

impl<'a, S: Scalar> Balance<'a, S> {
    pub(super) fn new(
        topology: &'a Topology,
        parameters: &[S],
        inputs: &[S],
        edge: Option<Edge>,
    ) -> Self {
        let mut values = topology.shapes.complete(parameters);
        for depending in &topology.depending {
            let signal = inputs[topology.acting + depending.signal];
            let change = values[depending.slope] * signal;
            values[depending.slot] += change;
        }
        let mut input_signals = settled(topology, &values, inputs);
        if let Some(Edge::Play {
            line,
            slot,
            direction,
        }) = edge
        {
            // The play passes its middle on where it has no width.
            let half = not_below_zero(values[slot]) * 0.5;
            let (mut without, mut shifted) = (values.clone(), inputs.to_vec());
            without[slot] = S::ZERO;
            shifted[topology.lines[line].input] += half * direction;
            input_signals[line] = settled(topology, &without, &shifted)[line];
        }
        Self {
            topology,
            values,
            input_signals,
            edge,
            state: State::rest(topology),
            branches: vec![1; topology.switches.len()],
            forces: Forces::new(topology),
            evaluations: 0,
        }
    }

    /// Puts the bodies at `q`, effects at rest and charges where the voltages have arrived.
    fn place(&mut self, q: &[S]) {
        let topology = self.topology;
        self.state.q[..q.len()].copy_from_slice(q);
        self.state.z.fill(S::ZERO);
        for hasel in &topology.hasels {
            let at = self.point();
            let voltage =
                (hasel.lines.iter()).fold(S::ZERO, |sum, &line| sum + topology.through(line, &at));
            let capacitance = hasel.pull(&self.values, &self.state.q, S::ZERO).capacitance;
            self.state.z[hasel.charge] = voltage * capacitance;
        }
        if let Some(Edge::Saturated { state, value }) = self.edge {
            self.state.z[state] = S::constant(value);
        }
        let at = Point {
            values: &self.values,
            state: &self.state,
            input_signals: &self.input_signals,
            tau: S::ZERO,
            motions: &[],
            branches: &[],
            smoothing: 0.0,
        };
        topology.initialise_branches(at, &mut self.branches, &mut self.forces);
    }

    fn point(&self) -> Point<'_, S> {
        Point {
            values: &self.values,
            state: &self.state,
            input_signals: &self.input_signals,
            tau: S::ZERO,
            motions: &[],
            branches: &self.branches,
            smoothing: 0.0,
        }
    }

    /// Force on every body at `q`, N or N m.
    pub(super) fn forces(&mut self, q: &[S]) -> Vec<S> {
        self.evaluations += 1;
        self.place(q);
        let mut forces = Forces::new(self.topology);
        self.topology.forces(&self.point(), &mut forces);
        if let Some(Edge::Friction { index, direction }) = self.edge {
            let friction = &self.topology.frictions[index];
            let [forward, backward] =
                friction.hold(&self.values, &self.state, &forces.load, &self.branches);
            let held = if direction > 0.0 { forward } else { -backward };
            for &(body, arm) in &friction.path {
                let along = Friction::arm(&self.values, arm) * held;
                forces.force[body] -= along;
            }
        }
        forces.force.truncate(q.len());
        forces.force
    }

    /// Hold of a friction at the last positions, forward and backward.
    pub(super) fn hold(&mut self, index: usize) -> [S; 2] {
        let mut forces = Forces::new(self.topology);
        self.topology.forces(&self.point(), &mut forces);
        self.topology.frictions[index].hold(&self.values, &self.state, &forces.load, &self.branches)
    }

    /// Values of the parameters, with what depends on signals.
    pub(super) fn values(&self) -> &[S] {
        &self.values
    }

    /// Branch of every law with branches, at the last positions.
    pub(super) fn branches(&self) -> &[i8] {
        &self.branches
    }

    /// State and signals of the rest at `q`.
    pub(super) fn read(&mut self, q: &[S]) -> (Vec<S>, Vec<S>) {
        self.place(q);
        let topology = self.topology;
        for &sensor in &topology.lagging {
            let reading = topology.reading(sensor, &self.point());
            if let Some((_, state)) = topology.sensors[sensor].lag {
                self.state.z[state] = reading;
            }
        }
        let mut signals = Vec::with_capacity(topology.sensors.len());
        topology.signals(&self.point(), &mut signals);
        let bodies = q.len();
        let state = &self.state;
        let state = [&state.q[..bodies], &state.v[..bodies], &state.z].concat();
        (state, signals)
    }

    /// Names of the tendons that are slack and of the bodies that press a stop.
    pub(super) fn branch_names(&self, plant: &Plant) -> (Vec<String>, Vec<String>) {
        let topology = self.topology;
        let slack = topology
            .tendons
            .iter()
            .filter(|tendon| (tendon.unilateral).is_some_and(|switch| self.branches[switch] == 0));
        let pressed = (topology.stops.iter()).filter(|stop| self.branches[stop.switch] == 1);
        (
            slack.map(|tendon| plant.owner(tendon.stiffness)).collect(),
            pressed.map(|stop| plant.owner(stop.slot)).collect(),
        )
    }
}

impl Balance<'_, Dual<SEEDS>> {
    /// Stiffness at `q`: minus the derivatives of the forces by the positions, row by row.
    pub(super) fn stiffness(&mut self, q: &[f64]) -> Vec<f64> {
        let n = q.len();
        let mut stiffness = vec![0.0; n * n];
        for first in (0..n).step_by(SEEDS) {
            let seeded = q.iter().enumerate().map(|(body, &q)| {
                match body.checked_sub(first).filter(|&seed| seed < SEEDS) {
                    Some(seed) => Dual::variable(q, seed),
                    None => Dual::constant(q),
                }
            });
            let seeded: Vec<_> = seeded.collect();
            for (row, force) in self.forces(&seeded).iter().enumerate() {
                for (column, slope) in (first..n).zip(force.derivative) {
                    stiffness[row * n + column] = -slope;
                }
            }
        }
        for row in 0..n {
            for column in 0..row {
                let mean = 0.5 * (stiffness[row * n + column] + stiffness[column * n + row]);
                stiffness[row * n + column] = mean;
                stiffness[column * n + row] = mean;
            }
        }
        stiffness
    }
}

/// Inputs of the actuators once delays and lags have passed; a play comes from zero.
fn settled<S: Scalar>(topology: &Topology, values: &[S], inputs: &[S]) -> Vec<InputSignal<S>> {
    let mut chain = InputChain::new(topology);
    for (input, &value) in inputs.iter().enumerate() {
        chain.take(input, 0.0, value, S::ZERO);
    }
    chain.begin(topology, values, 0.0);
    let mut signals = vec![InputSignal::ZERO; topology.lines.len()];
    let _ = chain.next_piece(topology, values, 0.0, S::ZERO, 1.0, &mut signals);
    signals
}

/// Largest Bouc-Wen state: where `z' = 0` in steady motion (eq. 15a); infinite without hardening.
pub(super) fn saturation<S: Scalar>(p: &[S]) -> f64 {
    let hardening = p[1].value() + p[2].value();
    if hardening > 0.0 {
        crate::math::exp(-crate::math::ln(hardening) / p[3].value())
    } else {
        f64::INFINITY
    }
}

impl Plant {
    /// Name of a parameter without its last word: its component, or the effect at one.
    pub(super) fn owner(&self, slot: usize) -> String {
        let name = &self.parameters()[slot].name;
        let end = name.rfind('.').unwrap_or(name.len());
        name[..end].to_owned()
    }
}

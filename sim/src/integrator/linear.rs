//! The rates of a linear rig's states, and an interval by their series (docs/explanation/plant.md,
//! eq. 18b and 18c).

use super::dynamics::Dynamics;
use super::modes::Modes;
use crate::plant::forces::{Forces, State};
use crate::plant::input_signal::{InputSignal, Shape};
use crate::plant::topology::Topology;
use crate::scalar::Scalar;

/// Norm up to which the series is summed at once: beyond, its terms grow before they fall, and
/// cancel.
const REACH: f64 = 2.0;
/// The first term that is left out, beside one. Its derivative is some twenty times larger: below
/// rounding still.
const LEFT_OUT: f64 = 1e-19;

/// `x' = A x + b + sum lines u`: positions, then velocities, then what effects remember.
#[derive(Clone, Debug)]
pub(super) struct Linear<S> {
    /// A, row by row.
    pub(super) matrix: Vec<S>,
    /// b: at rest and without inputs.
    pub(super) zero: Vec<S>,
    pub(super) lines: Vec<Vec<S>>,
    /// Largest row sum of A in balanced units, 1/s.
    pub(super) norm: f64,
    bodies: usize,
    rate: f64,
}

impl<S: Scalar> Linear<S> {
    /// Asked of the plant itself, one unit of each state and line at a time; `rate` is the rig's
    /// fastest, 1/s.
    pub(super) fn of(topology: &Topology, dynamics: &Dynamics<S>, lines: usize, rate: f64) -> Self {
        let asked = Asked { topology, dynamics };
        let bodies = topology.bodies.len();
        let rest = State::rest(topology);
        let still = vec![InputSignal::ZERO; lines];
        let zero = asked.rates(&rest, &still);
        let n = zero.len();
        let beyond = |rates: Vec<S>| -> Vec<S> {
            let pairs = rates.into_iter().zip(&zero);
            pairs.map(|(with, &without)| with - without).collect()
        };
        let one = S::constant(1.0);
        let mut matrix = vec![S::ZERO; n * n];
        for column in 0..n {
            let mut state = rest.clone();
            match column {
                q if q < bodies => state.q[q] = one,
                v if v < 2 * bodies => state.v[v - bodies] = one,
                z => state.z[z - 2 * bodies] = one,
            }
            for (row, slope) in (beyond(asked.rates(&state, &still)).into_iter()).enumerate() {
                matrix[row * n + column] = slope;
            }
        }
        let by_line = |line: usize| {
            let mut input_signals = still.clone();
            input_signals[line].c[0] = one;
            beyond(asked.rates(&rest, &input_signals))
        };
        let lines = (0..lines).map(by_line).collect();
        Self::asked(matrix, zero, lines, (bodies, rate))
    }

    /// From what the plant answered.
    pub(super) fn asked(
        matrix: Vec<S>,
        zero: Vec<S>,
        lines: Vec<Vec<S>>,
        (bodies, rate): (usize, f64),
    ) -> Self {
        let n = zero.len();
        let mut rates = Self {
            matrix,
            zero,
            lines,
            norm: 0.0,
            bodies,
            rate,
        };
        let size =
            |at: usize| rates.matrix[at].value().abs() * rates.unit(at % n) / rates.unit(at / n);
        rates.norm = (0..n)
            .map(|row| (row * n..(row + 1) * n).map(size).sum::<f64>())
            .fold(0.0, f64::max);
        rates
    }

    pub(super) fn states(&self) -> usize {
        self.zero.len()
    }

    /// Units in which a velocity is about as large as its position.
    pub(super) fn unit(&self, state: usize) -> f64 {
        if state < self.bodies || self.rate <= 0.0 {
            1.0
        } else {
            self.rate
        }
    }

    /// Into how many parts an interval is cut, a whole number or infinity, and how many terms of
    /// its series each takes.
    fn parts(&self, dt: f64) -> (f64, usize) {
        let parts = (self.norm * dt / REACH).ceil().max(1.0);
        let reach = self.norm * dt / parts;
        let (mut terms, mut term) = (2, 0.5 * reach * reach);
        while term > LEFT_OUT {
            terms += 1;
            term *= reach / terms as f64;
        }
        (parts, terms)
    }

    /// Multiplications that an interval takes, about.
    pub(super) fn work(&self, dt: f64) -> f64 {
        let (parts, terms) = self.parts(dt);
        parts * terms as f64 * (self.states() as f64).powi(2)
    }

    /// Takes a state over `dt` seconds by the series of its derivatives (eq. 18c). For what is less
    /// [`Linear::work`] than a matrix: that bounds the parts.
    pub(super) fn take(
        &self,
        input_signals: &[InputSignal<S>],
        dt: f64,
        state: &mut [S],
        [term, last]: &mut [Vec<S>; 2],
    ) {
        let (parts, terms) = self.parts(dt);
        let h = dt / parts;
        term.resize(state.len(), S::ZERO);
        last.resize(state.len(), S::ZERO);
        for part in 0..parts as usize {
            let tau = part as f64 * h;
            self.times(state, term);
            for (slope, &zero) in term.iter_mut().zip(&self.zero) {
                *slope += zero;
            }
            for (input_signal, line) in input_signals.iter().zip(&self.lines) {
                let input = input_signal.at(S::constant(tau));
                for (slope, &by) in term.iter_mut().zip(line) {
                    *slope += by * input;
                }
            }
            for k in 1..=terms {
                if k > 1 {
                    std::mem::swap(term, last);
                    self.times(last, term);
                }
                // What a straight input adds to the second derivative.
                let ramps = input_signals.iter().zip(&self.lines);
                for (input_signal, line) in
                    ramps.filter(|(input_signal, _)| k == 2 && input_signal.shape == Shape::Ramp)
                {
                    for (slope, &by) in term.iter_mut().zip(line) {
                        *slope += by * input_signal.c[1] * h;
                    }
                }
                for (x, term) in state.iter_mut().zip(term.iter_mut()) {
                    *term = *term * (h / k as f64);
                    *x += *term;
                }
            }
        }
    }

    fn times(&self, vector: &[S], product: &mut [S]) {
        for (sum, row) in product
            .iter_mut()
            .zip(self.matrix.chunks_exact(vector.len()))
        {
            *sum = S::ZERO;
            for (&slope, &x) in row.iter().zip(vector) {
                *sum += slope * x;
            }
        }
    }
}

/// The plant, asked for the rates of its states.
struct Asked<'a, S> {
    topology: &'a Topology,
    dynamics: &'a Dynamics<S>,
}

impl<S: Scalar> Asked<'_, S> {
    fn rates(&self, state: &State<S>, input_signals: &[InputSignal<S>]) -> Vec<S> {
        let modes = Modes {
            friction: Vec::new(),
            branches: Vec::new(),
        };
        let mut forces = Forces::new(self.topology);
        let at = self
            .dynamics
            .at(state, input_signals, S::ZERO, &modes.branches);
        self.topology.forces(&at, &mut forces);
        (self.dynamics).accelerate(self.topology, &at, &[], &mut forces, &mut []);
        let bodies = self.topology.bodies.len();
        [&state.v[..bodies], &forces.force[..bodies], &forces.rate].concat()
    }
}

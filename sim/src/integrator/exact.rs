//! A sample interval of a linear rig in one step, without error of its own (docs/plant.md, eq. 18b).
//!
//! Springs, dampers, constant forces, creep, hidden modes and tendons that may push make
//! `x' = A x + b + c tau` between two samples, whose solution is a matrix: found once, it carries the state
//! from one sample to the next at the price of a product.

use super::dynamics::{Dynamics, Modes};
use crate::plant::forces::{Forces, State};
use crate::plant::topology::Topology;
use crate::plant::wave::{Shape, Wave};
use crate::scalar::Scalar;

/// Most states; beyond, a product costs more than it saves.
pub(crate) const MOST_STATES: usize = 12;
/// Intervals this much alike, relatively, are one: timestamps in decimals differ by their rounding. What
/// they differ by is owed to the next.
const ALIKE: f64 = 1e-9;
/// Norm down to which a matrix is halved before its series is summed.
const SMALL: f64 = 0.5;
/// Terms of the series: 0.5^15 / 17! is below rounding.
const TERMS: usize = 15;

/// The step of one interval length.
#[derive(Clone, Debug)]
pub(super) struct Exact<S> {
    /// The interval that it is for, s; 0: none yet.
    length: f64,
    /// How much longer the intervals so far were than what was taken for them, s.
    owed: f64,
    /// None: to be found for `length`.
    step: Option<Step<S>>,
    next: Vec<S>,
}

/// `x <- transition x + constant + sum (held u + ramp u')`, the sum over lines.
#[derive(Clone, Debug)]
struct Step<S> {
    transition: Vec<S>,
    constant: Vec<S>,
    held: Vec<Vec<S>>,
    ramp: Vec<Vec<S>>,
}

impl<S: Scalar> Exact<S> {
    pub(super) fn new() -> Self {
        Self {
            length: 0.0,
            owed: 0.0,
            step: None,
            next: Vec::new(),
        }
    }

    /// The same for other numbers.
    pub(super) fn lifted<T: Scalar>(&self) -> Exact<T> {
        Exact {
            length: self.length,
            owed: self.owed,
            ..Exact::new()
        }
    }

    /// Takes `state` over `dt` seconds; `rate` is the rig's fastest, 1/s.
    pub(super) fn advance(
        &mut self,
        topology: &Topology,
        dynamics: &Dynamics<S>,
        waves: &[Wave<S>],
        state: &mut State<S>,
        (dt, rate): (f64, f64),
    ) {
        let wanted = dt + self.owed;
        if (wanted - self.length).abs() > ALIKE * self.length {
            self.length = wanted;
            self.step = None;
        }
        self.owed = wanted - self.length;
        let length = self.length;
        let step = self
            .step
            .get_or_insert_with(|| Step::of(topology, dynamics, waves, length, rate));
        let bodies = topology.bodies.len();
        let next = &mut self.next;
        next.clear();
        next.extend_from_slice(&step.constant);
        let lines = waves.iter().zip(step.held.iter().zip(&step.ramp));
        for (wave, (held, ramp)) in lines {
            for (x, &by) in next.iter_mut().zip(held) {
                *x += by * wave.c[0];
            }
            if wave.shape == Shape::Ramp {
                for (x, &by) in next.iter_mut().zip(ramp) {
                    *x += by * wave.c[1];
                }
            }
        }
        let rows = step.transition.chunks_exact(next.len());
        for (x, row) in next.iter_mut().zip(rows) {
            let (q, others) = row.split_at(bodies);
            let (v, z) = others.split_at(bodies);
            for (coefficients, states) in [(q, &state.q), (v, &state.v), (z, &state.z)] {
                for (&coefficient, &y) in coefficients.iter().zip(states) {
                    *x += coefficient * y;
                }
            }
        }
        let (q, others) = next.split_at(bodies);
        let (v, z) = others.split_at(bodies);
        state.q[..bodies].copy_from_slice(q);
        state.v[..bodies].copy_from_slice(v);
        state.z.copy_from_slice(z);
    }
}

impl<S: Scalar> Step<S> {
    fn of(
        topology: &Topology,
        dynamics: &Dynamics<S>,
        waves: &[Wave<S>],
        dt: f64,
        rate: f64,
    ) -> Self {
        let slopes = Slopes::new(topology, dynamics, waves.len());
        let n = slopes.zero.len();
        let bodies = topology.bodies.len();
        // In units in which a velocity is about as large as its position.
        let unit = |state: usize| {
            if state < bodies || rate <= 0.0 {
                1.0
            } else {
                rate
            }
        };
        let mut matrix = vec![S::ZERO; n * n];
        for column in 0..n {
            for (row, slope) in slopes.by_state(column).into_iter().enumerate() {
                matrix[row * n + column] = slope * (dt * unit(column) / unit(row));
            }
        }
        let [whole, first, second] = phi(&matrix, n);
        let through = |matrix: &[S], vector: &[S], time: f64| -> Vec<S> {
            let row = |row: usize| {
                let mut sum = S::ZERO;
                for (column, &x) in vector.iter().enumerate() {
                    sum += matrix[row * n + column] * x * (unit(row) / unit(column) * time);
                }
                sum
            };
            (0..n).map(row).collect()
        };
        let inputs: Vec<Vec<S>> = (0..waves.len()).map(|line| slopes.by_line(line)).collect();
        let of_all = |matrix: &[S], time: f64| -> Vec<Vec<S>> {
            let through = |input: &Vec<S>| through(matrix, input, time);
            inputs.iter().map(through).collect()
        };
        Self {
            transition: (0..n * n)
                .map(|at| whole[at] * (unit(at / n) / unit(at % n)))
                .collect(),
            constant: through(&first, &slopes.zero, dt),
            held: of_all(&first, dt),
            ramp: of_all(&second, dt * dt),
        }
    }
}

/// The rates of the states, asked for one unit at a time.
struct Slopes<'a, S> {
    topology: &'a Topology,
    dynamics: &'a Dynamics<S>,
    lines: usize,
    /// At rest and without inputs.
    zero: Vec<S>,
}

impl<'a, S: Scalar> Slopes<'a, S> {
    fn new(topology: &'a Topology, dynamics: &'a Dynamics<S>, lines: usize) -> Self {
        let mut slopes = Self {
            topology,
            dynamics,
            lines,
            zero: Vec::new(),
        };
        slopes.zero = slopes.rates(&State::rest(topology), &vec![Wave::ZERO; lines]);
        slopes
    }

    fn rates(&self, state: &State<S>, waves: &[Wave<S>]) -> Vec<S> {
        let modes = Modes {
            friction: Vec::new(),
            branches: Vec::new(),
        };
        let mut forces = Forces::new(self.topology);
        let at = self.dynamics.at(state, waves, S::ZERO, &modes.branches);
        self.topology.forces(&at, &mut forces);
        (self.dynamics).accelerate(self.topology, &at, &[], &mut forces, &mut []);
        let bodies = self.topology.bodies.len();
        [&state.v[..bodies], &forces.force[..bodies], &forces.rate].concat()
    }

    fn beyond(&self, rates: Vec<S>) -> Vec<S> {
        let pairs = rates.into_iter().zip(&self.zero);
        pairs.map(|(with, &without)| with - without).collect()
    }

    fn by_state(&self, index: usize) -> Vec<S> {
        let mut state = State::rest(self.topology);
        let bodies = self.topology.bodies.len();
        let one = S::constant(1.0);
        match index {
            q if q < bodies => state.q[q] = one,
            v if v < 2 * bodies => state.v[v - bodies] = one,
            z => state.z[z - 2 * bodies] = one,
        }
        self.beyond(self.rates(&state, &vec![Wave::ZERO; self.lines]))
    }

    fn by_line(&self, line: usize) -> Vec<S> {
        let mut waves = vec![Wave::ZERO; self.lines];
        waves[line].c[0] = S::constant(1.0);
        self.beyond(self.rates(&State::rest(self.topology), &waves))
    }
}

/// `phi_0 = e^A`, `phi_1 = (e^A - 1) / A`, `phi_2 = (phi_1 - 1) / A` of an n by n matrix: the series of
/// phi_2 for a matrix halved until it is small, then doubled as often (Higham 2008, section 10.7).
fn phi<S: Scalar>(matrix: &[S], n: usize) -> [Vec<S>; 3] {
    let norm = (matrix.chunks_exact(n))
        .map(|row| row.iter().map(|x| x.value().abs()).sum::<f64>())
        .fold(0.0, f64::max);
    let mut halvings = 0;
    while norm * 0.5f64.powi(halvings) > SMALL && halvings < 64 {
        halvings += 1;
    }
    let scale = 0.5f64.powi(halvings);
    let small: Vec<S> = matrix.iter().map(|&x| x * scale).collect();
    let plus_one = |mut matrix: Vec<S>, one: f64| {
        for k in 0..n {
            matrix[k * n + k] += S::constant(one);
        }
        matrix
    };
    let mut factor = (1..=TERMS + 2).fold(1.0, |product, k| product / k as f64);
    let mut second = plus_one(vec![S::ZERO; n * n], factor);
    for k in (0..TERMS).rev() {
        factor *= (k + 3) as f64;
        second = plus_one(product(&small, &second, n), factor);
    }
    let mut first = plus_one(product(&small, &second, n), 1.0);
    let mut whole = plus_one(product(&small, &first, n), 1.0);
    for _ in 0..halvings {
        // phi_2(2 A) = (phi_1^2 + 2 phi_2) / 4, phi_1(2 A) = (phi_0 phi_1 + phi_1) / 2, phi_0(2 A) = phi_0^2.
        let squared = product(&first, &first, n);
        let mean = |a: Vec<S>, b: &[S], half: f64| -> Vec<S> {
            let pairs = a.into_iter().zip(b);
            pairs.map(|(a, &b)| a * half + b * 0.5).collect()
        };
        second = mean(squared, &second, 0.25);
        first = mean(product(&whole, &first, n), &first, 0.5);
        whole = product(&whole, &whole, n);
    }
    [whole, first, second]
}

fn product<S: Scalar>(a: &[S], b: &[S], n: usize) -> Vec<S> {
    let mut c = vec![S::ZERO; n * n];
    for (row, c) in a.chunks_exact(n).zip(c.chunks_exact_mut(n)) {
        for (&a, b) in row.iter().zip(b.chunks_exact(n)) {
            for (c, &b) in c.iter_mut().zip(b) {
                *c += a * b;
            }
        }
    }
    c
}

#[cfg(test)]
mod tests {
    use super::phi;

    /// An oscillator's closed form, and a matrix that cannot be inverted.
    #[test]
    fn exponential_and_its_integrals_are_those_of_the_closed_forms() {
        for angle in [1e-3f64, 0.4, 3.0, 40.0] {
            let [whole, first, second] = phi(&[0.0, angle, -angle, 0.0], 2);
            let (sin, cos) = angle.sin_cos();
            let near = |ours: f64, exact: f64| (ours - exact).abs() < 1e-13 * (1.0 + angle);
            assert!(near(whole[0], cos) && near(whole[1], sin) && near(whole[2], -sin));
            assert!(near(first[0], sin / angle) && near(first[1], (1.0 - cos) / angle));
            let exact = (1.0 - cos) / (angle * angle);
            assert!(near(
                second[0],
                if angle < 0.01 {
                    0.5 - angle * angle / 24.0
                } else {
                    exact
                }
            ));
            assert!(near(second[1], (angle - sin) / (angle * angle)) || angle < 0.01);
        }
        let [whole, first, second] = phi(&[0.0, 2.0, 0.0, 0.0], 2);
        assert_eq!(whole, [1.0, 2.0, 0.0, 1.0]);
        assert_eq!(first, [1.0, 1.0, 0.0, 1.0]);
        assert!((second[1] - 1.0 / 3.0).abs() < 1e-15);
    }
}

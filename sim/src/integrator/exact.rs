//! A sample interval of a linear rig in one step, without error of its own
//! (docs/explanation/plant.md, eq. 18b).
//!
//! Springs, dampers, constant forces, creep, hidden modes and tendons that may push make
//! `x' = A x + b + c tau` between two samples, whose solution is a matrix: found once, it carries
//! the state from one sample to the next at the price of a product. Where no interval is like the
//! one before, a series does.

use std::sync::{Arc, OnceLock};

use super::dynamics::Dynamics;
use super::linear::Linear;
use crate::plant::forces::State;
use crate::plant::input_signal::{InputSignal, Shape};
use crate::plant::topology::Topology;
use crate::scalar::Scalar;

/// Intervals this much alike, relatively, are one: timestamps in decimals differ by their rounding.
/// The difference is owed to the next.
const ALIKE: f64 = 1e-9;
/// Norm down to which a matrix is halved before its series is summed.
const SMALL: f64 = 0.5;
/// Terms of the series: 0.5^15 / 17! is below rounding.
const TERMS: usize = 15;

/// A linear rig between two samples.
#[derive(Clone, Debug)]
pub(super) struct Exact<S> {
    /// The interval before, s; 0: none yet.
    length: f64,
    /// Excess of the intervals so far over the lengths that were taken for them, s.
    owed: f64,
    rates: Option<Linear<S>>,
    /// None: to be found for `length`.
    step: Option<Step<S>>,
    /// Cache shared with other simulations of the same parameter values.
    kept: Option<Arc<TransitionCache<S>>>,
    /// The state, and room for what becomes of it.
    next: Vec<S>,
    room: [Vec<S>; 2],
}

/// Cache of one set of parameter values: the rates, and the transition over one interval length,
/// which costs about a hundred steps. The first simulation that needs an entry computes it.
#[derive(Debug)]
pub struct TransitionCache<S> {
    length: f64,
    rates: OnceLock<Linear<S>>,
    step: OnceLock<Step<S>>,
}

impl<S> TransitionCache<S> {
    /// For intervals of so many seconds; those of another length share no step.
    pub(crate) fn new(length: f64) -> Self {
        Self {
            length,
            rates: OnceLock::new(),
            step: OnceLock::new(),
        }
    }
}

fn alike(wanted: f64, length: f64) -> bool {
    (wanted - length).abs() <= ALIKE * length
}

impl<S: Scalar> Exact<S> {
    pub(super) fn new() -> Self {
        Self {
            length: 0.0,
            owed: 0.0,
            rates: None,
            step: None,
            kept: None,
            next: Vec::new(),
            room: [Vec::new(), Vec::new()],
        }
    }

    /// Takes from there what is known of its numbers.
    pub(super) fn share(&mut self, kept: Arc<TransitionCache<S>>) {
        self.kept = Some(kept);
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
        input_signals: &[InputSignal<S>],
        state: &mut State<S>,
        (dt, rate): (f64, f64),
    ) {
        let find = || Linear::of(topology, dynamics, input_signals.len(), rate);
        let rates = match &self.kept {
            Some(kept) => kept.rates.get_or_init(find),
            None => self.rates.get_or_insert_with(find),
        };
        let wanted = dt + self.owed;
        let kept = (self.kept.as_ref()).filter(|kept| alike(wanted, kept.length));
        let again = alike(wanted, self.length);
        if let Some(kept) = kept {
            (self.length, self.step) = (kept.length, None);
        } else if !again {
            (self.length, self.step) = (wanted, None);
        }
        self.owed = wanted - self.length;
        let length = self.length;
        let find = || Step::of(rates, length);
        // Infinite rates are less than nothing: the matrix is found in as many steps as ever, and
        // the state diverges.
        let less = || rates.work(length) < Step::<S>::work(rates, length);
        let step = match kept {
            Some(kept) => Some(kept.step.get_or_init(find)),
            None if again || !less() => Some(&*self.step.get_or_insert_with(find)),
            None => None,
        };
        let next = &mut self.next;
        next.clear();
        let bodies = topology.bodies.len();
        for part in [&state.q[..bodies], &state.v[..bodies], &state.z] {
            next.extend_from_slice(part);
        }
        match step {
            Some(step) => step.take(input_signals, next, &mut self.room[0]),
            None => rates.take(input_signals, length, next, &mut self.room),
        }
        let (q, others) = next.split_at(bodies);
        let (v, z) = others.split_at(bodies);
        state.q[..bodies].copy_from_slice(q);
        state.v[..bodies].copy_from_slice(v);
        state.z.copy_from_slice(z);
    }
}

/// `x <- transition x + constant + sum (held u + ramp u')`, the sum over lines.
#[derive(Clone, Debug)]
struct Step<S> {
    transition: Vec<S>,
    constant: Vec<S>,
    held: Vec<Vec<S>>,
    ramp: Vec<Vec<S>>,
}

impl<S: Scalar> Step<S> {
    fn of(rates: &Linear<S>, dt: f64) -> Self {
        let n = rates.states();
        let unit = |state: usize| rates.unit(state);
        let matrix: Vec<S> = (rates.matrix.iter().enumerate())
            .map(|(at, &slope)| slope * (dt * unit(at % n) / unit(at / n)))
            .collect();
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
        let of_all = |matrix: &[S], time: f64| -> Vec<Vec<S>> {
            let through = |input: &Vec<S>| through(matrix, input, time);
            rates.lines.iter().map(through).collect()
        };
        Self {
            transition: (0..n * n)
                .map(|at| whole[at] * (unit(at / n) / unit(at % n)))
                .collect(),
            constant: through(&first, &rates.zero, dt),
            held: of_all(&first, dt),
            ramp: of_all(&second, dt * dt),
        }
    }

    /// Multiplications that finding it takes, about.
    fn work(rates: &Linear<S>, dt: f64) -> f64 {
        let doublings = (rates.norm * dt / SMALL).log2().ceil().max(0.0);
        (TERMS as f64 + 2.0 + 3.0 * doublings) * (rates.states() as f64).powi(3)
    }

    fn take(&self, input_signals: &[InputSignal<S>], state: &mut [S], next: &mut Vec<S>) {
        next.clone_from(&self.constant);
        let lines = input_signals.iter().zip(self.held.iter().zip(&self.ramp));
        for (input_signal, (held, ramp)) in lines {
            for (x, &by) in next.iter_mut().zip(held) {
                *x += by * input_signal.c[0];
            }
            if input_signal.shape == Shape::Ramp {
                for (x, &by) in next.iter_mut().zip(ramp) {
                    *x += by * input_signal.c[1];
                }
            }
        }
        let rows = self.transition.chunks_exact(next.len());
        for (x, row) in next.iter_mut().zip(rows) {
            for (&coefficient, &y) in row.iter().zip(&*state) {
                *x += coefficient * y;
            }
        }
        state.copy_from_slice(next);
    }
}

/// `phi_0 = e^A`, `phi_1 = (e^A - 1) / A`, `phi_2 = (phi_1 - 1) / A` of an n by n matrix: the
/// series of phi_2 for a matrix halved until it is small, then doubled as often (Higham 2008,
/// section 10.7).
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
        // phi_2(2 A) = (phi_1^2 + 2 phi_2) / 4, phi_1(2 A) = (phi_0 phi_1 + phi_1) / 2, phi_0(2 A)
        // = phi_0^2.
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
    use super::{Step, phi};
    use crate::dual::Dual;
    use crate::integrator::linear::Linear;
    use crate::plant::input_signal::{InputSignal, Shape};
    use crate::scalar::Scalar;

    /// Slow, as fast as samples, and stiff; with a straight input, and derivatives in the
    /// stiffness.
    #[test]
    fn a_series_takes_a_state_where_the_matrix_does() {
        let one = Dual::<1>::constant;
        for stiffness in [1e-4_f64, 1.0, 90.0, 2e4] {
            let mut k = one(stiffness);
            k.derivative = [1.0];
            let matrix = vec![one(0.0), one(1.0), -k, one(-0.3)];
            let zero = vec![one(0.0), one(0.7)];
            let lines = vec![vec![one(0.0), one(2.0)]];
            let rates = Linear::asked(matrix, zero, lines, (1, stiffness.sqrt()));
            let input_signal = InputSignal {
                shape: Shape::Ramp,
                c: [one(0.5), one(-1.5), one(0.0)],
                ..InputSignal::ZERO
            };
            let dt = 0.4;
            let start = [one(0.2), one(-0.1)];
            let (mut by_series, mut by_matrix) = (start, start);
            rates.take(&[input_signal], dt, &mut by_series, &mut Default::default());
            Step::of(&rates, dt).take(&[input_signal], &mut by_matrix, &mut Vec::new());
            for (series, matrix) in by_series.iter().zip(&by_matrix) {
                let near = |a: f64, b: f64| (a - b).abs() < 1e-12 * (1.0 + b.abs());
                assert!(near(series.value, matrix.value), "{series:?} {matrix:?}");
                assert!(
                    near(series.derivative[0], matrix.derivative[0]),
                    "{series:?} {matrix:?}"
                );
            }
        }
    }

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

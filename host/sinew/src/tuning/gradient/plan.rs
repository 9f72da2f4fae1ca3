//! Blocks of the plan, its limits, and the set of those that are active: those of the firmware
//! (docs/explanation/controller.md, sections 2 and 4) in any scalar.

use sinew_mpc::constraints::{Constraint, Side};
use sinew_sim::Scalar;

/// Horizon and blocks of moves.
pub struct Blocks {
    /// N1, from 1.
    pub first: usize,
    /// Steps in each block.
    pub length: Vec<usize>,
    /// Per step of the horizon: its block, and how much of the block's move is made.
    pub places: Vec<(usize, f64)>,
}

impl Blocks {
    /// `horizon` steps, the moves of which are made in blocks of these lengths.
    pub fn new(first: usize, length: Vec<usize>, horizon: usize) -> Self {
        let moving = length.iter().enumerate().flat_map(|(block, length)| {
            (1..=*length).map(move |done| (block, done as f64 / *length as f64))
        });
        let held = std::iter::repeat((length.len().saturating_sub(1), 1.0));
        let places = moving.chain(held).take(horizon).collect();
        Self {
            first,
            length,
            places,
        }
    }

    /// The command at a place of a plan whose first neighbour is `previous`.
    pub fn command<S: Scalar>(&self, j: usize, plan: &[S], previous: &[S]) -> Vec<S> {
        let (block, weight) = self.places[j];
        let inputs = previous.len();
        let before = match block {
            0 => previous,
            block => &plan[(block - 1) * inputs..],
        };
        let ends = plan[block * inputs..].iter().zip(before).take(inputs);
        ends.map(|(end, before)| *end - (*end - *before) * (1.0 - weight))
            .collect()
    }

    /// The plan one step later, held at its end.
    pub fn shift<S: Scalar>(&self, plan: &mut [S], inputs: usize) {
        for block in 0..self.length.len().saturating_sub(1) {
            let share = 1.0 / self.length[block + 1] as f64;
            for v in block * inputs..(block + 1) * inputs {
                let next = plan[v + inputs];
                plan[v] = next - (next - plan[v]) * (1.0 - share);
            }
        }
    }
}

/// Limits in model units.
pub struct Bounds<S> {
    /// Smallest command of each input.
    pub lower: Vec<f64>,
    /// Largest command of each input.
    pub upper: Vec<f64>,
    /// Largest change over the block that ends at each decision variable.
    pub rate: Vec<f64>,
    /// The command applied last.
    pub previous: Vec<S>,
}

/// The nearest value between two others.
pub fn clamp<S: Scalar>(value: S, low: S, high: S) -> S {
    if value.value() < low.value() {
        low
    } else if value.value() > high.value() {
        high
    } else {
        value
    }
}

impl<S: Scalar> Bounds<S> {
    /// The command before `u[v]` in its channel.
    fn before(&self, u: &[S], v: usize) -> S {
        let inputs = self.previous.len();
        if v < inputs {
            self.previous[v]
        } else {
            u[v - inputs]
        }
    }

    /// Moves a plan into the limits, first command first.
    pub fn project(&self, u: &mut [S]) {
        let inputs = self.previous.len();
        for v in 0..u.len() {
            let before = self.before(u, v);
            let (lower, upper) = (self.lower[v % inputs], self.upper[v % inputs]);
            let boxed = clamp(u[v], S::constant(lower), S::constant(upper));
            u[v] = clamp(boxed, before - self.rate[v], before + self.rate[v]);
        }
    }
}

/// The active set: per variable its box, and the edge to the command before it.
#[derive(Clone, Debug, PartialEq)]
pub struct Active {
    /// The side of the box.
    pub bound: Vec<Side>,
    /// The side of the rate.
    pub edge: Vec<Side>,
}

/// The first limit that a move runs into.
pub struct Hit<S> {
    /// The limit.
    pub place: Constraint,
    /// Its side.
    pub side: Side,
    /// Fraction of the move.
    pub fraction: S,
}

/// A few roundings of the firmware's sums.
const TIGHT: f64 = 1e-6;

impl Active {
    /// Nothing is active.
    pub fn none(variables: usize) -> Self {
        Self {
            bound: vec![Side::Free; variables],
            edge: vec![Side::Free; variables],
        }
    }

    /// Nothing is active.
    pub fn is_empty(&self) -> bool {
        let mut sides = self.bound.iter().chain(&self.edge);
        sides.all(|side| *side == Side::Free)
    }

    /// Sets the side of one limit.
    pub fn set(&mut self, place: Constraint, side: Side) {
        match place {
            Constraint::Bound(v) => self.bound[v] = side,
            Constraint::Edge(v) => self.edge[v] = side,
        }
    }

    /// One step later.
    pub fn shift(&mut self, length: &[usize], inputs: usize) {
        let variables = self.bound.len();
        let long = |block: usize| length.get(block).is_some_and(|l| *l > 1);
        for v in 0..variables {
            let block = v / inputs;
            let (bound, edge) = match v + inputs {
                next if next < variables => (self.bound[next], self.edge[next]),
                _ => (self.bound[v], Side::Free),
            };
            let kept = |same: bool, side| if same { side } else { Side::Free };
            self.bound[v] = kept(!long(block + 1) || self.bound[v] == bound, bound);
            self.edge[v] = kept(!long(block) || self.edge[v] == edge, edge);
        }
    }

    /// Drops what is not tight at `u`, and what would make the set linearly dependent.
    pub fn keep_tight<S: Scalar>(&mut self, bounds: &Bounds<S>, u: &[S]) {
        if self.is_empty() {
            return;
        }
        let inputs = bounds.previous.len();
        let (mut anchored, mut tied) = (vec![false; inputs], vec![true; inputs]);
        for v in 0..u.len() {
            let c = v % inputs;
            let boxed = match self.bound[v] {
                Side::Free => false,
                Side::Lower => u[v].value() - bounds.lower[c] <= TIGHT,
                Side::Upper => bounds.upper[c] - u[v].value() <= TIGHT,
            };
            let change = (u[v] - bounds.before(u, v)).value();
            let joined = match self.edge[v] {
                Side::Free => false,
                Side::Lower => change + bounds.rate[v] <= TIGHT,
                Side::Upper => bounds.rate[v] - change <= TIGHT,
            };
            if !joined {
                self.edge[v] = Side::Free;
            }
            tied[c] &= joined;
            anchored[c] &= joined;
            if !boxed || anchored[c] || tied[c] {
                self.bound[v] = Side::Free;
            }
            anchored[c] |= boxed;
        }
    }

    /// The first limit that a move from `u` by `p` runs into.
    pub fn ratio_test<S: Scalar>(&self, bounds: &Bounds<S>, u: &[S], p: &[S]) -> Option<Hit<S>> {
        let inputs = bounds.previous.len();
        let mut hit: Option<Hit<S>> = None;
        let mut consider = |place, below: S, above: S, by: S| {
            let (side, room, length) = if by.value() > above.value() {
                (Side::Upper, above, by)
            } else if -by.value() > below.value() {
                (Side::Lower, below, -by)
            } else {
                return;
            };
            let fraction = if room.value() > 0.0 {
                room / length
            } else {
                S::ZERO
            };
            let nearer = |hit: &Hit<S>| fraction.value() < hit.fraction.value();
            if hit.as_ref().is_none_or(nearer) {
                hit = Some(Hit {
                    place,
                    side,
                    fraction,
                });
            }
        };
        for v in 0..u.len() {
            let c = v % inputs;
            let before = if v < inputs { S::ZERO } else { p[v - inputs] };
            if self.bound[v] == Side::Free && p[v].value() != 0.0 {
                let (below, above) = (u[v] - bounds.lower[c], -u[v] + bounds.upper[c]);
                consider(Constraint::Bound(v), below, above, p[v]);
            }
            if self.edge[v] == Side::Free && p[v].value() != before.value() {
                let change = u[v] - bounds.before(u, v);
                let (below, above) = (change + bounds.rate[v], -change + bounds.rate[v]);
                consider(Constraint::Edge(v), below, above, p[v] - before);
            }
        }
        hit
    }
}

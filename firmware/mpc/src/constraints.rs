//! Limits of a plan. Per channel they form a chain: a box on the command at the end of every block
//! and an edge, the rate over the block, between neighbours; edge 0 ties the first one to the
//! command applied last (docs/explanation/controller.md, section 4). What holds at the ends of the
//! blocks holds between them.
#![allow(
    clippy::needless_range_loop,
    reason = "one index runs through several arrays and their neighbours, as in the equations"
)]

use crate::math::clamp;

/// Limits in model units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds<const NU: usize, const NV: usize> {
    /// Smallest command.
    pub lower: [f32; NU],
    /// Largest command.
    pub upper: [f32; NU],
    /// Largest change over the block that ends at each decision variable.
    pub rate: [f32; NV],
    /// u(k-1), the command applied last.
    pub previous: [f32; NU],
}

impl<const NU: usize, const NV: usize> Bounds<NU, NV> {
    /// The command before `u[v]` in its channel.
    #[inline(always)]
    fn before(&self, u: &[f32; NV], v: usize) -> f32 {
        if v < NU { self.previous[v] } else { u[v - NU] }
    }

    /// Moves `u` into the limits, first command first: each is held to its box, then to the rate
    /// around its (already moved) neighbour. A plan that is inside stays as it is.
    pub fn project(&self, u: &mut [f32; NV]) {
        let mut before = self.previous;
        for (ends, rates) in u.chunks_exact_mut(NU).zip(self.rate.chunks_exact(NU)) {
            for (c, ((u, rate), before)) in ends.iter_mut().zip(rates).zip(&mut before).enumerate()
            {
                let boxed = clamp(*u, self.lower[c], self.upper[c]);
                *u = clamp(boxed, *before - rate, *before + rate);
                *before = *u;
            }
        }
    }
}

/// Side of a limit that holds with equality.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Side {
    /// Not active.
    Free,
    /// At the smallest value.
    Lower,
    /// At the largest value.
    Upper,
}

/// The active set: per variable its box, and the edge to the command before it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ActiveSet<const NV: usize> {
    /// `lower <= u_i` or `u_i <= upper`.
    pub bound: [Side; NV],
    /// `-rate <= u_i - u_{i-1}` or `u_i - u_{i-1} <= rate`.
    pub edge: [Side; NV],
}

/// A limit by its place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Constraint {
    /// The box of a variable.
    Bound(usize),
    /// The edge from a variable to the one before it.
    Edge(usize),
}

impl<const NV: usize> ActiveSet<NV> {
    /// Nothing active.
    pub const fn new() -> Self {
        Self {
            bound: [Side::Free; NV],
            edge: [Side::Free; NV],
        }
    }

    /// No limit is active.
    pub fn is_empty(&self) -> bool {
        let free = |side: &Side| *side == Side::Free;
        self.bound.iter().all(free) && self.edge.iter().all(free)
    }

    /// One step later: block b then starts a step into itself and ends a step into the next. Its
    /// end is tight where both ends were (one suffices where the next block is one step long), its
    /// edge where both blocks moved alike. After the last block nothing moves.
    pub fn shift<const NU: usize, const NB: usize>(&mut self, length: &[u8; NB]) {
        for v in 0..NV {
            let long = |block: usize| length.get(block).is_some_and(|l| *l > 1);
            let block = v / NU;
            let (bound, edge) = match (self.bound.get(v + NU), self.edge.get(v + NU)) {
                (Some(bound), Some(edge)) => (*bound, *edge),
                _ => (self.bound[v], Side::Free),
            };
            if !long(block + 1) || self.bound[v] == bound {
                self.bound[v] = bound;
            } else {
                self.bound[v] = Side::Free;
            }
            if !long(block) || self.edge[v] == edge {
                self.edge[v] = edge;
            } else {
                self.edge[v] = Side::Free;
            }
        }
    }

    /// Sets the side of one limit.
    pub fn set(&mut self, place: Constraint, side: Side) {
        let slot = match place {
            Constraint::Bound(v) => self.bound.get_mut(v),
            Constraint::Edge(v) => self.edge.get_mut(v),
        };
        if let Some(slot) = slot {
            *slot = side;
        }
    }

    /// Drops what is not tight at `u`, and what would make the set linearly dependent: a group of
    /// commands joined by active edges keeps one anchor (a box, or the edge to the last command).
    pub fn keep_tight<const NU: usize>(&mut self, bounds: &Bounds<NU, NV>, u: &[f32; NV]) {
        // A few roundings of the sums that put `u` there.
        const TIGHT: f32 = 1e-6;
        if self.is_empty() {
            return;
        }
        let mut anchored = [false; NU];
        // Edge 0 anchors its group; a box further along that group is then one anchor too many.
        let mut tied = [true; NU];
        for v in 0..NV {
            let c = v % NU;
            let slack = match self.bound[v] {
                Side::Free => f32::INFINITY,
                Side::Lower => u[v] - bounds.lower[c],
                Side::Upper => bounds.upper[c] - u[v],
            };
            let boxed = slack <= TIGHT;
            let change = u[v] - bounds.before(u, v);
            let slack = match self.edge[v] {
                Side::Free => f32::INFINITY,
                Side::Lower => change + bounds.rate[v],
                Side::Upper => bounds.rate[v] - change,
            };
            let joined = slack <= TIGHT;
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

    /// The first limit that a move from `u` by `p` runs into, and the fraction of `p` up to there.
    pub fn ratio_test<const NU: usize>(
        &self,
        bounds: &Bounds<NU, NV>,
        u: &[f32; NV],
        p: &[f32; NV],
    ) -> Option<BlockingConstraint> {
        let mut hit: Option<BlockingConstraint> = None;
        let mut consider = |place, room_below: f32, room_above: f32, move_by: f32| {
            let (side, room, length) = if move_by > room_above {
                (Side::Upper, room_above, move_by)
            } else if -move_by > room_below {
                (Side::Lower, room_below, -move_by)
            } else {
                return;
            };
            // `room` may be a rounding below zero.
            let fraction = if room > 0.0 { room / length } else { 0.0 };
            if hit.as_ref().is_none_or(|h| fraction < h.fraction) {
                hit = Some(BlockingConstraint {
                    place,
                    side,
                    fraction,
                });
            }
        };
        for v in 0..NV {
            let c = v % NU;
            let (u_before, p_before) = match v.checked_sub(NU) {
                Some(before) => (u[before], p[before]),
                None => (bounds.previous[c], 0.0),
            };
            if self.bound[v] == Side::Free && p[v] != 0.0 {
                consider(
                    Constraint::Bound(v),
                    u[v] - bounds.lower[c],
                    bounds.upper[c] - u[v],
                    p[v],
                );
            }
            if self.edge[v] == Side::Free && p[v] != p_before {
                let change = u[v] - u_before;
                let rate = bounds.rate[v];
                consider(
                    Constraint::Edge(v),
                    change + rate,
                    rate - change,
                    p[v] - p_before,
                );
            }
        }
        hit
    }
}

impl<const NV: usize> Default for ActiveSet<NV> {
    fn default() -> Self {
        Self::new()
    }
}

/// Blocking constraint of a move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlockingConstraint {
    /// The limit.
    pub place: Constraint,
    /// Its side.
    pub side: Side,
    /// Fraction of the move, 0 to 1.
    pub fraction: f32,
}

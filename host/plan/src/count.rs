//! Simulations that a plan took.

use std::sync::atomic::{AtomicUsize, Ordering};

/// Plain simulations that one forward pass with eight derivatives stands for.
pub const FORWARD_COST: usize = 4;
/// Plain simulations that one backward pass stands for.
pub const BACKWARD_COST: usize = 10;

/// Simulations by kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Count {
    /// Simulations without derivatives.
    pub plain: usize,
    /// Simulations that carry eight derivatives forwards.
    pub forward: usize,
    /// Simulations with a backward pass.
    pub backward: usize,
}

impl Count {
    /// All of them in plain simulations: a forward pass counts [`FORWARD_COST`], a backward pass
    /// [`BACKWARD_COST`].
    pub fn equivalent(self) -> usize {
        self.plain + FORWARD_COST * self.forward + BACKWARD_COST * self.backward
    }
}

/// Count that several threads add to.
#[derive(Debug, Default)]
pub(crate) struct Counter {
    plain: AtomicUsize,
    forward: AtomicUsize,
    backward: AtomicUsize,
}

impl Counter {
    pub fn plain(&self) {
        self.plain.fetch_add(1, Ordering::Relaxed);
    }

    pub fn forward(&self) {
        self.forward.fetch_add(1, Ordering::Relaxed);
    }

    pub fn backward(&self) {
        self.backward.fetch_add(1, Ordering::Relaxed);
    }

    pub fn count(&self) -> Count {
        Count {
            plain: self.plain.load(Ordering::Relaxed),
            forward: self.forward.load(Ordering::Relaxed),
            backward: self.backward.load(Ordering::Relaxed),
        }
    }
}

//! Time that a search may take, and a request to stop it.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Request to stop a diagnosis and to answer with the best so far, to be set from another thread or
/// from a handler of signals.
#[derive(Clone, Debug, Default)]
pub struct Stop(Arc<AtomicBool>);

impl Stop {
    /// Asks for it.
    pub fn ask(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Tells whether somebody asked.
    pub fn is_asked(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

/// End of a search: an instant, a request, or neither.
#[derive(Clone, Debug, Default)]
pub(crate) struct TimeBudget {
    until: Option<Instant>,
    stop: Stop,
}

impl TimeBudget {
    /// A budget that begins now.
    pub fn new(limit: Option<Duration>, stop: Stop) -> Self {
        let until = limit.and_then(|limit| Instant::now().checked_add(limit));
        Self { until, stop }
    }

    /// Tells whether it is used up.
    pub fn is_spent(&self) -> bool {
        self.stop.is_asked() || self.until.is_some_and(|until| Instant::now() >= until)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_budget_is_spent_when_its_time_is_over_or_somebody_asks() {
        assert!(!TimeBudget::default().is_spent());
        assert!(TimeBudget::new(Some(Duration::ZERO), Stop::default()).is_spent());
        let stop = Stop::default();
        let budget = TimeBudget::new(Some(Duration::MAX), stop.clone());
        assert!(!budget.is_spent());
        stop.ask();
        assert!(budget.is_spent());
    }
}

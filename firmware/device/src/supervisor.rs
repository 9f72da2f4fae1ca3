//! Fault detection, which ends control: signs that the loop no longer does what it is for. Counts
//! in a row, each with its bound; docs/reference/faults.md has the table.

use crate::mode::Cause;
use sinew_mpc::status::Status;

/// An output this far from model zero, in model units, is far beyond what was seen in training (-1
/// to 1).
pub const ENVELOPE: f32 = 5.0;
/// Samples in a row beyond [`ENVELOPE`]: one may be a glitch.
pub const OUTSIDE_LIMIT: u16 = 3;
/// Samples in a row that are equal to the last bit before a sensor may be called stuck.
pub const STUCK_LIMIT: u16 = 60;
/// ... if meanwhile a command has moved this far, model units: a quarter of its range of -1 to 1.
pub const STUCK_TRAVEL: f32 = 0.5;
/// Late steps in a row.
pub const LATE_LIMIT: u16 = 25;

/// Supervisor of an armed session: counts of signs of a fault. Model units throughout.
///
/// ```
/// use sinew_device::mode::Cause;
/// use sinew_device::supervisor::{ENVELOPE, OUTSIDE_LIMIT, Supervisor};
/// use sinew_mpc::status::Status;
///
/// let mut supervisor: Supervisor<1, 1> = Supervisor::new();
/// let mut far = || supervisor.check(&[2.0 * ENVELOPE], &[0.0], Status::Converged, 12);
/// for _ in 1..OUTSIDE_LIMIT {
///     assert_eq!(far(), None); // one may be a glitch
/// }
/// assert_eq!(far(), Some(Cause::Diverged));
/// ```
#[derive(Clone, Debug)]
pub struct Supervisor<const NU: usize, const NY: usize> {
    outside: u16,
    last: [f32; NY],
    same: [u16; NY],
    /// Each output's smallest and largest command since it changed last.
    lowest: [[f32; NU]; NY],
    highest: [[f32; NU]; NY],
    unplanned: u16,
    late: u16,
    late_now: bool,
}

impl<const NU: usize, const NY: usize> Supervisor<NU, NY> {
    /// Nothing seen yet.
    pub const fn new() -> Self {
        Self {
            outside: 0,
            last: [f32::NAN; NY],
            same: [0; NY],
            lowest: [[0.0; NU]; NY],
            highest: [[0.0; NU]; NY],
            unplanned: 0,
            late: 0,
            late_now: false,
        }
    }

    /// The last step ended after its period.
    pub const fn note_late(&mut self) {
        self.late_now = true;
    }

    /// Checks one armed step: what was measured (NaN: missing), what was commanded, and how it
    /// went. `max_missing_samples`: how many steps may pass without a plan.
    pub fn check(
        &mut self,
        y: &[f32; NY],
        u: &[f32; NU],
        status: Status,
        max_missing_samples: u16,
    ) -> Option<Cause> {
        // Of the step before: this one has not ended yet.
        self.late = run(self.late, core::mem::take(&mut self.late_now));
        // A NaN is missing, not outside.
        self.outside = run(self.outside, y.iter().any(|y| y.abs() > ENVELOPE));
        self.unplanned = run(
            self.unplanned,
            !status.is_controlled() && status != Status::OpenLoop,
        );
        let stuck = self.compare(y, u);
        if status == Status::SignalLost {
            Some(Cause::SamplesLost)
        } else if self.outside >= OUTSIDE_LIMIT {
            Some(Cause::Diverged)
        } else if stuck {
            Some(Cause::Stuck)
        } else if self.unplanned > max_missing_samples {
            Some(Cause::NoPlan)
        } else if self.late >= LATE_LIMIT {
            Some(Cause::Late)
        } else {
            None
        }
    }

    /// True if an output stands still to the bit while a command moves far.
    fn compare(&mut self, y: &[f32; NY], u: &[f32; NU]) -> bool {
        let mut stuck = false;
        let kept = self.last.iter_mut().zip(&mut self.same);
        let ranges = self.lowest.iter_mut().zip(&mut self.highest);
        for (((last, same), (lowest, highest)), y) in kept.zip(ranges).zip(y) {
            // A missing sample says nothing either way.
            if y.is_nan() {
                continue;
            }
            if *last == *y {
                *same = same.saturating_add(1);
            } else {
                (*last, *same) = (*y, 0);
                (*lowest, *highest) = (*u, *u);
            }
            for ((lowest, highest), u) in lowest.iter_mut().zip(highest).zip(u) {
                *lowest = lowest.min(*u);
                *highest = highest.max(*u);
                stuck |= *same >= STUCK_LIMIT && *highest - *lowest >= STUCK_TRAVEL;
            }
        }
        stuck
    }
}

impl<const NU: usize, const NY: usize> Default for Supervisor<NU, NY> {
    fn default() -> Self {
        Self::new()
    }
}

/// Length of a run, with one more sample that continues or ends it.
const fn run(before: u16, so: bool) -> u16 {
    if so { before.saturating_add(1) } else { 0 }
}

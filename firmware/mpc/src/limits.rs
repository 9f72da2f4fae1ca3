//! The last word on every command: inside the box and inside the rate, exactly, whatever comes in.
//!
//! "Exactly" is in real arithmetic on the f32 values: `lower <= u <= upper` and
//! `|u - u_before| <= rate`, not up to a rounding (docs/explanation/controller.md, section 6).
//! Every controller, and the way to the safe command, go through [`Limiter::limit`].

use crate::math::{add_down, add_up, clamp};

/// Limits of the commands, physical units.
///
/// ```
/// use sinew_mpc::limits::{Limiter, Limits};
///
/// let limits = Limits { lower: [-1.0], upper: [1.0], rate: [0.25], safe: [0.0] };
/// let mut limiter = Limiter::new(limits);
/// assert_eq!(limiter.limit(&[5.0]), [0.25]);
/// assert_eq!(limiter.limit(&[f32::NAN]), [0.25]);
/// assert!(limits.contain(limiter.applied()));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits<const NU: usize> {
    /// Smallest command; `-INFINITY`: none.
    pub lower: [f32; NU],
    /// Largest command; `INFINITY`: none.
    pub upper: [f32; NU],
    /// Largest change from one step to the next; `INFINITY`: none.
    pub rate: [f32; NU],
    /// Command to go to, within the rate, when nothing better is known. Also the command before the
    /// first step.
    pub safe: [f32; NU],
}

impl<const NU: usize> Limits<NU> {
    /// The same limits with every contradiction taken out: a rate that is negative or NaN forbids
    /// any change; a safe command outside the box moves to its edge; an empty or NaN box shrinks to
    /// the safe command (0 where that is not finite).
    pub const fn sanitised(mut self) -> Self {
        let mut i = 0;
        while i < NU {
            if !(self.rate[i] >= 0.0) {
                self.rate[i] = 0.0;
            }
            if !self.safe[i].is_finite() {
                self.safe[i] = 0.0;
            }
            // An infinite box on the wrong side (lower = +INFINITY) holds no finite command.
            let holds_a_number = self.lower[i] <= self.upper[i]
                && self.lower[i] < f32::INFINITY
                && self.upper[i] > f32::NEG_INFINITY;
            if !holds_a_number {
                self.lower[i] = self.safe[i];
                self.upper[i] = self.safe[i];
            }
            if self.safe[i] > self.upper[i] {
                self.safe[i] = self.upper[i];
            }
            if self.safe[i] < self.lower[i] {
                self.safe[i] = self.lower[i];
            }
            i += 1;
        }
        self
    }

    /// No wider than `widest` in any limit, nothing NaN, and the safe command the same.
    pub fn is_within(&self, widest: &Self) -> bool {
        let boxes = self.lower.iter().zip(&self.upper);
        let widest_boxes = widest.lower.iter().zip(&widest.upper);
        let boxed = boxes
            .zip(widest_boxes)
            .all(|((low, high), (least, most))| *least <= *low && *low <= *high && *high <= *most);
        let rates = self.rate.iter().zip(&widest.rate);
        let slower = rates
            .into_iter()
            .all(|(rate, most)| (0.0..=*most).contains(rate));
        boxed && slower && self.safe == widest.safe && self.contain(&widest.safe)
    }

    /// True if a command is inside the box.
    pub fn contain(&self, u: &[f32; NU]) -> bool {
        let boxes = self.lower.iter().zip(&self.upper);
        boxes
            .zip(u)
            .all(|((low, high), u)| (*low..=*high).contains(u))
    }
}

/// Holds the limits and the command that was applied last.
#[derive(Clone, Debug)]
pub struct Limiter<const NU: usize> {
    limits: Limits<NU>,
    applied: [f32; NU],
}

impl<const NU: usize> Limiter<NU> {
    /// A limiter whose last command is the safe one. Contradictory limits are
    /// [sanitised](Limits::sanitised).
    pub const fn new(limits: Limits<NU>) -> Self {
        let limits = limits.sanitised();
        Self {
            limits,
            applied: limits.safe,
        }
    }

    /// The limits in force.
    pub const fn limits(&self) -> &Limits<NU> {
        &self.limits
    }

    /// The command applied last, physical units.
    pub const fn applied(&self) -> &[f32; NU] {
        &self.applied
    }

    /// The nearest command inside the limits; it counts as applied from here on.
    ///
    /// A unsaturated that is not finite holds the last command of its channel.
    pub fn limit(&mut self, unsaturated: &[f32; NU]) -> [f32; NU] {
        let Limits {
            lower, upper, rate, ..
        } = &self.limits;
        let boxes = lower.iter().zip(upper).zip(rate);
        for ((applied, unsaturated), ((lower, upper), rate)) in
            self.applied.iter_mut().zip(unsaturated).zip(boxes)
        {
            *applied = limit(*unsaturated, *applied, *lower, *upper, *rate);
        }
        self.applied
    }

    /// The safe command counts as applied, whatever the rate.
    pub const fn emergency_stop(&mut self) {
        self.applied = self.limits.safe;
    }

    /// Other limits; the command applied last stays what it is and should be inside.
    pub const fn set_limits(&mut self, limits: Limits<NU>) {
        self.limits = limits.sanitised();
    }

    /// One step towards the safe command.
    pub fn ramp_to_safe(&mut self) -> [f32; NU] {
        let safe = self.limits.safe;
        self.limit(&safe)
    }
}

/// The nearest command of one channel; never inlined, so that flash holds it once.
#[inline(never)]
fn limit(unsaturated: f32, applied: f32, lower: f32, upper: f32, rate: f32) -> f32 {
    let unsaturated = if unsaturated.is_finite() {
        unsaturated
    } else {
        applied
    };
    let boxed = clamp(unsaturated, lower, upper);
    // The last command is inside the box, so the interval below holds it, and clamping to the rate
    // never leaves the box again. Rounding is inwards.
    clamp(boxed, add_up(applied, -rate), add_down(applied, rate))
}

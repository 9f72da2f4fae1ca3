//! A policy: a network says by how much each command moves, from what was measured, what was
//! commanded and what is asked ahead (docs/explanation/imitation.md, eq. 1 and 4). The limits
//! around it are those of every controller.

use crate::limits::{Limiter, Limits};

/// Past of a loop and the limits of its commands.
///
/// `NY` outputs, `NU` commands; `PY` samples of the outputs and `PU` earlier commands are
/// remembered.
///
/// ```
/// use sinew_mpc::feedback::policy::Policy;
/// use sinew_mpc::limits::Limits;
///
/// let limits = Limits { lower: [-1.0], upper: [1.0], rate: [0.25], safe: [0.0] };
/// let mut policy = Policy::<1, 1, 2, 1>::new(limits);
/// // y(k), y(k-1), u(k-1), r(k+1): the network asks for half of the distance to go.
/// let network = |raw: &[f32; 4]| [0.5 * (raw[3] - raw[0])];
/// assert_eq!(policy.step(&[0.0], &[[0.2]], network), [0.1]);
/// assert_eq!(policy.step(&[0.0], &[[9.0]], network), [0.35]);
/// ```
#[derive(Clone, Debug)]
pub struct Policy<const NY: usize, const NU: usize, const PY: usize, const PU: usize> {
    /// Latest first; none before the first sample.
    y: Option<[[f32; NY]; PY]>,
    u: [[f32; NU]; PU],
    limiter: Limiter<NU>,
}

impl<const NY: usize, const NU: usize, const PY: usize, const PU: usize> Policy<NY, NU, PY, PU> {
    /// A policy that has seen nothing, at the safe command.
    pub const fn new(limits: Limits<NU>) -> Self {
        let limiter = Limiter::new(limits);
        let u = [*limiter.applied(); PU];
        Self {
            y: None,
            u,
            limiter,
        }
    }

    /// The command applied last, physical units.
    pub const fn applied(&self) -> &[f32; NU] {
        self.limiter.applied()
    }

    /// The commands for this sample, inside the limits whatever comes in.
    ///
    /// `network` gives the change of each command for y(k) .. y(k-PY+1), u(k-1) .. u(k-PU),
    /// r(k+1) .. r(k+H), `N` numbers together.
    ///
    /// A reading that is not finite counts as the one before; without one before, the way goes to
    /// the safe command. A change that is not finite holds its command.
    #[inline]
    pub fn step<const H: usize, const N: usize>(
        &mut self,
        y: &[f32; NY],
        reference: &[[f32; NY]; H],
        network: impl FnOnce(&[f32; N]) -> [f32; NU],
    ) -> [f32; NU] {
        const { assert!(N == NY * (PY + H) + NU * PU, "the network sees all of it") };
        let finite = |y: &f32| y.is_finite();
        let mut past = match self.y {
            Some(past) => past,
            None if y.iter().all(finite) => [*y; PY],
            None => {
                let applied = self.limiter.ramp_to_safe();
                self.u = [applied; PU];
                return applied;
            }
        };
        let mut now = *y;
        if let Some(before) = past.first() {
            for (now, before) in now.iter_mut().zip(before) {
                if !finite(now) {
                    *now = *before;
                }
            }
        }
        push(&mut past, &now);
        self.y = Some(past);
        let mut raw = [0.0; N];
        let seen = past.as_flattened().iter();
        let seen = seen.chain(self.u.as_flattened());
        let seen = seen.chain(reference.as_flattened());
        for (raw, seen) in raw.iter_mut().zip(seen) {
            *raw = *seen;
        }
        let mut asked = *self.limiter.applied();
        for (asked, change) in asked.iter_mut().zip(network(&raw)) {
            *asked += change;
        }
        let applied = self.limiter.limit(&asked);
        push(&mut self.u, &applied);
        applied
    }

    /// Forgets the past; the command applied last stays, so that the rate holds across a reset.
    pub const fn reset(&mut self) {
        self.y = None;
        self.u = [*self.limiter.applied(); PU];
    }
}

/// Puts a row in front; the last one goes.
fn push<const W: usize, const P: usize>(rows: &mut [[f32; W]; P], first: &[f32; W]) {
    let mut next = *first;
    for row in rows {
        core::mem::swap(row, &mut next);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITS: Limits<1> = Limits {
        lower: [-1.0],
        upper: [1.0],
        rate: [0.25],
        safe: [0.0],
    };

    #[test]
    fn the_network_sees_the_latest_samples_commands_and_reference_in_order() {
        let mut policy = Policy::<1, 1, 3, 2>::new(LIMITS);
        let mut seen = [0.0; 7];
        for (y, change) in [(1.0, 0.125), (2.0, -0.0625), (3.0, 0.0)] {
            policy.step(&[y], &[[8.0], [9.0]], |raw| {
                seen = *raw;
                [change]
            });
        }
        assert_eq!(seen, [3.0, 2.0, 1.0, 0.0625, 0.125, 8.0, 9.0]);
        policy.reset();
        policy.step(&[5.0], &[[8.0], [9.0]], |raw| {
            seen = *raw;
            [0.0]
        });
        assert_eq!(seen, [5.0, 5.0, 5.0, 0.0625, 0.0625, 8.0, 9.0]);
    }

    #[test]
    fn commands_stay_inside_the_limits_whatever_comes_in() {
        let hostile = [
            f32::NAN,
            f32::INFINITY,
            f32::NEG_INFINITY,
            f32::MAX,
            -f32::MAX,
            0.3,
        ];
        let mut policy = Policy::<1, 1, 2, 2>::new(LIMITS);
        let mut before = 0.0_f32;
        for k in 0..6 * 6 * 6 {
            let (y, r, change) = (hostile[k % 6], hostile[k / 6 % 6], hostile[k / 36]);
            let [u] = policy.step(&[y], &[[r]], |_: &[f32; 5]| [change]);
            assert!((-1.0..=1.0).contains(&u), "{u}");
            assert!(
                (f64::from(u) - f64::from(before)).abs() <= 0.25,
                "{before} to {u}"
            );
            before = u;
        }
    }

    #[test]
    fn a_missing_reading_counts_as_the_one_before_with_a_past_of_one_too() {
        let seen = |mut policy: Policy<1, 1, 1, 1>| {
            let mut seen = [0.0; 3];
            for y in [f32::NAN, 0.5, f32::NAN] {
                policy.step(&[y], &[[1.0]], |raw| {
                    seen = *raw;
                    [0.1]
                });
            }
            seen
        };
        assert_eq!(seen(Policy::new(LIMITS)), [0.5, 0.1, 1.0]);
    }
}

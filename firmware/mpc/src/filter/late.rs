//! Readings that arrive late, taken at their own time.

use super::{Estimate, Filter, StateSpace, Update};

/// A filter that keeps the last `DEPTH` periods: a reading that arrives up to `DEPTH - 1` periods
/// late enters at its own time, and the periods after it are computed again.
///
/// The result is that of a filter that had the reading in time. A late reading costs an update and
/// a prediction for each period since; with none the cost is that of [`Filter`] and a copy. A
/// camera at a quarter of the rate whose pictures are 7 periods old needs `DEPTH` of 8 or more.
///
/// ```
/// # use sinew_mpc::filter::*;
/// # struct Lag;
/// # impl StateSpace<1, 1, 1, 0> for Lag {
/// #     type Trace = ();
/// #     const TRACE: () = ();
/// #     fn transition(&self, x: &[f32; 1], u: &[f32; 1], _: &[f32; 0], _: &mut ()) -> [f32; 1] {
/// #         [0.9 * x[0] + 0.1 * u[0]]
/// #     }
/// #     fn transition_jacobian(&self, _: &(), jacobian: &mut TransitionJacobian<1, 1, 0>) {
/// #         jacobian.x[0][0] = 0.9;
/// #         jacobian.u[0][0] = 0.1;
/// #     }
/// #     fn measure(&self, x: &[f32; 1], _: &[f32; 0]) -> [f32; 1] {
/// #         *x
/// #     }
/// #     fn measurement_jacobian(
/// #         &self,
/// #         _: &[f32; 1],
/// #         _: &[f32; 0],
/// #         jacobian: &mut MeasurementJacobian<1, 1, 0>,
/// #     ) {
/// #         jacobian.x[0][0] = 1.0;
/// #     }
/// # }
/// # let prior = Prior {
/// #     x: [0.0],
/// #     rest_deviation: [1.0],
/// #     state_deviation: [1.0],
/// #     disturbance_deviation: [0.1],
/// #     theta: [],
/// #     parameter_deviation: [],
/// #     lower: [],
/// #     upper: [],
/// # };
/// # let settings = FilterSettings {
/// #     state_noise: [0.01],
/// #     disturbance_noise: [0.01],
/// #     parameter_noise: [],
/// #     measurement_noise: [0.1],
/// #     gate: 5.0,
/// #     adapt: true,
/// #     max_missing_samples: 10,
/// # };
/// // The model `Lag` is x(k+1) = 0.9 x(k) + 0.1 (u(k) + d), and x is read.
/// let mut in_time: Filter<1, 1, 1, 0, 2> = Filter::new(prior, settings);
/// let mut late: LateFilter<1, 1, 1, 0, 2, 4> = LateFilter::new(Filter::new(prior, settings));
/// for reading in [0.3, 0.4, 0.5] {
///     let _ = in_time.update(&Lag, &[reading]);
///     in_time.predict(&Lag, &[1.0]);
///     // The second reading does not come.
///     let came = if reading == 0.4 { f32::NAN } else { reading };
///     let _ = late.update(&Lag, &[came]);
///     late.predict(&Lag, &[1.0]);
/// }
/// assert_ne!(late.filter().x(), in_time.x());
/// // One period before the newest.
/// assert!(late.late(&Lag, 1, &[0.4]).is_some());
/// assert_eq!(late.filter().x(), in_time.x());
/// ```
#[derive(Clone, Debug)]
pub struct LateFilter<
    const NX: usize,
    const NU: usize,
    const NM: usize,
    const NP: usize,
    const NZ: usize,
    const DEPTH: usize,
> {
    filter: Filter<NX, NU, NM, NP, NZ>,
    /// A ring of periods.
    past: [Period<NX, NU, NM, NP, NZ>; DEPTH],
    /// Place of the newest period in the ring.
    newest: usize,
    /// Periods in the ring.
    filled: usize,
    /// The newest period is over: its command is known.
    over: bool,
}

/// One period: the estimate before its readings, and what it brought.
#[derive(Clone, Copy, Debug)]
struct Period<const NX: usize, const NU: usize, const NM: usize, const NP: usize, const NZ: usize> {
    before: Estimate<NX, NU, NP, NZ>,
    readings: [f32; NM],
    u: [f32; NU],
}

impl<
    const NX: usize,
    const NU: usize,
    const NM: usize,
    const NP: usize,
    const NZ: usize,
    const DEPTH: usize,
> LateFilter<NX, NU, NM, NP, NZ, DEPTH>
{
    /// A filter without a past.
    pub const fn new(filter: Filter<NX, NU, NM, NP, NZ>) -> Self {
        const { assert!(DEPTH >= 1) };
        let period = Period {
            before: filter.estimate,
            readings: [f32::NAN; NM],
            u: [0.0; NU],
        };
        Self {
            filter,
            past: [period; DEPTH],
            newest: 0,
            filled: 0,
            over: false,
        }
    }

    /// The filter at the newest period.
    pub const fn filter(&self) -> &Filter<NX, NU, NM, NP, NZ> {
        &self.filter
    }

    /// The filter, to change its settings between two calls.
    pub const fn filter_mut(&mut self) -> &mut Filter<NX, NU, NM, NP, NZ> {
        &mut self.filter
    }

    /// As [`Filter::update`], once a period; NaN also for a reading that may still come.
    pub fn update<M: StateSpace<NX, NU, NM, NP>>(
        &mut self,
        model: &M,
        readings: &[f32; NM],
    ) -> Update<NM> {
        self.newest = (self.newest + 1) % DEPTH;
        self.filled = (self.filled + 1).min(DEPTH);
        self.over = false;
        if let Some(period) = self.past.get_mut(self.newest) {
            period.before = self.filter.estimate;
            period.readings = *readings;
        }
        self.filter.update(model, readings)
    }

    /// As [`Filter::predict`].
    pub fn predict<M: StateSpace<NX, NU, NM, NP>>(&mut self, model: &M, u: &[f32; NU]) {
        if let Some(period) = self.past.get_mut(self.newest) {
            period.u = *u;
        }
        self.over = true;
        self.filter.predict(model, u);
    }

    /// Takes readings of `age` periods before the newest update; NaN: none. They replace what was
    /// read then. `None`, and nothing changes, where that period is no longer kept.
    ///
    /// Returns the update of the newest period.
    pub fn late<M: StateSpace<NX, NU, NM, NP>>(
        &mut self,
        model: &M,
        age: usize,
        readings: &[f32; NM],
    ) -> Option<Update<NM>> {
        if age >= self.filled {
            return None;
        }
        let mut result = None;
        for back in (0..DEPTH).rev() {
            if back > age {
                continue;
            }
            let place = (self.newest + DEPTH - back) % DEPTH;
            let Some(period) = self.past.get_mut(place) else {
                continue;
            };
            if back == age {
                self.filter.estimate = period.before;
                for (kept, late) in period.readings.iter_mut().zip(readings) {
                    if late.is_finite() {
                        *kept = *late;
                    }
                }
            } else {
                period.before = self.filter.estimate;
            }
            result = Some(self.filter.update(model, &period.readings));
            if back > 0 || self.over {
                self.filter.predict(model, &period.u);
            }
        }
        result
    }
}

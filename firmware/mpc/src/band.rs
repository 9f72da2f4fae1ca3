//! Band around the prediction that keeps its promise, and bridging for as long as it is narrow
//! (docs/explanation/controller.md, section 13).

use crate::budget::Budget;
use crate::channel_watch::LeftOut;
use crate::controller::{ControlLoop, Step};
use crate::cost::CostTerm;
use crate::filter::StateSpace;
use crate::limits::Limits;
use crate::model::{Model, Regressor};
use crate::predictive_loop::PredictiveLoop;
use crate::rollout::shift;
use crate::soft_sensor::SensedLoop;
use crate::state_loop::StateLoop;
use crate::status::Status;
use crate::work_bound::{Parts, Work};

/// Steps ahead of which the band knows.
pub const AHEAD: usize = 10;
/// Part of the errors that the band promises to hold.
pub const PROMISED: f32 = 0.9;
/// Factor of a bound that an error has passed: `exp(0.1 PROMISED)`.
const WIDER: f32 = 1.094_174_3;
/// Factor of a bound that has held: `exp(-0.1 (1 - PROMISED))`. With nine that hold for one that
/// does not, a bound stays.
const NARROWER: f32 = 0.990_049_8;
/// Least bound, model units.
const LEAST: f32 = 1.0e-6;

/// Quantiles of `|prediction - measurement|`, 1 to [`AHEAD`] steps ahead, model units. A bound of
/// zero has seen nothing yet.
///
/// ```
/// use sinew_mpc::band::Band;
///
/// let mut band: Band<1> = Band::new();
/// // Errors of 0.0 to 0.9, one as often as another.
/// for k in 0..20_000 {
///     band.take(1, &[0.1 * ((7 * k) % 10) as f32]);
/// }
/// let [[bound, ..]] = band.bounds();
/// assert!((0.75..=0.95).contains(bound), "{bound}");
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Band<const NY: usize> {
    bounds: [[f32; AHEAD]; NY],
}

impl<const NY: usize> Band<NY> {
    /// A band that has seen nothing yet.
    pub const fn new() -> Self {
        Self {
            bounds: [[0.0; AHEAD]; NY],
        }
    }

    /// Takes errors of a prediction `age` steps ahead, one an output. An error that is no number
    /// says nothing, nor does an age beyond the band's.
    #[inline(always)]
    pub fn take(&mut self, age: usize, errors: &[f32; NY]) {
        for (bounds, error) in self.bounds.iter_mut().zip(errors) {
            let Some(bound) = age.checked_sub(1).and_then(|age| bounds.get_mut(age)) else {
                continue;
            };
            let error = error.abs();
            if !error.is_finite() {
                continue;
            }
            *bound = if *bound == 0.0 {
                error.max(LEAST)
            } else if error > *bound {
                (*bound * WIDER).min(f32::MAX)
            } else {
                (*bound * NARROWER).max(LEAST)
            };
        }
    }

    /// Bounds of every output, 1 to [`AHEAD`] steps ahead.
    pub const fn bounds(&self) -> &[[f32; AHEAD]; NY] {
        &self.bounds
    }

    /// Bound of each output `age` steps ahead. Further than [`AHEAD`] it grows by as much a step as
    /// it did in the mean until there.
    pub fn at(&self, age: usize) -> [f32; NY] {
        let mut at = [0.0; NY];
        for (at, bounds) in at.iter_mut().zip(&self.bounds) {
            let (first, last) = (bounds.first(), bounds.last());
            let (first, last) = (first.copied().unwrap_or(0.0), last.copied().unwrap_or(0.0));
            *at = match age.checked_sub(1).and_then(|age| bounds.get(age)) {
                Some(bound) => *bound,
                None => {
                    let beyond = age.saturating_sub(AHEAD) as f32;
                    last + (last - first).max(0.0) / (AHEAD - 1) as f32 * beyond
                }
            };
        }
        at
    }
}

impl<const NY: usize> Default for Band<NY> {
    fn default() -> Self {
        Self::new()
    }
}

/// A controller that can predict on from where it is, without measurements.
pub trait Forecast<const NU: usize, const NY: usize> {
    /// State that such a prediction carries along.
    type Ahead: Copy;

    /// A prediction that begins where the last step ended.
    fn begin(&self) -> Self::Ahead;

    /// One step on, under a command in physical units; outputs in model units.
    fn on(&self, ahead: &mut Self::Ahead, u: &[f32; NU]) -> [f32; NY];
}

impl<
    M: CostTerm<NU, NY, NS, ND, DD>,
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
    const N: usize,
    const NB: usize,
    const NV: usize,
    const P: usize,
> Forecast<NU, NY> for ControlLoop<M, NU, NY, NS, ND, DD, N, NB, NV, P>
{
    /// History and disturbance, as a gap that begins now would find them.
    type Ahead = (Regressor<NU, NY, NS, ND, DD>, [f32; NY]);

    #[inline(always)]
    fn begin(&self) -> Self::Ahead {
        let estimator = self.estimator();
        (*estimator.regressor(), *estimator.disturbance())
    }

    fn on(&self, (x, disturbance): &mut Self::Ahead, u: &[f32; NU]) -> [f32; NY] {
        let u = self.scaling().u.to_model(u);
        if let Some(newest) = x.u.first_mut() {
            *newest = u;
        }
        let mut trace = M::Model::TRACE;
        let mut y = self.model().predict(x, &mut trace);
        if M::Model::PREDICTS_CHANNELS {
            x.s = self.model().channels(x, &trace);
        }
        for (y, d) in y.iter_mut().zip(disturbance.iter()) {
            *y += d;
        }
        shift(&mut x.y, y);
        // Room for the next command.
        shift(&mut x.u, u);
        y
    }
}

impl<
    S: StateSpace<NX, NU, NM, NP>,
    const NX: usize,
    const NU: usize,
    const NY: usize,
    const NM: usize,
    const NP: usize,
    const NZ: usize,
    const DEPTH: usize,
    const N: usize,
    const NB: usize,
    const NV: usize,
> Forecast<NU, NY> for StateLoop<S, NX, NU, NY, NM, NP, NZ, DEPTH, N, NB, NV>
{
    /// State before the last command, disturbance and parameters. The filter has predicted on
    /// already, so the first step gives that prediction.
    type Ahead = (bool, [f32; NX], [f32; NU], [f32; NP]);

    #[inline(always)]
    fn begin(&self) -> Self::Ahead {
        let filter = self.filter();
        (true, *filter.x(), *filter.disturbance(), *filter.theta())
    }

    fn on(&self, (first, x, disturbance, theta): &mut Self::Ahead, u: &[f32; NU]) -> [f32; NY] {
        if !core::mem::take(first) {
            let mut u = self.scaling().u.to_model(u);
            for (u, d) in u.iter_mut().zip(disturbance.iter()) {
                *u += d;
            }
            let mut trace = S::TRACE;
            *x = self.model().transition(x, &u, theta, &mut trace);
        }
        let mut y = [0.0; NY];
        for (y, m) in y.iter_mut().zip(self.model().measure(x, theta)) {
            *y = m;
        }
        y
    }
}

impl<
    C: Forecast<NU, NY>,
    const NU: usize,
    const NS: usize,
    const NY: usize,
    const NQ: usize,
    const NI: usize,
    const N: usize,
    W,
> Forecast<NU, NY> for SensedLoop<C, NS, NY, NQ, NI, N, W>
{
    type Ahead = C::Ahead;

    #[inline(always)]
    fn begin(&self) -> Self::Ahead {
        self.controller().begin()
    }

    #[inline(always)]
    fn on(&self, ahead: &mut Self::Ahead, u: &[f32; NU]) -> [f32; NY] {
        self.controller().on(ahead, u)
    }
}

/// A controller with a band around its prediction.
///
/// Beside it runs one prediction without measurements, begun anew every [`AHEAD`] steps. Its errors
/// are those that a gap would have had. A gap is bridged for as long as the band of its age stays
/// within `tolerance`, and no longer than the controller within bridges it.
#[derive(Clone, Debug)]
pub struct BandedLoop<C: Forecast<NU, NY>, const NU: usize, const NY: usize> {
    controller: C,
    band: Band<NY>,
    /// Tolerated error of each output while it is missing, physical units.
    tolerance: [f32; NY],
    /// The prediction, its age, and what it says of the next sample.
    ahead: Option<(C::Ahead, usize, [f32; NY])>,
    /// Incomplete samples in a row.
    missing_run: usize,
}

impl<C: Forecast<NU, NY>, const NU: usize, const NY: usize> BandedLoop<C, NU, NY> {
    /// `controller` with a band that has seen nothing yet. A tolerance of infinity: gaps are
    /// bridged as without a band.
    pub const fn new(controller: C, tolerance: [f32; NY]) -> Self {
        Self {
            controller,
            band: Band::new(),
            tolerance,
            ahead: None,
            missing_run: 0,
        }
    }

    /// The controller within.
    pub const fn controller(&self) -> &C {
        &self.controller
    }

    /// The band.
    pub const fn band(&self) -> &Band<NY> {
        &self.band
    }

    /// Prediction of the next sample, model units, and the steps before it from which it was made.
    /// `None` where nothing was measured.
    pub const fn expected(&self) -> Option<(usize, &[f32; NY])> {
        match &self.ahead {
            Some((_, age, said)) => Some((*age, said)),
            None => None,
        }
    }

    /// Replaces the tolerance, physical units.
    pub const fn set_tolerance(&mut self, tolerance: [f32; NY]) {
        self.tolerance = tolerance;
    }

    /// Bounds of the prediction's error `age` steps ahead, physical units.
    pub fn bounds<const NS: usize, const N: usize>(&self, age: usize) -> [f32; NY]
    where
        C: PredictiveLoop<NU, NY, NS, N>,
    {
        let zero = self.controller.to_physical(&[0.0; NY], &[0.0; NS]).0;
        let mut bounds = self
            .controller
            .to_physical(&self.band.at(age), &[0.0; NS])
            .0;
        for (bound, zero) in bounds.iter_mut().zip(&zero) {
            *bound = (*bound - zero).abs();
        }
        bounds
    }

    /// Takes a sample: the band learns from it, or the gap grows. `true` where the band of the
    /// gap's age passes the tolerance.
    fn learn<const NS: usize, const N: usize>(&mut self, y: &[f32; NY]) -> bool
    where
        C: PredictiveLoop<NU, NY, NS, N>,
    {
        if y.iter().any(|y| !y.is_finite()) {
            self.missing_run = self.missing_run.saturating_add(1);
            // What it would have been compared with is not known.
            self.ahead = None;
            let bounds = self.bounds(self.missing_run);
            let mut within = bounds.iter().zip(&self.tolerance);
            return within.any(|(bound, tolerance)| bound > tolerance);
        }
        self.missing_run = 0;
        if let Some((_, age, said)) = &self.ahead {
            let (mut errors, _) = self.controller.to_model(y, self.controller.applied());
            for (error, said) in errors.iter_mut().zip(said) {
                *error -= said;
            }
            self.band.take(*age, &errors);
        }
        false
    }

    /// Predicts on, after the step of a sample.
    fn predict<const NS: usize, const N: usize>(&mut self, lost: bool)
    where
        C: PredictiveLoop<NU, NY, NS, N>,
    {
        if self.missing_run > 0 || lost {
            return;
        }
        let (mut ahead, age) = match self.ahead {
            Some((ahead, age, _)) if age < AHEAD => (ahead, age),
            _ => (self.controller.begin(), 0),
        };
        let said = self.controller.on(&mut ahead, self.controller.applied());
        self.ahead = Some((ahead, age + 1, said));
    }
}

impl<
    C: PredictiveLoop<NU, NY, NS, N> + Forecast<NU, NY>,
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const N: usize,
> PredictiveLoop<NU, NY, NS, N> for BandedLoop<C, NU, NY>
{
    const HIDDEN_CHANNELS: bool = C::HIDDEN_CHANNELS;
    const POINT: usize = C::POINT;
    const DERIVATIVES: usize = C::DERIVATIVES;
    const SENSED: bool = C::SENSED;
    const WATCHES: bool = C::WATCHES;
    const PARAMETERS: usize = C::PARAMETERS;

    #[inline(always)]
    fn outputs(&mut self, y: &[f32; NY], s: &[f32; NS]) -> [f32; NY] {
        self.controller.outputs(y, s)
    }

    #[inline(always)]
    fn left_out(&self) -> LeftOut {
        self.controller.left_out()
    }

    #[inline(always)]
    fn parameter(&self, i: usize) -> (f32, f32) {
        self.controller.parameter(i)
    }

    #[inline(always)]
    fn step(&mut self, y: &[f32; NY], s: &[f32; NS], reference: &[[f32; NY]; N]) -> Step<NU> {
        let y = self.controller.outputs(y, s);
        let step = if self.learn(&y) {
            let mut step = self.controller.open_loop(&y, s, None);
            step.status = Status::SignalLost;
            step
        } else {
            self.controller.step(&y, s, reference)
        };
        self.predict(step.status == Status::SignalLost);
        step
    }

    #[inline(always)]
    fn open_loop(
        &mut self,
        y: &[f32; NY],
        s: &[f32; NS],
        unsaturated: Option<&[f32; NU]>,
    ) -> Step<NU> {
        let y = self.controller.outputs(y, s);
        self.learn(&y);
        let step = self.controller.open_loop(&y, s, unsaturated);
        self.predict(step.status == Status::SignalLost);
        step
    }

    #[inline(always)]
    fn missed(&self) -> u32 {
        self.controller.missed()
    }

    #[inline(always)]
    fn max_missing_samples(&self) -> u16 {
        self.controller.max_missing_samples()
    }

    #[inline(always)]
    fn to_model(&self, y: &[f32; NY], u: &[f32; NU]) -> ([f32; NY], [f32; NU]) {
        self.controller.to_model(y, u)
    }

    #[inline(always)]
    fn to_physical(&self, y: &[f32; NY], s: &[f32; NS]) -> ([f32; NY], [f32; NS]) {
        self.controller.to_physical(y, s)
    }

    #[inline(always)]
    fn limits(&self) -> &Limits<NU> {
        self.controller.limits()
    }

    #[inline(always)]
    fn set_limits(&mut self, limits: Limits<NU>, widest: &Limits<NU>) -> bool {
        self.controller.set_limits(limits, widest)
    }

    #[inline(always)]
    fn applied(&self) -> &[f32; NU] {
        self.controller.applied()
    }

    #[inline(always)]
    fn tune(
        &mut self,
        tracking_weight: [f32; NY],
        move_suppression: [f32; NU],
        disturbance_gain: f32,
        iterations: u8,
    ) -> bool {
        self.controller.tune(
            tracking_weight,
            move_suppression,
            disturbance_gain,
            iterations,
        )
    }

    /// The band stays: it is of the device.
    #[inline(always)]
    fn reset(&mut self) {
        self.controller.reset();
        (self.ahead, self.missing_run) = (None, 0);
    }

    #[inline(always)]
    fn emergency_stop(&mut self) {
        self.controller.emergency_stop();
        (self.ahead, self.missing_run) = (None, 0);
    }

    #[inline(always)]
    fn estimate(&self) -> [f32; NY] {
        self.controller.estimate()
    }

    #[inline(always)]
    fn disturbance(&self) -> &[f32] {
        self.controller.disturbance()
    }

    #[inline(always)]
    fn probe(
        &self,
        point: &[f32],
        prediction: &mut impl FnMut(f32),
        derivative: &mut impl FnMut(f32),
    ) -> bool {
        self.controller.probe(point, prediction, derivative)
    }

    #[inline(always)]
    fn parts(&self, draw: &mut impl FnMut() -> f32, ticks: impl Fn() -> u32) -> Parts {
        self.controller.parts(draw, ticks)
    }

    #[inline(always)]
    fn most_work(&self) -> Work {
        self.controller.most_work()
    }

    #[inline(always)]
    fn budget(&self) -> Option<Budget> {
        self.controller.budget()
    }
}

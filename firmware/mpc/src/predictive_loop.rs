//! Common interface of the two predictive controllers, for a device's session.

use crate::budget::Budget;
use crate::channel_watch::LeftOut;
use crate::controller::{ControlLoop, Settings, Step};
use crate::cost::CostTerm;
use crate::filter::{StateSpace, TransitionJacobian};
use crate::limits::Limits;
use crate::model::{Jacobian, Model};
use crate::network;
use crate::state_loop::{StateLoop, StateSettings};
use crate::tuning::Tuning;
use crate::work_bound::{Parts, Work};

/// Predictive controller with `NU` commands, `NY` outputs, `NS` channels and `N` steps predicted:
/// [`ControlLoop`] or [`StateLoop`].
///
/// All arguments are in physical units, and every command is inside the limits.
pub trait PredictiveLoop<const NU: usize, const NY: usize, const NS: usize, const N: usize> {
    /// True where some channels are hidden state, which no sensor gives.
    const HIDDEN_CHANNELS: bool;
    /// Values that [`PredictiveLoop::probe`] takes.
    const POINT: usize;
    /// Derivatives that it gives.
    const DERIVATIVES: usize;
    /// True where channels may say what outputs are: [`PredictiveLoop::outputs`] is then to be
    /// asked before anything looks at an output.
    const SENSED: bool = false;
    /// True where channels are judged: [`PredictiveLoop::left_out`].
    const WATCHES: bool = false;
    /// Parameters that are estimated while it runs: [`PredictiveLoop::parameter`].
    const PARAMETERS: usize = 0;

    /// Outputs as they are known at this step: those that are measured, and of a
    /// [`SensedLoop`](crate::soft_sensor::SensedLoop) those that channels say. NaN: missing. To be
    /// asked once, before the step.
    #[inline(always)]
    fn outputs(&mut self, y: &[f32; NY], _s: &[f32; NS]) -> [f32; NY] {
        *y
    }

    /// Channels that are left out because the others contradict them.
    #[inline(always)]
    fn left_out(&self) -> LeftOut {
        LeftOut::default()
    }

    /// Estimate of parameter `i` and its variance, model units; NaN where there is none.
    #[inline(always)]
    fn parameter(&self, _i: usize) -> (f32, f32) {
        (f32::NAN, f32::NAN)
    }

    /// One control step; NaN stands for a reading that is missing.
    fn step(&mut self, y: &[f32; NY], s: &[f32; NS], reference: &[[f32; NY]; N]) -> Step<NU>;

    /// A step without an optimisation, towards the given command, or the safe one.
    fn open_loop(
        &mut self,
        y: &[f32; NY],
        s: &[f32; NS],
        unsaturated: Option<&[f32; NU]>,
    ) -> Step<NU>;

    /// Incomplete samples since the reset.
    fn missed(&self) -> u32;

    /// Missing samples in a row after which the signal is lost.
    fn max_missing_samples(&self) -> u16;

    /// Outputs and commands in model units.
    fn to_model(&self, y: &[f32; NY], u: &[f32; NU]) -> ([f32; NY], [f32; NU]);

    /// Outputs and channels in physical units.
    fn to_physical(&self, y: &[f32; NY], s: &[f32; NS]) -> ([f32; NY], [f32; NS]);

    /// The limits in force.
    fn limits(&self) -> &Limits<NU>;

    /// Replaces the limits; `false`, and nothing is changed, where they are not within `widest`.
    fn set_limits(&mut self, limits: Limits<NU>, widest: &Limits<NU>) -> bool;

    /// The command applied last.
    fn applied(&self) -> &[f32; NU];

    /// Replaces Q, Lambda (model units), gain of the disturbance estimate and Newton iterations;
    /// `false`, and nothing is changed, where one is out of its range.
    fn tune(
        &mut self,
        tracking_weight: [f32; NY],
        move_suppression: [f32; NU],
        disturbance_gain: f32,
        iterations: u8,
    ) -> bool;

    /// Forgets the plan and the past, not the command applied last.
    fn reset(&mut self);

    /// The safe command at once, without regard to the rate. Resets.
    fn emergency_stop(&mut self);

    /// Estimated outputs.
    fn estimate(&self) -> [f32; NY];

    /// Estimated disturbance, model units: of each output, or of each input.
    fn disturbance(&self) -> &[f32];

    /// Predicts at a point in model units: gives the prediction, then its derivatives by all but
    /// channels or parameters, row after row. `false` where `point` has another length.
    fn probe(
        &self,
        point: &[f32],
        prediction: &mut impl FnMut(f32),
        derivative: &mut impl FnMut(f32),
    ) -> bool;

    /// Cost of the parts of an optimisation at the plan that `draw` gives, model units.
    fn parts(&self, draw: &mut impl FnMut() -> f32, ticks: impl Fn() -> u32) -> Parts;

    /// The most that one optimisation may do, by its iterations.
    fn most_work(&self) -> Work;

    /// The model's own budget of an optimisation, where it has one.
    #[inline(always)]
    fn budget(&self) -> Option<Budget> {
        None
    }
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
> PredictiveLoop<NU, NY, NS, P> for ControlLoop<M, NU, NY, NS, ND, DD, N, NB, NV, P>
{
    const HIDDEN_CHANNELS: bool = M::Model::PREDICTS_CHANNELS;
    const POINT: usize = NU * ND + NY * DD + NS;
    const DERIVATIVES: usize = NY * (NU * ND + NY * DD);

    #[inline(always)]
    fn step(&mut self, y: &[f32; NY], s: &[f32; NS], reference: &[[f32; NY]; P]) -> Step<NU> {
        Self::step(self, y, s, reference)
    }

    #[inline(always)]
    fn open_loop(
        &mut self,
        y: &[f32; NY],
        s: &[f32; NS],
        unsaturated: Option<&[f32; NU]>,
    ) -> Step<NU> {
        Self::open_loop(self, y, s, unsaturated)
    }

    #[inline(always)]
    fn missed(&self) -> u32 {
        self.estimator().missed()
    }

    #[inline(always)]
    fn max_missing_samples(&self) -> u16 {
        self.settings().max_missing_samples
    }

    #[inline(always)]
    fn to_model(&self, y: &[f32; NY], u: &[f32; NU]) -> ([f32; NY], [f32; NU]) {
        let scaling = self.scaling();
        (scaling.y.to_model(y), scaling.u.to_model(u))
    }

    #[inline(always)]
    fn to_physical(&self, y: &[f32; NY], s: &[f32; NS]) -> ([f32; NY], [f32; NS]) {
        let scaling = self.scaling();
        (scaling.y.to_physical(y), scaling.s.to_physical(s))
    }

    #[inline(always)]
    fn limits(&self) -> &Limits<NU> {
        self.limits()
    }

    #[inline(always)]
    fn set_limits(&mut self, limits: Limits<NU>, widest: &Limits<NU>) -> bool {
        Self::set_limits(self, limits, widest)
    }

    #[inline(always)]
    fn applied(&self) -> &[f32; NU] {
        self.applied()
    }

    #[inline(always)]
    fn tune(
        &mut self,
        tracking_weight: [f32; NY],
        move_suppression: [f32; NU],
        disturbance_gain: f32,
        iterations: u8,
    ) -> bool {
        let settings = Settings {
            tracking_weight,
            move_suppression,
            disturbance_gain,
            iterations,
            max_missing_samples: self.settings().max_missing_samples,
        };
        if !settings.is_valid() {
            return false;
        }
        *self.settings_mut() = settings;
        true
    }

    #[inline(always)]
    fn reset(&mut self) {
        Self::reset(self);
    }

    #[inline(always)]
    fn emergency_stop(&mut self) {
        Self::emergency_stop(self);
    }

    #[inline(always)]
    fn estimate(&self) -> [f32; NY] {
        let newest = self.estimator().regressor().y.first().copied();
        self.scaling()
            .y
            .to_physical(&newest.unwrap_or([f32::NAN; NY]))
    }

    #[inline(always)]
    fn disturbance(&self) -> &[f32] {
        self.estimator().disturbance()
    }

    #[inline(always)]
    fn probe(
        &self,
        point: &[f32],
        prediction: &mut impl FnMut(f32),
        derivative: &mut impl FnMut(f32),
    ) -> bool {
        let Some(regressor) = network::unflatten::<NU, NY, NS, ND, DD>(point) else {
            return false;
        };
        let (mut trace, mut jacobian) = (M::Model::TRACE, Jacobian::ZERO);
        let y = self.model().predict(&regressor, &mut trace);
        self.model().jacobian(&trace, &mut jacobian);
        for y in y {
            prediction(y);
        }
        for r in 0..NY {
            let inputs = jacobian.u.iter().filter_map(|lag| lag.get(r)).flatten();
            let outputs = jacobian.y.iter().filter_map(|lag| lag.get(r)).flatten();
            for value in inputs.chain(outputs) {
                derivative(*value);
            }
        }
        true
    }

    #[inline(always)]
    fn parts(&self, draw: &mut impl FnMut() -> f32, ticks: impl Fn() -> u32) -> Parts {
        Self::parts(self, &core::array::from_fn(|_| draw()), ticks)
    }

    #[inline(always)]
    fn most_work(&self) -> Work {
        Work::most(self.settings().iterations, NU, NV)
    }

    #[inline(always)]
    fn budget(&self) -> Option<Budget> {
        <M::Model as Tuning>::BUDGET
    }
}

impl<
    S: StateSpace<NX, NU, NM, NP>,
    const NX: usize,
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const NM: usize,
    const NP: usize,
    const NZ: usize,
    const DEPTH: usize,
    const N: usize,
    const NB: usize,
    const NV: usize,
> PredictiveLoop<NU, NY, NS, N> for StateLoop<S, NX, NU, NY, NM, NP, NZ, DEPTH, N, NB, NV>
{
    const HIDDEN_CHANNELS: bool = false;
    const POINT: usize = NU + NX + NP;
    const DERIVATIVES: usize = NX * (NU + NX);
    const PARAMETERS: usize = NP;

    fn parameter(&self, i: usize) -> (f32, f32) {
        let filter = self.filter();
        match filter.theta().get(i) {
            Some(theta) => (*theta, filter.covariance().variance(NX + NU + i)),
            None => (f32::NAN, f32::NAN),
        }
    }

    #[inline(always)]
    fn step(&mut self, y: &[f32; NY], s: &[f32; NS], reference: &[[f32; NY]; N]) -> Step<NU> {
        Self::step(self, &measurements(y, s), reference)
    }

    #[inline(always)]
    fn open_loop(
        &mut self,
        y: &[f32; NY],
        s: &[f32; NS],
        unsaturated: Option<&[f32; NU]>,
    ) -> Step<NU> {
        Self::open_loop(self, &measurements(y, s), unsaturated)
    }

    #[inline(always)]
    fn missed(&self) -> u32 {
        self.missed()
    }

    #[inline(always)]
    fn max_missing_samples(&self) -> u16 {
        self.filter().settings().max_missing_samples
    }

    fn to_model(&self, y: &[f32; NY], u: &[f32; NU]) -> ([f32; NY], [f32; NU]) {
        let scaling = self.scaling();
        let m = scaling.y.to_model(&measurements(y, &[0.0; NS]));
        (parts_of::<NY, NS, NM>(&m).0, scaling.u.to_model(u))
    }

    fn to_physical(&self, y: &[f32; NY], s: &[f32; NS]) -> ([f32; NY], [f32; NS]) {
        parts_of(
            &self
                .scaling()
                .y
                .to_physical(&measurements::<NY, NS, NM>(y, s)),
        )
    }

    #[inline(always)]
    fn limits(&self) -> &Limits<NU> {
        self.limits()
    }

    #[inline(always)]
    fn set_limits(&mut self, limits: Limits<NU>, widest: &Limits<NU>) -> bool {
        Self::set_limits(self, limits, widest)
    }

    #[inline(always)]
    fn applied(&self) -> &[f32; NU] {
        self.applied()
    }

    /// The gain sets the noise of every input's disturbance, [`DISTURBANCE_NOISE`] times the gain.
    fn tune(
        &mut self,
        tracking: [f32; NY],
        moves: [f32; NU],
        disturbance_gain: f32,
        iterations: u8,
    ) -> bool {
        let settings = StateSettings {
            weights: crate::problem::Weights { tracking, moves },
            iterations,
        };
        if !settings.is_valid() || !(0.0..=1.0).contains(&disturbance_gain) {
            return false;
        }
        *self.settings_mut() = settings;
        let noise = DISTURBANCE_NOISE * disturbance_gain;
        self.filter_mut().settings_mut().disturbance_noise = [noise; NU];
        true
    }

    #[inline(always)]
    fn reset(&mut self) {
        Self::reset(self);
    }

    #[inline(always)]
    fn emergency_stop(&mut self) {
        Self::emergency_stop(self);
    }

    fn estimate(&self) -> [f32; NY] {
        let filter = self.filter();
        let m = self.model().measure(filter.x(), filter.theta());
        parts_of::<NY, NS, NM>(&self.scaling().y.to_physical(&m)).0
    }

    #[inline(always)]
    fn disturbance(&self) -> &[f32] {
        self.filter().disturbance()
    }

    /// The point is (u, x, theta), the prediction the next state.
    fn probe(
        &self,
        point: &[f32],
        prediction: &mut impl FnMut(f32),
        derivative: &mut impl FnMut(f32),
    ) -> bool {
        if point.len() != NU + NX + NP {
            return false;
        }
        let mut values = point.iter().copied();
        let mut next = || values.next().unwrap_or(0.0);
        let u: [f32; NU] = core::array::from_fn(|_| next());
        let x: [f32; NX] = core::array::from_fn(|_| next());
        let theta: [f32; NP] = core::array::from_fn(|_| next());
        let (mut trace, mut jacobian) = (S::TRACE, TransitionJacobian::ZERO);
        let x = self.model().transition(&x, &u, &theta, &mut trace);
        self.model().transition_jacobian(&trace, &mut jacobian);
        for x in x {
            prediction(x);
        }
        for (by_u, by_x) in jacobian.u.iter().zip(&jacobian.x) {
            for value in by_u.iter().chain(by_x) {
                derivative(*value);
            }
        }
        true
    }

    #[inline(always)]
    fn parts(&self, draw: &mut impl FnMut() -> f32, ticks: impl Fn() -> u32) -> Parts {
        Self::parts(self, &core::array::from_fn(|_| draw()), ticks)
    }

    #[inline(always)]
    fn most_work(&self) -> Work {
        Work::most(self.settings().iterations, NU, NV)
    }

    #[inline(always)]
    fn budget(&self) -> Option<Budget> {
        S::BUDGET
    }
}

/// Standard deviation of the change of an input's disturbance over a period, model units, at a
/// disturbance gain of 1.
pub const DISTURBANCE_NOISE: f32 = 0.1;

/// Outputs, then channels.
#[inline(always)]
fn measurements<const NY: usize, const NS: usize, const NM: usize>(
    y: &[f32; NY],
    s: &[f32; NS],
) -> [f32; NM] {
    const { assert!(NM == NY + NS, "measurements are outputs and channels") };
    let mut m = [f32::NAN; NM];
    for (place, value) in m.iter_mut().zip(y.iter().chain(s)) {
        *place = *value;
    }
    m
}

/// The inverse of [`measurements`].
#[inline(always)]
fn parts_of<const NY: usize, const NS: usize, const NM: usize>(
    m: &[f32; NM],
) -> ([f32; NY], [f32; NS]) {
    let mut values = m.iter().copied();
    let mut next = || values.next().unwrap_or(f32::NAN);
    let y = core::array::from_fn(|_| next());
    (y, core::array::from_fn(|_| next()))
}

//! One step of a loop that knows its state: filter, optimise, limit
//! (docs/explanation/controller.md, section 10).

use crate::budget::{Interrupt, Meter, Unlimited, Until};
use crate::constraints::Bounds;
use crate::controller::{Step, scaled_bounds};
use crate::estimator::Sample;
use crate::filter::{Filter, LateFilter, StateSpace, Update};
use crate::limits::{Limiter, Limits};
use crate::model::Regressor;
use crate::move_blocking::Horizons;
use crate::newton::{self, MAX_ITERATIONS};
use crate::problem::{Plan, Problem, Weights};
use crate::scaling::ModelScaling;
use crate::state_predictor::{Outputs, StatePredictor};
use crate::status::Status;
use crate::work_bound::Parts;

/// Weights and iterations of a [`StateLoop`], model units; may change between two steps. The noise
/// of its filter is in [`Filter::settings_mut`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StateSettings<const NU: usize, const NY: usize> {
    /// Q and Lambda (eq. 4).
    pub weights: Weights<NU, NY>,
    /// Newton iterations a step, 1 to [`MAX_ITERATIONS`].
    pub iterations: u8,
}

impl<const NU: usize, const NY: usize> StateSettings<NU, NY> {
    /// Weights are numbers that are not negative, and there is an iteration.
    pub fn is_valid(&self) -> bool {
        let is_weight = |w: &f32| (0.0..f32::INFINITY).contains(w);
        self.weights.tracking.iter().all(is_weight)
            && self.weights.moves.iter().all(is_weight)
            && (1..=MAX_ITERATIONS).contains(&self.iterations)
    }
}

/// Predictive controller of a [`StateSpace`] model behind a [`LateFilter`].
///
/// `NM` measurements, of which the first `NY` are the outputs that follow the reference. `NZ = NX +
/// NU + NP` is all that is estimated, `DEPTH` periods are kept for late readings (1: none), `NB`
/// blocks of moves, `NV = NB NU` decision variables, `N` steps predicted. [`state_controller!`]
/// names them.
///
/// [`state_controller!`]: crate::state_controller
#[derive(Clone, Debug)]
pub struct StateLoop<
    S,
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
> {
    predictor: Outputs<S, NU, NM, NP>,
    scaling: ModelScaling<NU, NM, 0>,
    /// Limits in model units; `previous` is rewritten at every step.
    bounds: Bounds<NU, NV>,
    horizons: Horizons<N, NB>,
    limiter: Limiter<NU>,
    settings: StateSettings<NU, NY>,
    filter: LateFilter<NX, NU, NM, NP, NZ, DEPTH>,
    plan: Plan<NV>,
    /// The plan continues the last command; otherwise it has to be started from there.
    warm: bool,
    /// Periods in which a measurement was missing or refused, since the reset.
    missed: u32,
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
> StateLoop<S, NX, NU, NY, NM, NP, NZ, DEPTH, N, NB, NV>
{
    /// A loop at rest at the safe command. Contradictory limits are
    /// [sanitised](Limits::sanitised); settings are checked at every step.
    pub const fn new(
        model: S,
        scaling: ModelScaling<NU, NM, 0>,
        limits: Limits<NU>,
        settings: StateSettings<NU, NY>,
        filter: Filter<NX, NU, NM, NP, NZ>,
        horizons: Horizons<N, NB>,
    ) -> Self {
        const {
            assert!(
                NV == NB * NU,
                "NV is the number of decision variables, NB NU"
            );
            assert!(NB >= 1 && N >= NB, "the blocks fit the horizon");
            assert!(NY >= 1 && NY <= NM, "outputs are the first measurements");
        }
        let limiter = Limiter::new(limits);
        let bounds = scaled_bounds(limiter.limits(), &scaling, &horizons);
        Self {
            predictor: Outputs(StatePredictor {
                model,
                theta: *filter.theta(),
                disturbance: *filter.disturbance(),
            }),
            scaling,
            bounds,
            horizons,
            limiter,
            settings,
            filter: LateFilter::new(filter),
            plan: Plan::new(),
            warm: false,
            missed: 0,
        }
    }

    /// One step, all arguments in physical units: measurements (NaN: missing), r(k+1) .. r(k+N) of
    /// the outputs.
    ///
    /// The command is inside the limits exactly, for any input and whatever the status.
    /// `Step::predicted` says that at least one measurement was missing or refused. Where the model
    /// has a [`BUDGET`](StateSpace::BUDGET), the optimisation keeps to it.
    #[inline(never)]
    pub fn step(&mut self, m: &[f32; NM], reference: &[[f32; NY]; N]) -> Step<NU> {
        match S::BUDGET {
            None => self.step_while(m, reference, &mut Unlimited),
            Some(budget) => self.step_while(m, reference, &mut Meter::new(budget)),
        }
    }

    /// As [`StateLoop::step`], with a budget of time in the place of the model's: the optimisation
    /// ends soon after `stop` becomes true ([`newton::solve_until`]), with the best plan so far.
    #[inline(never)]
    pub fn step_until(
        &mut self,
        m: &[f32; NM],
        reference: &[[f32; NY]; N],
        stop: impl FnMut() -> bool,
    ) -> Step<NU> {
        self.step_while(m, reference, &mut Until(stop))
    }

    /// As [`StateLoop::step`], until `interrupt` ends the optimisation, in the place of the model's
    /// budget.
    #[inline(never)]
    pub fn step_within(
        &mut self,
        m: &[f32; NM],
        reference: &[[f32; NY]; N],
        interrupt: &mut impl Interrupt,
    ) -> Step<NU> {
        self.step_while(m, reference, interrupt)
    }

    #[inline(always)]
    fn step_while(
        &mut self,
        m: &[f32; NM],
        reference: &[[f32; NY]; N],
        interrupt: &mut impl Interrupt,
    ) -> Step<NU> {
        let sample = self.observe(m);
        let mut step = Step {
            u: [0.0; NU],
            status: Status::SignalLost,
            iterations: 0,
            cost: 0.0,
            predicted: sample == Sample::Predicted,
        };
        self.bounds.previous = self.scaling.u.to_model(self.limiter.applied());
        if sample == Sample::SignalLost {
            step.u = self.limiter.ramp_to_safe();
            self.warm = false;
        } else {
            self.optimise(reference, &mut step, interrupt);
            let planned = self.plan.first(&self.horizons, &self.bounds.previous);
            step.u = self.limiter.limit(&self.scaling.u.to_physical(&planned));
        }
        self.apply(&step.u);
        step
    }

    /// A step without an optimisation: the estimate is kept up, and the command goes where it is
    /// asked to (`None`: to the safe command), inside the limits.
    #[inline(never)]
    pub fn open_loop(&mut self, m: &[f32; NM], unsaturated: Option<&[f32; NU]>) -> Step<NU> {
        let sample = self.observe(m);
        self.warm = false;
        let (u, status) = match unsaturated {
            Some(unsaturated) => (self.limiter.limit(unsaturated), Status::OpenLoop),
            None => (self.limiter.ramp_to_safe(), Status::Disarmed),
        };
        self.apply(&u);
        Step {
            u,
            status,
            iterations: 0,
            cost: 0.0,
            predicted: sample == Sample::Predicted,
        }
    }

    /// Takes measurements of `age` periods before the last step, physical units; NaN: none. To be
    /// called between two steps. `None` where that period is no longer kept.
    pub fn late(&mut self, age: usize, m: &[f32; NM]) -> Option<Update<NM>> {
        let scaled = self.scaling.y.to_model(m);
        self.filter.late(&self.predictor.0.model, age, &scaled)
    }

    fn observe(&mut self, m: &[f32; NM]) -> Sample {
        let scaled = self.scaling.y.to_model(m);
        let sample = self.filter.update(&self.predictor.0.model, &scaled).sample;
        if sample != Sample::Measured {
            self.missed = self.missed.wrapping_add(1);
        }
        sample
    }

    fn apply(&mut self, u: &[f32; NU]) {
        let scaled = self.scaling.u.to_model(u);
        self.filter.predict(&self.predictor.0.model, &scaled);
    }

    /// Continues the plan of the last step and improves it, if the request makes sense.
    fn optimise(
        &mut self,
        reference: &[[f32; NY]; N],
        step: &mut Step<NU>,
        interrupt: &mut impl Interrupt,
    ) {
        if self.warm {
            self.plan.shift::<NU, N, NB>(&self.horizons);
        } else {
            self.plan.hold(&self.bounds.previous);
            self.warm = true;
        }
        let mut scaled = *reference;
        let units = self.scaling.y.span.iter().zip(&self.scaling.y.offset);
        for row in &mut scaled {
            for (r, (span, offset)) in row.iter_mut().zip(units.clone()) {
                *r = (*r - offset) / span;
            }
        }
        if !scaled.as_flattened().iter().all(|r| r.is_finite()) {
            step.status = Status::BadReference;
            return;
        }
        if !self.settings.is_valid() {
            step.status = Status::BadSettings;
            return;
        }
        self.predictor.0.follow(self.filter.filter());
        let problem = Problem {
            model: &self.predictor,
            start: &self.start(),
            disturbance: &[0.0; NY],
            reference: &scaled,
            weights: self.settings.weights,
            bounds: &self.bounds,
            horizons: &self.horizons,
        };
        let iterations = self.settings.iterations;
        let outcome = newton::solve_within(&problem, &mut self.plan, iterations, interrupt);
        step.status = outcome.status;
        step.iterations = outcome.iterations;
        step.cost = outcome.cost;
    }

    /// Forgets the plan and the state, and begins at rest. Disturbance and parameters are kept, and
    /// so is the command applied last: an actuator stays where it is.
    pub fn reset(&mut self) {
        self.forget(Filter::rest);
    }

    fn forget(&mut self, start: impl FnOnce(&mut Filter<NX, NU, NM, NP, NZ>)) {
        let mut filter = *self.filter.filter();
        start(&mut filter);
        self.filter = LateFilter::new(filter);
        self.warm = false;
        self.missed = 0;
    }

    /// One step towards the safe command, physical units: what to call when control ends. Resets,
    /// without a belief that the plant is at rest.
    pub fn ramp_to_safe(&mut self) -> [f32; NU] {
        let u = self.limiter.ramp_to_safe();
        self.forget(Filter::restart);
        u
    }

    /// The safe command at once, without regard to the rate: an emergency stop. Resets, without a
    /// belief that the plant is at rest.
    pub fn emergency_stop(&mut self) {
        self.limiter.emergency_stop();
        self.forget(Filter::restart);
    }

    /// Replaces the limits; `false`, and nothing is changed, unless they lie within `widest` and
    /// hold both the safe command and the one applied last.
    pub fn set_limits(&mut self, limits: Limits<NU>, widest: &Limits<NU>) -> bool {
        if !limits.is_within(widest) || !limits.contain(self.limiter.applied()) {
            return false;
        }
        self.limiter.set_limits(limits);
        self.bounds = scaled_bounds(self.limiter.limits(), &self.scaling, &self.horizons);
        true
    }

    /// The limits in force, physical units.
    pub const fn limits(&self) -> &Limits<NU> {
        self.limiter.limits()
    }

    /// Scaling between physical and model units; `y` is of the measurements.
    pub const fn scaling(&self) -> &ModelScaling<NU, NM, 0> {
        &self.scaling
    }

    /// Transition and measurements.
    pub const fn model(&self) -> &S {
        &self.predictor.0.model
    }

    /// Periods in which a measurement was missing or refused, since the reset.
    pub const fn missed(&self) -> u32 {
        self.missed
    }

    /// Weights and iterations, as they are at the next step.
    pub const fn settings(&self) -> &StateSettings<NU, NY> {
        &self.settings
    }

    /// Cost of the parts of an optimisation here and now, with a reference of zeros: for bounds,
    /// not for control ([`work_bound`](crate::work_bound)). Changes nothing.
    pub fn parts(&self, plan: &[f32; NV], ticks: impl Fn() -> u32) -> Parts {
        let problem = Problem {
            model: &self.predictor,
            start: &self.start(),
            disturbance: &[0.0; NY],
            reference: &[[0.0; NY]; N],
            weights: self.settings.weights,
            bounds: &self.bounds,
            horizons: &self.horizons,
        };
        Parts::measure(&problem, plan, ticks)
    }

    /// The state estimate as the solver takes it.
    #[inline(always)]
    fn start(&self) -> Regressor<NU, NY, NX, 1, 1> {
        Regressor {
            u: [self.bounds.previous],
            y: [[0.0; NY]],
            s: *self.filter.filter().x(),
        }
    }

    /// The command applied last, physical units.
    pub const fn applied(&self) -> &[f32; NU] {
        self.limiter.applied()
    }

    /// The filter: state, disturbance, parameters and their covariance, in model units.
    pub const fn filter(&self) -> &Filter<NX, NU, NM, NP, NZ> {
        self.filter.filter()
    }

    /// The filter, to change its settings between two steps.
    pub const fn filter_mut(&mut self) -> &mut Filter<NX, NU, NM, NP, NZ> {
        self.filter.filter_mut()
    }

    /// The weights, to be changed between two steps; checked at the next one.
    pub const fn settings_mut(&mut self) -> &mut StateSettings<NU, NY> {
        &mut self.settings
    }

    /// Planned commands of the last step at the ends of the blocks, model units, time-major.
    pub const fn plan(&self) -> &[f32; NV] {
        &self.plan.u
    }
}

/// Names of a state controller's const parameters, and its types.
///
/// Prints the constants `STATES`, `INPUTS`, `OUTPUTS`, `MEASUREMENTS` and `PARAMETERS`, with which
/// a [`StateSpace`] is implemented, and the types `Filter`, `FilterSettings`, `Prior`,
/// `TransitionJacobian`, `MeasurementJacobian`, `Scaling`, `Horizons` and `Controller`.
///
/// `examples/state_space.rs` is complete.
#[macro_export]
macro_rules! state_controller {
    (
        model: $model:ty,
        states: $states:expr,
        inputs: $inputs:expr,
        outputs: $outputs:expr,
        measurements: $measurements:expr,
        parameters: $parameters:expr,
        periods_kept: $periods_kept:expr,
        horizon: $horizon:expr,
        move_blocks: $move_blocks:expr $(,)?
    ) => {
        /// States.
        pub const STATES: usize = $states;
        /// Commands.
        pub const INPUTS: usize = $inputs;
        /// Outputs that follow the reference: the first measurements.
        pub const OUTPUTS: usize = $outputs;
        /// Measurements.
        pub const MEASUREMENTS: usize = $measurements;
        /// Parameters that are estimated.
        pub const PARAMETERS: usize = $parameters;
        /// Estimator of state, disturbance and parameters.
        pub type Filter = $crate::filter::Filter<
            { $states },
            { $inputs },
            { $measurements },
            { $parameters },
            { $states + $inputs + $parameters },
        >;
        /// Noise and rules of the filter.
        pub type FilterSettings = $crate::filter::FilterSettings<
            { $states },
            { $inputs },
            { $measurements },
            { $parameters },
        >;
        /// Belief of the filter before any reading.
        pub type Prior = $crate::filter::Prior<{ $states }, { $inputs }, { $parameters }>;
        /// Derivatives of the next state.
        pub type TransitionJacobian =
            $crate::filter::TransitionJacobian<{ $states }, { $inputs }, { $parameters }>;
        /// Derivatives of the measurements.
        pub type MeasurementJacobian =
            $crate::filter::MeasurementJacobian<{ $states }, { $measurements }, { $parameters }>;
        /// Scaling between physical and model units; `y` is of the measurements.
        pub type Scaling = $crate::scaling::ModelScaling<{ $inputs }, { $measurements }, 0>;
        /// Horizons and the blocks of the plan.
        pub type Horizons = $crate::move_blocking::Horizons<{ $horizon }, { $move_blocks }>;
        /// The controller.
        pub type Controller = $crate::state_loop::StateLoop<
            $model,
            { $states },
            { $inputs },
            { $outputs },
            { $measurements },
            { $parameters },
            { $states + $inputs + $parameters },
            { $periods_kept },
            { $horizon },
            { $move_blocks },
            { $inputs * $move_blocks },
        >;
    };
}

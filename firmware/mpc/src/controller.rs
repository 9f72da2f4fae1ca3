//! One step of the loop: measure, estimate, optimise, limit.

use crate::budget::{Interrupt, Meter, Unlimited, Until};
use crate::constraints::Bounds;
use crate::cost::CostTerm;
use crate::estimator::{Estimator, Sample};
use crate::limits::{Limiter, Limits};
use crate::move_blocking::Horizons;
use crate::newton;
use crate::problem::{Plan, Problem, Weights};
use crate::scaling::ModelScaling;
pub use crate::settings::{InvalidSetting, Settings};
use crate::status::Status;
use crate::tuning::Tuning;
use crate::work_bound::Parts;

/// The result of a step.
#[must_use]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step<const NU: usize> {
    /// Command, physical units, inside the limits.
    pub u: [f32; NU],
    /// Status of the step.
    pub status: Status,
    /// Newton iterations (linearisations).
    pub iterations: u8,
    /// J of the plan that is followed; 0 where nothing was optimised.
    pub cost: f32,
    /// At least one output was missing; its prediction stood in.
    pub predicted: bool,
}

/// The controller of one rig. `NB` blocks of moves, `NV = NB NU` decision variables, `N` steps
/// predicted. `P` rows of the reference are seen: those of the horizon and, where a cost-to-go
/// stands at its end, those ahead of it.
#[derive(Clone, Debug)]
pub struct ControlLoop<
    M,
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
    const N: usize,
    const NB: usize,
    const NV: usize,
    const P: usize = N,
> {
    model: M,
    scaling: ModelScaling<NU, NY, NS>,
    /// Limits in model units; `previous` is rewritten at every step.
    bounds: Bounds<NU, NV>,
    horizons: Horizons<N, NB>,
    limiter: Limiter<NU>,
    settings: Settings<NU, NY>,
    estimator: Estimator<NU, NY, NS, ND, DD>,
    plan: Plan<NV>,
    /// The plan continues the last command; otherwise it has to be started from there.
    warm: bool,
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
> ControlLoop<M, NU, NY, NS, ND, DD, N, NB, NV, P>
{
    /// A loop at rest at the safe command. Contradictory limits are
    /// [sanitised](Limits::sanitised); settings are checked at every step.
    pub const fn new(
        model: M,
        scaling: ModelScaling<NU, NY, NS>,
        limits: Limits<NU>,
        settings: Settings<NU, NY>,
        horizons: Horizons<N, NB>,
    ) -> Self {
        const {
            assert!(
                NV == NB * NU,
                "NV is the number of decision variables, NB NU"
            );
            assert!(NB >= 1 && N >= NB, "the blocks fit the horizon");
            assert!(P >= N, "every predicted step has a row of the reference");
        }
        let limiter = Limiter::new(limits);
        let bounds = scaled_bounds(limiter.limits(), &scaling, &horizons);
        Self {
            model,
            scaling,
            bounds,
            horizons,
            limiter,
            settings,
            estimator: Estimator::new(bounds.previous),
            plan: Plan::new(),
            warm: false,
        }
    }

    /// One step, all arguments in physical units: measured outputs (NaN: missing), sensor channels,
    /// r(k+1) .. r(k+P).
    ///
    /// The command is inside the limits exactly, for any input and whatever the status. Where the
    /// model has a [`BUDGET`](crate::Tuning::BUDGET), the optimisation keeps to it.
    #[inline(never)]
    pub fn step(&mut self, y: &[f32; NY], s: &[f32; NS], reference: &[[f32; NY]; P]) -> Step<NU> {
        match <M::Model as Tuning>::BUDGET {
            None => self.step_while(y, s, reference, &mut Unlimited),
            Some(budget) => self.step_while(y, s, reference, &mut Meter::new(budget)),
        }
    }

    /// As [`ControlLoop::step`], with a budget of time in the place of the model's: the
    /// optimisation ends soon after `stop` becomes true ([`newton::solve_until`]), with the best
    /// plan so far.
    ///
    /// ```
    /// # use sinew_mpc::{Limits, Model, Propagate, Settings, Status, Tuning};
    /// # sinew_mpc::controller! {
    /// #     model: Lag, inputs: 1, outputs: 1, channels: 0, past_inputs: 1, past_outputs: 1,
    /// #     horizon: 10, move_blocks: 2,
    /// # }
    /// # struct Lag;
    /// # impl Model<INPUTS, OUTPUTS, CHANNELS, PAST_INPUTS, PAST_OUTPUTS> for Lag {
    /// #     type Trace = ();
    /// #     const TRACE: () = ();
    /// #     fn predict(&self, x: &Regressor, _: &mut ()) -> [f32; OUTPUTS] {
    /// #         [0.9 * x.y[0][0] + 0.1 * x.u[0][0]]
    /// #     }
    /// #     fn jacobian(&self, _: &(), jacobian: &mut Jacobian) {
    /// #         jacobian.y[0][0][0] = 0.9;
    /// #         jacobian.u[0][0][0] = 0.1;
    /// #     }
    /// # }
    /// # impl Propagate<INPUTS, OUTPUTS, CHANNELS, PAST_INPUTS, PAST_OUTPUTS> for Lag {}
    /// # impl Tuning for Lag {}
    /// # let limits = Limits { lower: [-1.0], upper: [1.0], rate: [0.5], safe: [0.0] };
    /// # let settings = Settings {
    /// #     tracking_weight: [1.0], move_suppression: [0.01], disturbance_gain: 0.5, iterations: 2,
    /// #     max_missing_samples: 5,
    /// # };
    /// # let horizons = Horizons::new(1, [1, 2]);
    /// # let mut controller = Controller::new(Lag, Scaling::IDENTITY, limits, settings, horizons);
    /// // On a board: `|| timer.ticks().wrapping_sub(start) > budget`.
    /// let mut asked = 0;
    /// let stop = || {
    ///     asked += 1;
    ///     asked > 3
    /// };
    /// let step = controller.step_until(&[0.0], &[], &[[0.5]; 10], stop);
    /// assert!(step.status.is_controlled() && step.u[0].abs() <= 0.5);
    /// ```
    #[inline(never)]
    pub fn step_until(
        &mut self,
        y: &[f32; NY],
        s: &[f32; NS],
        reference: &[[f32; NY]; P],
        stop: impl FnMut() -> bool,
    ) -> Step<NU> {
        self.step_while(y, s, reference, &mut Until(stop))
    }

    /// As [`ControlLoop::step`], until `interrupt` ends the optimisation, in the place of the
    /// model's budget.
    #[inline(never)]
    pub fn step_within(
        &mut self,
        y: &[f32; NY],
        s: &[f32; NS],
        reference: &[[f32; NY]; P],
        interrupt: &mut impl Interrupt,
    ) -> Step<NU> {
        self.step_while(y, s, reference, interrupt)
    }

    #[inline(always)]
    fn step_while(
        &mut self,
        y: &[f32; NY],
        s: &[f32; NS],
        reference: &[[f32; NY]; P],
        interrupt: &mut impl Interrupt,
    ) -> Step<NU> {
        let valid = self.settings.is_valid();
        let sample = self.observe(y, s, valid);
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
            self.optimise(reference, valid, &mut step, interrupt);
            let unsaturated = self
                .scaling
                .u
                .to_physical(&self.plan.first(&self.horizons, &self.bounds.previous));
            step.u = self.limiter.limit(&unsaturated);
        }
        self.estimator.apply(&self.scaling.u.to_model(&step.u));
        step
    }

    /// A step without an optimisation: the past is kept up, and the command goes where it is asked
    /// to (`None`: to the safe command), inside the limits. A plan starts anew afterwards, from
    /// there.
    #[inline(never)]
    pub fn open_loop(
        &mut self,
        y: &[f32; NY],
        s: &[f32; NS],
        unsaturated: Option<&[f32; NU]>,
    ) -> Step<NU> {
        let sample = self.observe(y, s, self.settings.is_valid());
        self.warm = false;
        let (u, status) = match unsaturated {
            Some(unsaturated) => (self.limiter.limit(unsaturated), Status::OpenLoop),
            None => (self.limiter.ramp_to_safe(), Status::Disarmed),
        };
        self.estimator.apply(&self.scaling.u.to_model(&u));
        Step {
            u,
            status,
            iterations: 0,
            cost: 0.0,
            predicted: sample == Sample::Predicted,
        }
    }

    fn observe(&mut self, y: &[f32; NY], s: &[f32; NS], valid: bool) -> Sample {
        let gain = if valid {
            self.settings.disturbance_gain
        } else {
            0.0
        };
        self.estimator.observe(
            self.model.model(),
            &self.scaling.y.to_model(y),
            &self.scaling.s.to_model(s),
            gain,
            self.settings.max_missing_samples,
        )
    }

    /// Continues the plan of the last step and improves it, if the request makes sense.
    fn optimise(
        &mut self,
        reference: &[[f32; NY]; P],
        valid: bool,
        step: &mut Step<NU>,
        interrupt: &mut impl Interrupt,
    ) {
        if self.warm {
            self.plan.shift::<NU, N, NB>(&self.horizons);
        } else {
            self.plan.hold(&self.bounds.previous);
            self.warm = true;
        }
        let mut scaled = [[0.0; NY]; P];
        for (scaled, reference) in scaled.iter_mut().zip(reference) {
            *scaled = self.scaling.y.to_model(reference);
        }
        let finite = scaled.as_flattened().iter().all(|r| r.is_finite());
        if !finite || !valid {
            step.status = if finite {
                Status::BadSettings
            } else {
                Status::BadReference
            };
            return;
        }
        // The constructor holds that there are as many.
        let Some(predicted) = scaled.first_chunk::<N>() else {
            return;
        };
        let disturbance = self.estimator.disturbance();
        (self.model).prepare(scaled.get(N - 1..).unwrap_or_default(), disturbance);
        let problem = Problem {
            model: &self.model,
            start: self.estimator.regressor(),
            disturbance,
            reference: predicted,
            weights: Weights {
                tracking: self.settings.tracking_weight,
                moves: self.settings.move_suppression,
            },
            bounds: &self.bounds,
            horizons: &self.horizons,
        };
        let iterations = self.settings.iterations;
        let outcome = newton::solve_within(&problem, &mut self.plan, iterations, interrupt);
        step.status = outcome.status;
        step.iterations = outcome.iterations;
        step.cost = outcome.cost;
    }

    /// Cost of the parts of an optimisation here and now, with a reference of zeros: for bounds,
    /// not for control ([`work_bound`](crate::work_bound)). Changes nothing.
    pub fn parts(&self, plan: &[f32; NV], ticks: impl Fn() -> u32) -> Parts {
        let problem = Problem {
            model: &self.model,
            start: self.estimator.regressor(),
            disturbance: self.estimator.disturbance(),
            reference: &[[0.0; NY]; N],
            weights: Weights {
                tracking: self.settings.tracking_weight,
                moves: self.settings.move_suppression,
            },
            bounds: &self.bounds,
            horizons: &self.horizons,
        };
        Parts::measure(&problem, plan, ticks)
    }

    /// Forgets the plan, the history and the disturbance. The command applied last is *not*
    /// forgotten: an actuator stays where it is, and the rate holds across a reset too.
    pub fn reset(&mut self) {
        let applied = self.scaling.u.to_model(self.limiter.applied());
        self.estimator.reset(applied);
        self.warm = false;
    }

    /// One step towards the safe command, physical units: what to call when control ends. The past
    /// is forgotten, as by [`ControlLoop::reset`]; control may start again at any time.
    pub fn ramp_to_safe(&mut self) -> [f32; NU] {
        let u = self.limiter.ramp_to_safe();
        self.reset();
        u
    }

    /// The safe command at once, without regard to the rate: an emergency stop. The past is
    /// forgotten.
    pub fn emergency_stop(&mut self) {
        self.limiter.emergency_stop();
        self.reset();
    }

    /// Replaces the limits; `false`, and nothing is changed, unless they are finite where the old
    /// ones are, lie within `widest`, and hold both the safe command and the one applied last.
    pub fn set_limits(&mut self, limits: Limits<NU>, widest: &Limits<NU>) -> bool {
        if !limits.is_within(widest) || !limits.contain(self.limiter.applied()) {
            return false;
        }
        self.limiter.set_limits(limits);
        self.bounds = scaled_bounds(self.limiter.limits(), &self.scaling, &self.horizons);
        true
    }

    /// The command applied last, physical units.
    pub const fn applied(&self) -> &[f32; NU] {
        self.limiter.applied()
    }

    /// The settings in force.
    pub const fn settings(&self) -> &Settings<NU, NY> {
        &self.settings
    }

    /// The settings, to be changed; checked at the next step.
    pub const fn settings_mut(&mut self) -> &mut Settings<NU, NY> {
        &mut self.settings
    }

    /// Planned commands of the last step at the ends of the blocks, model units, time-major.
    pub const fn plan(&self) -> &[f32; NV] {
        &self.plan.u
    }

    /// The predictor.
    pub fn model(&self) -> &M::Model {
        self.model.model()
    }

    /// The estimator.
    pub const fn estimator(&self) -> &Estimator<NU, NY, NS, ND, DD> {
        &self.estimator
    }

    /// The limits in force, physical units.
    pub const fn limits(&self) -> &Limits<NU> {
        self.limiter.limits()
    }

    /// The scaling between physical and model units.
    pub const fn scaling(&self) -> &ModelScaling<NU, NY, NS> {
        &self.scaling
    }
}

/// Limits in model units: near enough for planning, the limiter has the exact ones.
pub(crate) const fn scaled_bounds<
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const N: usize,
    const NB: usize,
    const NV: usize,
>(
    limits: &Limits<NU>,
    scaling: &ModelScaling<NU, NY, NS>,
    horizons: &Horizons<N, NB>,
) -> Bounds<NU, NV> {
    let mut bounds = Bounds {
        lower: [0.0; NU],
        upper: [0.0; NU],
        rate: [0.0; NV],
        previous: [0.0; NU],
    };
    let mut i = 0;
    while i < NU {
        let span = scaling.u.span[i];
        let offset = scaling.u.offset[i];
        let lower = (limits.lower[i] - offset) / span;
        let upper = (limits.upper[i] - offset) / span;
        // A negative span turns the axis round.
        let turned = span < 0.0;
        bounds.lower[i] = if turned { upper } else { lower };
        bounds.upper[i] = if turned { lower } else { upper };
        let rate = limits.rate[i] / if turned { -span } else { span };
        let mut b = 0;
        while b < NB {
            bounds.rate[b * NU + i] = rate * horizons.length[b] as f32;
            b += 1;
        }
        bounds.previous[i] = (limits.safe[i] - offset) / span;
        i += 1;
    }
    bounds
}

//! Derivatives of an optimal plan by everything that it depends on
//! (docs/explanation/controller.md, eq. 22): for tuning, learning, and how far an error reaches.
//! No control step calls this, and nothing of it is in an image that does not.
//!
//! At the optimum half the gradient F of J vanishes along every direction that the active limits
//! leave free. With K the derivative of F by the plan and E the free directions, a change dF moves
//! the plan by `-E (E' K E)^-1 E' dF`. F is linear in the weights and in the reference; by all
//! else, and by the plan, its derivatives are differences of the exact gradient. They are good to a
//! few parts in 10,000, as single precision allows.

use crate::active_set::reduced_step;
use crate::constraints::{Bounds, Side};
use crate::cost::{CostTerm, Quadratic};
use crate::model::{Model, Regressor};
use crate::problem::{Plan, Problem, Weights};
use crate::rollout::Trajectory;

/// Half the distance between two gradients, in model units.
const STEP: f32 = 1.0 / 128.0;

/// Derivatives of a plan; the last index is the decision variable.
#[derive(Clone, Debug, PartialEq)]
pub struct PlanDerivatives<
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
    const N: usize,
    const NV: usize,
> {
    /// By the tracking weight of each output.
    pub tracking: [[f32; NV]; NY],
    /// By the move suppression of each input.
    pub moves: [[f32; NV]; NU],
    /// By r(k+1) .. r(k+N). What a cost-to-go sees of the reference is held.
    pub reference: [[[f32; NV]; NY]; N],
    /// By the disturbance of each output.
    pub disturbance: [[f32; NV]; NY],
    /// By the command applied last, as the limits and the first move see it.
    pub previous: [[f32; NV]; NU],
    /// By u(k), u(k-1) .. of the regressor; the first is a place for u(k) and has no effect.
    pub u: [[[f32; NV]; NU]; ND],
    /// By y(k), y(k-1) .. of the regressor.
    pub y: [[[f32; NV]; NY]; DD],
    /// By the channels.
    pub s: [[f32; NV]; NS],
}

/// Derivatives of a plan that [`solve`](crate::newton::solve) has brought to its optimum, at its
/// active set; `None` where one of them is not finite.
///
/// Cost: two gradients for each decision variable and for each number that is differentiated by.
///
/// ```
/// # use sinew_mpc::model::{Jacobian, Model, Regressor};
/// # use sinew_mpc::sensitivity::Propagate;
/// # struct Lag;
/// # impl Model<1, 1, 0, 1, 1> for Lag {
/// #     type Trace = ();
/// #     const TRACE: () = ();
/// #     fn predict(&self, x: &Regressor<1, 1, 0, 1, 1>, _: &mut ()) -> [f32; 1] {
/// #         [0.5 * x.y[0][0] + 0.5 * x.u[0][0]]
/// #     }
/// #     fn jacobian(&self, _: &(), jacobian: &mut Jacobian<1, 1, 1, 1>) {
/// #         jacobian.y[0][0][0] = 0.5;
/// #         jacobian.u[0][0][0] = 0.5;
/// #     }
/// # }
/// # impl sinew_mpc::Tuning for Lag {}
/// # impl Propagate<1, 1, 0, 1, 1> for Lag {}
/// use sinew_mpc::{Bounds, Horizons, Plan, Problem, Weights, differentiate, solve};
///
/// // The model `Lag` is y(k+1) = 0.5 y(k) + 0.5 u(k); one step, no cost of moves: u is what leads
/// // to r, 2 r - y.
/// let problem = Problem {
///     model: &Lag,
///     start: &Regressor { u: [[0.0]], y: [[0.1]], s: [] },
///     disturbance: &[0.0],
///     reference: &[[0.3]; 1],
///     weights: Weights { tracking: [1.0], moves: [0.0] },
///     bounds: &Bounds { lower: [-1.0], upper: [1.0], rate: [1.0], previous: [0.0] },
///     horizons: &Horizons::new(1, [1]),
/// };
/// let mut plan = Plan::<1>::new();
/// let _ = solve(&problem, &mut plan, 4);
/// let derivatives = differentiate(&problem, &plan).expect("they are finite");
/// assert!((derivatives.reference[0][0][0] - 2.0).abs() < 1e-3);
/// assert!((derivatives.y[0][0][0] + 1.0).abs() < 1e-3);
/// ```
pub fn differentiate<
    M: CostTerm<NU, NY, NS, ND, DD>,
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
    const N: usize,
    const NB: usize,
    const NV: usize,
>(
    problem: &Problem<'_, M, NU, NY, NS, ND, DD, N, NB, NV>,
    plan: &Plan<NV>,
) -> Option<PlanDerivatives<NU, NY, NS, ND, DD, N, NV>> {
    let here = Optimum {
        problem,
        plan,
        curvature: curvature(problem, plan),
    };
    let still = [0.0; NV];
    let mut found = PlanDerivatives {
        tracking: [still; NY],
        moves: [still; NU],
        reference: [[still; NY]; N],
        disturbance: [still; NY],
        previous: [still; NU],
        u: [[still; NU]; ND],
        y: [[still; NY]; DD],
        s: [still; NS],
    };
    for (r, place) in found.tracking.iter_mut().enumerate() {
        *place = here.by_weight(|weights| weights.tracking.get_mut(r));
    }
    for (c, place) in found.moves.iter_mut().enumerate() {
        *place = here.by_weight(|weights| weights.moves.get_mut(c));
    }
    for (j, row) in found.reference.iter_mut().enumerate() {
        for (r, place) in row.iter_mut().enumerate() {
            *place = here.by(|step| {
                let mut reference = *problem.reference;
                add(reference.get_mut(j).and_then(|row| row.get_mut(r)), step);
                gradient(
                    &Problem {
                        reference: &reference,
                        ..*problem
                    },
                    plan,
                )
            });
        }
    }
    for (r, place) in found.disturbance.iter_mut().enumerate() {
        *place = here.by(|step| {
            let mut disturbance = *problem.disturbance;
            add(disturbance.get_mut(r), step);
            gradient(
                &Problem {
                    disturbance: &disturbance,
                    ..*problem
                },
                plan,
            )
        });
    }
    for (lag, row) in found.u.iter_mut().enumerate() {
        for (c, place) in row.iter_mut().enumerate() {
            *place = here.by_start(|x| x.u.get_mut(lag).and_then(|row| row.get_mut(c)));
        }
    }
    for (lag, row) in found.y.iter_mut().enumerate() {
        for (r, place) in row.iter_mut().enumerate() {
            *place = here.by_start(|x| x.y.get_mut(lag).and_then(|row| row.get_mut(r)));
        }
    }
    for (c, place) in found.s.iter_mut().enumerate() {
        *place = here.by_start(|x| x.s.get_mut(c));
    }
    for (c, place) in found.previous.iter_mut().enumerate() {
        *place = here.by_previous(c);
    }
    found.is_finite().then_some(found)
}

impl<
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
    const N: usize,
    const NV: usize,
> PlanDerivatives<NU, NY, NS, ND, DD, N, NV>
{
    fn is_finite(&self) -> bool {
        let rows = self.tracking.iter().chain(&self.moves);
        let rows = rows.chain(self.reference.as_flattened());
        let rows = rows.chain(&self.disturbance).chain(&self.previous);
        let rows = rows
            .chain(self.u.as_flattened())
            .chain(self.y.as_flattened());
        (rows.chain(&self.s).flatten()).all(|value| value.is_finite())
    }
}

fn add(place: Option<&mut f32>, step: f32) {
    if let Some(place) = place {
        *place += step;
    }
}

/// F: half the gradient of J at a plan.
fn gradient<
    M: CostTerm<NU, NY, NS, ND, DD>,
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
    const N: usize,
    const NB: usize,
    const NV: usize,
>(
    problem: &Problem<'_, M, NU, NY, NS, ND, DD, N, NB, NV>,
    plan: &Plan<NV>,
) -> [f32; NV] {
    let mut trajectory = const { Trajectory::new(M::Model::TRACE, M::RESIDUALS) };
    let mut quadratic = Quadratic::new();
    problem.rollout(&plan.u, &mut trajectory);
    problem.linearise(&plan.u, &trajectory, &mut quadratic);
    quadratic.gradient
}

/// K: the derivative of F by the plan, symmetric.
fn curvature<
    M: CostTerm<NU, NY, NS, ND, DD>,
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
    const N: usize,
    const NB: usize,
    const NV: usize,
>(
    problem: &Problem<'_, M, NU, NY, NS, ND, DD, N, NB, NV>,
    plan: &Plan<NV>,
) -> Quadratic<NV> {
    let mut curvature = Quadratic::new();
    for v in 0..NV {
        let at = |step: f32| {
            let mut moved = plan.clone();
            add(moved.u.get_mut(v), step);
            gradient(problem, &moved)
        };
        for (w, slope) in between(at).iter().enumerate() {
            curvature.add(v, w, 0.5 * slope);
            curvature.add(w, v, 0.5 * slope);
        }
    }
    curvature
}

/// Central difference.
fn between<const NV: usize>(at: impl Fn(f32) -> [f32; NV]) -> [f32; NV] {
    let (mut slope, below) = (at(STEP), at(-STEP));
    for (slope, below) in slope.iter_mut().zip(&below) {
        *slope = (*slope - below) / (2.0 * STEP);
    }
    slope
}

/// A problem, its plan, and K there.
struct Optimum<
    'a,
    M,
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
    const N: usize,
    const NB: usize,
    const NV: usize,
> {
    problem: &'a Problem<'a, M, NU, NY, NS, ND, DD, N, NB, NV>,
    plan: &'a Plan<NV>,
    curvature: Quadratic<NV>,
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
> Optimum<'_, M, NU, NY, NS, ND, DD, N, NB, NV>
{
    /// Motion of the plan where F changes by `change`.
    fn moved(&self, change: &[f32; NV]) -> [f32; NV] {
        let active = &self.plan.active;
        reduced_step::<NU, NV>(&self.curvature, change, active, active.is_empty())
    }

    fn by(&self, at: impl Fn(f32) -> [f32; NV]) -> [f32; NV] {
        self.moved(&between(at))
    }

    /// F is the sum of its parts, a weight times a part each.
    fn by_weight(&self, place: impl Fn(&mut Weights<NU, NY>) -> Option<&mut f32>) -> [f32; NV] {
        let with = |value: f32| {
            let mut weights = Weights {
                tracking: [0.0; NY],
                moves: [0.0; NU],
            };
            add(place(&mut weights), value);
            gradient(
                &Problem {
                    weights,
                    ..*self.problem
                },
                self.plan,
            )
        };
        let (mut change, none) = (with(1.0), with(0.0));
        for (change, none) in change.iter_mut().zip(&none) {
            *change -= none;
        }
        self.moved(&change)
    }

    fn by_start(
        &self,
        place: impl Fn(&mut Regressor<NU, NY, NS, ND, DD>) -> Option<&mut f32>,
    ) -> [f32; NV] {
        self.by(|step| {
            let mut start = *self.problem.start;
            add(place(&mut start), step);
            gradient(
                &Problem {
                    start: &start,
                    ..*self.problem
                },
                self.plan,
            )
        })
    }

    /// Commands that rates tie to the last one move along with it; what that does to F moves the
    /// others.
    fn by_previous(&self, channel: usize) -> [f32; NV] {
        let mut carried = [0.0; NV];
        let edges = self.plan.active.edge.iter();
        let places = carried.iter_mut().zip(edges);
        for (place, edge) in places.skip(channel).step_by(NU) {
            if *edge == Side::Free {
                break;
            }
            *place = 1.0;
        }
        let mut change = between(|step| {
            let mut bounds: Bounds<NU, NV> = *self.problem.bounds;
            add(bounds.previous.get_mut(channel), step);
            gradient(
                &Problem {
                    bounds: &bounds,
                    ..*self.problem
                },
                self.plan,
            )
        });
        let along = self.curvature.hessian_times(&carried);
        for (change, along) in change.iter_mut().zip(&along) {
            *change += along;
        }
        let mut moved = self.moved(&change);
        for (moved, carried) in moved.iter_mut().zip(&carried) {
            *moved += carried;
        }
        moved
    }
}

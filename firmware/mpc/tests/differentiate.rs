//! Derivatives of a plan against differences of plans that are solved anew, with limits active.

mod common;

use common::{Random, Shallow};
use sinew_mpc::active_set;
use sinew_mpc::model::Regressor;
use sinew_mpc::{Bounds, Horizons, Plan, Problem, Weights, differentiate, solve};

type Net = Shallow<9, 5, 2>;
type Nets<'a> = Problem<'a, Net, 2, 2, 1, 2, 2, 6, 3, 6>;

/// The same sequence of changes of a problem and of its derivatives.
#[derive(Clone, Copy, Debug)]
enum By {
    Tracking(usize),
    Moves(usize),
    Reference(usize, usize),
    Disturbance(usize),
    Previous(usize),
    PastCommand(usize),
    PastOutput(usize, usize),
    Channel,
}

const ALL: [By; 13] = [
    By::Tracking(0),
    By::Tracking(1),
    By::Moves(0),
    By::Moves(1),
    By::Reference(0, 1),
    By::Reference(5, 0),
    By::Disturbance(0),
    By::Previous(0),
    By::Previous(1),
    By::PastCommand(1),
    By::PastOutput(0, 0),
    By::PastOutput(1, 1),
    By::Channel,
];

/// Everything that a problem points to.
#[derive(Clone)]
struct Parts {
    net: Net,
    start: Regressor<2, 2, 1, 2, 2>,
    reference: [[f32; 2]; 6],
    disturbance: [f32; 2],
    weights: Weights<2, 2>,
    bounds: Bounds<2, 6>,
    horizons: Horizons<6, 3>,
}

impl Parts {
    fn drawn(random: &mut Random, limits: f32) -> Self {
        Self {
            net: Net::random(random, false),
            start: Regressor {
                u: random.matrix(0.5),
                y: random.matrix(0.5),
                s: random.array(0.5),
            },
            reference: random.matrix(0.8),
            disturbance: random.array(0.1),
            weights: Weights {
                tracking: core::array::from_fn(|_| 0.5 + random.unit()),
                moves: core::array::from_fn(|_| 0.1 + 0.3 * random.unit()),
            },
            bounds: Bounds {
                lower: [-limits; 2],
                upper: [limits; 2],
                rate: [0.6 * limits; 6],
                previous: random.array(0.3 * limits),
            },
            horizons: Horizons::new(1, [1, 2, 2]),
        }
    }

    fn problem(&self) -> Nets<'_> {
        Problem {
            model: &self.net,
            start: &self.start,
            disturbance: &self.disturbance,
            reference: &self.reference,
            weights: self.weights,
            bounds: &self.bounds,
            horizons: &self.horizons,
        }
    }

    /// The optimum; `None` where Gauss and Newton's steps do not come to rest there.
    fn solved(&self, from: &Plan<6>) -> Option<Plan<6>> {
        let mut plan = from.clone();
        let _ = solve(&self.problem(), &mut plan, 8);
        // What promises a ten-millionth of J is too little for the solver, and too much for a
        // difference.
        let mut moved = f32::INFINITY;
        for _ in 0..60 {
            let (_, quadratic) = common::quadratic(&self.problem(), &plan.u);
            let u = plan.u;
            active_set::solve(&quadratic, &self.bounds, &u, &mut plan.active, &mut plan.u);
            let moves = u.iter().zip(&plan.u).map(|(a, b)| (a - b).abs());
            moved = moves.fold(0.0, f32::max);
        }
        (moved < 3e-6).then_some(plan)
    }

    fn changed(&self, by: By, step: f32) -> Self {
        let mut other = self.clone();
        let place = match by {
            By::Tracking(r) => &mut other.weights.tracking[r],
            By::Moves(c) => &mut other.weights.moves[c],
            By::Reference(j, r) => &mut other.reference[j][r],
            By::Disturbance(r) => &mut other.disturbance[r],
            By::Previous(c) => &mut other.bounds.previous[c],
            By::PastCommand(c) => &mut other.start.u[1][c],
            By::PastOutput(lag, r) => &mut other.start.y[lag][r],
            By::Channel => &mut other.start.s[0],
        };
        *place += step;
        other
    }
}

#[test]
fn derivatives_of_plans_are_differences_of_plans_solved_anew() {
    const STEP: f32 = 0.005;
    let mut random = Random(43);
    let (mut compared, mut limited, mut carried, mut worst) = (0, 0, 0, 0.0_f32);
    for case in 0..60 {
        let parts = Parts::drawn(&mut random, if case % 3 == 0 { 3.0 } else { 0.25 });
        let Some(plan) = parts.solved(&Plan::new()) else {
            continue;
        };
        let found = differentiate(&parts.problem(), &plan).expect("they are finite");
        for by in ALL {
            let derivative = match by {
                By::Tracking(r) => found.tracking[r],
                By::Moves(c) => found.moves[c],
                By::Reference(j, r) => found.reference[j][r],
                By::Disturbance(r) => found.disturbance[r],
                By::Previous(c) => found.previous[c],
                By::PastCommand(c) => found.u[1][c],
                By::PastOutput(lag, r) => found.y[lag][r],
                By::Channel => found.s[0],
            };
            // Where a limit comes or goes the plan has a kink.
            let difference = |step: f32| -> Option<[f32; 6]> {
                let at = |step| {
                    let other = parts.changed(by, step).solved(&plan);
                    other.filter(|other| other.active == plan.active)
                };
                let (above, below) = (at(step)?, at(-step)?);
                Some(core::array::from_fn(|v| {
                    (above.u[v] - below.u[v]) / (2.0 * step)
                }))
            };
            let (Some(wide), Some(close)) = (difference(2.0 * STEP), difference(STEP)) else {
                continue;
            };
            let pairs = wide.iter().zip(&close);
            let bends = pairs.map(|(a, b)| (a - b).abs() / (0.05 + b.abs()));
            if bends.fold(0.0, f32::max) > 0.02 {
                continue;
            }
            compared += 1;
            limited += usize::from(!plan.active.is_empty());
            for (v, (derivative, difference)) in derivative.iter().zip(&close).enumerate() {
                let off = (derivative - difference).abs() / (0.05 + difference.abs());
                worst = worst.max(off);
                assert!(
                    off < 0.01,
                    "case {case}, {by:?}, {v}: {derivative} for {difference}"
                );
                carried += usize::from(matches!(by, By::Previous(_)) && *derivative == 1.0);
            }
        }
        assert_eq!(found.u[0], [[0.0; 6]; 2], "the place for u(k) is not read");
    }
    println!("{compared} compared, {limited} at limits, {carried} carried, worst {worst}");
    assert!(compared > 500 && limited > 200, "{compared}, {limited}");
    assert!(
        carried > 20,
        "{carried} commands are tied to the one applied last"
    );
}

#[test]
fn plans_that_are_not_finite_have_no_derivatives() {
    let mut parts = Parts::drawn(&mut Random(7), 1.0);
    let mut plan = Plan::new();
    let _ = solve(&parts.problem(), &mut plan, 8);
    parts.disturbance[0] = f32::NAN;
    assert!(differentiate(&parts.problem(), &plan).is_none());
}

//! A step may end at any instant: whatever was found by then is inside every limit and no dearer
//! than the plan it began with, to within the size of steps that are not evaluated.

mod common;

use std::cell::Cell;

use common::case::{Case, FAR};
use common::counting::Counting;
use common::{Random, Shallow};
use sinew_mpc::budget::{Budget, Interrupt, Meter, Part};
use sinew_mpc::controller::{ControlLoop, Settings};
use sinew_mpc::limits::Limits;
use sinew_mpc::model::{Jacobian, Model, Regressor};
use sinew_mpc::rollout::Trajectory;
use sinew_mpc::scaling::ModelScaling;
use sinew_mpc::sensitivity::Propagate;
use sinew_mpc::{Bounds, Horizons, Parts, Plan, Status, Tuning, solve, solve_until, solve_within};

const NU: usize = 2;
const NY: usize = 3;
const N: usize = 6;
const NB: usize = 3;
const NV: usize = NU * NB;

type Net = Shallow<12, 6, NY>;

/// Random stops of plans, and as many of steps: 10^5, or as many as the variable says. Of 10^6 none
/// left a limit, and J rose by 2.3e-4 of it at most.
fn stops() -> usize {
    match std::env::var("SINEW_STOPS") {
        Ok(text) => text.parse().expect("SINEW_STOPS is a count"),
        Err(_) => 100_000,
    }
}

/// The plan is inside, to the last bit of the plan's own arithmetic.
fn inside(bounds: &Bounds<NU, NV>, plan: &[f32; NV]) -> bool {
    (0..NV).all(|v| {
        let before = match v.checked_sub(NU) {
            Some(before) => plan[before],
            None => bounds.previous[v],
        };
        let box_holds = bounds.lower[v % NU] <= plan[v] && plan[v] <= bounds.upper[v % NU];
        let rate = bounds.rate[v];
        box_holds && before - rate <= plan[v] && plan[v] <= before + rate
    })
}

#[test]
fn a_plan_is_inside_the_limits_and_no_dearer_wherever_it_is_stopped() {
    let mut random = Random(91);
    let horizons = Horizons::<N, NB>::new(1, [1, 2, 3]);
    // How far the work had come: asked so many times, at most.
    let (mut stopped, mut whole, mut tight, mut better) = (0, 0, 0, 0);
    let total = stops();
    let mut most = 0.0_f32;
    for case in 0..total {
        let net = Net::random(&mut random, case % 2 == 0);
        let mut drawn = Case::<NU, NY, 0, 3, 2, N, NV>::draw(&mut random, FAR);
        drawn.bounds.rate = core::array::from_fn(|v| [0.05, 0.1, 0.15][v / NU]);
        drawn.bounds.lower = [-0.7; NU];
        drawn.bounds.upper = [0.7; NU];
        let problem = drawn.problem(&net, &horizons);
        let mut plan = Plan::<NV>::new();
        plan.u = drawn.plan;
        // A cost of the last plan that makes a restart likely in half of the cases.
        plan.cost = if case % 4 < 2 { 1e-3 } else { f32::INFINITY };
        drawn.bounds.project(&mut plan.u);
        let mut trajectory = Trajectory::new(<Net as Model<NU, NY, 0, 3, 2>>::TRACE, ());
        let start = problem.rollout(&plan.u, &mut trajectory);
        let until = (random.unit() * random.unit() * 60.0) as u32;
        let mut asked = 0;
        let mut ended = false;
        let outcome = solve_until(&problem, &mut plan, 4, || {
            asked += 1;
            ended |= asked > until;
            ended
        });
        assert!(inside(&drawn.bounds, &plan.u), "case {case}: {:?}", plan.u);
        let cost = problem.rollout(&plan.u, &mut trajectory);
        // The last step may be one that promises next to nothing and is not evaluated.
        let rise = (cost - start) / (1e-3 + start);
        assert!(rise < 1e-3, "case {case}: {start} to {cost}");
        most = rise.max(most);
        assert!(outcome.status.is_controlled(), "case {case}: {outcome:?}");
        assert!(
            ended || outcome.status != Status::CutShort,
            "case {case}: {outcome:?}"
        );
        stopped += usize::from(ended);
        whole += usize::from(!ended);
        better += usize::from(cost < 0.999 * start);
        let edge = |v: usize| {
            let before = if v < NU {
                drawn.bounds.previous[v]
            } else {
                plan.u[v - NU]
            };
            (plan.u[v] - before).abs() > 0.999 * drawn.bounds.rate[v]
        };
        tight += usize::from((0..NV).any(edge));
    }
    println!(
        "{total} plans, {stopped} stopped, {whole} whole, {tight} at a limit, {better} better, \
         largest rise of J {most:.1e} of it"
    );
    assert!(
        stopped > total / 4 && whole > total / 100,
        "{stopped}, {whole}"
    );
    assert!(tight > total / 4 && better > total / 4, "{tight}, {better}");
}

#[test]
fn a_stop_that_never_comes_changes_no_bit_and_one_at_once_keeps_the_plan() {
    let mut random = Random(92);
    let horizons = Horizons::<N, NB>::new(1, [1, 2, 3]);
    for case in 0..200 {
        let net = Net::random(&mut random, case % 2 == 0);
        let mut drawn = Case::<NU, NY, 0, 3, 2, N, NV>::draw(&mut random, FAR);
        drawn.bounds.rate = [0.1; NV];
        let problem = drawn.problem(&net, &horizons);
        let mut plan = Plan::<NV>::new();
        plan.u = drawn.plan;
        drawn.bounds.project(&mut plan.u);
        let (mut whole, mut never, mut at_once) = (plan.clone(), plan.clone(), plan.clone());
        let one = solve(&problem, &mut whole, 3);
        let other = solve_until(&problem, &mut never, 3, || false);
        assert_eq!(one, other);
        assert_eq!(whole.u.map(f32::to_bits), never.u.map(f32::to_bits));
        let none = solve_until(&problem, &mut at_once, 3, || true);
        assert_eq!((none.iterations, at_once.u), (0, plan.u));
    }
}

/// Rule that ends the steps of one case.
#[derive(Clone, Copy)]
enum Rule {
    /// After so many questions, as a timer does.
    Questions(u32),
    /// A count of work.
    Work(Budget),
}

impl Rule {
    fn draw(random: &mut Random) -> Self {
        if random.signed() > 0.0 {
            return Self::Questions((random.unit() * 20.0) as u32);
        }
        let mut ticks = |most: f32| (most * random.unit() * random.unit()) as u32;
        Self::Work(Budget {
            ticks: ticks(60_000.0),
            parts: Parts {
                rollout: ticks(5000.0),
                derivative: ticks(9000.0),
                factorisation: ticks(1000.0),
            },
        })
    }
}

/// A step of a controller with the rule in force.
macro_rules! stopped {
    ($control:expr, $rule:expr, $($input:expr),*) => {
        match $rule {
            Rule::Questions(until) => {
                let mut asked = 0;
                $control.step_until($($input,)* || {
                    asked += 1;
                    asked > until
                })
            }
            Rule::Work(budget) => $control.step_within($($input,)* &mut Meter::new(budget)),
        }
    };
}

/// Readings that are mostly ordinary, now and then missing or anything at all.
fn hostile(random: &mut Random) -> f32 {
    match (random.unit() * 40.0) as u32 {
        0 => f32::NAN,
        1 => 1e30 * random.signed(),
        _ => random.signed(),
    }
}

/// Steps of one shape of problem, stopped anywhere: how many were, and how many commands moved.
/// Twice the same stops give the same bits.
fn commands<
    const NX: usize,
    const NU: usize,
    const NY: usize,
    const ND: usize,
    const DD: usize,
    const N: usize,
    const NB: usize,
    const NV: usize,
>(
    steps: usize,
    seed: u64,
    rate: f32,
    horizons: &Horizons<N, NB>,
) -> (usize, usize) {
    let mut random = Random(seed);
    let (mut stopped, mut moved) = (0, 0);
    for case in 0..steps.div_ceil(40) {
        let limits = Limits {
            lower: core::array::from_fn(|i| -0.3 - 0.2 * i as f32),
            upper: core::array::from_fn(|i| 0.9 - 0.2 * i as f32),
            rate: core::array::from_fn(|i| rate / (1.0 + i as f32)),
            safe: [0.0; NU],
        };
        let settings = Settings {
            tracking_weight: [1.0; NY],
            move_suppression: [0.02; NU],
            disturbance_gain: 0.5,
            iterations: 1 + (case % 8) as u8,
            max_missing_samples: 3,
        };
        let net = Shallow::<NX, 6, NY>::random(&mut random, case % 2 == 0);
        let mut control: ControlLoop<_, NU, NY, 0, ND, DD, N, NB, NV> = ControlLoop::new(
            net,
            ModelScaling::IDENTITY,
            limits,
            settings,
            horizons.clone(),
        );
        let mut again = control.clone();
        let mut before = limits.safe;
        for _ in 0..40 {
            let rule = Rule::draw(&mut random);
            let y = core::array::from_fn(|_| hostile(&mut random));
            let reference = core::array::from_fn(|_| random.array(2.0));
            let step = stopped!(control, rule, &y, &[], &reference);
            assert!(limits.contain(&step.u), "{step:?}");
            for ((u, before), rate) in step.u.iter().zip(&before).zip(&limits.rate) {
                let change = f64::from(*u) - f64::from(*before);
                assert!(change.abs() <= f64::from(*rate), "{change}");
                moved += usize::from(change != 0.0);
            }
            before = step.u;
            stopped += usize::from(step.status == Status::CutShort);
            let other = stopped!(again, rule, &y, &[], &reference);
            assert_eq!(step.u.map(f32::to_bits), other.u.map(f32::to_bits));
            assert_eq!(step.status, other.status);
        }
    }
    (stopped, moved)
}

#[test]
fn commands_of_stopped_steps_are_inside_the_limits_exactly() {
    let steps = stops() / 5;
    let each = Horizons::<8, 4>::every_step;
    // One input and one output; a rate that holds always, and none; two inputs and three outputs
    // in blocks; three inputs and two outputs; one block.
    let shapes = [
        commands::<5, 1, 1, 3, 2, 8, 4, 4>(steps, 93, 0.1, &each()),
        commands::<5, 1, 1, 3, 2, 8, 4, 4>(steps, 94, f32::INFINITY, &each()),
        commands::<12, 2, 3, 3, 2, 6, 3, 6>(steps, 95, 0.1, &Horizons::new(1, [1, 2, 3])),
        commands::<8, 3, 2, 2, 1, 5, 4, 12>(steps, 96, 0.04, &Horizons::new(2, [1, 1, 1, 2])),
        commands::<12, 2, 3, 3, 2, 4, 1, 2>(steps, 97, 0.2, &Horizons::new(1, [2])),
    ];
    for (shape, (stopped, moved)) in shapes.iter().enumerate() {
        println!("shape {shape}: {steps} steps, {stopped} stopped, {moved} moves of a command");
        assert!(*stopped > steps / 4, "shape {shape}: {stopped} of {steps}");
        assert!(*moved > steps / 4, "shape {shape}: {moved} of {steps}");
    }
}

/// A meter, and the factorisations that it let pass.
struct Watched(Meter, u32);

impl Interrupt for Watched {
    fn ends(&mut self, next: Part) -> bool {
        let ends = self.0.ends(next);
        self.1 += u32::from(next == Part::Factorisation && !ends);
        ends
    }

    fn ended(&mut self) -> bool {
        self.0.ended()
    }
}

#[test]
fn the_work_of_a_step_stays_within_its_budget() {
    let mut random = Random(98);
    let horizons = Horizons::<N, NB>::new(1, [1, 2, 3]);
    let parts = Parts {
        rollout: 700,
        derivative: 1100,
        factorisation: 130,
    };
    let (mut cut, mut whole, mut nearly) = (0, 0, 0);
    let (steps, mut restarts) = (2000, 0);
    for case in 0..steps {
        let (predictions, linearisations) = (Cell::new(0), Cell::new(0));
        let model = Counting {
            net: Net::random(&mut random, case % 2 == 0),
            predictions: &predictions,
            derivatives: &linearisations,
        };
        let mut drawn = Case::<NU, NY, 0, 3, 2, N, NV>::draw(&mut random, FAR);
        drawn.bounds.rate = [0.1; NV];
        let problem = drawn.problem(&model, &horizons);
        let mut plan = Plan::<NV>::new();
        plan.u = drawn.plan;
        plan.cost = if case % 4 < 2 { 1e-3 } else { f32::INFINITY };
        let ticks = parts.rollout + (random.unit() * 8000.0) as u32;
        let mut watched = Watched(Meter::new(Budget { ticks, parts }), 0);
        let outcome = solve_within(&problem, &mut plan, 4, &mut watched);
        assert!(inside(&drawn.bounds, &plan.u));
        let n = N as u32;
        assert_eq!((predictions.get() % n, linearisations.get() % n), (0, 0));
        let spent = predictions.get() / n * parts.rollout
            + linearisations.get() / n * parts.derivative
            + watched.1 * parts.factorisation;
        assert!(spent <= ticks, "case {case}: {spent} of {ticks}");
        // All that is counted is made, but for the last evaluation of a restart that was cut.
        let counted = ticks - watched.0.left();
        assert!(spent <= counted, "case {case}: {spent}, counted {counted}");
        let stopped = outcome.status == Status::CutShort;
        assert!(!stopped || watched.0.ended(), "case {case}: {outcome:?}");
        // A linearisation is never thrown away: its result is evaluated, or next to nothing.
        assert!(predictions.get() / n >= linearisations.get() / n);
        cut += usize::from(stopped);
        whole += usize::from(!watched.0.ended());
        nearly += usize::from(stopped && spent + 2000 > ticks);
        restarts += usize::from(predictions.get() / n > 3 * linearisations.get() / n + 1);
    }
    assert!(cut > steps / 4 && whole > steps / 10, "{cut}, {whole}");
    assert!(nearly > cut / 2, "{nearly} of {cut}: budgets are not used");
    assert!(restarts > 20, "{restarts}: no restart is tested");
}

/// A network whose model says how much work a step may do.
#[derive(Clone)]
struct Budgeted<const TICKS: u32>(Net);

impl<const TICKS: u32> Model<NU, NY, 0, 3, 2> for Budgeted<TICKS> {
    type Trace = [f32; 6];
    const TRACE: [f32; 6] = [0.0; 6];

    fn predict(&self, x: &Regressor<NU, NY, 0, 3, 2>, a: &mut [f32; 6]) -> [f32; NY] {
        self.0.predict(x, a)
    }

    fn jacobian(&self, a: &[f32; 6], jacobian: &mut Jacobian<NU, NY, 3, 2>) {
        Model::<NU, NY, 0, 3, 2>::jacobian(&self.0, a, jacobian);
    }
}

impl<const TICKS: u32> Propagate<NU, NY, 0, 3, 2> for Budgeted<TICKS> {}
impl<const TICKS: u32> Tuning for Budgeted<TICKS> {
    const BUDGET: Option<Budget> = Some(Budget {
        ticks: TICKS,
        parts: Parts {
            rollout: 10,
            derivative: 15,
            factorisation: 2,
        },
    });
}

/// Statuses of 200 steps, and the sum of their costs.
fn run<const TICKS: u32>() -> (usize, usize, f64) {
    let mut random = Random(99);
    let net = Budgeted::<TICKS>(Net::random(&mut random, false));
    let limits = Limits {
        lower: [-0.7; NU],
        upper: [0.7; NU],
        rate: [0.3; NU],
        safe: [0.0; NU],
    };
    let settings = Settings {
        tracking_weight: [1.0; NY],
        move_suppression: [0.02; NU],
        disturbance_gain: 0.5,
        iterations: 4,
        max_missing_samples: 3,
    };
    let horizons = Horizons::new(1, [1, 2, 3]);
    let mut control: ControlLoop<_, NU, NY, 0, 3, 2, N, NB, NV> =
        ControlLoop::new(net, ModelScaling::IDENTITY, limits, settings, horizons);
    let (mut stopped, mut iterations, mut cost) = (0, 0, 0.0);
    for _ in 0..200 {
        let y = random.array(0.5);
        let step = control.step(&y, &[], &random.matrix(1.0));
        stopped += usize::from(step.status == Status::CutShort);
        iterations += usize::from(step.iterations);
        cost += f64::from(step.cost);
    }
    (stopped, iterations, cost)
}

#[test]
fn the_budget_of_a_model_holds_in_every_step() {
    let (none, tight, loose) = (run::<26>(), run::<70>(), run::<100_000>());
    let unevaluated = run::<30>();
    println!("stopped, iterations, cost: {none:?}, {unevaluated:?}, {tight:?}, {loose:?}");
    // Less than an evaluation, a linearisation and a factorisation.
    assert_eq!((none.0, none.1), (200, 0));
    // Room for one step, and none to evaluate it; it is worth more than none.
    assert_eq!(unevaluated.1, 200);
    assert!(unevaluated.2 < none.2, "{unevaluated:?}");
    assert!(tight.0 > 100 && tight.1 >= 200, "{tight:?}");
    assert_eq!(loose.0, 0);
    assert!(loose.1 > tight.1 && loose.2 < tight.2 && tight.2 < none.2);
}

#[test]
fn the_bound_of_a_budget_is_met_by_the_part_that_is_counted_as_too_little() {
    let parts = Parts {
        rollout: 1000,
        derivative: 2000,
        factorisation: 100,
    };
    let budget = Budget {
        ticks: 10_000,
        parts,
    };
    assert_eq!(budget.bound(&parts), 10_000);
    let slower = Parts {
        factorisation: 150,
        ..parts
    };
    assert_eq!(budget.bound(&slower), 15_000);
    let unknown = Budget {
        parts: Parts::default(),
        ..budget
    };
    assert_eq!(unknown.bound(&parts), u32::MAX);
    // The first evaluation is made whatever the budget.
    let none = Budget { ticks: 0, ..budget };
    assert_eq!(none.bound(&parts), 1000);
}

//! A step may end at any instant: whatever was found by then is inside every limit and no dearer
//! than the plan it began with, to within the size of steps that are not evaluated.

mod common;

use common::case::{Case, FAR};
use common::{Random, Shallow};
use sinew_mpc::controller::{ControlLoop, Settings};
use sinew_mpc::limits::Limits;
use sinew_mpc::model::Model;
use sinew_mpc::rollout::Trajectory;
use sinew_mpc::scaling::ModelScaling;
use sinew_mpc::{Bounds, Horizons, Plan, solve, solve_until};

const NU: usize = 2;
const NY: usize = 3;
const N: usize = 6;
const NB: usize = 3;
const NV: usize = NU * NB;

type Net = Shallow<12, 6, NY>;

/// Random stops: 10^5, or as many as the variable says. Of 10^6 none left a limit, and J rose by
/// 2.3e-4 of it at most.
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

#[test]
fn commands_of_stopped_steps_are_inside_the_limits_exactly() {
    let mut random = Random(93);
    let limits = Limits {
        lower: [-0.7, -0.3],
        upper: [0.7, 0.9],
        rate: [0.1, 0.03],
        safe: [0.0; NU],
    };
    let settings = Settings {
        tracking_weight: [1.0; NY],
        move_suppression: [0.02; NU],
        disturbance_gain: 0.5,
        iterations: 4,
        max_missing_samples: 3,
    };
    let mut moved = 0;
    for case in 0..100 {
        let net = Net::random(&mut random, case % 2 == 0);
        let mut control: ControlLoop<Net, NU, NY, 0, 3, 2, N, NB, NV> = ControlLoop::new(
            net,
            ModelScaling::IDENTITY,
            limits,
            settings,
            Horizons::new(1, [1, 2, 3]),
        );
        let mut before = limits.safe;
        for _ in 0..30 {
            let until = (random.unit() * 20.0) as u32;
            let mut asked = 0;
            let y = random.array(1.0);
            let reference = random.matrix(2.0);
            let step = control.step_until(&y, &[], &reference, || {
                asked += 1;
                asked > until
            });
            assert!(limits.contain(&step.u), "{step:?}");
            for ((u, before), rate) in step.u.iter().zip(&before).zip(&limits.rate) {
                let change = f64::from(*u) - f64::from(*before);
                assert!(change.abs() <= f64::from(*rate), "{change}");
                moved += u32::from(change != 0.0);
            }
            before = step.u;
        }
    }
    assert!(moved > 3000, "{moved}");
}

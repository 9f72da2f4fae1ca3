//! Cost-to-go at the end of the horizon: its derivatives against double precision, its equality to
//! a longer horizon where that is known in closed form, and the limits.

mod common;

use common::rollout::exact_rollout;
use common::{Linear, Random, Shallow, quadratic};
use sinew_mpc::controller::{ControlLoop, Settings};
use sinew_mpc::cost::CostTerm;
use sinew_mpc::limits::Limits;
use sinew_mpc::model::{ChannelJacobian, Jacobian, Model, Regressor};
use sinew_mpc::scaling::ModelScaling;
use sinew_mpc::sensitivity::Propagate;
use sinew_mpc::terminal::{ValuePoint, Valued};
use sinew_mpc::{Bounds, Horizons, Problem, Weights};

/// Rows of the reference from r(k+N) on.
const AHEAD: usize = 4;

/// Rows that are drawn, at a place.
fn drawn<
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
    const R: usize,
>(
    random: &mut Random,
    at: f32,
    disturbances: usize,
) -> ValuePoint<NU, NY, NS, ND, DD, R> {
    ValuePoint {
        at,
        u: core::array::from_fn(|_| random.matrix(1.0)),
        y: core::array::from_fn(|_| random.matrix(1.0)),
        s: random.matrix(1.0),
        offset: random.array(0.3),
        disturbance: Box::leak((0..disturbances).map(|_| random.array(1.0)).collect()),
        reference: Box::leak((0..AHEAD).map(|_| random.matrix(0.5)).collect()),
    }
}

/// `|W z|^2` in double precision, with W a share of the way from one point to the next. `u` and `y`
/// are all commands and outputs, the newest last.
#[allow(clippy::too_many_arguments)]
fn exact_value<
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
    const R: usize,
>(
    points: [(&ValuePoint<NU, NY, NS, ND, DD, R>, f64); 2],
    u: &[Vec<f64>],
    y: &[Vec<f64>],
    s: &[f32],
    disturbance: &[f32],
    reference: &[[f32; NY]],
) -> f64 {
    let dot =
        |w: &[f32], x: &[f64]| -> f64 { w.iter().zip(x).map(|(w, x)| f64::from(*w) * x).sum() };
    let wide = |x: &[f32]| -> Vec<f64> { x.iter().map(|x| f64::from(*x)).collect() };
    let row = |r: usize| -> f64 {
        let of_point = |point: &ValuePoint<NU, NY, NS, ND, DD, R>| -> f64 {
            let mut sum = f64::from(point.offset[r]) + dot(&point.s[r], &wide(s));
            for (lag, rows) in point.u.iter().enumerate() {
                sum += dot(&rows[r], &u[u.len() - 1 - lag]);
            }
            for (lag, rows) in point.y.iter().enumerate() {
                sum += dot(&rows[r], &y[y.len() - 1 - lag]);
            }
            for (column, d) in point.disturbance.iter().zip(disturbance) {
                sum += f64::from(column[r]) * f64::from(*d);
            }
            for (rows, reference) in point.reference.iter().zip(reference) {
                sum += dot(&rows[r], &wide(reference));
            }
            sum
        };
        points
            .iter()
            .map(|(point, part)| part * of_point(point))
            .sum()
    };
    (0..R).map(|r| row(r) * row(r)).sum()
}

/// Gradient against central differences of the exact cost; Hessian against the Gauss-Newton part of
/// those differences.
fn check<
    const NX: usize,
    const H: usize,
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const ND: usize,
    const DD: usize,
    const N: usize,
    const NB: usize,
    const NV: usize,
    const R: usize,
>(
    seed: u64,
    cases: usize,
    horizons: &Horizons<N, NB>,
) where
    Shallow<NX, H, NY>: Model<NU, NY, NS, ND, DD> + Clone,
{
    let mut random = Random(seed);
    let mut worst = 0.0_f64;
    for case in 0..cases {
        let net = Shallow::<NX, H, NY>::random(&mut random, case % 2 == 1);
        let points: &'static [_] = Box::leak(Box::new([
            drawn(&mut random, -0.5, NY),
            drawn(&mut random, 0.5, NY),
        ]));
        let direction: [f32; NY] = random.array(0.8);
        let start = Regressor {
            u: random.matrix(0.8),
            y: random.matrix(0.8),
            s: random.array(0.8),
        };
        let reference: [[f32; NY]; N] = random.matrix(1.0);
        let mut ahead: [[f32; NY]; AHEAD] = random.matrix(1.0);
        ahead[0] = reference[N - 1];
        let disturbance = random.array(0.1);
        let mut valued = Valued::<_, NU, NY, NS, ND, DD, R>::new(net.clone(), direction, points);
        CostTerm::prepare(&mut valued, &ahead, &disturbance);
        let bounds = Bounds {
            lower: [-1.0; NU],
            upper: [1.0; NU],
            rate: [f32::INFINITY; NV],
            previous: random.array(0.5),
        };
        let weights = Weights {
            tracking: core::array::from_fn(|_| 0.2 + random.unit()),
            moves: core::array::from_fn(|_| 0.2 * random.unit()),
        };
        let problem = Problem {
            model: &valued,
            start: &start,
            disturbance: &disturbance,
            reference: &reference,
            weights,
            bounds: &bounds,
            horizons,
        };
        let plan: [f32; NV] = random.array(0.8);
        let (cost, with) = quadratic(&problem, &plan);
        let plain = Problem {
            model: &net,
            start: &start,
            disturbance: &disturbance,
            reference: &reference,
            weights,
            bounds: &bounds,
            horizons,
        };
        let (_, without) = quadratic(&plain, &plan);

        let place: f64 = (direction.iter().zip(&ahead[0]))
            .map(|(d, r)| f64::from(*d) * f64::from(*r))
            .sum();
        let part = (place + 0.5).clamp(0.0, 1.0);
        let value = |ends: &[f64]| -> (f64, f64) {
            let (cost, predictions) = exact_rollout(&net, &problem, ends);
            let wide = |x: &[f32]| -> Vec<f64> { x.iter().map(|x| f64::from(*x)).collect() };
            let mut u: Vec<Vec<f64>> = start.u[1..].iter().rev().map(|u| wide(u)).collect();
            for place in &horizons.interpolation {
                let end = |block: usize| ends[block * NU..][..NU].to_vec();
                let before = match place.block {
                    0 => wide(&bounds.previous),
                    block => end(block - 1),
                };
                let weight = f64::from(place.weight);
                let mixed = end(place.block).into_iter().zip(before);
                u.push(
                    mixed
                        .map(|(e, b)| weight * e + (1.0 - weight) * b)
                        .collect(),
                );
            }
            let mut y: Vec<Vec<f64>> = start.y.iter().rev().map(|y| wide(y)).collect();
            y.extend(predictions.iter().map(|y| y.to_vec()));
            let points = [(&points[0], 1.0 - part), (&points[1], part)];
            let to_go = exact_value(points, &u, &y, &start.s, &disturbance, &ahead);
            (cost, to_go)
        };
        let wide: Vec<f64> = plan.iter().map(|u| f64::from(*u)).collect();
        let (stages, to_go) = value(&wide);
        let exact = stages + to_go;
        assert!(
            (f64::from(cost) - exact).abs() < 2e-4 * (0.1 + exact),
            "case {case}: {cost}, {exact}"
        );
        let step = 1e-5;
        let slope = |v: usize| {
            let (mut above, mut below) = (wide.clone(), wide.clone());
            above[v] += step;
            below[v] -= step;
            (value(&above).1 - value(&below).1) / (2.0 * step)
        };
        let size = (0..NV).map(|v| slope(v).abs()).fold(0.5, f64::max);
        for v in 0..NV {
            let got = 2.0 * f64::from(with.gradient[v] - without.gradient[v]);
            let error = (got - slope(v)).abs() / size;
            worst = worst.max(error);
            assert!(error < 1e-3, "case {case}: dV/du{v} {}, {got}", slope(v));
        }
        // V = |W z|^2: V times its curvature is at least the square of half its slope (Cauchy and
        // Schwarz), and equal to it where there is one row.
        let along: [f32; NV] = random.array(1.0);
        let added = f64::from(with.curvature(&along) - without.curvature(&along));
        let slope: f64 = (0..NV).map(|v| 0.5 * slope(v) * f64::from(along[v])).sum();
        let (product, square) = (added * to_go, slope * slope);
        let tolerance = 2e-3 * (1.0 + square);
        assert!(
            product >= square - tolerance && (R > 1 || product <= square + tolerance),
            "case {case}: {added} times {to_go}, {slope} squared"
        );
    }
    println!("N {N}, {R} rows: largest relative error of the gradient {worst:.1e}");
}

#[test]
fn gradient_of_a_horizon_of_one() {
    check::<12, 10, 2, 3, 0, 3, 2, 1, 1, 2, 2>(1, 500, &Horizons::every_step());
}

#[test]
fn gradient_in_blocks_of_equal_moves() {
    check::<12, 10, 2, 3, 0, 3, 2, 4, 2, 4, 3>(2, 500, &Horizons::new(1, [1, 2]));
    check::<12, 10, 2, 3, 0, 3, 2, 3, 2, 4, 1>(3, 300, &Horizons::new(1, [1, 2]));
}

#[test]
fn gradient_with_channels_that_are_held() {
    check::<7, 6, 3, 1, 3, 1, 1, 2, 1, 3, 2>(4, 300, &Horizons::every_step());
}

/// A model with a channel that follows, all of it linear.
#[derive(Clone, Copy)]
struct Follows;

impl Model<1, 1, 1, 2, 1> for Follows {
    type Trace = ();
    const TRACE: () = ();
    const PREDICTS_CHANNELS: bool = true;

    fn predict(&self, x: &Regressor<1, 1, 1, 2, 1>, (): &mut ()) -> [f32; 1] {
        [0.8 * x.y[0][0] + 0.3 * x.u[0][0] + 0.1 * x.u[1][0] + 0.5 * x.s[0]]
    }

    fn jacobian(&self, (): &(), jacobian: &mut Jacobian<1, 1, 2, 1>) {
        jacobian.y[0][0][0] = 0.8;
        jacobian.u = [[[0.3]], [[0.1]]];
    }

    fn channels(&self, x: &Regressor<1, 1, 1, 2, 1>, (): &()) -> [f32; 1] {
        [0.6 * x.s[0] + 0.2 * x.u[0][0] - 0.1 * x.y[0][0]]
    }

    fn channel_jacobian(&self, (): &(), jacobian: &mut ChannelJacobian<1, 1, 1, 2, 1>) {
        jacobian.y_by_s = [[0.5]];
        jacobian.s = [[0.6]];
        jacobian.u = [[[0.2]], [[0.0]]];
        jacobian.y = [[[-0.1]]];
    }
}

impl Propagate<1, 1, 1, 2, 1> for Follows {}
impl sinew_mpc::Tuning for Follows {}

#[test]
fn a_linear_model_with_predicted_channels_has_exactly_its_quadratic() {
    let mut random = Random(5);
    for case in 0..300 {
        let points: &'static [_] = Box::leak(Box::new([drawn(&mut random, 0.0, 1)]));
        let mut model = Valued::<_, 1, 1, 1, 2, 1, 2>::new(Follows, [1.0], points);
        model.prepare(&random.matrix::<1, AHEAD>(1.0), &[0.1]);
        let problem = Problem {
            model: &model,
            start: &Regressor {
                u: random.matrix(0.8),
                y: random.matrix(0.8),
                s: random.array(0.8),
            },
            disturbance: &[0.1],
            reference: &random.matrix::<1, 4>(1.0),
            weights: Weights {
                tracking: [0.5],
                moves: [0.1],
            },
            bounds: &Bounds {
                lower: [-1.0],
                upper: [1.0],
                rate: [f32::INFINITY; 2],
                previous: [0.2],
            },
            horizons: &Horizons::<4, 2>::new(1, [1, 2]),
        };
        let plan: [f32; 2] = random.array(0.8);
        let step: [f32; 2] = random.array(0.8);
        let moved = [plan[0] + step[0], plan[1] + step[1]];
        let (cost, there) = quadratic(&problem, &plan);
        let (expected, _) = quadratic(&problem, &moved);
        let got = cost + there.slope(&step) + there.curvature(&step);
        assert!(
            (got - expected).abs() < 2e-5 * (1.0 + expected + cost),
            "case {case}: {got}, {expected}"
        );
    }
}

const MODEL: Linear = Linear {
    a: 0.9,
    b: 0.3,
    b1: 0.1,
};

/// The error of y(k+2) with the command held: `y(k+2) = a y(k+1) + (b + b1) u(k) + d`.
const NEXT: ValuePoint<1, 1, 0, 2, 1, 1> = ValuePoint {
    at: 0.0,
    u: [[[MODEL.b + MODEL.b1]], [[0.0]]],
    y: [[[MODEL.a]]],
    s: [[]],
    offset: [0.0],
    disturbance: &[[1.0]],
    reference: &[[[0.0]], [[-1.0]]],
};

const LIMITS: Limits<1> = Limits {
    lower: [-1.0],
    upper: [1.0],
    rate: [0.4],
    safe: [0.0],
};

const SETTINGS: Settings<1, 1> = Settings {
    tracking_weight: [1.0],
    move_suppression: [0.05],
    disturbance_gain: 0.3,
    iterations: 2,
    max_missing_samples: 5,
};

#[test]
fn the_next_stage_as_a_value_is_one_step_more_of_the_horizon() {
    // Two points with the same rows: the way between them changes nothing.
    static POINTS: [ValuePoint<1, 1, 0, 2, 1, 1>; 2] = [NEXT, ValuePoint { at: 0.5, ..NEXT }];
    let model = Valued::new(MODEL, [1.0], &POINTS);
    let scaling = ModelScaling::IDENTITY;
    let mut short: ControlLoop<Valued<Linear, 1, 1, 0, 2, 1, 1>, 1, 1, 0, 2, 1, 1, 1, 1, 2> =
        ControlLoop::new(model, scaling, LIMITS, SETTINGS, Horizons::every_step());
    let mut long: ControlLoop<Linear, 1, 1, 0, 2, 1, 2, 1, 1> =
        ControlLoop::new(MODEL, scaling, LIMITS, SETTINGS, Horizons::every_step());
    let mut alone: ControlLoop<Linear, 1, 1, 0, 2, 1, 1, 1, 1> =
        ControlLoop::new(MODEL, scaling, LIMITS, SETTINGS, Horizons::every_step());
    let mut random = Random(6);
    let (mut y, mut before, mut apart, mut at_limits) = (0.0_f32, 0.0, 0.0_f32, 0);
    for k in 0..400 {
        let row = |k: i32| [0.6 * if (k / 40) % 2 == 0 { 1.0 } else { -1.0 }];
        let reference = [row(k + 1), row(k + 2)];
        let step = short.step(&[y], &[], &reference);
        let other = long.step(&[y], &[], &reference);
        let without = alone.step(&[y], &[], &[reference[0]]);
        let [u] = step.u;
        assert!((u - other.u[0]).abs() < 2e-5, "step {k}: {u}, {other:?}");
        apart = apart.max((u - without.u[0]).abs());
        at_limits += i32::from((u - before).abs() > 0.399);
        // A plant with another gain, so that there is a disturbance to estimate.
        y = 0.9 * y + 0.25 * u + 0.1 * before + 0.02 * random.signed();
        before = u;
    }
    assert!(apart > 0.05, "the value changed nothing");
    assert!(at_limits > 5, "no limit was reached");
}

#[test]
fn beyond_the_points_the_nearest_one_holds() {
    let point = |at, offset| ValuePoint {
        at,
        offset: [offset],
        ..ValuePoint::<1, 1, 0, 2, 1, 1>::ZERO
    };
    let points: &'static [_] = Box::leak(Box::new([
        point(-1.0, 1.0),
        point(0.0, 2.0),
        point(2.0, 4.0),
    ]));
    let end = Regressor {
        u: [[0.0]; 2],
        y: [[0.0]],
        s: [],
    };
    let root_at = |r: f32| {
        let mut model = Valued::new(MODEL, [2.0], points);
        model.prepare(&[[r / 2.0]], &[]);
        let mut residual = [0.0];
        let cost = model.cost_to_go(&end, &mut residual);
        assert_eq!(cost, residual[0] * residual[0]);
        residual[0]
    };
    let places = [-5.0, -1.0, -0.5, 0.0, 1.0, 2.0, 9.0];
    assert_eq!(places.map(root_at), [1.0, 1.0, 1.5, 2.0, 3.0, 4.0, 4.0]);
    // No point: no cost.
    let mut none = Valued::<_, 1, 1, 0, 2, 1, 1>::new(MODEL, [1.0], &[]);
    none.prepare(&[[1.0]], &[1.0]);
    assert_eq!(none.cost_to_go(&end, &mut [7.0]), 0.0);
}

#[test]
fn no_bits_of_rows_and_samples_lead_outside_the_limits() {
    let mut random = Random(7);
    let hostile = |random: &mut Random| match (random.unit() * 8.0) as u32 {
        0 => f32::NAN,
        1 => f32::INFINITY * random.signed(),
        2 => 1e30 * random.signed(),
        _ => random.signed(),
    };
    let mut controlled = 0;
    for _ in 0..200 {
        let at = hostile(&mut random);
        let mut point = drawn::<1, 1, 0, 2, 1, 1>(&mut random, at, 1);
        point.y[0][0][0] = 10.0 * hostile(&mut random);
        point.u[0][0][0] = 10.0 * hostile(&mut random);
        let points: &'static [_] = Box::leak(Box::new([point, ValuePoint { at: 0.5, ..NEXT }]));
        let model = Valued::new(MODEL, [1.0], points);
        let mut control: ControlLoop<_, 1, 1, 0, 2, 1, 1, 1, 1, 4> = ControlLoop::new(
            model,
            ModelScaling::IDENTITY,
            LIMITS,
            SETTINGS,
            Horizons::every_step(),
        );
        let mut before = 0.0_f32;
        for _ in 0..20 {
            let reference = core::array::from_fn(|_| [hostile(&mut random)]);
            let step = control.step(&[hostile(&mut random)], &[], &reference);
            controlled += u32::from(step.status.is_controlled());
            assert!(LIMITS.contain(&step.u), "{step:?}");
            let change = f64::from(step.u[0]) - f64::from(before);
            assert!(change.abs() <= f64::from(LIMITS.rate[0]), "{change}");
            before = step.u[0];
        }
    }
    assert!(controlled > 200, "{controlled} steps were optimised");
}

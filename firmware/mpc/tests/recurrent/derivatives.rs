//! Gradient and Gauss-Newton Hessian through outputs and memory together, against double precision.

use sinew_mpc::Horizons;
use sinew_mpc::Propagate;

use crate::cells::{GruNet, LstmNet};
use crate::common::Random;
use crate::common::case::{Case, REMEMBERED};
use crate::exact::Exact;

fn check<M, const NU: usize, const NY: usize, const NS: usize>(seed: u64, cases: usize)
where
    M: Exact<NY, NS> + Propagate<NU, NY, NS, 1, 1>,
{
    const N: usize = 8;
    const NB: usize = 3;
    const LENGTH: [u8; NB] = [1, 2, 3];
    match NU {
        1 => check_in_blocks::<M, NU, NY, NS, N, NB, 3>(seed, cases, LENGTH),
        2 => check_in_blocks::<M, NU, NY, NS, N, NB, 6>(seed, cases, LENGTH),
        _ => unreachable!("one or two commands"),
    }
}

fn check_in_blocks<
    M,
    const NU: usize,
    const NY: usize,
    const NS: usize,
    const N: usize,
    const NB: usize,
    const NV: usize,
>(
    seed: u64,
    cases: usize,
    length: [u8; NB],
) where
    M: Exact<NY, NS> + Propagate<NU, NY, NS, 1, 1>,
{
    let mut random = Random(seed);
    let horizons = Horizons::<N, NB>::new(1, length);
    let (mut worst, mut by_memory) = (0.0_f64, 0.0_f64);
    for case in 0..cases {
        let model = M::random(&mut random);
        let drawn = Case::<NU, NY, NS, 1, 1, N, NV>::draw(&mut random, REMEMBERED);
        let (cost, quadratic) = drawn.derive(&model, &horizons);
        let Case {
            start,
            reference,
            disturbance,
            bounds,
            weights,
            plan,
        } = drawn;

        // Errors along the horizon, times the root of Q; `frozen`: with the memory held.
        let errors = |plan: &[f64], frozen: bool| -> Vec<f64> {
            let mut y = start.y[0].map(f64::from);
            let mut s = start.s.map(f64::from);
            let mut errors = Vec::new();
            let mut before = bounds.previous.map(f64::from);
            let mut commands = Vec::new();
            for (b, length) in length.iter().enumerate() {
                let end = &plan[b * NU..(b + 1) * NU];
                for i in 1..=*length {
                    let share = f64::from(i) / f64::from(*length);
                    commands.push(core::array::from_fn::<f64, NU, _>(|c| {
                        before[c] + share * (end[c] - before[c])
                    }));
                }
                before = core::array::from_fn(|c| end[c]);
            }
            for j in 0..N {
                let u = commands.get(j).unwrap_or(&before);
                let x: Vec<f64> = u.iter().chain(&y).copied().collect();
                let (next, memory) = model.exact(&x, &s);
                for r in 0..NY {
                    y[r] = next[r] + f64::from(disturbance[r]);
                    let error = y[r] - f64::from(reference[j][r]);
                    errors.push(f64::from(weights.tracking[r]).sqrt() * error);
                }
                if !frozen {
                    s = memory;
                }
            }
            errors
        };
        let wide: Vec<f64> = plan.iter().map(|u| f64::from(*u)).collect();
        let slopes = |frozen: bool| -> Vec<Vec<f64>> {
            let h = 1e-5;
            let one = |v: usize| {
                let moved = |by: f64| {
                    let mut plan = wide.clone();
                    plan[v] += by;
                    errors(&plan, frozen)
                };
                let pairs = moved(h).into_iter().zip(moved(-h));
                pairs.map(|(a, b)| (a - b) / (2.0 * h)).collect()
            };
            (0..NV).map(one).collect()
        };
        let at = errors(&wide, false);
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let exact = dot(&at, &at);
        assert!(
            (f64::from(cost) - exact).abs() < 1e-4 * exact,
            "case {case}"
        );
        let (s, without) = (slopes(false), slopes(true));
        // A small gradient is the difference of large terms.
        let size = (0..NV).map(|v| dot(&s[v], &at).abs()).fold(0.2, f64::max);
        for a in 0..NV {
            let gradient = dot(&s[a], &at);
            let error = (f64::from(quadratic.gradient[a]) - gradient).abs() / size;
            worst = worst.max(error);
            by_memory = by_memory.max((dot(&without[a], &at) - gradient).abs() / size);
            assert!(error < 2e-4, "case {case}: g[{a}] {error:e}");
            for b in 0..NV {
                let exact = dot(&s[a], &s[b]);
                let error = (f64::from(quadratic.hessian[a][b]) - exact).abs();
                assert!(
                    error < 5e-4 * (0.1 + exact.abs()),
                    "case {case}: H[{a}][{b}]"
                );
            }
        }
    }
    assert!(
        by_memory > 0.1,
        "the memory carried nothing: nothing was tested"
    );
    println!("largest error of the gradient {worst:.1e}; without the memory {by_memory:.1e}");
}

#[test]
fn gradient_and_hessian_through_a_gru() {
    check::<GruNet<5, 5, 3>, 2, 3, 5>(51, 700);
    check::<GruNet<2, 8, 1>, 1, 1, 8>(52, 500);
}

#[test]
fn gradient_and_hessian_through_an_lstm() {
    check::<LstmNet<5, 4, 3>, 2, 3, 8>(53, 700);
    check::<LstmNet<2, 6, 1>, 1, 1, 12>(54, 500);
}

//! The active-set method against enumeration of every active set, and the factorisation.
#![allow(
    clippy::needless_range_loop,
    reason = "the indices are those of the equations, over several arrays at once"
)]

mod common;

use common::Random;
use sinew_mpc::{ActiveSet, Bounds, Quadratic, active_set, ldl};

/// `g'p + p'Hp / 2` in f64 (the halves of `Quadratic` cancel).
fn objective<const NV: usize>(q: &Quadratic<NV>, u: &[f32; NV], w: &[f64]) -> f64 {
    let p: Vec<f64> = (0..NV).map(|v| w[v] - f64::from(u[v])).collect();
    let mut value = 0.0;
    for a in 0..NV {
        value += f64::from(q.gradient[a]) * p[a];
        for b in 0..NV {
            value += 0.5 * f64::from(q.hessian[a][b]) * p[a] * p[b];
        }
    }
    value
}

/// Gaussian elimination; `None` where the matrix is singular.
fn solve(mut a: Vec<Vec<f64>>, mut b: Vec<f64>) -> Option<Vec<f64>> {
    let n = b.len();
    for i in 0..n {
        let pivot = (i..n).max_by(|r, s| a[*r][i].abs().total_cmp(&a[*s][i].abs()))?;
        a.swap(i, pivot);
        b.swap(i, pivot);
        if a[i][i].abs() < 1e-9 {
            return None;
        }
        for r in i + 1..n {
            let factor = a[r][i] / a[i][i];
            for c in i..n {
                a[r][c] -= factor * a[i][c];
            }
            b[r] -= factor * b[i];
        }
    }
    for i in (0..n).rev() {
        for c in i + 1..n {
            b[i] -= a[i][c] * b[c];
        }
        b[i] /= a[i][i];
    }
    Some(b)
}

/// Rows `a w = b` of every limit: 0 box low, 1 box high, 2 edge low, 3 edge high of each variable.
fn limit<const NU: usize, const NV: usize>(
    bounds: &Bounds<NU, NV>,
    v: usize,
    kind: usize,
) -> (Vec<f64>, f64) {
    let c = v % NU;
    let mut row = vec![0.0; NV];
    row[v] = 1.0;
    let value = match kind {
        0 => f64::from(bounds.lower[c]),
        1 => f64::from(bounds.upper[c]),
        _ => {
            let rate = f64::from(bounds.rate[v]) * if kind == 2 { -1.0 } else { 1.0 };
            if v < NU {
                rate + f64::from(bounds.previous[c])
            } else {
                row[v - NU] = -1.0;
                rate
            }
        }
    };
    (row, value)
}

fn violation<const NU: usize, const NV: usize>(bounds: &Bounds<NU, NV>, w: &[f64]) -> f64 {
    let mut worst = 0.0_f64;
    for v in 0..NV {
        for kind in 0..4 {
            let (row, value) = limit::<NU, NV>(bounds, v, kind);
            let sum: f64 = row.iter().zip(w).map(|(a, w)| a * w).sum();
            worst = worst.max(if kind % 2 == 0 {
                value - sum
            } else {
                sum - value
            });
        }
    }
    worst
}

/// The optimum over all subsets of limits: each variable's box and edge free, low or high.
fn enumerate<const NU: usize, const NV: usize>(
    q: &Quadratic<NV>,
    bounds: &Bounds<NU, NV>,
    u: &[f32; NV],
) -> f64 {
    let mut best = f64::INFINITY;
    for set in 0..9_usize.pow(NV as u32) {
        let mut rows = Vec::new();
        let mut digits = set;
        for v in 0..NV {
            for first in [0, 2] {
                if digits % 3 > 0 {
                    rows.push(limit::<NU, NV>(bounds, v, first + digits % 3 - 1));
                }
                digits /= 3;
            }
        }
        if rows.len() > NV {
            continue;
        }
        // KKT: H w - A' lambda = H u - g, A w = b.
        let n = NV + rows.len();
        let (mut a, mut b) = (vec![vec![0.0; n]; n], vec![0.0; n]);
        for i in 0..NV {
            b[i] = -f64::from(q.gradient[i]);
            for j in 0..NV {
                a[i][j] = f64::from(q.hessian[i][j]);
                b[i] += a[i][j] * f64::from(u[j]);
            }
        }
        for (k, (row, value)) in rows.iter().enumerate() {
            for j in 0..NV {
                a[NV + k][j] = row[j];
                a[j][NV + k] = -row[j];
            }
            b[NV + k] = *value;
        }
        if let Some(w) = solve(a, b)
            && violation::<NU, NV>(bounds, &w) < 1e-9
        {
            best = best.min(objective(q, u, &w[..NV]));
        }
    }
    best
}

fn problem<const NU: usize, const NV: usize>(
    random: &mut Random,
) -> (Quadratic<NV>, Bounds<NU, NV>, [f32; NV]) {
    let mut q = Quadratic::new();
    let factor: [[f32; NV]; NV] = random.matrix(1.0);
    for a in 0..NV {
        for b in 0..NV {
            q.hessian[a][b] = (0..NV).map(|k| factor[k][a] * factor[k][b]).sum();
        }
        q.hessian[a][a] += 0.05;
    }
    q.gradient = random.array(2.0);
    let mut bounds = Bounds {
        lower: core::array::from_fn(|_| -0.3 - 0.7 * random.unit()),
        upper: core::array::from_fn(|_| 0.3 + 0.7 * random.unit()),
        rate: core::array::from_fn(|_| 0.05 + 0.5 * random.unit()),
        previous: [0.0; NU],
    };
    for c in 0..NU {
        let range = bounds.upper[c] - bounds.lower[c];
        // At the edge of the box in a third of the cases.
        let place = (1.5 * random.unit() - 0.25).clamp(0.0, 1.0);
        bounds.previous[c] = bounds.lower[c] + place * range;
    }
    let mut u = random.array(1.0);
    bounds.project(&mut u);
    (q, bounds, u)
}

fn check<const NU: usize, const NV: usize>(seed: u64, cases: usize) {
    let mut random = Random(seed);
    let (mut limited, mut most) = (0, 0);
    for case in 0..cases {
        let (q, bounds, u) = problem::<NU, NV>(&mut random);
        let mut active = ActiveSet::new();
        let mut w = [0.0; NV];
        let solution = active_set::solve(&q, &bounds, &u, &mut active, &mut w);
        let wide = w.map(f64::from);
        assert!(
            violation::<NU, NV>(&bounds, &wide) < 2e-7,
            "case {case}: {w:?} is outside"
        );
        let (found, best) = (objective(&q, &u, &wide), enumerate(&q, &bounds, &u));
        assert!(
            found - best < 2e-5 * (1.0 + best.abs()),
            "case {case}: {found} found, {best} possible; {active:?}"
        );
        assert!(solution.optimal, "case {case}: ended by the limit");
        limited += usize::from(!active.is_empty());
        most = most.max(solution.iterations);

        // Warm: from the solution with its active set, one factorisation proves it.
        let mut again = w;
        let warm = active_set::solve(
            &requadratic(&q, &u, &w),
            &bounds,
            &w,
            &mut active,
            &mut again,
        );
        assert!(
            warm.optimal && warm.iterations <= 2,
            "case {case}: {warm:?}"
        );
    }
    assert!(
        limited > cases / 2,
        "only {limited} of {cases} cases met a limit"
    );
    println!("NU {NU}, NV {NV}: {limited} of {cases} limited, at most {most} factorisations");
}

/// The same function around another point.
fn requadratic<const NV: usize>(q: &Quadratic<NV>, u: &[f32; NV], w: &[f32; NV]) -> Quadratic<NV> {
    let p: [f32; NV] = core::array::from_fn(|v| w[v] - u[v]);
    let change = q.hessian_times(&p);
    let mut moved = q.clone();
    for v in 0..NV {
        moved.gradient[v] += change[v];
    }
    moved
}

#[test]
fn one_channel_of_four_is_optimal() {
    check::<1, 4>(1, 150);
}

#[test]
fn two_channels_of_two_are_optimal() {
    check::<2, 4>(2, 150);
}

#[test]
fn three_channels_held_at_once_are_optimal() {
    check::<3, 3>(3, 300);
}

/// Check beyond enumeration: no direction inside the limits is left that lowers the objective.
#[test]
fn long_chains_are_optimal_by_first_order_probing() {
    let mut random = Random(4);
    for case in 0..300 {
        let (q, bounds, u) = problem::<2, 20>(&mut random);
        let mut active = ActiveSet::new();
        let mut w = [0.0; 20];
        let solution = active_set::solve(&q, &bounds, &u, &mut active, &mut w);
        assert!(solution.optimal, "case {case}: ended by the limit");
        let best = objective(&q, &u, &w.map(f64::from));
        for _ in 0..300 {
            let length = 0.3 * random.unit();
            let mut other: [f32; 20] = core::array::from_fn(|v| w[v] + length * random.signed());
            bounds.project(&mut other);
            let value = objective(&q, &u, &other.map(f64::from));
            assert!(
                value > best - 1e-4 * (1.0 + best.abs()),
                "case {case}: {value} below {best}"
            );
        }
    }
}

#[test]
fn indefinite_and_flat_hessians_end_feasible_and_lower() {
    let mut random = Random(5);
    for case in 0..300 {
        let (mut q, bounds, u) = problem::<2, 6>(&mut random);
        match case % 3 {
            0 => q.hessian = [[0.0; 6]; 6],
            1 => (0..6).for_each(|v| q.hessian[v][v] -= 1.5),
            _ => q.hessian.iter_mut().flatten().for_each(|h| *h *= -1.0),
        }
        let mut w = [0.0; 6];
        let _ = active_set::solve(&q, &bounds, &u, &mut ActiveSet::new(), &mut w);
        assert!(
            violation::<2, 6>(&bounds, &w.map(f64::from)) < 2e-7,
            "case {case}"
        );
        let p: [f32; 6] = core::array::from_fn(|v| w[v] - u[v]);
        assert!(
            q.slope(&p) < 0.0 || w == u || case % 3 > 0,
            "case {case}: not downhill"
        );
    }
}

#[test]
fn factorisation_solves_and_shifts() {
    let mut random = Random(6);
    for _ in 0..200 {
        let (q, _, _) = problem::<1, 8>(&mut random);
        let b: [f32; 8] = random.array(1.0);
        let mut x = b;
        assert_eq!(ldl::solve(&q.hessian, &mut x), 0.0);
        let back = q.hessian_times(&x);
        for (back, b) in back.iter().zip(&b) {
            assert!((back - b).abs() < 2e-3, "{back} and {b}");
        }
        let mut indefinite = q.hessian;
        indefinite[3][3] = -2.0;
        let mut x = b;
        let shift = ldl::solve(&indefinite, &mut x);
        assert!(shift > 2.0 && x.iter().all(|x| x.is_finite()));
        let downhill: f32 = x.iter().zip(&b).map(|(x, b)| x * b).sum();
        assert!(
            downhill > 0.0,
            "the shifted matrix is not positive definite"
        );
    }
    let mut x = [1.0, f32::NAN];
    ldl::solve(&[[1.0, 0.0], [0.0, 1.0]], &mut x);
    assert!(x[1].is_nan());
}

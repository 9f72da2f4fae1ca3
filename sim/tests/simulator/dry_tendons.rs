//! Tendons that rub over paths that follow from one another: three or four over two bodies, so that
//! what holds is not told by the motion. Judged by the law written down once more, smoothed to a
//! creep that hardly shows.

use crate::mechanisms::{effect, plant, run, times};
use proptest::prelude::*;
use sinew_sim::{Dual, InputTrajectory, Plant, Scalar};

/// Speed along a path at which the smoothed friction has three quarters of its level, m/s.
const CREEP: f64 = 2e-5;
const STIFFNESS: [f64; 2] = [30.0, 45.0];
const INERTIA: [f64; 2] = [1.0, 0.7];
const DAMPING: [f64; 2] = [4.0, 3.0];
const PRETENSION: f64 = 2.0;

/// A tendon over both bodies: where it pulls and how much of its tension it rubs with.
#[derive(Clone, Debug)]
struct Dry {
    arms: [f64; 2],
    coefficient: f64,
}

fn push(t: f64) -> [f64; 2] {
    [
        3.0 * (2.1 * t).sin() + 1.5 * (5.3 * t).sin(),
        2.5 * (1.7 * t).sin() - 2.0 * (4.4 * t).sin(),
    ]
}

/// The rig with these tendons, body `a` on a dry slide.
fn rig(tendons: &[Dry], slide: f64) -> Plant {
    let mut text = String::new();
    if slide > 0.0 {
        text += &effect("coulomb_friction", "a", &[("level", slide)]);
    }
    for (i, name) in ["a", "b"].iter().enumerate() {
        text += &format!(
            "[[body]]\nname = \"{name}\"\nmotion = \"slide\"\ninertia = {:?}\n\
             [[spring]]\nname = \"spring_{name}\"\nfrom = \"ground\"\nto = \"{name}\"\nstiffness = {:?}\n\
             [[damper]]\nname = \"damper_{name}\"\nfrom = \"ground\"\nto = \"{name}\"\ndamping = {:?}\n\
             [[actuator]]\nname = \"push_{name}\"\ndrives = \"{name}\"\ninput = \"u_{name}_N\"\ngain = 1.0\n\
             [[sensor]]\nname = \"x_{name}\"\nreads = \"{name}.position\"\nsignal = \"q_{name}_m\"\n",
            INERTIA[i], STIFFNESS[i], DAMPING[i]
        );
    }
    for (index, tendon) in tendons.iter().enumerate() {
        let [a, b] = tendon.arms;
        // Without stiffness of its own its tension stays, and the level of its friction with it.
        text += &format!(
            "[[tendon]]\nname = \"line_{index}\"\npath = [{{ body = \"a\", arm = {a:?} }}, {{ body = \"b\", arm = {b:?} }}]\n\
             stiffness = 0.0\npretension = {PRETENSION:?}\n"
        );
        text += &effect(
            "load_dependent_friction",
            &format!("line_{index}"),
            &[("coefficient", tendon.coefficient)],
        );
    }
    plant(&text)
}

/// The same by the law itself, friction smoothed, in steps that are short beside its rate.
fn smoothed(tendons: &[Dry], slide: f64, times: &[f64]) -> Vec<[f64; 2]> {
    let rate = |held: [f64; 2], q: [f64; 2], v: [f64; 2]| {
        let mut force = [0, 1].map(|i| held[i] - STIFFNESS[i] * q[i] - DAMPING[i] * v[i]);
        for Dry { arms, coefficient } in tendons {
            let speed = arms[0] * v[0] + arms[1] * v[1];
            let rubbing = coefficient * PRETENSION * (speed / CREEP).tanh();
            for i in 0..2 {
                force[i] -= arms[i] * (PRETENSION + rubbing);
            }
        }
        force[0] -= slide * (v[0] / CREEP).tanh();
        [0, 1].map(|i| force[i] / INERTIA[i])
    };
    let (mut q, mut v) = ([0.0; 2], [0.0; 2]);
    let mut out = vec![q];
    for pair in times.windows(2) {
        let held = push(pair[0]);
        let steps = 400;
        let h = (pair[1] - pair[0]) / f64::from(steps);
        for _ in 0..steps {
            // Heun's two stages.
            let first = rate(held, q, v);
            let (q1, v1) = (
                [0, 1].map(|i| q[i] + h * v[i]),
                [0, 1].map(|i| v[i] + h * first[i]),
            );
            let second = rate(held, q1, v1);
            q = [0, 1].map(|i| q[i] + 0.5 * h * (v[i] + v1[i]));
            v = [0, 1].map(|i| v[i] + 0.5 * h * (first[i] + second[i]));
        }
        out.push(q);
    }
    out
}

fn inputs(times: &[f64]) -> [Vec<f64>; 2] {
    [0, 1].map(|i| times.iter().map(|&t| push(t)[i]).collect())
}

/// Largest difference from the smoothed law over the range of the motion, and how many rows rest.
fn compare(tendons: &[Dry], slide: f64) -> (f64, usize) {
    let times = times(300, 0.01);
    let columns = inputs(&times);
    let ours = run(&rig(tendons, slide), &times, &[&columns[0], &columns[1]]);
    assert_eq!(ours.report.fallbacks, 0, "{:?}", ours.report);
    let theirs = smoothed(tendons, slide, &times);
    let mut worst = 0.0f64;
    for i in 0..2 {
        let theirs: Vec<f64> = theirs.iter().map(|q| q[i]).collect();
        let range = theirs.iter().copied().fold(f64::MIN, f64::max)
            - theirs.iter().copied().fold(f64::MAX, f64::min);
        let difference = crate::mechanisms::distance(&theirs, ours.column(i));
        worst = worst.max(difference / range.max(1e-2));
    }
    let (a, b) = (ours.column(0), ours.column(1));
    let still = |q: &[f64], row: usize| (q[row] - q[row - 1]).abs() < 1e-14;
    let rests = |row: &usize| still(&a, *row) && still(&b, *row);
    (worst, (1..times.len()).filter(rests).count())
}

fn around(count: usize, coefficient: impl Fn(usize) -> f64) -> Vec<Dry> {
    let angle = |k: usize| std::f64::consts::TAU * k as f64 / count as f64 + 0.3;
    (0..count)
        .map(|k| Dry {
            arms: [angle(k).cos(), angle(k).sin()],
            coefficient: coefficient(k),
        })
        .collect()
}

#[test]
fn tendons_all_around_hold_together_what_one_alone_could_not() {
    for count in [3, 4, 5] {
        let (error, rests) = compare(&around(count, |k| 0.35 + 0.05 * k as f64), 0.0);
        println!("{count} tendons: {error:.1e} of the range, {rests} of 300 rows at rest");
        assert!(error < 1e-3, "{count} tendons: {error:.1e} of the range");
        assert!(rests > 20, "{count} tendons: {rests} rows at rest");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_dry_tendons_over_two_bodies_move_as_the_smoothed_law(
        drawn in prop::collection::vec((0.01..std::f64::consts::TAU, 0.3..1.2f64, 0.02..0.5f64), 1..5),
        opposite in any::<bool>(),
        slide in prop_oneof![Just(0.0), 0.05..1.0f64],
    ) {
        let mut tendons: Vec<Dry> = drawn
            .iter()
            .map(|&(angle, size, coefficient)| Dry {
                arms: [size * angle.cos(), size * angle.sin()],
                coefficient,
            })
            .collect();
        if opposite {
            let Dry { arms, coefficient } = tendons[0].clone();
            tendons.push(Dry { arms: arms.map(|arm| -1.3 * arm), coefficient: 0.7 * coefficient });
        }
        let (error, _) = compare(&tendons, slide);
        prop_assert!(error < 2e-3, "{tendons:?}, {slide}: {error:.1e} of the range");
    }
}

/// Two opposite tendons share a load in any proportion: the motion has derivatives all the same.
#[test]
fn derivatives_go_through_the_rest_of_opposite_tendons() {
    let tendons = [
        Dry {
            arms: [0.8, 0.5],
            coefficient: 0.4,
        },
        Dry {
            arms: [-0.8, -0.5],
            coefficient: 0.3,
        },
        Dry {
            arms: [-0.5, 0.8],
            coefficient: 0.2,
        },
    ];
    let plant = rig(&tendons, 0.0);
    let times = times(300, 0.01);
    let columns = inputs(&times);
    let drive = InputTrajectory::new(&plant, times.len(), &[&columns[0], &columns[1]]).unwrap();
    let slot = |k: usize| plant.slot(&format!("line_{k}.load_dependent_friction.coefficient"));
    let slots: Vec<usize> = (0..3).map(|k| slot(k).unwrap()).collect();
    let values = plant.values();
    let seeded: Vec<Dual<4>> = (0..values.len())
        .map(|i| match slots.iter().position(|&slot| slot == i) {
            Some(seed) => Dual::variable(values[i], seed),
            None => Dual::constant(values[i]),
        })
        .collect();
    let start = vec![0.0; plant.state_len()];
    let lifted: Vec<Dual<4>> = start.iter().map(|&x| Dual::constant(x)).collect();
    let ours = plant.simulate(&seeded, &lifted, &drive, &times).unwrap();
    for (seed, &slot) in slots.iter().enumerate() {
        let moved = |by: f64| {
            let mut values = values.clone();
            values[slot] += by;
            plant.simulate(&values, &start, &drive, &times).unwrap()
        };
        let d = 1e-6;
        let (more, less) = (moved(d), moved(-d));
        for sensor in 0..2 {
            let slopes: Vec<f64> = (0..times.len())
                .map(|row| (more.signal(row, sensor) - less.signal(row, sensor)) / (2.0 * d))
                .collect();
            let largest = slopes
                .iter()
                .fold(0.0f64, |most, slope| most.max(slope.abs()));
            assert!(
                largest > 1e-3,
                "line {seed} does not show in sensor {sensor}"
            );
            for (row, slope) in slopes.iter().enumerate() {
                let own = ours.signal(row, sensor).derivative[seed];
                assert!(
                    (own - slope).abs() < 1e-4 * largest,
                    "line {seed}, sensor {sensor}, row {row}: {own:e} {slope:e}"
                );
            }
        }
    }
}

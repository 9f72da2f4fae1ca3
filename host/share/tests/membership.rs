//! An attacker who knows everything but whether one device was in the fleet.

use rand::SeedableRng;
use rand_chacha::ChaCha20Rng;
use sinew_share::statistics::{Counts, sensitivity};
use sinew_share::{Budget, Noise, Release};

const TRIALS: usize = 10_000;

/// Statistic of the likelihood-ratio test, the strongest there is: the noisy sums along the
/// difference of the two fleets, from half-way between them.
fn evidence(release: &Release, with: &[i64], without: &[i64]) -> f64 {
    let each = release.sums.iter().zip(with).zip(without);
    each.map(|((sum, with), without)| {
        let middle = 0.5 * (*with as f64 + *without as f64);
        (*sum as f64 - middle) * (with - without) as f64
    })
    .sum()
}

/// Largest violation of `share(members) <= e^epsilon share(others) + delta` over all thresholds,
/// and the largest difference of the two shares.
fn attacked(budget: &Budget, noise: &Budget) -> (f64, f64) {
    let rest: Vec<Vec<f64>> = (0..30)
        .map(|k| vec![0.01 * f64::from(k), -0.2, 0.4])
        .collect();
    let fleet = |device: [f64; 3]| -> Vec<Vec<f64>> {
        let mut all = rest.clone();
        all.push(device.to_vec());
        all
    };
    // The worst case of eq. 3: a device at one end of the region, in place of one at the other.
    let (member, other) = (fleet([0.6, 0.8, 0.0]), fleet([-0.6, -0.8, 0.0]));
    let (with, without) = (Counts::sum(&member), Counts::sum(&other));
    let variance = noise.variance(sensitivity(3));
    let mut source = Noise::new(ChaCha20Rng::seed_from_u64(1));
    let mut draw = |fleet: &[Vec<f64>]| {
        let release = Release::with_variance(fleet, variance, &mut source);
        evidence(&release, with.numbers(), without.numbers())
    };
    let mut all: Vec<(f64, bool)> = Vec::new();
    for _ in 0..TRIALS {
        all.push((draw(&member), true));
        all.push((draw(&other), false));
    }
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    let (mut hits, mut false_hits) = (0.0, 0.0);
    let (mut violation, mut advantage) = (f64::NEG_INFINITY, 0.0_f64);
    for (_, is_member) in all {
        if is_member {
            hits += 1.0 / TRIALS as f64;
        } else {
            false_hits += 1.0 / TRIALS as f64;
        }
        violation = violation.max(hits - budget.epsilon.exp() * false_hits - budget.delta);
        advantage = advantage.max(hits - false_hits);
    }
    (violation, advantage)
}

/// Four standard deviations of a share of so many trials, with what `e^epsilon` makes of it.
fn chance(budget: &Budget) -> f64 {
    4.0 * (1.0 + budget.epsilon.exp()) * (0.25 / TRIALS as f64).sqrt() * 0.5
}

#[test]
fn no_threshold_of_the_strongest_test_beats_the_budget() {
    for epsilon in [0.5, 1.0, 2.0] {
        let budget = Budget {
            epsilon,
            delta: 1e-4,
        };
        let (violation, advantage) = attacked(&budget, &budget);
        assert!(violation < chance(&budget), "{epsilon}: {violation}");
        assert!(
            advantage < budget.most_advantage(),
            "{epsilon}: {advantage}"
        );
        // The attack does find something: it is no straw man.
        assert!(
            advantage > 0.2 * budget.most_advantage(),
            "{epsilon}: {advantage}"
        );
    }
}

#[test]
fn the_same_test_finds_a_mechanism_with_too_little_noise() {
    let budget = Budget {
        epsilon: 1.0,
        delta: 1e-4,
    };
    let broken = Budget {
        epsilon: 6.0,
        ..budget
    };
    let (violation, advantage) = attacked(&budget, &broken);
    assert!(violation > chance(&budget), "{violation}");
    assert!(advantage > budget.most_advantage(), "{advantage}");
}

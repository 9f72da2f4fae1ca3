//! `cargo xtask experiments share`: what a private release of a fleet is worth, and what an
//! attacker learns from it (docs/evaluation/sharing.md).
//!
//! The devices are masses that MuJoCo runs (tests/foreign/plants/fleet.py), 5 s each. The rig has
//! their laws and the catalogue's numbers, which are the public guess.

use std::fs;

use anyhow::{Context, Result};
use rand::SeedableRng;
use rand_chacha::ChaCha20Rng;
use sinew_ident::excite::{Kind, Options};
use sinew_ident::fleet::Recorded;
use sinew_ident::recording::Recording;
use sinew_share::statistics::{Counts, expected_error, sensitivity};
use sinew_share::{Budget, Inputs, Noise, Region, Release, places, recordings, synthesise};
use sinew_sim::{Plant, Rig};

use super::problems::MASS;
use crate::foreign::python;
use xtask::process::root;

/// Its name on the command line.
pub const NAME: &str = "share";

const DEVICES: usize = 200;
const SIZES: [usize; 3] = [50, 100, 200];
const EPSILONS: [f64; 3] = [1.0, 2.0, 4.0];
const DELTA: f64 = 1e-6;
/// The public guess: within this factor of the catalogue.
const WITHIN: f64 = 2.5;
/// Factor of a region that clips nothing.
const ANYWHERE: f64 = 1000.0;
/// Releases a cell of the table.
const RELEASES: u64 = 20;
/// Synthetic devices, and those that are recorded and fitted.
const COUNT: usize = 100;
const RECORDED: usize = 40;
/// Releases that an attacker sees, of either fleet.
const TRIALS: usize = 10_000;

/// Answers for a seed.
///
/// # Errors
/// Python, a recording, or a fit.
pub fn run(seed: u64) -> Result<()> {
    let study = Study::new()?;
    study.table(seed)?;
    study.fitted(seed)?;
    study.attack(seed)
}

/// Fitted devices.
struct Study {
    rig: Rig,
    region: Region,
    /// Parameters of each device as fitted, SI.
    values: Vec<Vec<f64>>,
}

/// Fits devices without clipping.
fn fitted(rig: &Rig, devices: &[Recorded]) -> Result<Vec<Vec<f64>>> {
    let wide = Region::new(rig, &Plant::new(rig)?, ANYWHERE, &[])?;
    let found = places(rig, &wide, devices, &|_| {})?.each;
    Ok(found.iter().map(|place| wide.values(place)).collect())
}

/// Geometric mean of each parameter, and the deviation of its logarithm.
fn moments(values: &[Vec<f64>]) -> Vec<(f64, f64)> {
    let count = values.len() as f64;
    let each = (0..values.first().map_or(0, Vec::len)).map(|k| {
        let mean = values.iter().map(|it| it[k].ln()).sum::<f64>() / count;
        let squares: f64 = values.iter().map(|it| (it[k].ln() - mean).powi(2)).sum();
        (mean.exp(), (squares / count).sqrt())
    });
    each.collect()
}

impl Study {
    fn new() -> Result<Self> {
        let folder = root().join("target/experiments").join(NAME);
        let there = folder.join("recordings");
        fs::create_dir_all(&there).with_context(|| format!("cannot make {}", there.display()))?;
        let path = |k: usize| there.join(format!("device-{k:03}.csv"));
        if !path(DEVICES).exists() {
            let name = there.to_str().context("a folder's name in UTF-8")?;
            let count = DEVICES.to_string();
            python::environment()?.run(&["-m", "plants.fleet", name, &count])?;
        }
        let text = |path: &str| fs::read_to_string(root().join(path));
        let rig = format!("{}\n{}", text(MASS.nominal)?, text(MASS.left_out)?);
        let rig = Rig::parse(&rig, "rig.toml")?;
        let devices = (1..=DEVICES).map(|k| {
            let recordings = vec![Recording::read(path(k))?];
            let name = k.to_string();
            Ok(Recorded { name, recordings })
        });
        let devices = devices.collect::<Result<Vec<_>>>()?;
        let region = Region::new(&rig, &Plant::new(&rig)?, WITHIN, &[])?;
        let values = fitted(&rig, &devices)?;
        println!("{DEVICES} devices of 5 s, as fitted:");
        for (side, (mean, deviation)) in region.sides.iter().zip(moments(&values)) {
            let (name, unit) = (&side.axis.name, &side.axis.unit);
            println!("  {name}: {mean:.4} {unit}, deviation {deviation:.3}");
        }
        Ok(Self {
            rig,
            region,
            values,
        })
    }

    /// Places of the first devices in the public region.
    fn places(&self, devices: usize) -> Vec<Vec<f64>> {
        let values = self.values[..devices].iter();
        values.map(|it| self.region.place(it)).collect()
    }

    /// Errors of means and deviations over budgets and sizes.
    fn table(&self, seed: u64) -> Result<()> {
        println!(
            "\n| devices | epsilon | expected | means: RMS, largest of {RELEASES} | deviations: RMS |"
        );
        println!("|--:|--:|--:|--:|--:|");
        let half = WITHIN.ln();
        for devices in SIZES {
            let (wanted, own) = (moments(&self.values[..devices]), self.places(devices));
            for epsilon in EPSILONS {
                let budget = Budget {
                    epsilon,
                    delta: DELTA,
                };
                budget.check(devices)?;
                let (mut squares, mut largest, mut spread) = (0.0, 0.0_f64, 0.0);
                for k in 0..RELEASES {
                    let random = ChaCha20Rng::seed_from_u64(1000 * seed + k);
                    let release = Release::new(&own, &budget, random);
                    let shared = synthesise(&release, COUNT, k);
                    let values: Vec<Vec<f64>> = shared
                        .places
                        .iter()
                        .map(|it| self.region.values(it))
                        .collect();
                    for (a, b) in moments(&values).iter().zip(&wanted) {
                        let error = a.0 / b.0 - 1.0;
                        squares += error * error;
                        largest = largest.max(error.abs());
                        spread += (a.1 - b.1).powi(2);
                    }
                }
                let count = RELEASES as f64 * wanted.len() as f64;
                let expected = half * expected_error(wanted.len(), devices, &budget);
                println!(
                    "| {devices} | {epsilon} | {:.1} % | {:.1} %, {:.1} % | {:.3} |",
                    100.0 * expected,
                    100.0 * (squares / count).sqrt(),
                    100.0 * largest,
                    (spread / count).sqrt()
                );
            }
        }
        Ok(())
    }

    /// Fits of the recordings that are shared, beside fits of the true ones.
    fn fitted(&self, seed: u64) -> Result<()> {
        println!("\n| epsilon | parameter | true recordings | shared recordings | apart |");
        println!("|--:|---|--:|--:|--:|");
        let wanted = moments(&self.values);
        let own = self.places(DEVICES);
        for epsilon in EPSILONS {
            let budget = Budget {
                epsilon,
                delta: DELTA,
            };
            let release = Release::new(&own, &budget, ChaCha20Rng::seed_from_u64(seed));
            let shared = synthesise(&release, RECORDED, seed);
            let inputs = Inputs {
                design: Options {
                    kind: Kind::Mixed,
                    seconds: 10.0,
                    ..Options::default()
                },
                noise: 0.005,
            };
            let made = recordings(&self.rig, &self.region, &shared.places, &inputs)?;
            let devices: Vec<Recorded> = (made.into_iter().enumerate())
                .map(|(k, recording)| Recorded {
                    name: k.to_string(),
                    recordings: vec![recording],
                })
                .collect();
            let found = moments(&fitted(&self.rig, &devices)?);
            let mut worst = 0.0_f64;
            for ((side, a), b) in self.region.sides.iter().zip(&wanted).zip(&found) {
                let apart = b.0 / a.0 - 1.0;
                worst = worst.max(apart.abs());
                println!(
                    "| {epsilon} | {} | {:.4}, deviation {:.3} | {:.4}, deviation {:.3} | {:.1} % |",
                    side.axis.name,
                    a.0,
                    a.1,
                    b.0,
                    b.1,
                    100.0 * apart
                );
            }
            let verdict = if worst <= 0.05 { "reached" } else { "MISSED" };
            println!(
                "{verdict}: epsilon {epsilon}: means within 5 %: {:.1} %",
                100.0 * worst
            );
        }
        Ok(())
    }

    /// The strongest test of membership, for the device farthest from all others.
    fn attack(&self, seed: u64) -> Result<()> {
        println!("\n| devices | epsilon | told from each other | the budget's bound |");
        println!("|--:|--:|--:|--:|");
        let size = |place: &[f64]| place.iter().map(|x| x * x).sum::<f64>();
        for devices in [SIZES[0], DEVICES] {
            let member = self.places(devices);
            let farthest =
                (0..devices).max_by(|a, b| size(&member[*a]).total_cmp(&size(&member[*b])));
            let farthest = farthest.context("no devices")?;
            let mut other = member.clone();
            other[farthest] = member[farthest].iter().map(|x| -x).collect();
            for epsilon in EPSILONS {
                let budget = Budget {
                    epsilon,
                    delta: DELTA,
                };
                let advantage = advantage(&member, &other, &budget, seed);
                let bound = budget.most_advantage();
                let verdict = if advantage <= bound {
                    "reached"
                } else {
                    "MISSED"
                };
                println!("| {devices} | {epsilon} | {advantage:.3} | {bound:.3}: {verdict} |");
            }
        }
        Ok(())
    }
}

/// Largest difference between the shares of releases of two fleets that a threshold of the
/// likelihood ratio calls those of the first.
fn advantage(member: &[Vec<f64>], other: &[Vec<f64>], budget: &Budget, seed: u64) -> f64 {
    let (with, without) = (Counts::sum(member), Counts::sum(other));
    let variance = budget.variance(sensitivity(member.first().map_or(0, Vec::len)));
    let mut noise = Noise::new(ChaCha20Rng::seed_from_u64(seed));
    let mut evidence = |fleet: &[Vec<f64>]| -> f64 {
        let release = Release::with_variance(fleet, variance, &mut noise);
        let each = release
            .sums
            .iter()
            .zip(with.numbers())
            .zip(without.numbers());
        each.map(|((sum, a), b)| (*sum as f64 - 0.5 * (a + b) as f64) * (a - b) as f64)
            .sum()
    };
    let mut all: Vec<(f64, f64)> = Vec::new();
    for _ in 0..TRIALS {
        all.push((evidence(member), 1.0));
        all.push((evidence(other), -1.0));
    }
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut difference = 0.0;
    let running = all.iter().map(|(_, sign)| {
        difference += sign / TRIALS as f64;
        difference
    });
    running.fold(0.0, f64::max)
}

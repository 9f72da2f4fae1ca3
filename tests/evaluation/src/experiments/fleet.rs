//! `cargo xtask experiments fleet`: what the distribution of a dozen devices is worth
//! (docs/evaluation/fleet.md).
//!
//! The devices are masses that MuJoCo runs (tests/foreign/plants/fleet.py). The rig has their laws
//! and the catalogue's numbers. `unseen` compares the responses of 200 further devices with those
//! of draws; `new` fits devices to little with the fleet as prior and without; `loops` tunes a
//! controller on plants of the fleet and of a box.

use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;
use sinew_ident::fit::{FitOptions, fit, score};
use sinew_ident::fleet::{FleetFit, Recorded, estimate};
use sinew_ident::population::Fleet;
use sinew_ident::recording::Recording;
use sinew_sim::{InputTrajectory, Plant, Rig};

use super::bench::Bench;
use super::problems::MASS;
use crate::figure::{Row, middle, millimetres};
use crate::foreign::python;
use xtask::process::{self, root};

/// Its name on the command line.
pub const NAME: &str = "fleet";

const CASES: [&str; 3] = ["unseen", "new", "loops"];
const DEVICES: usize = 12;
const NEW: usize = 41;
const UNSEEN: usize = 200;
/// Plants drawn for a band; pairs of them for a distance.
const DRAWS: usize = 500;
/// Rows before any device has moved.
const STILL_ROWS: usize = 12;
/// Controllers: tuned on plants of the box, tuned on plants of the fleet, trained on them as well.
const TUNED: [&str; 3] = ["box", "fleet", "trained"];
/// Half the width of the box that the fleet is compared with.
const BOX: f64 = 0.2;

/// Distribution that tests/foreign/plants/fleet.py draws from: geometric mean and deviation of the
/// logarithm.
const TRUTH: [(&str, f64, f64); 4] = [
    ("coil.stiffness", 34.0, 0.20),
    ("dashpot.damping", 1.6, 0.30),
    ("mass.coulomb_friction.level", 0.7, 0.30),
    ("mass.inertia", 1.15, 0.10),
];

/// Its correlations, by places above.
const CORRELATIONS: [(usize, usize, f64); 2] = [(0, 1, 0.7), (1, 2, 0.3)];

/// The true distribution as a fleet whose devices are beyond number.
fn true_fleet() -> Result<Fleet> {
    let size = TRUTH.len();
    let mut covariance = vec![vec![0.0; size]; size];
    for (j, (_, _, deviation)) in TRUTH.iter().enumerate() {
        covariance[j][j] = deviation * deviation;
    }
    for (a, b, correlation) in CORRELATIONS {
        covariance[a][b] = correlation * TRUTH[a].2 * TRUTH[b].2;
        covariance[b][a] = covariance[a][b];
    }
    let nothing = vec![vec![0.0; size]; size];
    let mut text = format!(
        "format = \"sinew-fleet/1\"\nrig = \"truth\"\nwidening = 1.0\nfreedom = 100000\n\
         covariance = {covariance:?}\ncovariance_of_mean = {nothing:?}\n"
    );
    for (name, mean, _) in TRUTH {
        text += &format!(
            "[[parameter]]\nname = \"{name}\"\nunit = \"\"\nscale = \"log\"\nmean = {mean:?}\n"
        );
    }
    Ok(Fleet::parse(&text, Path::new("the true distribution"))?)
}

/// Answers for a seed; with names in `only`, those cases alone.
///
/// # Errors
/// A case that there is not, Python, a fit, or the exit status of `sinew`.
pub fn run(seed: u64, only: &[String]) -> Result<()> {
    if let Some(name) = only.iter().find(|name| !CASES.contains(&name.as_str())) {
        bail!(
            "{NAME} has no case '{name}'; there are {}",
            CASES.join(", ")
        );
    }
    let asked = |case: &str| only.is_empty() || only.iter().any(|name| name == case);
    let folder = root().join("target/experiments").join(NAME);
    let recordings = folder.join("recordings");
    fs::create_dir_all(&recordings)
        .with_context(|| format!("cannot make {}", recordings.display()))?;
    let python = python::environment()?;
    let there = recordings.to_str().context("a folder's name in UTF-8")?;
    python.run(&["-m", "plants.fleet", there])?;
    let study = Study::new(&folder, seed)?;
    for (said, value, reached) in [
        if asked("unseen") {
            study.unseen()?
        } else {
            Vec::new()
        },
        if asked("new") {
            study.new_devices()?
        } else {
            Vec::new()
        },
        if asked("loops") {
            study.loops(&python)?
        } else {
            Vec::new()
        },
    ]
    .concat()
    {
        let verdict = if reached { "reached" } else { "MISSED" };
        println!("{verdict}: {said}: {value}");
    }
    Ok(())
}

/// A target: what is asked, what was found, and whether that reaches it.
type Target = (String, String, bool);

/// Rig, recordings and fleet.
struct Study {
    folder: PathBuf,
    seed: u64,
    rig: Rig,
    plant: Plant,
    found: FleetFit,
}

impl Study {
    fn new(folder: &Path, seed: u64) -> Result<Self> {
        let text = |path: &str| fs::read_to_string(root().join(path));
        let rig = format!("{}\n{}", text(MASS.nominal)?, text(MASS.left_out)?);
        fs::write(folder.join("rig.toml"), &rig)?;
        let rig = Rig::parse(&rig, "rig.toml")?;
        let devices = (1..=DEVICES).map(|k| {
            let name = format!("device-{k:02}");
            let path = folder.join("recordings").join(format!("{name}.csv"));
            let recordings = vec![Recording::read(path)?];
            Ok(Recorded { name, recordings })
        });
        let devices = devices.collect::<Result<Vec<_>>>()?;
        let found = estimate(&rig, &devices, false, &mut |_, _| {})?;
        fs::write(folder.join("fleet.toml"), found.fleet.to_toml())?;
        println!("{DEVICES} devices of 1.5 s:");
        for (j, axis) in found.fleet.axes.iter().enumerate() {
            println!(
                "  {}: mean {:.3} {}, deviation {:.3}, of a new device {:.3}",
                axis.name,
                axis.mean,
                axis.unit,
                found.population.covariance[(j, j)].sqrt(),
                found.fleet.of_a_new_device()[(j, j)].sqrt()
            );
        }
        println!("  {}", found.said_of_few());
        for line in found.outliers() {
            println!("  {line}");
        }
        Ok(Self {
            folder: folder.to_path_buf(),
            seed,
            plant: Plant::new(&rig)?,
            rig,
            found,
        })
    }

    fn read(&self, name: &str) -> Result<Recording> {
        Ok(Recording::read(self.folder.join("recordings").join(name))?)
    }

    /// Bands and distances of the responses of draws, beside those of devices never seen.
    fn unseen(&self) -> Result<Vec<Target>> {
        let table = self.read("unseen.csv")?;
        let column = |name: &str| table.column(name).map(<[f64]>::to_vec);
        let unseen: Vec<Vec<f64>> = (1..=UNSEEN)
            .map(|k| column(&format!("q{k:03}_m")).context("a device's column"))
            .collect::<Result<_>>()?;
        let inputs = column("u_N").context("the input's column")?;
        let respond = |values: &[f64]| -> Result<Vec<f64>> {
            let drive = InputTrajectory::new(&self.plant, inputs.len(), &[&inputs])?;
            let run = self
                .plant
                .simulate(values, &[0.0, 0.0], &drive, table.t())?;
            Ok(run.column(0))
        };
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        let mut of_fleet = Vec::new();
        let mut of_box = Vec::new();
        for _ in 0..DRAWS {
            let values = self.found.fleet.draw_plant(&self.plant, &mut random);
            of_fleet.push(respond(&values)?);
            let mut values = self.plant.values();
            for slot in self.plant.free_slots() {
                values[slot] *= 1.0 + random.random_range(-BOX..=BOX);
            }
            of_box.push(respond(&values)?);
        }
        let each = self.found.devices.iter();
        let each = each.map(|device| respond(&Plant::new(&device.fit.rig)?.values()));
        let each = each.collect::<Result<Vec<_>>>()?;
        let nominal = [respond(&self.plant.values())?];
        let whole = energy_distance(&unseen, &nominal);
        println!("\n| draws | 90 % band holds | energy distance, of the nominal device's |");
        println!("|---|--:|--:|");
        let row = |name: &str, draws: &[Vec<f64>]| {
            let (held, part) = (
                held(&unseen, draws),
                energy_distance(&unseen, draws) / whole,
            );
            println!("| {name} | {:.1} % | {part:.3} |", 100.0 * held);
            (held, part)
        };
        let (share, part) = row("fleet", &of_fleet);
        row("its devices, each as fitted", &each);
        row("box of 20 % about the nominal device", &of_box);
        println!();
        Ok(vec![
            (
                "90 % band holds 86 to 96 % of 200 unseen devices".into(),
                format!("{:.1} %", 100.0 * share),
                (0.86..=0.96).contains(&share),
            ),
            (
                "energy distance at most 0.15 of the nominal device's".into(),
                format!("{part:.3}"),
                part <= 0.15,
            ),
        ])
    }

    /// Free-run errors of new devices that were fitted to one and to five seconds.
    fn new_devices(&self) -> Result<Vec<Target>> {
        let of = |fleet: Fleet| FitOptions {
            fleet: Some(fleet),
            ..FitOptions::default()
        };
        let (with, ideal) = (of(self.found.fleet.clone()), of(true_fleet()?));
        println!(
            "\n| new device | 1 s alone | 1 s, fleet | 5 s alone | 5 s, fleet | 1 s, true \
             distribution |"
        );
        println!("|---|--:|--:|--:|--:|--:|");
        let mut all: Vec<[f64; 5]> = Vec::new();
        for k in 1..=NEW {
            let test = [self.read(&format!("new-{k:02}.test.csv"))?];
            let error = |length: &str, options: &FitOptions| -> Result<f64> {
                let recordings = [self.read(&format!("new-{k:02}.{length}.csv"))?];
                let fitted = fit(&self.rig, &recordings, options, &mut |_| {})?;
                Ok(score(&fitted.rig, &test)?[0].rms)
            };
            let alone = FitOptions::default();
            let errors = [
                error("1s", &alone)?,
                error("1s", &with)?,
                error("5s", &alone)?,
                error("5s", &with)?,
                error("1s", &ideal)?,
            ];
            println!("| {k} | {} |", errors.map(millimetres).join(" | "));
            all.push(errors);
        }
        let column =
            |of: &dyn Fn(&[f64; 5]) -> f64| middle(&all.iter().map(of).collect::<Vec<_>>());
        let medians: Vec<f64> = (0..5).map(|k| column(&|it| it[k]).0).collect();
        let pooled: Vec<f64> = (0..5)
            .map(|k| {
                let squares: f64 = all.iter().map(|it| it[k] * it[k]).sum();
                (squares / all.len() as f64).sqrt()
            })
            .collect();
        for (name, row) in [("median", &medians), ("root mean square", &pooled)] {
            let row: Vec<String> = row.iter().map(|it| millimetres(*it)).collect();
            println!("| {name} | {} |", row.join(" | "));
        }
        println!();
        let (part, of_all) = (medians[1] / medians[0], pooled[1] / pooled[0]);
        let (typical, worst) = column(&|it| it[3] / it[2]);
        Ok(vec![
            (
                "fit --fleet with 1 s: median free-run error at most half of fit alone".into(),
                format!("{part:.2}; {of_all:.2} in the root mean square of all"),
                part <= 0.5,
            ),
            (
                "with 5 s never more than 10 % worse".into(),
                format!(
                    "ratio {typical:.2} in the median, {worst:.2} at worst; {:.2} in the root \
                     mean square of all",
                    pooled[3] / pooled[2]
                ),
                worst <= 1.1,
            ),
        ])
    }

    /// A controller tuned on plants of the fleet, beside one tuned on plants of the box.
    fn loops(&self, python: &python::Python) -> Result<Vec<Target>> {
        let bench = Bench::new(NAME, self.seed)?;
        let rig = bench.path("rig.toml");
        for (k, name) in (0..).zip(["fit", "test"]) {
            let seed = (10 * self.seed + k).to_string();
            let wanted = ["--seconds", "30", "--amplitude", "0.3"];
            let inputs = bench.inputs(&rig, &wanted, &seed)?;
            let mut simulate = bench.sinew("simulate", &rig);
            simulate.arg("--input").arg(&inputs).arg("--out");
            simulate.arg(bench.path(&format!("{name}.csv")));
            simulate.args(["--with-inputs", "--noise", "0.005", "--quiet"]);
            process::run(simulate.args(["--seed", &seed]))?;
        }
        let recorded = |command: &mut std::process::Command| {
            for name in ["fit", "test"] {
                command.arg(format!("--{name}"));
                command.arg(bench.path(&format!("{name}.csv")));
            }
            command.args(["--seed", &self.seed.to_string()]);
        };
        let fleet = bench.path("fleet.toml");
        let train = |name: &str, of_fleet: bool| -> Result<PathBuf> {
            let model = bench.path(name);
            let mut train = bench.sinew("train", &rig);
            recorded(&mut train);
            if of_fleet {
                train.arg("--fleet").arg(&fleet);
            }
            process::run(train.arg("--out").arg(&model))?;
            Ok(model)
        };
        let (of_rig, of_fleet) = (train("model", false)?, train("model-fleet", true)?);
        let mut models = Vec::new();
        for (name, model) in TUNED.iter().zip([&of_rig, &of_rig, &of_fleet]) {
            let mut tune = bench.sinew("tune", &rig);
            tune.arg(model);
            recorded(&mut tune);
            tune.args(["--by", "gradient", "--evaluations", "25", "--plants", "12"]);
            tune.args(["--horizons", "12", "--control-horizons", "4", "--mpc-only"]);
            tune.args(["--disturbance", "step"]);
            if *name != TUNED[0] {
                tune.arg("--fleet").arg(&fleet);
            }
            // Not `fleet.toml`, which is the fleet.
            tune.arg("--out")
                .arg(bench.path(&format!("tuned-{name}.toml")));
            models.push(bench.path("models").join(name));
            process::run(tune.arg("--model-out").args(models.last()))?;
        }
        let mut compare = bench.sinew("compare", &rig);
        compare.args(&models);
        recorded(&mut compare);
        compare.args(["--draws", "20", "--spread", "0", "--evaluations", "20"]);
        compare.args(["--disturbance", "step", "--delay", "0.004"]);
        compare.args(["--plant-program", &python.line("plants.fleet")]);
        compare.arg("--out").arg(bench.path("firmware"));
        process::run(compare.arg("--json").arg(bench.path("comparison.json")))?;
        let comparison = bench.json("comparison.json")?;
        let controllers = comparison["controllers"].as_array().context("no loops")?;
        println!("\n| tuned on | RMS error: median, worst | largest error: median, worst |");
        println!("|---|---|---|");
        let mut worst = Vec::new();
        for name in TUNED {
            let of = |controller: &&Value| controller["name"] == *name;
            let row = Row::of(controllers.iter().find(of).context("no loops of it")?)?;
            let pair = |values: &[f64]| {
                let (median, worst) = middle(values);
                format!("{}, {}", millimetres(median), millimetres(worst))
            };
            println!("| {name} | {} | {} |", pair(&row.rms), pair(&row.max));
            worst.push(middle(&row.rms).1);
        }
        println!();
        Ok(vec![(
            "worst loop of the controller tuned on the fleet at most that of the box's".into(),
            format!("{} beside {}", millimetres(worst[1]), millimetres(worst[0])),
            worst[1] <= worst[0],
        )])
    }
}

/// Part of all rows of all `devices` within the central 90 % of the draws there.
fn held(devices: &[Vec<f64>], draws: &[Vec<f64>]) -> f64 {
    let rows = devices.first().map_or(0, Vec::len);
    let (mut inside, mut of) = (0_usize, 0_usize);
    for row in STILL_ROWS..rows {
        let mut sorted: Vec<f64> = draws.iter().map(|draw| draw[row]).collect();
        sorted.sort_by(f64::total_cmp);
        let [low, high] = [0.05, 0.95].map(|part| quantile(&sorted, part));
        let within = devices.iter().filter(|it| (low..=high).contains(&it[row]));
        inside += within.count();
        of += devices.len();
    }
    inside as f64 / of as f64
}

/// Quantile of sorted values, straight between neighbours.
fn quantile(sorted: &[f64], part: f64) -> f64 {
    let place = part * (sorted.len() - 1) as f64;
    let (low, high) = (
        sorted[place.floor() as usize],
        sorted[place.ceil() as usize],
    );
    low + (high - low) * place.fract()
}

/// Energy distance of two sets of responses (Székely and Rizzo 2013), over pairs of different
/// members: without bias, so that chance takes it below zero for sets that are alike.
fn energy_distance(a: &[Vec<f64>], b: &[Vec<f64>]) -> f64 {
    2.0 * between(a, b) - within(a) - within(b)
}

fn between(a: &[Vec<f64>], b: &[Vec<f64>]) -> f64 {
    let pairs = a
        .iter()
        .flat_map(|one| b.iter().map(|other| apart(one, other)));
    pairs.sum::<f64>() / (a.len() * b.len()) as f64
}

fn within(a: &[Vec<f64>]) -> f64 {
    let count = a.len();
    if count < 2 {
        return 0.0;
    }
    let pairs = (0..count).flat_map(|i| (0..i).map(move |j| apart(&a[i], &a[j])));
    2.0 * pairs.sum::<f64>() / (count * (count - 1)) as f64
}

/// Root mean square difference of two responses.
fn apart(a: &[f64], b: &[f64]) -> f64 {
    let squares: f64 = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum();
    (squares / a.len() as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_band_holds_what_lies_in_it() {
        let draws: Vec<Vec<f64>> = (0..=100).map(|k| vec![f64::from(k); 13]).collect();
        let device = |value: f64| vec![value; 13];
        assert_eq!(held(&[device(50.0), device(4.0)], &draws), 0.5);
        assert_eq!(held(&[device(5.5), device(94.5)], &draws), 1.0);
    }

    #[test]
    fn alike_sets_have_no_distance_and_shifted_ones_do() {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let mut set = |shift: f64| -> Vec<Vec<f64>> {
            (0..300)
                .map(|_| vec![shift + random.random::<f64>()])
                .collect()
        };
        let (a, b, c) = (set(0.0), set(0.0), set(1.0));
        assert!(energy_distance(&a, &b).abs() < 0.01);
        // 2 E|X - Y| - 2 E|X - X'| of two uniform sets a width apart: 2 - 2 / 3.
        assert!((energy_distance(&a, &c) - 4.0 / 3.0).abs() < 0.1);
    }
}

//! Duration of a simulation: the EMPS rig over 24,841 samples at 1 kHz, plain and with 8
//! derivatives, driven by a recording where one is given and by a chirp otherwise; and the two-mass
//! drive over 4,000 samples, plain and with up to 12 derivatives.
//!
//! `cargo run --release -p sinew-sim --example speed -- [RECORDING.csv]`

use sinew_sim::{Dual, InputTrajectory, Plant, Rig, Scalar, Simulated};
use std::error::Error;
use std::time::Instant;

const RIG: &str = include_str!("../../rigs/emps.toml");

/// Time, input and position of a recording with the columns t, q_m, ..., u_V.
fn read(path: &str) -> Result<[Vec<f64>; 3], Box<dyn Error>> {
    let text = std::fs::read_to_string(path)?;
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let header: Vec<&str> = lines.next().ok_or("empty file")?.split(',').collect();
    let column = |name| header.iter().position(|h| *h == name);
    let wanted = ["t", "u_V", "q_m"].map(column);
    let mut columns = [Vec::new(), Vec::new(), Vec::new()];
    for line in lines {
        let fields: Vec<&str> = line.split(',').collect();
        for (column, at) in columns.iter_mut().zip(wanted) {
            column.push(fields[at.ok_or("a column is missing")?].parse()?);
        }
    }
    Ok(columns)
}

/// A voltage that sweeps through slow and fast motion, with rests, for 24.841 s.
fn chirp() -> [Vec<f64>; 3] {
    let times: Vec<f64> = (0..24_841).map(|k| 1e-3 * f64::from(k)).collect();
    let input = times.iter().map(|t| 3.0 * (0.4 * t * t).sin());
    let input = input.collect();
    let position = vec![0.0; times.len()];
    [times, input, position]
}

fn best_of(rounds: usize, mut run: impl FnMut()) -> f64 {
    let time = |_| {
        let begun = Instant::now();
        run();
        begun.elapsed().as_secs_f64()
    };
    (0..rounds).map(time).fold(f64::INFINITY, f64::min)
}

/// Contract section 2's drive: a motor and a load on a shaft.
const TWO_MASS: &str = r#"
format = "sinew-rig/1"
name = "two-mass drive"
[[body]]
name = "motor"
motion = "hinge"
inertia = { value = 0.02 }
start = { value = 0.1 }
start_velocity = { value = 0.0 }
[[body]]
name = "load"
motion = "hinge"
inertia = { value = 0.10 }
start = { value = 0.0 }
start_velocity = { value = 0.0 }
[[spring]]
name = "shaft"
from = "motor"
to = "load"
stiffness = { value = 30.0 }
rest = { value = 0.0 }
[[damper]]
name = "bearing"
from = "ground"
to = "load"
damping = { value = 0.05 }
[[damper]]
name = "commutator"
from = "ground"
to = "motor"
damping = { value = 0.01 }
[[actuator]]
name = "drive"
drives = "motor"
input = "u_V"
gain = { value = 0.4 }
[[sensor]]
name = "encoder"
reads = "load.position"
signal = "q_rad"
gain = { value = 1.0 }
offset = { value = 0.0 }
"#;

/// Seconds for a trajectory with the derivatives of every signal by the first `p` free parameters.
fn jacobian<const P: usize>(
    plant: &Plant,
    start: &[f64],
    drive: &InputTrajectory,
    times: &[f64],
) -> Result<f64, Box<dyn Error>>
where
    Dual<P>: Simulated,
{
    let mut values: Vec<Dual<P>> = plant.values().into_iter().map(Dual::constant).collect();
    for (seed, &slot) in plant.free_slots().iter().take(P).enumerate() {
        values[slot] = Dual::variable(values[slot].value, seed);
    }
    let start: Vec<Dual<P>> = start.iter().map(|&x| Dual::constant(x)).collect();
    plant.simulate(&values, &start, drive, times)?;
    Ok(best_of(40, || {
        assert!(plant.simulate(&values, &start, drive, times).is_ok());
    }))
}

/// 4,000 samples of the two-mass drive at 1 kHz: plain, and with up to 12 derivatives.
fn two_mass() -> Result<(), Box<dyn Error>> {
    let plant = Plant::new(&Rig::parse(TWO_MASS, "two-mass")?)?;
    let times: Vec<f64> = (0..4000).map(|k| 1e-3 * f64::from(k)).collect();
    let input: Vec<f64> = times.iter().map(|t| 3.0 * (7.0 * t).sin()).collect();
    let drive = InputTrajectory::new(&plant, times.len(), &[&input])?;
    let values = plant.values();
    let start = plant.initial_state(&values, &[None])?;
    let report = plant.simulate(&values, &start, &drive, &times)?.report;
    let plain = best_of(100, || {
        assert!(plant.simulate(&values, &start, &drive, &times).is_ok());
    });
    println!(
        "two-mass drive, 4,000 samples, {} sub-steps: {:.3} ms",
        report.substeps,
        1e3 * plain
    );
    for (p, seconds) in [
        (1, jacobian::<1>(&plant, &start, &drive, &times)?),
        (2, jacobian::<2>(&plant, &start, &drive, &times)?),
        (4, jacobian::<4>(&plant, &start, &drive, &times)?),
        (8, jacobian::<8>(&plant, &start, &drive, &times)?),
        (12, jacobian::<12>(&plant, &start, &drive, &times)?),
    ] {
        println!(
            "  with {p} derivatives {:.2} times, allowed {:.1}",
            seconds / plain,
            1.0 + 0.5 * f64::from(p)
        );
    }
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    two_mass()?;
    let [times, input, position] = match std::env::args().nth(1) {
        Some(path) => read(&path)?,
        None => chirp(),
    };
    let plant = Plant::new(&Rig::parse(RIG, "rigs/emps.toml")?)?;
    let drive = InputTrajectory::new(&plant, times.len(), &[&input])?;
    let values = plant.values();
    let start = plant.initial_state(&values, &[Some(position[0])])?;
    let run = plant.simulate(&values, &start, &drive, &times)?;
    let squares: f64 = (run.signals.iter().zip(&position))
        .map(|(a, b)| (a - b).powi(2))
        .sum();
    println!("{} samples, {:?}", times.len(), run.report);
    println!(
        "free-run RMS {:.3} mm",
        1e3 * (squares / times.len() as f64).sqrt()
    );

    let plain = best_of(20, || {
        assert!(plant.simulate(&values, &start, &drive, &times).is_ok());
    });
    println!("plain: {:.2} ms", 1e3 * plain);

    let seeds = plant.free_slots();
    let mut dual: Vec<Dual<8>> = values.iter().map(|&v| Dual::constant(v)).collect();
    for (seed, &slot) in seeds.iter().take(8).enumerate() {
        dual[slot] = Dual::variable(values[slot], seed);
    }
    let dual_start: Vec<Dual<8>> = start.iter().map(|&x| Dual::constant(x)).collect();
    let with = best_of(20, || {
        assert!(plant.simulate(&dual, &dual_start, &drive, &times).is_ok());
    });
    println!(
        "with 8 derivatives: {:.2} ms, {:.1} times",
        1e3 * with,
        with / plain
    );
    Ok(())
}

//! Simulates a rig file from rest, with a step at every input, and draws its signals.
//!
//! `cargo run -p sinew-sim --example simulate -- rigs/two-mass-drive.toml [SECONDS]`

use std::error::Error;

use sinew_sim::{InputTrajectory, Plant, Rig};

/// Seconds between two samples.
const INTERVAL: f64 = 0.005;
/// Characters across a plot, and rows of it.
const SIZE: (usize, usize) = (72, 9);

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let path = arguments
        .next()
        .unwrap_or_else(|| "rigs/mass-spring-damper.toml".to_owned());
    let seconds: f64 = arguments.next().map_or(Ok(2.0), |text| text.parse())?;

    let rig = Rig::load(&path)?;
    let plant = Plant::new(&rig)?;
    let rows = (seconds / INTERVAL) as usize + 1;
    let times: Vec<f64> = (0..rows).map(|row| row as f64 * INTERVAL).collect();

    // Half of what each actuator may do (1 without a limit), from a tenth of the time on.
    let step = |limit: Option<(f64, f64)>| 0.5 * limit.map_or(1.0, |(_, high)| high);
    let column = |height: f64| -> Vec<f64> {
        let on = |row: usize| if row * 10 < rows { 0.0 } else { height };
        (0..rows).map(on).collect()
    };
    let columns: Vec<Vec<f64>> = (plant.inputs().iter())
        .map(|input| column(step(input.limit)))
        .collect();
    let columns: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
    let inputs = InputTrajectory::new(&plant, rows, &columns)?;

    let values = plant.values();
    let start = plant.initial_state(&values, &vec![None; plant.sensors().len()])?;
    let run = plant.simulate(&values, &start, &inputs, &times)?;

    for (index, sensor) in plant.sensors().iter().enumerate() {
        println!("\n{} ({}), {} s", sensor.name, sensor.unit, seconds);
        draw(&run.column(index));
    }
    let report = run.report;
    println!(
        "\n{} sub-steps, {} events of friction, {} of other laws",
        report.substeps, report.events, report.kinks
    );
    Ok(())
}

/// A signal as rows of characters, its extremes at the left.
fn draw(signal: &[f64]) {
    let (width, height) = SIZE;
    let low = signal.iter().copied().fold(f64::INFINITY, f64::min);
    let high = signal.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let span = if high > low { high - low } else { 1.0 };
    let at = |column: usize| signal[column * (signal.len() - 1) / (width - 1)];
    let level = |value: f64| ((value - low) / span * (height - 1) as f64).round() as usize;
    for row in (0..height).rev() {
        let label = match row {
            0 => format!("{low:>10.4}"),
            row if row == height - 1 => format!("{high:>10.4}"),
            _ => " ".repeat(10),
        };
        let line: String = (0..width)
            .map(|column| if level(at(column)) == row { '*' } else { ' ' })
            .collect();
        println!("{label} |{}", line.trim_end());
    }
}

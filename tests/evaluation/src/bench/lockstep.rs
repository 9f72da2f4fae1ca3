//! A counting image and the reference problem's plant, in lockstep.

use std::fmt::Write as _;
use std::fs;
use std::io::{Read, Write as _};
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};

use super::image;
use super::reference::{OUTPUTS, Plant, Reference, STEPS};
use xtask::process::target_folder;

/// `Status::CutShort` of `sinew-mpc`, as the counting image says it.
const STOPPED: u32 = 9;

/// Result of a run.
pub struct Run {
    /// Steps that the controller predicts.
    pub horizon: usize,
    /// Its blocks of equal moves.
    pub blocks: Vec<u32>,
    /// Of every step.
    pub instructions: Vec<u64>,
    /// Steps that a budget ended.
    pub stopped: usize,
    /// Of the plant's outputs.
    pub tracking_rms: f64,
    /// High-water mark, bytes.
    pub stack: u64,
    /// Every step: measurement, command, plan.
    pub log: PathBuf,
}

impl Run {
    /// Mean and largest number of instructions of a step.
    pub fn mean_and_most(&self) -> (u64, u64) {
        let sum: u64 = self.instructions.iter().sum();
        let most = self.instructions.iter().max().copied();
        (
            sum / self.instructions.len().max(1) as u64,
            most.unwrap_or(0),
        )
    }
}

/// Closes the loop around an image of the program `count`; leaves every step in
/// `target/bench/NAME.csv`.
///
/// # Errors
/// QEMU does not start, or the image breaks off.
pub fn close(elf: &Path, name: &str) -> Result<Run> {
    let reference = Reference::load().map_err(anyhow::Error::msg)?;
    let mut child = image::start(elf)?;
    let mut output = child.stdout.take().context("the child has an output")?;
    let mut input = child.stdin.take().context("the child has an input")?;
    let mut hear = |words: usize| -> Result<Vec<u32>> {
        let mut bytes = vec![0; 4 * words];
        output
            .read_exact(&mut bytes)
            .context("the image broke off")?;
        let words = bytes.chunks_exact(4);
        Ok(words
            .map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]))
            .collect())
    };
    let shapes = hear(5)?;
    let [n_u, _, n_s, horizon, n_blocks] =
        shapes.iter().map(|n| *n as usize).collect::<Vec<_>>()[..]
    else {
        bail!("the image's hello has another shape");
    };
    let blocks = hear(n_blocks)?;
    let mut plant = Plant::default();
    let (mut instructions, mut squares, mut stopped) = (Vec::new(), 0.0, 0);
    let mut log = String::from("k,y1,y2,y3,u1,u2,plan\n");
    for k in 0..STEPS {
        let y = plant.outputs();
        for (y, r) in y.iter().zip(reference.at(k)) {
            squares += (y - f64::from(r)).powi(2);
        }
        let channels = if n_s > 0 { plant.channels(n_s) } else { vec![] };
        let rows = reference.preview(k, horizon);
        let measured = y.iter().chain(&channels).map(|y| *y as f32);
        for word in measured.clone().chain(rows.into_iter().flatten()) {
            input.write_all(&word.to_le_bytes())?;
        }
        input.flush()?;
        let answer = hear(4 + n_u + n_u * n_blocks)?;
        let (head, rest) = answer.split_at(4);
        instructions.push(image::instructions(head[0]));
        stopped += usize::from(head[1] == STOPPED);
        let numbers: Vec<f32> = rest.iter().map(|bits| f32::from_bits(*bits)).collect();
        let _ = write!(log, "{k}");
        for value in measured.take(OUTPUTS).chain(numbers.iter().copied()) {
            let _ = write!(log, ",{value:?}");
        }
        log.push('\n');
        plant.advance([f64::from(numbers[0]), f64::from(numbers[1])]);
    }
    drop(input);
    let stack = hear(1)?.first().copied().unwrap_or(0);
    child.wait()?;
    let path = target_folder().join(format!("bench/{name}.csv"));
    fs::write(&path, log)?;
    Ok(Run {
        horizon,
        blocks,
        instructions,
        stopped,
        tracking_rms: (squares / (STEPS * OUTPUTS) as f64).sqrt(),
        stack: stack.into(),
        log: path,
    })
}

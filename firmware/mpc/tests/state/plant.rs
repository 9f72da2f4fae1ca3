//! Mass, spring, damper and dry friction in double precision, and references for it.

use crate::common::Random;
use crate::mass::{NOISE_M, NOMINAL, PERIOD_S};

const PARTS: usize = 20;

/// m v' = u - k q - c v - friction; the friction stops the mass where it can (Moreau's
/// time-stepping), so it sticks exactly.
#[derive(Clone, Copy, Debug)]
pub struct Plant {
    pub q: f64,
    pub v: f64,
    /// Mass, stiffness, damping, friction.
    pub theta: [f64; 4],
}

impl Plant {
    /// At rest, its parameters 10 to 20 % off the believed ones.
    pub fn drawn(seed: u64) -> Self {
        let mut random = Random(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1);
        for _ in 0..8 {
            random.signed();
        }
        let theta = NOMINAL.map(|value| {
            let share = 0.1 + 0.1 * f64::from(random.unit());
            value * (1.0 + if random.signed() < 0.0 { -share } else { share })
        });
        Self {
            q: 0.0,
            v: 0.0,
            theta,
        }
    }

    pub fn advance(&mut self, u: f64) {
        let h = PERIOD_S / PARTS as f64;
        let [m, k, c, f] = self.theta;
        for _ in 0..PARTS {
            let free = self.v + h * (u - k * self.q - c * self.v) / m;
            let stopped = h * f / m;
            self.v = free.signum() * (free.abs() - stopped).max(0.0);
            self.q += h * self.v;
        }
    }
}

/// Gaussian noise of the sensor.
pub fn noise(random: &mut Random) -> f64 {
    let sum: f32 = (0..12).map(|_| random.signed()).sum();
    // Twelve uniform numbers in -1 to 1 have a variance of 4.
    NOISE_M * 0.5 * f64::from(sum)
}

/// Minimum-jerk moves of a mean speed of 0.236 m/s to these places, 333 steps for each.
pub fn moves(places: &[f64]) -> Vec<f64> {
    let mut rows = vec![0.0];
    for to in places {
        let from = rows[rows.len() - 1];
        let steps = ((to - from).abs() / 0.236 / PERIOD_S).ceil().max(1.0);
        for k in 1..=333 {
            let s = (f64::from(k) / steps).min(1.0);
            rows.push(from + (to - from) * s * s * s * (10.0 - 15.0 * s + 6.0 * s * s));
        }
    }
    rows
}

/// The coming rows of a reference; the last one is held.
pub fn preview<const N: usize>(reference: &[f64], k: usize) -> [[f32; 1]; N] {
    core::array::from_fn(|j| [reference[(k + j + 1).min(reference.len() - 1)] as f32])
}

/// Figures of a run.
#[derive(Clone, Copy, Debug)]
pub struct Figures {
    /// Root mean square of the tracking error, metres.
    pub rms: f64,
    /// Largest tracking error, metres.
    pub largest: f64,
    /// Root mean square change of the command, newtons.
    pub change: f64,
}

/// Runs a controller: called with the reading and the step, it returns the command.
pub fn run(
    mut plant: Plant,
    reference: &[f64],
    seed: u64,
    mut controller: impl FnMut(f64, usize) -> f64,
) -> Figures {
    let mut random = Random(seed);
    let (mut squares, mut changes, mut largest, mut before) = (0.0, 0.0, 0.0_f64, 0.0);
    for (k, r) in reference.iter().enumerate() {
        let error = plant.q - r;
        squares += error * error;
        largest = largest.max(error.abs());
        let u = controller(plant.q + noise(&mut random), k);
        changes += (u - before) * (u - before);
        before = u;
        plant.advance(u);
    }
    let n = reference.len() as f64;
    Figures {
        rms: (squares / n).sqrt(),
        largest,
        change: (changes / n).sqrt(),
    }
}

impl std::fmt::Display for Figures {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (rms, largest) = (1e3 * self.rms, 1e3 * self.largest);
        write!(f, "{rms:.3} {largest:.2} mm {:.2} N", self.change)
    }
}

//! PID with preview, tuned on the very plant.

use sinew_mpc::feedback::pid::{Pid, PidGains};

use crate::common::Random;
use crate::mass::{LIMITS, PERIOD_S};
use crate::plant::{Figures, Plant, run};

/// Gains as logarithms where they are scales, and steps of preview.
type Point = [f64; 8];

/// Half of the force's and of the workspace's range.
const HALF: (f64, f64) = (20.0, 0.35);
/// Weight of the command's change, as in the comparison of the host program.
const EFFORT: f64 = 1e-5;

fn figures(point: &Point, plant: Plant, reference: &[f64], seed: u64) -> Figures {
    let [kp, ki, kd, filter, b, c, tracking, lead] = *point;
    let gains = PidGains {
        kp: kp.exp() as f32,
        ki: ki.exp() as f32,
        kd: kd.exp() as f32,
        filter_s: filter.exp() as f32,
        proportional_setpoint_weight: b as f32,
        derivative_setpoint_weight: c as f32,
        tracking_time_s: tracking.exp() as f32,
    };
    let lead = lead.round().clamp(0.0, 12.0) as usize;
    let mut pid = Pid::new([gains], PERIOD_S as f32, LIMITS, 5);
    run(plant, reference, seed, |reading, k| {
        let ahead = reference[(k + lead).min(reference.len() - 1)];
        f64::from(pid.step(&[reading as f32], &[ahead as f32])[0])
    })
}

fn cost(figures: &Figures) -> f64 {
    (figures.rms / HALF.1).powi(2) + EFFORT * (figures.change / HALF.0).powi(2)
}

/// Tuned by a random search that narrows, on `reference` and with noise of its own.
pub struct TunedPid(Point);

impl TunedPid {
    pub fn on(plant: Plant, reference: &[f64]) -> Self {
        let mut random = Random(77);
        let mut best: Option<(f64, Point)> = None;
        for start in 0..6 {
            let first = [4.5, 5.5, 2.5, -4.5, 1.0, 1.0, -1.0, 1.0 + f64::from(start)];
            let mut here = (cost(&figures(&first, plant, reference, 4)), first);
            for i in 0..500 {
                let width = 1.5 * 0.99_f64.powi(i);
                let mut point = here.1;
                for (j, value) in point.iter_mut().enumerate() {
                    let scale = if (4..6).contains(&j) { 0.5 } else { 1.0 };
                    *value += width * scale * f64::from(random.signed());
                }
                let tried = cost(&figures(&point, plant, reference, 4));
                if tried < here.0 {
                    here = (tried, point);
                }
            }
            if best.is_none_or(|best| here.0 < best.0) {
                best = Some(here);
            }
        }
        Self(best.expect("six starts were tried").1)
    }

    pub fn figures(&self, plant: Plant, reference: &[f64], seed: u64) -> Figures {
        figures(&self.0, plant, reference, seed)
    }
}

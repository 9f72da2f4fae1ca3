//! The PID as an opponent: the firmware's own code, tuned on the very plant that it is compared on.

use sinew_firmware::pid::{Pid, PidGains};
use sinew_firmware::safety::Limits;

use super::closed_loop::{Controller, InputLimits, Scenario, cost};
use super::optimise::{Range, minimise};
use super::reference::Reference;
use crate::error::{Error, Result};

/// Gains of one channel and how many steps ahead it looks at the reference: the preview that the
/// predictive controller has is not withheld from its opponent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tuning {
    /// Gains in physical units.
    pub gains: PidGains,
    /// Steps ahead.
    pub lead: usize,
}

/// One PID a pair of output and input.
pub struct PidController {
    channels: Vec<(Pid<1>, usize)>,
}

/// Samples that a PID holds its command through before it goes to the safe one.
const GAP_LIMIT: u16 = 10;

impl PidController {
    /// A controller at rest at the command nearest to zero.
    pub fn new(tuning: &[Tuning], limits: &[InputLimits], period_s: f64) -> Self {
        let channels = tuning
            .iter()
            .zip(limits)
            .map(|(tuning, (low, high, change))| {
                let limits = Limits {
                    lower: [*low as f32],
                    upper: [*high as f32],
                    rate: [inwards(*change)],
                    safe: [0.0_f64.clamp(*low, *high) as f32],
                };
                (
                    Pid::new([tuning.gains], period_s as f32, limits, GAP_LIMIT),
                    tuning.lead,
                )
            });
        Self {
            channels: channels.collect(),
        }
    }
}

/// The largest f32 that does not exceed `value`.
fn inwards(value: f64) -> f32 {
    let near = value as f32;
    if f64::from(near) > value {
        near.next_down()
    } else {
        near
    }
}

impl Controller for PidController {
    fn command(&mut self, k: usize, y: &[f64], reference: &Reference) -> Result<Vec<f64>> {
        let commands = self
            .channels
            .iter_mut()
            .zip(y)
            .enumerate()
            .map(|(i, ((pid, lead), y))| {
                let asked = reference.row(k + *lead)[i] as f32;
                f64::from(pid.step(&[*y as f32], &[asked])[0])
            });
        Ok(commands.collect())
    }
}

/// Tunes a PID a channel on `scenarios` (whose references the comparison does not use), from several
/// starts; all channels share one scale of gains.
///
/// # Errors
/// A rig whose inputs and outputs do not pair off.
pub fn tune(
    scenarios: &[Scenario],
    limits: &[InputLimits],
    output_range: &[f64],
    input_range: &[f64],
    longest_lead: usize,
) -> Result<Vec<Tuning>> {
    let channels = output_range.len();
    if channels != limits.len() {
        return Err(Error::failed(format!(
            "a PID needs an input for every output, and this rig has {} for {channels}",
            limits.len()
        )));
    }
    let period = scenarios.first().map_or(1.0, |s| s.period_s);
    let of = |g: &[f64]| -> Vec<Tuning> {
        (0..channels)
            .map(|i| {
                let unit = input_range[i] / output_range[i];
                Tuning {
                    gains: PidGains {
                        kp: (g[0] * unit) as f32,
                        ki: (g[1] * g[0] * unit) as f32,
                        kd: (g[2] * g[0] * unit) as f32,
                        filter_s: (g[3] * period) as f32,
                        proportional_setpoint: g[4] as f32,
                        derivative_setpoint: g[5] as f32,
                        tracking_time_s: (g[6] * period) as f32,
                    },
                    lead: (g[7] + 0.5) as usize,
                }
            })
            .collect()
    };
    let ranges = [
        Range::logarithmic(1e-2, 1e4),  // kp, input ranges an output range
        Range::logarithmic(1e-3, 1e2),  // ki / kp, 1/s
        Range::logarithmic(1e-4, 1e1),  // kd / kp, s
        Range::logarithmic(0.1, 30.0),  // filter, periods
        Range::linear(0.0, 1.5),        // reference in P
        Range::linear(0.0, 1.5),        // reference in D
        Range::logarithmic(0.5, 200.0), // anti-windup, periods
        Range::linear(0.0, longest_lead.max(1) as f64), // lead, steps
    ];
    // Gentle to fierce, with the integral slow and fast.
    let starts: Vec<Vec<f64>> = [0.3, 3.0, 30.0, 300.0, 3000.0]
        .iter()
        .flat_map(|kp| {
            [(1.0, 0.1), (10.0, 0.03)].map(|(ki, kd)| vec![*kp, ki, kd, 1.0, 1.0, 1.0, 10.0, 1.0])
        })
        .collect();
    let judge = |g: &[f64]| -> f64 {
        let tuning = of(g);
        let costs = scenarios.iter().map(|scenario| {
            let mut pid = PidController::new(&tuning, limits, period);
            match scenario.run(&mut pid) {
                Ok(run) => cost(&run.score(limits), output_range, input_range),
                Err(_) => f64::INFINITY,
            }
        });
        costs.sum()
    };
    let (best, _) = minimise(&ranges, &starts, 200, judge);
    // The simplex shrinks along valleys: a second search from the best of the first.
    let (best, _) = minimise(&ranges, &[best], 250, judge);
    Ok(of(&best))
}

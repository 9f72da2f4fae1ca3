//! A pendulum whose angle alone is read, in noise and with gaps: speed, damping and length are
//! estimated, and a torque that nobody told of.
//!
//! `cargo run -p sinew-mpc --example filter` prints the estimates beside the truth.
#![allow(
    clippy::disallowed_methods,
    reason = "a host program; firmware takes these from `sinew_mpc::math`"
)]

use sinew_mpc::filter::{
    Filter, FilterSettings, MeasurementJacobian, Prior, StateSpace, TransitionJacobian,
};

/// Period, seconds.
const PERIOD_S: f32 = 0.02;

/// theta'' = u - a sin(theta) - b theta', with the parameters a = g/length (1/s^2) and b = damping
/// (1/s). States: angle (rad), speed (rad/s).
struct Pendulum;

impl StateSpace<2, 1, 1, 2> for Pendulum {
    /// Sine and cosine of the angle, speed and parameters.
    type Trace = [f32; 5];
    const TRACE: Self::Trace = [0.0; 5];

    fn transition(
        &self,
        x: &[f32; 2],
        u: &[f32; 1],
        theta: &[f32; 2],
        trace: &mut Self::Trace,
    ) -> [f32; 2] {
        let (sine, cosine) = (x[0].sin(), x[0].cos());
        *trace = [sine, cosine, x[1], theta[0], theta[1]];
        let speed = x[1] + PERIOD_S * (u[0] - theta[0] * sine - theta[1] * x[1]);
        [x[0] + PERIOD_S * speed, speed]
    }

    fn transition_jacobian(
        &self,
        &[sine, cosine, speed, gravity, damping]: &Self::Trace,
        jacobian: &mut TransitionJacobian<2, 1, 2>,
    ) {
        jacobian.x[1] = [-PERIOD_S * gravity * cosine, 1.0 - PERIOD_S * damping];
        jacobian.u[1] = [PERIOD_S];
        jacobian.theta[1] = [-PERIOD_S * sine, -PERIOD_S * speed];
        // The angle follows the new speed.
        jacobian.x[0] = jacobian.x[1].map(|value| PERIOD_S * value);
        jacobian.x[0][0] += 1.0;
        jacobian.u[0] = [PERIOD_S * PERIOD_S];
        jacobian.theta[0] = jacobian.theta[1].map(|value| PERIOD_S * value);
    }

    fn measure(&self, x: &[f32; 2], _: &[f32; 2]) -> [f32; 1] {
        [x[0]]
    }

    fn measurement_jacobian(
        &self,
        _: &[f32; 2],
        _: &[f32; 2],
        jacobian: &mut MeasurementJacobian<2, 1, 2>,
    ) {
        jacobian.x = [[1.0, 0.0]];
    }
}

/// Noise of a few hundredths, the same in every run.
fn noise(k: usize) -> f32 {
    let mixed = (k as u32).wrapping_mul(2_654_435_761).rotate_left(13) ^ 0x9E37;
    0.04 * (mixed.wrapping_mul(2_246_822_519) as f32 / u32::MAX as f32 - 0.5)
}

fn main() {
    let prior = Prior {
        x: [0.0; 2],
        rest_deviation: [1.0, 0.0],
        state_deviation: [1.0, 3.0],
        disturbance_deviation: [0.5],
        theta: [10.0, 0.5],
        parameter_deviation: [2.0, 0.3],
        lower: [4.0, 0.0],
        upper: [20.0, 3.0],
    };
    let settings = FilterSettings {
        state_noise: [0.0, 1e-3],
        disturbance_noise: [1e-3],
        parameter_noise: [1e-3, 1e-4],
        measurement_noise: [0.0115],
        gate: 5.0,
        adapt: true,
        max_missing_samples: 20,
    };
    let mut filter: Filter<2, 1, 1, 2, 5> = Filter::new(prior, settings);
    let (truth, load) = ([12.5, 0.25], 0.4);
    let mut x = [0.6, 0.0];
    println!("  k   speed (estimate)  g/length (12.5)  damping (0.25)  load (0.4)");
    for k in 0..1500 {
        // A tenth of the readings does not come, a hundredth is nonsense.
        let reading = match k {
            k if k % 10 == 3 => f32::NAN,
            k if k % 100 == 50 => 3.0,
            _ => x[0] + noise(k),
        };
        let update = filter.update(&Pendulum, &[reading]);
        if k % 150 == 149 {
            let deviation = filter.covariance().variance(3).sqrt();
            println!(
                "{k:4} {:7.3} ({:7.3})  {:9.2} +- {deviation:.2}  {:14.3}  {:10.3}  {:?}",
                x[1],
                filter.x()[1],
                filter.theta()[0],
                filter.theta()[1],
                filter.disturbance()[0],
                update.readings[0],
            );
        }
        let u = if k / 60 % 2 == 0 { 3.0 } else { -3.0 };
        filter.predict(&Pendulum, &[u]);
        x = Pendulum.transition(&x, &[u + load], &truth, &mut [0.0; 5]);
    }
    assert!((filter.theta()[0] - truth[0]).abs() < 0.2);
    assert!((filter.theta()[1] - truth[1]).abs() < 0.05);
    assert!((filter.disturbance()[0] - load).abs() < 0.1);
    assert!((filter.x()[1] - x[1]).abs() < 0.05, "the hidden speed");
}

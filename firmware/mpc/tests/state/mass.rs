//! Physical model of the demo's plant, and a controller on it.

use sinew_mpc::filter::StateSpace;
use sinew_mpc::{Limits, StateSettings, Weights};

sinew_mpc::state_controller! {
    model: Mass,
    states: 2,
    inputs: 1,
    outputs: 1,
    measurements: 1,
    parameters: 4,
    periods_kept: 1,
    horizon: 12,
    move_blocks: 4,
}

/// Period, seconds.
pub const PERIOD_S: f64 = 1.0 / 120.0;
/// Mass (kg), stiffness (N/m), damping (N s/m) and dry friction (N) that are believed.
pub const NOMINAL: [f64; 4] = [1.0, 40.0, 1.2, 0.58];
/// Standard deviation of a reading, metres.
pub const NOISE_M: f64 = 0.47e-3;
/// Parts of a period that the transition takes.
const PARTS: usize = 2;
const PART_S: f32 = PERIOD_S as f32 / PARTS as f32;
/// Speed at which the smooth friction has three quarters of its force, m/s.
const SMOOTHING: f32 = 0.01;

/// m v' = u - k q - c v - f tanh(v / smoothing), by semi-implicit Euler in two parts. The
/// parameters multiply the believed ones.
#[derive(Clone, Copy, Debug)]
pub struct Mass;

/// Values at the start of a part: position, speed, acceleration and tanh.
type Part = [f32; 4];

impl StateSpace<STATES, INPUTS, MEASUREMENTS, PARAMETERS> for Mass {
    type Trace = ([Part; PARTS], [f32; PARAMETERS]);
    const TRACE: Self::Trace = ([[0.0; 4]; PARTS], [0.0; PARAMETERS]);

    fn transition(
        &self,
        x: &[f32; STATES],
        u: &[f32; INPUTS],
        theta: &[f32; PARAMETERS],
        (parts, kept): &mut Self::Trace,
    ) -> [f32; STATES] {
        *kept = *theta;
        let [m, k, c, f] = physical(theta);
        let [mut q, mut v] = *x;
        for part in parts {
            let friction = sinew_mpc::math::tanh(v / SMOOTHING);
            let acceleration = (u[0] - k * q - c * v - f * friction) / m;
            *part = [q, v, acceleration, friction];
            v += PART_S * acceleration;
            q += PART_S * v;
        }
        [q, v]
    }

    fn transition_jacobian(&self, (parts, theta): &Self::Trace, jacobian: &mut TransitionJacobian) {
        let [m, k, c, f] = physical(theta);
        // Columns: position, speed, input, parameters.
        let mut position = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        let mut speed = [0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        for [q, v, acceleration, friction] in parts {
            let slope = f * sinew_mpc::math::tanh_slope(*friction) / SMOOTHING;
            let direct = [
                1.0,
                -acceleration * NOMINAL[0] as f32,
                -q * NOMINAL[1] as f32,
                -v * NOMINAL[2] as f32,
                -friction * NOMINAL[3] as f32,
            ];
            for column in 0..7 {
                let mut force = -k * position[column] - (c + slope) * speed[column];
                if let Some(direct) = column.checked_sub(2).and_then(|i| direct.get(i)) {
                    force += direct;
                }
                speed[column] += PART_S * force / m;
                position[column] += PART_S * speed[column];
            }
        }
        for (row, from) in [position, speed].iter().enumerate() {
            jacobian.x[row] = [from[0], from[1]];
            jacobian.u[row] = [from[2]];
            jacobian.theta[row] = [from[3], from[4], from[5], from[6]];
        }
    }

    fn measure(&self, x: &[f32; STATES], _: &[f32; PARAMETERS]) -> [f32; MEASUREMENTS] {
        [x[0]]
    }

    fn measurement_jacobian(
        &self,
        _: &[f32; STATES],
        _: &[f32; PARAMETERS],
        jacobian: &mut MeasurementJacobian,
    ) {
        jacobian.x = [[1.0, 0.0]];
    }
}

fn physical(theta: &[f32; PARAMETERS]) -> [f32; PARAMETERS] {
    core::array::from_fn(|i| theta[i] * NOMINAL[i] as f32)
}

pub const LIMITS: Limits<1> = Limits {
    lower: [-20.0],
    upper: [20.0],
    rate: [400.0 * PERIOD_S as f32],
    safe: [0.0],
};

pub const PRIOR: Prior = Prior {
    x: [0.0; 2],
    rest_deviation: [1.0, 0.01],
    state_deviation: [1.0, 1.0],
    disturbance_deviation: [0.2],
    theta: [1.0; 4],
    parameter_deviation: [0.15; 4],
    lower: [0.5, 0.5, 0.2, 0.2],
    upper: [2.0, 2.0, 3.0, 3.0],
};

/// Chosen on plants 11 to 16 of the seeds; the tests use others. The parameters' noise is that of a
/// plant that may change by 30 % within seconds.
pub const FILTER: FilterSettings = FilterSettings {
    state_noise: [1e-5, 2e-3],
    disturbance_noise: [0.02],
    parameter_noise: [3e-3; 4],
    measurement_noise: [NOISE_M as f32],
    gate: 6.0,
    adapt: true,
    max_missing_samples: 12,
};

/// Chosen on plants 11 to 16.
pub const SETTINGS: StateSettings<1, 1> = StateSettings {
    weights: Weights {
        tracking: [1.0],
        moves: [3e-8],
    },
    iterations: 2,
};

pub fn controller(filter: FilterSettings) -> Controller {
    Controller::new(
        Mass,
        Scaling::IDENTITY,
        LIMITS,
        SETTINGS,
        Filter::new(PRIOR, filter),
        Horizons::new(1, [1, 2, 3, 6]),
    )
}

//! A cart of unknown mass is moved along a track; only its position is read, in noise, and nobody
//! told of the slope that it stands on.
//!
//! `cargo run -p sinew-mpc --example state_space` prints position, reference and estimates.

use sinew_mpc::filter::StateSpace;
use sinew_mpc::{Limits, StateSettings, Weights};

sinew_mpc::state_controller! {
    model: Cart,
    states: 2,
    inputs: 1,
    outputs: 1,
    measurements: 1,
    parameters: 1,
    periods_kept: 1,
    horizon: 20,
    move_blocks: 5,
}

/// Period, seconds.
const PERIOD_S: f32 = 0.02;

/// x = (position, speed), v' = theta u - 0.3 v with theta = 1/mass.
struct Cart;

impl StateSpace<STATES, INPUTS, MEASUREMENTS, PARAMETERS> for Cart {
    /// Force and 1/mass.
    type Trace = [f32; 2];
    const TRACE: Self::Trace = [0.0; 2];

    fn transition(
        &self,
        x: &[f32; STATES],
        u: &[f32; INPUTS],
        theta: &[f32; PARAMETERS],
        trace: &mut Self::Trace,
    ) -> [f32; STATES] {
        *trace = [u[0], theta[0]];
        let speed = x[1] + PERIOD_S * (theta[0] * u[0] - 0.3 * x[1]);
        [x[0] + PERIOD_S * speed, speed]
    }

    fn transition_jacobian(&self, &[u, theta]: &Self::Trace, jacobian: &mut TransitionJacobian) {
        let damped = 1.0 - 0.3 * PERIOD_S;
        jacobian.x = [[1.0, PERIOD_S * damped], [0.0, damped]];
        jacobian.u = [[PERIOD_S * PERIOD_S * theta], [PERIOD_S * theta]];
        jacobian.theta = [[PERIOD_S * PERIOD_S * u], [PERIOD_S * u]];
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

fn main() {
    let prior = Prior {
        x: [0.0; 2],
        rest_deviation: [1.0, 0.01],
        state_deviation: [1.0; 2],
        disturbance_deviation: [0.5],
        theta: [1.0],
        parameter_deviation: [0.4],
        lower: [0.3],
        upper: [3.0],
    };
    let settings = FilterSettings {
        state_noise: [0.0, 1e-3],
        disturbance_noise: [5e-3],
        parameter_noise: [1e-3],
        measurement_noise: [2e-3],
        gate: 6.0,
        adapt: true,
        max_missing_samples: 10,
    };
    let mut controller = Controller::new(
        Cart,
        Scaling::IDENTITY,
        Limits {
            lower: [-3.0],
            upper: [3.0],
            rate: [0.6],
            safe: [0.0],
        },
        StateSettings {
            weights: Weights {
                tracking: [1.0],
                moves: [1e-4],
            },
            iterations: 2,
        },
        Filter::new(prior, settings),
        Horizons::new(1, [1, 2, 4, 6, 7]),
    );
    let reference_at = |k: usize| {
        let turn = (k / 100) % 2;
        [0.5, -0.2][turn]
    };
    // The cart is lighter than believed, and gravity pulls it down the slope.
    let (truth, slope) = (1.6, -0.4);
    let mut x = [0.0_f32; 2];
    println!("  k  position  reference  1/mass (1.6)  load (-0.4)");
    for k in 0..380_usize {
        let preview = core::array::from_fn(|j| [reference_at(k + j + 1)]);
        // Noise of a few millimetres, the same in every run.
        let noise = 4e-3 * ((k * 7919 % 1000) as f32 / 999.0 - 0.5);
        let step = controller.step(&[x[0] + noise], &preview);
        x = Cart.transition(&x, &[step.u[0] + slope], &[truth], &mut [0.0; 2]);
        if k % 40 == 19 {
            println!(
                "{k:3} {:9.3} {:10.3} {:13.2} {:12.2}",
                x[0],
                reference_at(k),
                controller.filter().theta()[0],
                controller.filter().disturbance()[0]
            );
        }
    }
    assert!((x[0] + 0.2).abs() < 5e-3, "the cart is there: {}", x[0]);
    assert!((controller.filter().theta()[0] - truth).abs() < 0.1);
}

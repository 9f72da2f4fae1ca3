//! A hand-written predictor in a loop: a heater with a gain that falls as it warms.
//!
//! `cargo run -p sinew-mpc --example own_model` prints output, reference and command.

use sinew_mpc::controller::Settings;
use sinew_mpc::model::Model;
use sinew_mpc::{Limits, Propagate, Tuning};

sinew_mpc::controller! {
    model: Heater,
    inputs: 1,
    outputs: 1,
    channels: 0,
    past_inputs: 1,
    past_outputs: 1,
    horizon: 20,
    move_blocks: 4,
}

/// y(k+1) = 0.9 y(k) + 0.2 u(k) (1 - 0.4 y(k)).
struct Heater;

impl Model<INPUTS, OUTPUTS, CHANNELS, PAST_INPUTS, PAST_OUTPUTS> for Heater {
    type Trace = (f32, f32);
    const TRACE: Self::Trace = (0.0, 0.0);

    fn predict(&self, x: &Regressor, trace: &mut Self::Trace) -> [f32; OUTPUTS] {
        let (y, u) = (x.y[0][0], x.u[0][0]);
        *trace = (y, u);
        [0.9 * y + 0.2 * u * (1.0 - 0.4 * y)]
    }

    fn jacobian(&self, &(y, u): &Self::Trace, jacobian: &mut Jacobian) {
        jacobian.y[0][0][0] = 0.9 - 0.08 * u;
        jacobian.u[0][0][0] = 0.2 * (1.0 - 0.4 * y);
    }
}

impl Propagate<INPUTS, OUTPUTS, CHANNELS, PAST_INPUTS, PAST_OUTPUTS> for Heater {}
impl Tuning for Heater {}

fn main() {
    let mut controller = Controller::new(
        Heater,
        Scaling::IDENTITY,
        Limits {
            lower: [0.0],
            upper: [1.0],
            rate: [0.15],
            safe: [0.0],
        },
        Settings {
            tracking_weight: [1.0],
            move_suppression: [0.02],
            disturbance_gain: 0.5,
            iterations: 3,
            max_missing_samples: 5,
        },
        Horizons::new(1, [1, 2, 3, 4]),
    );
    let reference_at = |k: usize| if k < 30 { 0.8 } else { 0.3 };
    let mut y = 0.0_f32;
    for k in 0..60 {
        let preview = core::array::from_fn(|j| [reference_at(k + j + 1)]);
        let [u] = controller.step(&[y], &[], &preview).u;
        let column = |value: f32| (value * 60.0) as usize;
        let mut row = [b' '; 64];
        row[column(reference_at(k))] = b'|';
        row[column(u)] = b'u';
        row[column(y)] = b'*';
        println!("{k:3} {}", String::from_utf8_lossy(&row).trim_end());
        // The real heater loses a tenth more than the model says.
        y = 0.89 * y + 0.2 * u * (1.0 - 0.4 * y);
    }
    assert!((y - 0.3).abs() < 0.01, "the reference is reached: {y}");
}

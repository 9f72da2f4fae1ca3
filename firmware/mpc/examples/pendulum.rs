//! A pendulum that is lifted by a limited torque and held above the horizontal.
//!
//! `cargo run -p sinew-mpc --example pendulum` writes `pendulum.svg` to the folder of temporary
//! files.
#![allow(
    clippy::disallowed_methods,
    reason = "this example runs on a computer; firmware takes its functions from sinew_mpc::math"
)]

use std::fmt::Write as _;

use sinew_mpc::controller::Settings;
use sinew_mpc::model::Model;
use sinew_mpc::{Limits, Propagate, Tuning};

sinew_mpc::controller! {
    model: Pendulum,
    inputs: 1,
    outputs: 1,
    channels: 0,
    past_inputs: 1,
    past_outputs: 2,
    horizon: 25,
    move_blocks: 5,
}

/// Period, seconds.
const PERIOD_S: f32 = 0.02;
/// Gravity over length, 1/s^2.
const GRAVITY: f32 = 9.81;
/// Damping, 1/s.
const DAMPING: f32 = 0.4;

/// theta'' = u - (g/l) sin(theta) - d theta', by central differences: y is the angle, u the torque
/// over the moment of inertia.
struct Pendulum;

impl Model<INPUTS, OUTPUTS, CHANNELS, PAST_INPUTS, PAST_OUTPUTS> for Pendulum {
    /// The angle.
    type Trace = f32;
    const TRACE: f32 = 0.0;

    fn predict(&self, x: &Regressor, trace: &mut f32) -> [f32; OUTPUTS] {
        let (u, theta, before) = (x.u[0][0], x.y[0][0], x.y[1][0]);
        *trace = theta;
        [next(theta, before, u)]
    }

    fn jacobian(&self, theta: &f32, jacobian: &mut Jacobian) {
        jacobian.u[0][0][0] = PERIOD_S * PERIOD_S;
        jacobian.y[0][0][0] =
            2.0 - DAMPING * PERIOD_S - PERIOD_S * PERIOD_S * GRAVITY * theta.cos();
        jacobian.y[1][0][0] = DAMPING * PERIOD_S - 1.0;
    }
}

impl Propagate<INPUTS, OUTPUTS, CHANNELS, PAST_INPUTS, PAST_OUTPUTS> for Pendulum {}
impl Tuning for Pendulum {}

fn next(theta: f32, before: f32, u: f32) -> f32 {
    let acceleration = u - GRAVITY * theta.sin() - DAMPING * (theta - before) / PERIOD_S;
    2.0 * theta - before + PERIOD_S * PERIOD_S * acceleration
}

fn main() -> std::io::Result<()> {
    let mut controller = Controller::new(
        Pendulum,
        Scaling::IDENTITY,
        Limits {
            lower: [-14.0],
            upper: [14.0],
            rate: [2.0],
            safe: [0.0],
        },
        Settings {
            tracking_weight: [1.0],
            move_suppression: [1e-4],
            disturbance_gain: 0.2,
            iterations: 4,
            max_missing_samples: 5,
        },
        Horizons::new(1, [1, 2, 4, 6, 8]),
    );
    let reference_at = |k: usize| if k < 10 { 0.0 } else { 2.0 };
    let (mut theta, mut before) = (0.0_f32, 0.0_f32);
    let mut rows = Vec::new();
    for k in 0..200 {
        let preview = core::array::from_fn(|j| [reference_at(k + j + 1)]);
        let step = controller.step(&[theta], &[], &preview);
        let [u] = step.u;
        assert!(u.abs() <= 14.0, "the limits hold exactly");
        rows.push([theta, reference_at(k), u / 14.0]);
        (theta, before) = (next(theta, before, u), theta);
    }
    assert!((theta - 2.0).abs() < 0.02, "the pendulum is held: {theta}");
    let path = std::env::temp_dir().join("pendulum.svg");
    std::fs::write(&path, plot(&rows))?;
    println!("held at {theta:.3} rad; {}", path.display());
    Ok(())
}

/// Angle, reference and the part of the largest torque, over time.
fn plot(rows: &[[f32; 3]]) -> String {
    let mut svg = String::from(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 820 320\" font-family=\"sans-serif\">\n",
    );
    let signals = [
        ("angle, rad", "#1f77b4"),
        ("reference", "#7f7f7f"),
        ("torque, of the largest", "#d62728"),
    ];
    for (i, (name, colour)) in signals.into_iter().enumerate() {
        let _ = write!(svg, "<polyline fill=\"none\" stroke=\"{colour}\" points=\"");
        for (k, row) in rows.iter().enumerate() {
            let _ = write!(svg, "{},{:.1} ", 10 + 4 * k, 220.0 - 80.0 * row[i]);
        }
        let _ = writeln!(
            svg,
            "\"/>\n<text x=\"{}\" y=\"15\" fill=\"{colour}\">{name}</text>",
            10 + 200 * i
        );
    }
    svg + "</svg>\n"
}

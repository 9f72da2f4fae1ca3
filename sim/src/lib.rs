//! `sinew-sim`: small actuated mechanisms, simulated with exact derivatives and true sticking.
//!
//! A rig file (TOML) becomes a [`Rig`], a typed description that still knows its lines; a rig
//! becomes a [`Plant`], an index-based topology whose every number is a parameter slot; a plant is
//! simulated over any [`Scalar`], so that a trajectory carries its derivatives when the scalar is a
//! [`Dual`]. The equations are numbered in `docs/explanation/plant.md`.
//!
//! ```
//! use sinew_sim::{InputTrajectory, Plant, Rig};
//!
//! let rig = Rig::parse(
//!     r#"
//! format = "sinew-rig/1"
//! name = "oscillator"
//! [[body]]
//! name = "mass"
//! motion = "slide"
//! inertia = 1.0
//! start = 0.1
//! [[spring]]
//! name = "coil"
//! from = "ground"
//! to = "mass"
//! stiffness = { value = 40.0, min = 1.0 }
//! [[sensor]]
//! name = "encoder"
//! reads = "mass.position"
//! signal = "q_m"
//! "#,
//!     "oscillator.toml",
//! )?;
//! let plant = Plant::new(&rig)?;
//! let values = plant.values();
//! let start = plant.initial_state(&values, &[None])?;
//! let times: Vec<f64> = (0..100).map(|k| 0.01 * f64::from(k)).collect();
//! let drive = InputTrajectory::new(&plant, times.len(), &[])?;
//! let run = plant.simulate(&values, &start, &drive, &times)?;
//! assert!((run.signal(99, 0) - 0.1 * (40f64.sqrt() * 0.99).cos()).abs() < 1e-6);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! What is refused says where and what was meant:
//!
//! ```
//! let text = "format = \"sinew-rig/1\"\nname = \"x\"\n[[body]]\nname = \"mass\"\nmotion = \"slid\"\ninertia = 1.0\n";
//! let error = sinew_sim::Rig::parse(text, "x.toml").unwrap_err().to_string();
//! assert!(error.starts_with("x.toml:5:10: "), "{error}");
//! assert!(error.contains("did you mean `slide`?"), "{error}");
//! ```

mod dual;
pub mod effects;
mod error;
mod geometry;
mod input_history;
mod input_trajectory;
mod integrator;
mod math;
mod plant;
mod reverse;
pub mod rig;
mod scalar;
mod settings;
mod simulate;
mod suggest;
pub mod unit;

pub use dual::Dual;
pub use error::{BodyPlace, Error, SimulationError};
pub use input_trajectory::InputTrajectory;
pub use integrator::Stepper;
pub use plant::{Input, Outline, Parameter, Plant, Role, SensorChannel};
pub use rig::Rig;
pub use scalar::Scalar;
pub use settings::{Report, Settings};
pub use simulate::{Gradient, ParameterizedPlant, RecordingRun, Simulated, Trajectory};

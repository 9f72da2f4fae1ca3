//! A differentiable simulator of small actuated mechanisms, with true sticking.
//!
//! A plant with positions `q`, velocities `v`, internal states `z` of effects, inputs `u` and
//! sensor signals `y` obeys
//!
//! ```text
//! q' = v,    M v' = f(q, v, z, u) + R(v, f),    z' = g(q, v, z, u),    y = h(q, v, z)
//! ```
//!
//! The inertias `M` are diagonal. The forces `f` come from springs, dampers, tendons, actuators and
//! effects. Dry friction `R` is set-valued at rest:
//!
//! ```text
//! R = -level sign(v)  while a body slides,    R = -f and v = 0  while |f| <= break-away level
//! ```
//!
//! The simulator does what smoothed ones do not:
//!
//! - **True sticking.** At rest the velocity is exactly 0 and the position keeps its bits. Friction
//!   paths that share bodies obey Gauss's principle of least constraint.
//! - **Events.** Stops, slack, backlash, break-away and reversal are located within a step, which
//!   is cut there.
//! - **Exact derivatives.** Forward with [`Dual`] numbers, backward with [`Plant::gradient`],
//!   through every event and its time.
//! - **Linear rigs in one step.** A sample interval is a matrix exponential, without truncation
//!   error.
//! - **Rests.** [`Plant::rest`] finds the static equilibrium without simulating.
//!
//! A rig file (TOML) becomes a [`Rig`], a typed description that keeps its text and lines. A rig
//! becomes a [`Plant`], whose every number is a parameter slot. A plant is simulated over any
//! [`Scalar`]: over recorded rows ([`Plant::simulate`]) or sample by sample ([`Stepper`]). Effects
//! beyond the textbook are in [`effects`]. The equations are numbered in
//! `docs/explanation/plant.md` of the repository.
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
//! An error names its place and the word that was probably meant:
//!
//! ```
//! let text = "format = \"sinew-rig/1\"\nname = \"x\"\n[[body]]\nname = \"mass\"\n\
//!             motion = \"slid\"\ninertia = 1.0\n";
//! let error = sinew_sim::Rig::parse(text, "x.toml").unwrap_err().to_string();
//! assert!(error.starts_with("x.toml:5:10: "), "{error}");
//! assert!(error.contains("did you mean `slide`?"), "{error}");
//! ```

mod dual;
pub mod effects;
mod error;
mod geometry;
mod imposed_motion;
mod input_history;
mod input_trajectory;
mod integrator;
mod law;
mod math;
mod plant;
mod reverse;
pub mod rig;
mod scalar;
mod settings;
mod simulate;
mod statics;
pub mod suggest;
pub mod unit;

pub use dual::Dual;
pub use error::{BodyPlace, Error, NoRest, SimulationError};
pub use imposed_motion::ImposedMotion;
pub use input_trajectory::InputTrajectory;
pub use integrator::Stepper;
pub use law::{LawKind, LawShape};
pub use plant::{Input, Meaning, MotionQuantity, Outline, Parameter, Plant, Role, SensorChannel};
pub use rig::Rig;
pub use scalar::Scalar;
pub use settings::{IntegrationReport, SimulationSettings};
pub use simulate::{Gradient, ParameterizedPlant, RecordingRun, Simulated, Trajectory};
pub use statics::{Contraction, Rest, RestInterval, RestPoint};

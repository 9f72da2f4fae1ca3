//! Small networks trained on a simulated plant, for a predictive controller.
//!
//! ```text
//!  rig, fitted ──► plant ──► dataset: states on the way of a recording,
//!                   │                 short rollouts from around them
//!                   │                        │ windows of past and future samples
//!                   ▼                        ▼
//!      state: a model's weights      train: a network's weights,
//!      over a population             f32, as the firmware carries them
//! ```
//!
//! | module | turns | into |
//! |---|---|---|
//! | [`dataset`] | a fitted plant | short simulated motions and their derivatives |
//! | [`train`] | those motions | a network's weights |
//! | [`soft_sensor`] | channels and outputs of one recording | the outputs, from the channels |
//! | [`state`] | a population of plants | a state-space model's weights |
//!
//! A network of six units for a mass on a spring, from a hundred episodes, in two short passes:
//!
//! ```
//! use sinew_train::dataset::{RolloutConfig, draw, sampled_states};
//! use sinew_train::train::{Options, Shape, scale, scaling, train};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let rig = include_str!("../../../rigs/mass-spring-damper.toml");
//! let plant = sinew_sim::Plant::new(&sinew_sim::Rig::parse(rig, "rig.toml")?)?;
//! let values = plant.values();
//!
//! // Where a recording with this input would go.
//! let period_s = 1.0 / 120.0;
//! let times: Vec<f64> = (0..600).map(|k| f64::from(k) * period_s).collect();
//! let push: Vec<f64> = times.iter().map(|t| 8.0 * (2.3 * t).sin()).collect();
//! let start = plant.initial_state(&values, &[None])?;
//! let met = sampled_states(&plant, &values, &start, &times, &[&push], 100)?;
//!
//! let config = RolloutConfig {
//!     period_s,
//!     steps: 40,
//!     outputs: vec![0],
//!     noise: vec![0.0],
//!     channels: vec![],
//!     channel_noise: vec![],
//!     seed: 1,
//! };
//! let episodes = draw(&plant, &[&values], &met, &config, 100)?;
//! let u = scaling(episodes.iter().flat_map(|e| e.u.iter().copied()));
//! let y = scaling(episodes.iter().flat_map(|e| e.y.iter().copied()));
//! let scaled = scale(&episodes, &[u], &[y], &[]);
//! let (training, validation) = scaled.split_at(70);
//!
//! let shape = Shape { n_u: 1, n_y: 1, past_inputs: 3, past_outputs: 3, n_s: 0 };
//! let options = Options { hidden: vec![6], epochs: 2, batches: 10, ..Options::default() };
//! let trained = train(shape, training, validation, &options, None, |_, _, _| {})?;
//! assert_eq!(trained.history.len(), 2);
//! assert_eq!(trained.folded.linear[0].len(), shape.regressor_len());
//! # Ok(())
//! # }
//! ```

mod channel_watch;
pub mod dataset;
mod network_table;
pub mod soft_sensor;
pub mod state;
pub mod train;

pub use network_table::{FirstLayer, Form, NetworkTable};

//! A policy: a network that moves commands, what it sees and its limits
//! (docs/explanation/imitation.md, eq. 1 and 4), on disk and as a crate.

mod emit;
mod error;
mod runner;
mod store;

use sinew_nn::Network;

pub use emit::emit;
pub use error::PolicyError;
pub use runner::Runner;
pub use store::{FORMAT, POLICY_FILE, load, save};

/// A measured output.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Output {
    /// Column of recordings, for instance `q_m`.
    pub name: String,
    /// Unit of the policy's numbers, for people; empty for none.
    pub unit: String,
    /// Lowest value that it was taught with.
    pub low: f64,
    /// Highest value that it was taught with.
    pub high: f64,
}

/// A command and its limits, physical units.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Input {
    /// Column of recordings, for instance `u_N`.
    pub name: String,
    /// Unit of the policy's numbers, for people; empty for none.
    pub unit: String,
    /// Smallest command.
    pub lower: f32,
    /// Largest command.
    pub upper: f32,
    /// Largest change in one control period; infinite: none.
    #[serde(default = "unlimited", skip_serializing_if = "is_unlimited")]
    pub rate: f32,
    /// Command before the first step.
    pub safe: f32,
}

fn unlimited() -> f32 {
    f32::INFINITY
}

#[allow(
    clippy::trivially_copy_pass_by_ref,
    reason = "serde calls it with a reference"
)]
fn is_unlimited(rate: &f32) -> bool {
    *rate == f32::INFINITY
}

/// Policy in physical units.
///
/// Its network sees y(k) .. y(k - past_outputs + 1), u(k-1) .. u(k - past_inputs), r(k+1) ..
/// r(k + ahead), each with one number an output or input, and gives the change of each command.
#[derive(Clone, Debug, PartialEq)]
pub struct PolicySpec {
    /// Name of the crate: lower-case letters, digits, `-`.
    pub name: String,
    /// Control period, s.
    pub period_s: f64,
    /// Measured outputs.
    pub outputs: Vec<Output>,
    /// Commands.
    pub inputs: Vec<Input>,
    /// Samples of the outputs, the present one among them.
    pub past_outputs: usize,
    /// Earlier commands.
    pub past_inputs: usize,
    /// Samples of the reference ahead.
    pub ahead: usize,
    /// The network.
    pub network: Network,
}

impl PolicySpec {
    /// Count of numbers that the network sees.
    pub fn seen(&self) -> usize {
        self.outputs.len() * (self.past_outputs + self.ahead) + self.inputs.len() * self.past_inputs
    }

    /// Refuses sizes that do not belong together.
    ///
    /// # Errors
    /// A reason in words.
    fn validate(&self) -> Result<(), String> {
        self.network.validate().map_err(|error| error.to_string())?;
        if self.outputs.is_empty() || self.inputs.is_empty() {
            return Err("a policy has an output and an input at least".into());
        }
        if self.past_outputs == 0 || self.past_inputs == 0 || self.ahead == 0 {
            return Err("past_outputs, past_inputs and ahead are 1 at least".into());
        }
        let (wanted, found) = (self.seen(), self.network.inputs());
        if wanted != found {
            return Err(format!(
                "the policy sees {wanted} numbers, and its network takes {found}"
            ));
        }
        let (wanted, found) = (self.inputs.len(), self.network.outputs());
        if wanted != found {
            return Err(format!(
                "{wanted} commands, and a network that gives {found}"
            ));
        }
        if self.network.state() > 0 {
            return Err(
                "a policy's network remembers nothing: its past is among its inputs".into(),
            );
        }
        if !(self.period_s.is_finite() && self.period_s > 0.0) {
            return Err(format!(
                "the period is {} s: more than 0 expected",
                self.period_s
            ));
        }
        for input in &self.inputs {
            let finite = input.lower.is_finite() && input.upper.is_finite();
            let holds = input.lower <= input.safe && input.safe <= input.upper;
            if !(finite && holds && input.rate >= 0.0) {
                return Err(format!(
                    "limits of `{}`: lower <= safe <= upper and a rate of 0 or more expected",
                    input.name
                ));
            }
        }
        Ok(())
    }
}

//! A policy on disk: a folder with `policy.toml`, and its network beside it as `network.toml` and
//! `weights.safetensors`. docs/reference/policy-files.md describes the first.

use std::path::Path;

use serde::{Deserialize, Serialize};
use sinew_files::{read, write};
use sinew_nn::store;

use super::{Input, Output, PolicyError, PolicySpec};

/// Format that `policy.toml` names.
pub const FORMAT: &str = "sinew-policy/1";
/// The description's file name.
pub const POLICY_FILE: &str = "policy.toml";
/// Larger than any description.
const MAX_BYTES: u64 = 64 * 1024;

/// `policy.toml`.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Text {
    format: String,
    name: String,
    period_s: f64,
    past_outputs: usize,
    past_inputs: usize,
    ahead: usize,
    output: Vec<Output>,
    input: Vec<Input>,
}

/// Reads and validates the policy in `directory`.
///
/// # Errors
/// [`PolicyError`]: a file that cannot be read, is not in the format, or does not fit the others.
pub fn load(directory: &Path) -> Result<PolicySpec, PolicyError> {
    let file = directory.join(POLICY_FILE);
    let bytes = read(&file, MAX_BYTES)?;
    let complaint = |message: String| PolicyError::Text {
        file: file.clone(),
        message,
    };
    let text = String::from_utf8(bytes).map_err(|_| complaint("no UTF-8 text".into()))?;
    let parsed: Text = toml::from_str(&text).map_err(|error| complaint(error.to_string()))?;
    if parsed.format != FORMAT {
        return Err(complaint(format!(
            "the format is {:?}: this program reads {FORMAT:?}",
            parsed.format
        )));
    }
    let network = store::load(directory)?;
    let spec = PolicySpec {
        name: parsed.name,
        period_s: parsed.period_s,
        outputs: parsed.output,
        inputs: parsed.input,
        past_outputs: parsed.past_outputs,
        past_inputs: parsed.past_inputs,
        ahead: parsed.ahead,
        network,
    };
    let message = spec.validate();
    message.map_err(|message| PolicyError::Spec { file, message })?;
    Ok(spec)
}

/// Writes the policy to `directory`.
///
/// # Errors
/// [`PolicyError`]: one that is not valid, or a file that cannot be written.
pub fn save(directory: &Path, spec: &PolicySpec) -> Result<(), PolicyError> {
    let file = directory.join(POLICY_FILE);
    if let Err(message) = spec.validate() {
        return Err(PolicyError::Spec { file, message });
    }
    let text = Text {
        format: FORMAT.into(),
        name: spec.name.clone(),
        period_s: spec.period_s,
        past_outputs: spec.past_outputs,
        past_inputs: spec.past_inputs,
        ahead: spec.ahead,
        output: spec.outputs.clone(),
        input: spec.inputs.clone(),
    };
    let text = toml::to_string(&text).map_err(|error| PolicyError::Text {
        file: file.clone(),
        message: error.to_string(),
    })?;
    store::save(directory, &spec.network)?;
    write(&file, text)?;
    Ok(())
}

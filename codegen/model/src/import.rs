//! Networks and models in files, as networks.

use std::path::Path;

use sinew_nn::store as network_store;
use sinew_nn::{Network, NetworkError, import};

use crate::store::{self, StoreError};
use crate::to_network;

/// Error of a network or model that cannot be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImportError {
    /// The network's file is refused.
    #[error(transparent)]
    Network(#[from] NetworkError),
    /// The model's folder is refused.
    #[error("model: {0}")]
    Model(#[from] StoreError),
}

/// The network in a file of another tool, in a folder with `network.toml`, or of the model in a
/// folder.
///
/// ```
/// use sinew_model::import;
///
/// let error = import::read("src".as_ref()).unwrap_err();
/// assert!(error.to_string().starts_with("src: network.toml and model.toml are both missing"));
/// ```
///
/// # Errors
/// [`ImportError`]; the message begins with the path.
pub fn read(path: &Path) -> Result<Network, ImportError> {
    if !path.is_dir() || path.join(network_store::NETWORK_FILE).is_file() {
        return Ok(import::read(path)?);
    }
    if !path.join(store::MODEL_FILE).is_file() {
        let message = format!(
            "{} and {} are both missing: expected a folder of `sinew import` or `sinew train`",
            network_store::NETWORK_FILE,
            store::MODEL_FILE
        );
        return Err(NetworkError::malformed(path.display().to_string(), message).into());
    }
    Ok(to_network::network(&store::load(path)?)?)
}

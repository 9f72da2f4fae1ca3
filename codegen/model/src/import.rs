//! Networks and models in files, as networks.

use std::path::Path;

use sinew_nn::store as network_store;
use sinew_nn::{Network, NetworkError, import};

use crate::{store, to_network};

/// The network in a file of another tool, in a folder with `network.toml`, or of the model in a folder.
///
/// # Errors
/// [`NetworkError`], beginning with the path.
pub fn read(path: &Path) -> Result<Network, NetworkError> {
    if !path.is_dir() || path.join(network_store::NETWORK_FILE).is_file() {
        return import::read(path);
    }
    if !path.join(store::MODEL_FILE).is_file() {
        let message = format!(
            "{} and {} are both missing: expected a folder of `sinew import` or `sinew train`",
            network_store::NETWORK_FILE,
            store::MODEL_FILE
        );
        return Err(NetworkError::malformed(path.display().to_string(), message));
    }
    let spec =
        store::load(path).map_err(|error| NetworkError::malformed("model", error.to_string()))?;
    to_network::network(&spec)
}

//! Keras: `.h5` of Keras 2 (and of Keras 3, on request), `.keras` of Keras 3.

mod config;
mod idle;
mod layers;
mod settings;
#[cfg(test)]
mod tests;
mod weights;

use std::collections::HashMap;
use std::io::{Cursor, Read};

use serde_json::Value;

use super::hdf5::Hdf5;
use crate::limits::MAX_FILE_BYTES;
use crate::rounding::Rounding;
use crate::{Network, NetworkError};
use config::{Model, Source};
use layers::Import;
pub(super) use layers::normalise;
use weights::Weights;

/// # Errors
/// [`NetworkError`].
pub(super) fn import_h5(name: &str, bytes: &[u8]) -> Result<Network, NetworkError> {
    let file = Hdf5::new(bytes)?;
    let text = file.text("model_config")?.ok_or_else(|| {
        NetworkError::malformed(
            "model_config",
            "the file has weights only: save the whole model, with model.save",
        )
    })?;
    let version = file.text("keras_version")?.unwrap_or_default();
    // Before version 3 there was no other than 2 that is still read.
    build(
        name,
        &text,
        || Weights::named(&file),
        !version.starts_with('3'),
    )
}

/// # Errors
/// [`NetworkError`].
pub(super) fn import_archive(name: &str, bytes: &[u8]) -> Result<Network, NetworkError> {
    let mut archive = zip::ZipArchive::new(Cursor::new(bytes)).map_err(|error| {
        let message = format!("no whole .keras file, perhaps cut off: {error}");
        NetworkError::malformed("archive", message)
    })?;
    let mut entry = |name: &str| {
        let entry = archive
            .by_name(name)
            .map_err(|error| NetworkError::caused(name, error))?;
        let mut contents = Vec::new();
        // An archive of a few bytes can unpack to gigabytes.
        entry
            .take(MAX_FILE_BYTES + 1)
            .read_to_end(&mut contents)
            .map_err(|error| NetworkError::caused(name, error))?;
        if contents.len() as u64 > MAX_FILE_BYTES {
            return Err(NetworkError::too_large(
                name,
                format!("larger than {MAX_FILE_BYTES} bytes"),
            ));
        }
        Ok(contents)
    };
    let text = String::from_utf8(entry("config.json")?)
        .map_err(|_| NetworkError::malformed("config.json", "it is not UTF-8 text"))?;
    let metadata = entry("metadata.json").unwrap_or_default();
    let metadata: Value = serde_json::from_slice(&metadata).unwrap_or_default();
    let keras_2 = metadata["keras_version"]
        .as_str()
        .is_some_and(|version| version.starts_with('2'));
    let weights = || Weights::numbered(&Hdf5::new(&entry("model.weights.h5")?)?);
    build(name, &text, weights, keras_2)
}

/// The configuration of an archive; none where it has none.
fn configuration(bytes: &[u8]) -> Option<String> {
    let mut archive = zip::ZipArchive::new(Cursor::new(bytes)).ok()?;
    let mut text = String::new();
    let entry = archive.by_name("config.json").ok()?;
    entry.take(MAX_FILE_BYTES).read_to_string(&mut text).ok()?;
    Some(text)
}

/// The rounding of a quantised model: its layers scale their inputs by the largest of each call.
pub(super) fn rounding(bytes: &[u8], archive: bool) -> Option<Rounding> {
    let text = if archive {
        configuration(bytes)?
    } else {
        Hdf5::new(bytes).ok()?.text("model_config").ok()??
    };
    let quantised = text.contains("\"QuantizedDTypePolicy\"");
    quantised.then_some(Rounding {
        bits: 8,
        input: None,
    })
}

fn build(
    name: &str,
    text: &str,
    weights: impl FnOnce() -> Result<Weights, NetworkError>,
    keras_2: bool,
) -> Result<Network, NetworkError> {
    let config: Value = serde_json::from_str(text)
        .map_err(|error| NetworkError::caused("model configuration", error))?;
    let model = Model::new(&config)?;
    // The configuration says in better words than the weights what cannot be read.
    let weights = weights()?;
    let streaming = model.steps_open;
    let network = Network::new(name, &model.input, model.shape.clone());
    let mut import = Import::new(network, &weights, keras_2, streaming);
    // By layer and number of the output.
    let mut places: HashMap<(&str, usize), usize> = HashMap::from([((model.input.as_str(), 0), 0)]);
    // A layer may stand before what it reads in the list; each round reads those that are ready.
    let mut waiting: Vec<usize> = (0..model.layers.len()).collect();
    while !waiting.is_empty() {
        let before = waiting.len();
        let mut later = Vec::new();
        for index in waiting {
            let layer = &model.layers[index];
            let place = |from: &Source| output(&places, &layer.name, from).transpose();
            let from: Option<Vec<usize>> = (layer.from.iter().map(place))
                .collect::<Option<Result<_, _>>>()
                .transpose()?;
            match from {
                Some(from) => {
                    let outputs = import.outputs(layer, &from)?;
                    if !idle::IDLE.contains(&layer.class) {
                        layer.config.expect_read(&layer.name, layer.class)?;
                    }
                    for (number, place) in outputs.into_iter().enumerate() {
                        places.insert((&layer.name, number), place);
                    }
                }
                None => later.push(index),
            }
        }
        if later.len() == before {
            let layer = &model.layers[later[0]];
            let message = format!(
                "it reads {:?}: a layer that is not there, or a cycle",
                layer
                    .from
                    .iter()
                    .map(|from| &from.layer)
                    .collect::<Vec<_>>()
            );
            return Err(NetworkError::malformed(&layer.name, message));
        }
        waiting = later;
    }
    let output = output(&places, "model", &model.output)?.ok_or_else(|| {
        NetworkError::malformed(&model.output.layer, "the output is none of the layers")
    })?;
    weights.expect_read()?;
    Ok(import.finish(output))
}

/// The place of an output of a layer; none where the layer has not been read yet.
///
/// # Errors
/// The layer has been read, and has no such output here.
fn output(
    places: &HashMap<(&str, usize), usize>,
    layer: &str,
    from: &Source,
) -> Result<Option<usize>, NetworkError> {
    let place = places.get(&(from.layer.as_str(), from.output)).copied();
    if place.is_some() || !places.contains_key(&(from.layer.as_str(), 0)) {
        return Ok(place);
    }
    Err(NetworkError::unsupported(
        layer,
        format!("output {} of {}", from.output, from.layer),
        "the first output works, and of a recurrent layer the hidden state, its second",
    ))
}

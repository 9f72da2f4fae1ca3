//! The weights of a layer, by name in Keras 2 and by number in Keras 3.

use std::cell::RefCell;
use std::collections::{HashMap, HashSet};

use super::config::Layer;
use crate::NetworkError;
use crate::import::hdf5::Hdf5;
use crate::import::tensor::Tensor;

/// All weights of a file.
pub(super) struct Weights {
    /// By path below the group of all layers.
    tensors: HashMap<String, Tensor>,
    numbered: bool,
    /// Paths of those that a layer took.
    taken: RefCell<HashSet<String>>,
}

/// True if a tensor changes nothing in a trained network: a state of random numbers, or the count
/// of what a Normalization has seen.
fn is_idle(path: &str) -> bool {
    let counted = path.starts_with("normalization") && path.ends_with("/vars/2");
    counted || path.contains("seed_generator") || path.contains("count:")
}

impl Weights {
    /// Keras 2: `model_weights/LAYER/.../kernel:0`.
    ///
    /// # Errors
    /// The file is broken.
    pub(super) fn named(file: &Hdf5) -> Result<Self, NetworkError> {
        let tensors = file.tensors("model_weights")?.into_iter().collect();
        Ok(Self {
            tensors,
            numbered: false,
            taken: RefCell::default(),
        })
    }

    /// Keras 3: `layers/CLASS_2/vars/0`.
    ///
    /// # Errors
    /// The file is broken.
    pub(super) fn numbered(file: &Hdf5) -> Result<Self, NetworkError> {
        let tensors = file.tensors("layers")?.into_iter().collect();
        Ok(Self {
            tensors,
            numbered: true,
            taken: RefCell::default(),
        })
    }

    /// The weight of `layer` that Keras 2 calls `name` and that is number `number` of Keras 3; none
    /// if there is none.
    pub(super) fn find(&self, layer: &Layer<'_>, name: &str, number: usize) -> Option<&Tensor> {
        if self.numbered {
            let class = snake_case(layer.class);
            let group = match layer.number {
                0 => class,
                n => format!("{class}_{n}"),
            };
            // Recurrent layers keep theirs in a cell, wrappers in a layer.
            let side = format!("{}_layer/", layer.side);
            let side = if layer.side.is_empty() { "" } else { &side };
            let paths = ["", "cell/", "layer/", "layer/cell/"];
            return paths
                .iter()
                .find_map(|inner| self.take(&format!("{group}/{side}{inner}vars/{number}")));
        }
        let own = layer.config["name"].as_str().unwrap_or("");
        let is_side = |segment: &str| {
            segment == own
                || segment
                    .strip_prefix(layer.side)
                    .is_some_and(|rest| rest.starts_with('_'))
        };
        let prefix = format!("{}/", layer.name);
        let mut paths = self.tensors.keys();
        let path = paths.find(|path| {
            let last = path.rsplit('/').next().unwrap_or("");
            let beside = layer.side.is_empty() || path.split('/').skip(1).any(is_side);
            path.starts_with(&prefix) && beside && last.split(':').next() == Some(name)
        })?;
        self.take(path)
    }

    fn take(&self, path: &str) -> Option<&Tensor> {
        let found = self.tensors.get(path)?;
        self.taken.borrow_mut().insert(path.into());
        Some(found)
    }

    /// Every tensor belongs to a layer that was read.
    ///
    /// # Errors
    /// One does not.
    pub(super) fn expect_read(&self) -> Result<(), NetworkError> {
        let taken = self.taken.borrow();
        let left = self
            .tensors
            .keys()
            .filter(|path| !taken.contains(*path) && !is_idle(path));
        match left.min() {
            Some(path) => Err(NetworkError::unsupported(
                path.split('/').next().unwrap_or(path),
                format!("the tensor {path:?}, which nothing here reads,"),
                "save the layer without it",
            )),
            None => Ok(()),
        }
    }

    /// As [`Weights::find`].
    ///
    /// # Errors
    /// There is none.
    pub(super) fn get(
        &self,
        layer: &Layer<'_>,
        name: &str,
        number: usize,
    ) -> Result<&Tensor, NetworkError> {
        self.find(layer, name, number).ok_or_else(|| {
            NetworkError::malformed(&layer.name, format!("its {name} is not in the file"))
        })
    }
}

/// `MaxPooling1D` as `max_pooling1d`, `SimpleRNN` as `simple_rnn`: Keras's own rule.
fn snake_case(class: &str) -> String {
    let letters: Vec<char> = class.chars().collect();
    let mut text = String::new();
    for (i, &c) in letters.iter().enumerate() {
        let before = i.checked_sub(1).map(|i| letters[i]);
        let next_is_small = letters.get(i + 1).is_some_and(char::is_ascii_lowercase);
        let begins_word = c.is_ascii_uppercase()
            && before.is_some_and(|before| next_is_small || before.is_ascii_lowercase());
        if begins_word {
            text.push('_');
        }
        text.push(c.to_ascii_lowercase());
    }
    text
}

#[cfg(test)]
mod tests {
    use super::snake_case;

    #[test]
    fn classes_are_named_as_keras_names_them() {
        let names = [
            "Dense",
            "Conv2D",
            "SimpleRNN",
            "GRU",
            "MaxPooling1D",
            "BatchNormalization",
            "LeakyReLU",
        ];
        let expected = [
            "dense",
            "conv2d",
            "simple_rnn",
            "gru",
            "max_pooling1d",
            "batch_normalization",
            "leaky_re_lu",
        ];
        assert_eq!(names.map(snake_case), expected);
    }
}

//! Footprint of each layer: the network printed with each layer in a function of its own, linked,
//! and run in QEMU between marks.

use std::path::Path;

use object::{Object, ObjectSymbol};

use super::cost::Cost;
use super::probe;
use super::sources::{linked, write};
use crate::emit::{Options, Weights, layer_symbol};
use crate::quantise::weight_bytes;
use crate::summary::{describe, shape, thousands};
use crate::{BuildError, Network};
use sinew_files::FileError;

/// Footprint of one layer of a folded network.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Layer {
    /// Name of the layer.
    pub name: String,
    /// Its kind, in words.
    pub kind: String,
    /// Axes of its output.
    pub shape: Vec<usize>,
    /// Bytes of flash for its weights.
    pub weight_bytes: u64,
    /// Bytes of flash for code of its own; none for a network that is too large to be linked. Code
    /// that layers share is no layer's.
    pub code_bytes: Option<u64>,
    /// Bytes of RAM for its values, and for what it keeps between calls. A layer that works in the
    /// buffer of another has none.
    pub ram_bytes: Option<u64>,
    /// Deepest stack while it runs, with the values of all layers; none without QEMU.
    pub stack_bytes: Option<u64>,
    /// Instructions of one prediction; none without QEMU.
    pub instructions: Option<u64>,
}

/// Measures each layer in `folder`, which is kept for the next time.
///
/// # Errors
/// [`BuildError`]. Without QEMU there are no instructions and no stack, which is no error.
pub fn layers(
    network: &Network,
    options: &Options,
    folder: &Path,
) -> Result<Vec<Layer>, BuildError> {
    write(network, options, folder)?;
    let image = linked(probe::build_layers(folder))?;
    let said = image.as_deref().and_then(|image| probe::run(image).ok());
    let code = image.as_deref().map(code_bytes).transpose()?;
    let int8 = options.weights == Weights::Int8;
    let network = network.folded();
    let layers = network.nodes.iter().enumerate().skip(1);
    Ok(layers
        .map(|(place, node)| {
            let mut numbers = numbers(said.as_deref(), place).into_iter();
            let mut next = || numbers.next();
            let (instructions, stack_bytes, ram_bytes) = (next(), next(), next());
            Layer {
                name: node.name.clone(),
                kind: describe(&node.op),
                shape: node.shape.clone(),
                weight_bytes: weight_bytes(&node.op, int8) as u64,
                code_bytes: code.as_ref().map(|of| of(place)),
                ram_bytes,
                stack_bytes,
                instructions,
            }
        })
        .collect())
}

/// The numbers of the line `layer 3 INSTRUCTIONS STACK BYTES`.
fn numbers(said: Option<&str>, place: usize) -> Vec<u64> {
    let start = format!("layer {place} ");
    let mut lines = said.unwrap_or("").lines();
    let line = lines.find_map(|line| line.strip_prefix(&start));
    let words = line.unwrap_or("").split(' ');
    words.map_while(|word| word.parse().ok()).collect()
}

/// Bytes of the functions of a layer, by its place.
fn code_bytes(image: &Path) -> Result<impl Fn(usize) -> u64, BuildError> {
    let data = std::fs::read(image).map_err(|error| FileError::read(image, error))?;
    let file = object::File::parse(&*data).map_err(|error| BuildError::Image {
        file: image.into(),
        error,
    })?;
    let symbols: Vec<(String, u64)> = file
        .symbols()
        .filter_map(|symbol| Some((symbol.name().ok()?.to_owned(), symbol.size())))
        .collect();
    Ok(move |place: usize| {
        let name = layer_symbol(place);
        let own = symbols.iter().filter(|(symbol, _)| symbol.contains(&name));
        own.map(|(_, size)| size).sum()
    })
}

/// The layers as a table, with what they share and their sum, the whole network's.
#[must_use]
pub fn layer_table(layers: &[Layer], predict: &Cost) -> String {
    let number = |n: Option<u64>| n.map_or("-".into(), |n| thousands(n as usize));
    let shares = |n: Option<u64>| match (n, predict.instructions) {
        (Some(n), Some(all)) if all > 0 => format!("{:.1} %", 100.0 * n as f64 / all as f64),
        _ => "-".into(),
    };
    let mut rows = vec![
        [
            "layer", "kind", "output", "weights", "code", "RAM", "stack", "instr.", "of all",
        ]
        .map(String::from),
    ];
    for layer in layers {
        rows.push([
            shortened(&layer.name),
            shortened(layer.kind.split([' ', ',']).next().unwrap_or_default()),
            shape(&layer.shape).replace(' ', ""),
            thousands(layer.weight_bytes as usize),
            number(layer.code_bytes),
            number(layer.ram_bytes),
            number(layer.stack_bytes),
            number(layer.instructions),
            shares(layer.instructions),
        ]);
    }
    let (mut flash, mut counted) = (0, 0);
    for layer in layers {
        flash += layer.weight_bytes + layer.code_bytes.unwrap_or(0);
        counted += layer.instructions.unwrap_or(0);
    }
    let rest = |whole: u64, parts: u64| {
        let rest = whole as i64 - parts as i64;
        let sign = if rest < 0 { "-" } else { "" };
        format!("{sign}{}", thousands(rest.unsigned_abs() as usize))
    };
    let blank = String::new;
    rows.push([
        "rest".into(),
        blank(),
        blank(),
        blank(),
        rest(predict.flash_bytes, flash),
        blank(),
        blank(),
        predict
            .instructions
            .map_or("-".into(), |all| rest(all, counted)),
        blank(),
    ]);
    let width = |column: usize| {
        rows.iter()
            .map(|row| row[column].chars().count())
            .max()
            .unwrap_or(0)
    };
    let widths: Vec<usize> = (0..rows[0].len()).map(width).collect();
    let mut text = String::new();
    for row in &rows {
        let cells = row.iter().zip(&widths).enumerate();
        let cells = cells.map(|(column, (cell, &width))| match column {
            0..3 => format!("{cell:<width$} "),
            _ => format!("{cell:>width$}"),
        });
        let line = cells.collect::<Vec<_>>().join(" ");
        text += line.trim_end();
        text += "\n";
    }
    text + "\nBytes. RAM is a layer's own values and state; stack is the deepest while it\n\
            runs, with the values of all layers. Rest is the code that layers share, less\n\
            what keeping them apart for this table adds.\n"
}

/// A name of 14 characters at most.
fn shortened(name: &str) -> String {
    const LONGEST: usize = 14;
    if name.chars().count() <= LONGEST {
        return name.to_string();
    }
    name.chars()
        .take(LONGEST - 1)
        .chain(std::iter::once('…'))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_numbers_of_a_layer_are_read_from_its_own_line() {
        let said = "layer 1 10 20 30\nlayer 11 40 50 60\n";
        assert_eq!(numbers(Some(said), 1), [10, 20, 30]);
        assert_eq!(numbers(Some(said), 11), [40, 50, 60]);
        assert!(numbers(Some(said), 2).is_empty() && numbers(None, 1).is_empty());
    }
}

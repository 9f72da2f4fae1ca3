//! Texts of `sinew import`, `sinew size`, and `sinew emit` of a network.

use std::path::{Path, PathBuf};

use super::emit::{self, Accuracy, LIBRARY, Options, Weights};
use super::footprint::{self, BOARDS, Board, Footprint, Layer};
use super::{Golden, Network, evaluate, generated, quantise, store, summary, target};
use crate::BuildError;
use sinew_files::FileError;

/// Writes a network as a folder, if `out` is given; the answer is its table.
///
/// # Errors
/// [`BuildError`].
pub fn import(network: &Network, out: Option<&Path>) -> Result<String, BuildError> {
    if let Some(out) = out {
        store::save(out, network).map_err(|error| error.within(&out.display().to_string()))?;
    }
    let written = out.map_or(String::new(), |out| format!("\nwrote {}\n", out.display()));
    Ok(format!(
        "{}\n\n{}{written}",
        network.name,
        summary::table(network)
    ))
}

/// The lines that say by how much a quantised file's framework rounds, and what it changes; nothing
/// for other files.
///
/// # Errors
/// [`BuildError`] if the file cannot be read.
pub fn rounding(network: &Network, file: &Path) -> Result<String, BuildError> {
    let Some(rounding) = super::import::rounding(file)? else {
        return Ok(String::new());
    };
    let loss = 100.0 * rounding.drawn_loss(network);
    Ok(format!(
        "{rounding}\noutputs therefore differ from its own, by up to about {loss:.2} % of their range\n"
    ))
}

/// Golden vectors of a crate whose network brings none.
const GOLDEN: usize = 4;
/// Inputs that are tried for them: a root or a logarithm has none at most of them.
const TRIED: usize = 400;

/// Adds golden vectors in double precision where the file of the network brings none and the crate
/// is to compute what the network says.
fn with_golden(network: &Network, options: &Options) -> Network {
    let mut network = network.clone();
    let exact = options.weights == Weights::default() && options.accuracy == Accuracy::default();
    if network.golden.is_empty() && exact {
        let mut state = 0x2545_f491_4f6c_dd1d_u64;
        let mut next = || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 40) as f32 / (1 << 23) as f32 - 1.0
        };
        for _ in 0..TRIED {
            let x: Vec<f32> = (0..network.inputs()).map(|_| next()).collect();
            let wide: Vec<f64> = x.iter().copied().map(f64::from).collect();
            let y = evaluate::run(&network, &wide);
            if y.iter().all(|value| value.is_finite()) {
                network.golden.push(Golden { x, y });
            }
            if network.golden.len() == GOLDEN {
                break;
            }
        }
    }
    network
}

/// Prints the crate of a network into `out`, and with the C interface builds its library; the
/// answer names what was written.
///
/// # Errors
/// [`BuildError`].
pub fn emit(network: &Network, out: &Path, options: &Options) -> Result<String, BuildError> {
    let network = &with_golden(network, options);
    generated::write(out, &emit::emit(network, options)?)?;
    let mut text = format!("wrote {}\n{}", out.display(), loss(network, options));
    if options.c_abi {
        let folder = absolute(&out.join("c"))?;
        target::build(&folder, &format!("{}-c", network.name))?;
        let library = format!("target/{}/release/lib{LIBRARY}.a", target::TARGET);
        text += &format!("library {}\n", folder.join(library).display());
        text += &format!("header {}\n", folder.join(format!("{LIBRARY}.h")).display());
    }
    Ok(text)
}

/// The footprint of a network, for one board or for all, as tables and in numbers; `folder` keeps
/// the compiled parts for the next time.
///
/// # Errors
/// [`BuildError`].
pub fn size(
    network: &Network,
    board: Option<&str>,
    options: &Options,
    folder: &Path,
) -> Result<(String, Footprint, Vec<Layer>), BuildError> {
    let board = board.map(self::board).transpose()?;
    let folder = absolute(folder)?;
    let size = footprint::measure(network, options, &folder)?;
    let layers = footprint::layers(network, options, &folder)?;
    let text = format!(
        "{}\n{}{}",
        footprint::table(network, &size, board),
        footprint::layer_table(&layers, &size.predict),
        loss(network, options)
    );
    Ok((text, size, layers))
}

/// The line that says what integers cost; nothing where weights stay as they are.
fn loss(network: &Network, options: &Options) -> String {
    match options.weights {
        Weights::Float32 => String::new(),
        Weights::Int8 => format!("{}\n", quantise::loss(network)),
    }
}

fn absolute(path: &Path) -> Result<PathBuf, FileError> {
    std::path::absolute(path).map_err(|error| FileError::read(path, error))
}

/// The board of a name.
///
/// # Errors
/// [`BuildError::Board`]; the message has the names.
pub fn board(name: &str) -> Result<&'static Board, BuildError> {
    Board::named(name).ok_or_else(|| BuildError::Board {
        name: name.into(),
        expected: BOARDS.map(|board| board.name).join(", "),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Activation, Op};

    #[test]
    fn golden_vectors_are_where_the_network_has_values() {
        let mut network = Network::new("root", "x", vec![2]);
        network
            .push("root", Op::Activation(Activation::Root), vec![0])
            .expect("a root of two values");
        let network = with_golden(&network, &Options::default());
        assert_eq!(network.golden.len(), GOLDEN);
        let mut inputs = network.golden.iter().flat_map(|golden| &golden.x);
        assert!(inputs.all(|x| *x >= 0.0));
    }
}

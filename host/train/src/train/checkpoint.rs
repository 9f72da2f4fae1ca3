//! A training that was stopped goes on where it was, and ends with the same bytes as one that was
//! not.
//!
//! It keeps what cannot be found again: weights, the optimizer's state, what was best so far, the
//! losses. Data and random numbers follow from the same arguments; a checkpoint of other ones is
//! none.

use std::fs;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::PathBuf;
use std::time::{Duration, Instant};

use burn::module::Module;
use burn::store::{ModuleRecord, RecordError};
use burn::tensor::Bytes;
use burn_optim::ModuleOptimizer;
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

use super::network::Predictor;
use super::{Epoch, Options};
use sinew_ident::error::Result;

const FORMAT: &str = "sinew-checkpoint/1";

/// Time between two checkpoints: what is lost when a training is stopped.
const INTERVAL: Duration = Duration::from_secs(10);

/// File of an unfinished training.
#[derive(Debug)]
pub struct Checkpoint {
    file: PathBuf,
    interval: Duration,
    last: Instant,
}

/// State of an unfinished training.
pub(super) struct Reached {
    pub predictor: Predictor,
    pub optimizer: ModuleOptimizer,
    /// Loss, pass and weights of the best one so far.
    pub best: (f64, usize, Predictor),
    pub history: Vec<Epoch>,
}

/// The first line of the file; what follows are the records, one after the other.
#[derive(Serialize, Deserialize)]
struct Header {
    format: String,
    key: u64,
    /// Of all that follows.
    checksum: u64,
    /// Bytes of the predictor, the best one and the optimizer.
    lengths: [usize; 3],
    best_pass: usize,
    /// Losses as bits: decimals would come back rounded, and a loss may be no number.
    best_loss: u64,
    history: Vec<[u64; 2]>,
}

impl Checkpoint {
    /// In this file, which is removed when the training has come to its end.
    pub fn new(file: impl Into<PathBuf>) -> Self {
        Self {
            file: file.into(),
            interval: INTERVAL,
            last: Instant::now(),
        }
    }

    /// State that was reached in a training with the same `key`, whose weights and optimizer
    /// `start` is. A file that cannot be read is no checkpoint: the training begins anew.
    pub(super) fn reached(&self, key: u64, start: Reached) -> Reached {
        let read = || {
            let bytes = fs::read(&self.file).ok()?;
            let (header, records) = parse(&bytes, key)?;
            let of = |predictor: &Predictor, bytes: &[u8]| -> std::result::Result<_, RecordError> {
                let record = ModuleRecord::from_bytes(Bytes::from_bytes_vec(bytes.to_vec()))?;
                predictor.clone().try_load_record(record)
            };
            let losses = |[training, validation]: [u64; 2]| Epoch {
                training: f64::from_bits(training),
                validation: f64::from_bits(validation),
            };
            let optimizer = start.optimizer.clone();
            Some(Reached {
                predictor: of(&start.predictor, records[0]).ok()?,
                best: (
                    f64::from_bits(header.best_loss),
                    header.best_pass,
                    of(&start.predictor, records[1]).ok()?,
                ),
                optimizer: optimizer
                    .from_bytes(Bytes::from_bytes_vec(records[2].to_vec()))
                    .ok()?,
                history: header.history.into_iter().map(losses).collect(),
            })
        };
        read().unwrap_or(start)
    }

    /// Writes down what was reached, if the last time is long enough ago.
    ///
    /// # Errors
    /// The file cannot be written.
    pub(super) fn save(&mut self, key: u64, reached: &Reached) -> Result<()> {
        if self.last.elapsed() < self.interval {
            return Ok(());
        }
        let records = [
            reached.predictor.clone().into_record().into_bytes(),
            reached.best.2.clone().into_record().into_bytes(),
            reached.optimizer.into_bytes(),
        ];
        // What burn cannot write is no reason to lose the training that it is for.
        let Ok(records) = records
            .into_iter()
            .collect::<std::result::Result<Vec<_>, _>>()
        else {
            return Ok(());
        };
        let body: Vec<u8> = records.iter().flat_map(|record| record.to_vec()).collect();
        let header = Header {
            format: FORMAT.into(),
            key,
            checksum: hash(&body),
            lengths: [records[0].len(), records[1].len(), records[2].len()],
            best_pass: reached.best.1,
            best_loss: reached.best.0.to_bits(),
            history: (reached.history.iter())
                .map(|losses| [losses.training.to_bits(), losses.validation.to_bits()])
                .collect(),
        };
        let mut bytes = serde_json::to_vec(&header).map_err(|e| {
            sinew_ident::error::Error::failed(format!("{}: {e}", self.file.display()))
        })?;
        bytes.push(b'\n');
        bytes.extend(body);
        sinew_files::write(&self.file, bytes)?;
        self.last = Instant::now();
        Ok(())
    }

    /// The training has come to its end.
    pub(super) fn done(&self) {
        // There is none where the training was shorter than a look at the clock.
        let _ = fs::remove_file(&self.file);
    }
}

/// The header and the three records, if they are whole and of this training.
fn parse(bytes: &[u8], key: u64) -> Option<(Header, [&[u8]; 3])> {
    let end = bytes.iter().position(|byte| *byte == b'\n')?;
    let header: Header = serde_json::from_slice(&bytes[..end]).ok()?;
    let body = &bytes[end + 1..];
    let ours = header.format == FORMAT && header.key == key && header.checksum == hash(body);
    let [first, second, third] = header.lengths;
    let (one, rest) = body.split_at_checked(first)?;
    let (two, three) = rest.split_at_checked(second)?;
    (ours && three.len() == third).then_some((header, [one, two, three]))
}

/// Key of a training: its options, its numbers, and the program that made them.
pub(super) fn key(options: &Options, numbers: [&DMatrix<f64>; 2]) -> u64 {
    let mut hasher = DefaultHasher::new();
    env!("CARGO_PKG_VERSION").hash(&mut hasher);
    format!("{options:?}").hash(&mut hasher);
    for matrix in numbers {
        matrix.shape().hash(&mut hasher);
        for number in matrix.iter() {
            number.to_bits().hash(&mut hasher);
        }
    }
    hasher.finish()
}

fn hash(bytes: &[u8]) -> u64 {
    let mut hasher = DefaultHasher::new();
    bytes.hash(&mut hasher);
    hasher.finish()
}

#[cfg(test)]
mod tests {
    use crate::network_table::FirstLayer;

    use super::*;
    use crate::dataset::Sensitivity;
    use crate::train::{Scaled, Shape, Trained, train};

    const SHAPE: Shape = Shape {
        n_u: 1,
        n_y: 1,
        past_inputs: 1,
        past_outputs: 2,
        n_s: 0,
    };

    fn episode(phase: f64) -> Scaled {
        let wave = |k: usize, rate: f64| 0.6 * (rate * k as f64 + phase).sin();
        let y: Vec<f64> = (0..=80).map(|k| wave(k, 0.31) * wave(k, 0.07)).collect();
        Scaled {
            u: (0..80).map(|k| wave(k, 0.53)).collect(),
            measured: y.clone(),
            y,
            channels: Vec::new(),
            sensitivities: vec![Sensitivity {
                from: 40,
                along: vec![1.0],
                of: vec![0.1, 0.2, 0.3],
            }],
            steps: 80,
        }
    }

    /// The training, the first pass that it made, and the checkpoint after the second.
    fn trained(options: &Options, file: &std::path::Path) -> (Trained, usize, Vec<u8>) {
        let mut checkpoint = Checkpoint {
            interval: Duration::ZERO,
            ..Checkpoint::new(file)
        };
        let (mut first, mut after_two) = (0, Vec::new());
        let outcome = train(
            SHAPE,
            &[episode(0.2), episode(1.1)],
            &[episode(2.3)],
            options,
            Some(&mut checkpoint),
            |done, _, _| {
                first = if first == 0 { done } else { first };
                if done == 2 {
                    after_two =
                        fs::read(file).expect("the checkpoint was written after every pass");
                }
            },
        );
        (outcome.expect("the training converges"), first, after_two)
    }

    #[test]
    fn a_training_that_was_stopped_ends_with_the_same_weights() {
        let folder = tempfile::tempdir().expect("a temporary folder can be made");
        let file = folder.path().join("deeper/training.checkpoint");
        for (layer, derivative_weight) in [
            (FirstLayer::Tanh, 0.0),
            (FirstLayer::Tanh, 1.0),
            (FirstLayer::Gru, 0.0),
            (FirstLayer::Lstm, 0.0),
        ] {
            let options = Options {
                first: layer,
                derivative_weight,
                hidden: vec![4],
                rollout: 3,
                epochs: 5,
                batches: 3,
                batch: 16,
                ..Options::default()
            };
            let (whole, first, after_two) = trained(&options, &file);
            assert_eq!(first, 1);
            assert!(!file.exists(), "it has come to its end");

            fs::write(&file, &after_two).expect("the folder is writable");
            let (resumed, first, _) = trained(&options, &file);
            assert_eq!(first, 3, "{layer:?}");
            assert_eq!(resumed.folded, whole.folded, "{layer:?}");
            let losses = |trained: &Trained| format!("{:?} {}", trained.history, trained.kept);
            assert_eq!(losses(&resumed), losses(&whole));
        }
    }

    #[test]
    fn a_checkpoint_of_other_options_or_with_a_wrong_byte_is_none() {
        let folder = tempfile::tempdir().expect("a temporary folder can be made");
        let file = folder.path().join("training.checkpoint");
        let options = Options {
            hidden: vec![3],
            rollout: 2,
            epochs: 3,
            batches: 2,
            batch: 8,
            ..Options::default()
        };
        let (_, _, bytes) = trained(&options, &file);
        let begins = |bytes: &[u8], options: &Options| {
            fs::write(&file, bytes).expect("the folder is writable");
            trained(options, &file).1
        };
        assert_eq!(begins(&bytes, &options), 3);
        let other = Options {
            seed: 1 + options.seed,
            ..options.clone()
        };
        assert_eq!(begins(&bytes, &other), 1);
        for at in [0, bytes.len() / 2, bytes.len() - 1] {
            let mut wrong = bytes.clone();
            wrong[at] ^= 0x10;
            assert_eq!(begins(&wrong, &options), 1, "byte {at}");
        }
        for length in [0, 1, bytes.len() / 3, bytes.len() - 1] {
            assert_eq!(begins(&bytes[..length], &options), 1, "{length} bytes");
        }
    }
}

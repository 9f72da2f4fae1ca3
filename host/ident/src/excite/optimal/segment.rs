//! Segments: short experiments of one shape, of which a design is put together.

use std::path::Path;

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use sinew_sim::Plant;

use crate::error::Result;
use crate::excite::{Experiment, Kind, Options, bounds_of, signal};

/// Units of time in a design; a segment takes one or more.
pub(super) const UNITS: usize = 8;
/// Lengths of the segments of the library, in units.
const LENGTHS: [usize; 2] = [1, 2];
/// Middle and half of the part of the range that a segment uses, both in halves of the range.
const PARTS: [(f64, f64); 5] = [(0.0, 1.0), (0.0, 0.5), (0.0, 0.2), (0.5, 0.5), (-0.5, 0.5)];
/// Parts that are tried with one input alone.
const ALONE: usize = 2;
/// Factor by which a neighbour's size or band differs, at most.
const NEAR: f64 = 1.6;
/// Furthest move of the middle of a neighbour's part of the range.
const MOVED: f64 = 0.3;
/// Smallest half of the range that a segment uses.
const SMALLEST: f64 = 0.05;
/// Lowest frequency whose period fits twice into a segment, and the band's upper end beside it.
const PERIODS: f64 = 2.0;

/// One shape, its band, the part of the range that it uses and the inputs that act.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Segment {
    kind: Kind,
    /// Only the sign of the shape counts: the input is at either end of its part of the range.
    two_level: bool,
    /// Hz.
    band: [f64; 2],
    /// Middle of the part of the range, -1 to 1.
    middle: f64,
    /// Half of the part of the range, up to 1.
    half: f64,
    /// The only input that acts; all where there is none.
    alone: Option<usize>,
    seed: u64,
    /// Units of time.
    pub(super) length: usize,
}

impl Segment {
    /// A family as a design of one segment, as [`crate::excite::design`] makes it.
    pub(super) fn family(kind: Kind, options: &Options) -> Self {
        Self {
            kind,
            two_level: false,
            band: options.band(),
            middle: 0.0,
            half: 1.0,
            alone: None,
            seed: options.seed,
            length: UNITS,
        }
    }

    /// The library: every family in low, high and whole bands, on several parts of the range, with
    /// all inputs and with each alone, in every length.
    pub(super) fn library(options: &Options, inputs: usize) -> Vec<Self> {
        let of = |length: &usize| Self::of_length(*length, options, inputs);
        LENGTHS.iter().flat_map(of).collect()
    }

    fn of_length(length: usize, options: &Options, inputs: usize) -> Vec<Self> {
        let low = PERIODS * (UNITS as f64 / length as f64) / options.seconds;
        let high = options
            .band_hz
            .map_or(options.rate_hz / 12.0, |[_, high]| high);
        let high = high.max(2.0 * low);
        let split = (low * high).sqrt();
        let shapes = [
            (Kind::Triangle, false, [low, high]),
            (Kind::Steps, false, [low, split]),
            (Kind::Steps, true, [low, high]),
            (Kind::Chirp, false, [low, high]),
            (Kind::Chirp, true, [low, high]),
            (Kind::Multisine, false, [low, split]),
            (Kind::Multisine, true, [low, split]),
            (Kind::Multisine, false, [split, high]),
        ];
        let alone = if inputs > 1 { inputs } else { 0 };
        let acting = std::iter::once((None, PARTS.len()))
            .chain((0..alone).map(|input| (Some(input), ALONE)));
        let mut library = Vec::new();
        for (alone, parts) in acting {
            for &(middle, half) in &PARTS[..parts] {
                for (kind, two_level, band) in shapes {
                    library.push(Self {
                        kind,
                        two_level,
                        band,
                        middle,
                        half,
                        alone,
                        seed: options.seed,
                        length,
                    });
                }
            }
        }
        library
    }

    /// The same with another length, in units.
    pub(super) fn with_length(self, length: usize) -> Self {
        Self { length, ..self }
    }

    /// A segment near this one: another band, another part of the range, or another draw.
    pub(super) fn neighbour(&self, options: &Options, random: &mut ChaCha8Rng) -> Self {
        let seed = random.random();
        let mut factor = || NEAR.powf(random.random_range(-1.0..1.0));
        let (size, edges) = (factor(), self.band.map(|f| f * factor()));
        let moved = self.middle + MOVED * random.random_range(-1.0..1.0);
        match random.random_range(0..4u8) {
            0 => {
                let highest = options.rate_hz / 4.0;
                let low = edges[0].min(0.5 * highest);
                let band = [low, edges[1].clamp(2.0 * low, highest)];
                Self { band, ..*self }
            }
            1 => {
                let half = (self.half * size).clamp(SMALLEST, 1.0);
                let room = 1.0 - half;
                let middle = moved.clamp(-room, room);
                Self {
                    half,
                    middle,
                    ..*self
                }
            }
            2 => Self {
                two_level: !self.two_level,
                ..*self
            },
            _ => Self { seed, ..*self },
        }
    }

    /// Normalised signal of one input at times from the segment's start; `rest` is the normalised
    /// zero of that input.
    fn signal(&self, t: &[f64], seconds: f64, options: &Options, at: Place) -> Vec<f64> {
        if self.alone.is_some_and(|input| input != at.index) {
            return vec![at.rest; t.len()];
        }
        let own = Options {
            kind: self.kind,
            seconds,
            ..*options
        };
        let mut random = ChaCha8Rng::seed_from_u64(self.seed);
        random.set_stream(at.index as u64);
        // One input alone has all the time and all the frequencies.
        let among = if self.alone.is_some() {
            (0, 1)
        } else {
            (at.index, at.count)
        };
        let signal = signal::shape(&own, self.band, t, among, &mut random);
        signal.iter().map(|w| self.middle + self.half * w).collect()
    }
}

/// An input among all.
#[derive(Clone, Copy)]
struct Place {
    index: usize,
    count: usize,
    /// Normalised zero.
    rest: f64,
}

/// Segments one after another, inside the limits of every actuator; `seconds` in all.
///
/// # Errors
/// `File`, with the actuator's line, where an input has no limit.
pub(super) fn assemble(
    plant: &Plant,
    file: &Path,
    (options, seconds): (&Options, f64),
    segments: &[Segment],
) -> Result<Experiment> {
    let rows = (seconds * options.rate_hz).round() as usize + 1;
    let t: Vec<f64> = (0..rows).map(|k| k as f64 / options.rate_hz).collect();
    let units: usize = segments.iter().map(|segment| segment.length).sum();
    let count = plant.inputs().len();
    let inputs = plant.inputs().iter().enumerate().map(|(index, input)| {
        let bounds = bounds_of(input, file, options.amplitude)?;
        let at = Place {
            index,
            count,
            rest: bounds.normalised_zero(),
        };
        let mut signal = Vec::with_capacity(rows);
        let mut taken = 0;
        for segment in segments {
            taken += segment.length;
            let own = &t[signal.len()..(rows * taken).div_ceil(units).min(rows)];
            let local: Vec<f64> = own.iter().map(|now| now - own[0]).collect();
            let length = own.len() as f64 / options.rate_hz;
            signal.extend(segment.signal(&local, length, options, at));
        }
        Ok(bounds.keep(&t, &signal))
    });
    Ok(Experiment {
        inputs: inputs.collect::<Result<_>>()?,
        t,
    })
}

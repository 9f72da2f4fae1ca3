//! Shapes of excitation between -1 and 1 (docs/explanation/experiments.md, eq. 1 to 4).

use rand::Rng;
use rand_chacha::ChaCha8Rng;

use super::{Kind, Options};

/// Fraction at rest before anything happens, as a part of the experiment: its start is seen.
const STILL: f64 = 0.02;
/// Most sines in a multisine.
const SINES: usize = 40;

/// The normalised signal, in -1 to 1, of input `index` of `count` at every time.
pub(super) fn shape(
    options: &Options,
    band: [f64; 2],
    t: &[f64],
    (index, count): (usize, usize),
    random: &mut ChaCha8Rng,
) -> Vec<f64> {
    let end = options.seconds;
    let begin = STILL * end;
    let parts: &[Kind] = match options.kind {
        Kind::Mixed => &[Kind::Triangle, Kind::Steps, Kind::Chirp, Kind::Multisine],
        ref one => std::slice::from_ref(one),
    };
    let each = (end - begin) / parts.len() as f64;
    let mut signal = vec![0.0; t.len()];
    for (part, kind) in parts.iter().enumerate() {
        let from = begin + part as f64 * each;
        let mut own = part_of(*kind, each, band, (index, count), random);
        for (signal, &t) in signal.iter_mut().zip(t) {
            // The last part goes on to the last row.
            let inside = t >= from && (t < from + each || part + 1 == parts.len());
            if inside {
                *signal = own(t - from);
            }
        }
    }
    signal
}

type Wave = Box<dyn FnMut(f64) -> f64>;

fn part_of(
    kind: Kind,
    seconds: f64,
    [low, high]: [f64; 2],
    (index, count): (usize, usize),
    random: &mut ChaCha8Rng,
) -> Wave {
    match kind {
        Kind::Multisine => multisine(seconds, [low, high], (index, count), random),
        Kind::Steps => steps(seconds, [low, high], random),
        Kind::Triangle => triangle(seconds, index),
        Kind::Chirp => chirp(seconds, [low, high], (index, count)),
        // A mixture of mixtures: `shape` has cut it up already.
        Kind::Mixed => Box::new(|_| 0.0),
    }
}

/// Sines at whole multiples of `1 / seconds`, evenly spread on a logarithmic scale and dealt out to
/// the inputs in turn, so that no two share one; amplitudes as `f^-1/2`, phases at random (eq. 1).
fn multisine(
    seconds: f64,
    [low, high]: [f64; 2],
    (index, count): (usize, usize),
    random: &mut ChaCha8Rng,
) -> Wave {
    let total = SINES * count;
    let mut multiples: Vec<u64> = (0..total)
        .map(|k| {
            let share = k as f64 / (total - 1).max(1) as f64;
            ((low * (high / low).powf(share)) * seconds)
                .round()
                .max(1.0) as u64
        })
        .collect();
    multiples.dedup();
    let own = multiples.into_iter().skip(index).step_by(count);
    let sines: Vec<(f64, f64, f64)> = own
        .map(|m| {
            let f = m as f64 / seconds;
            let phase = random.random_range(0.0..std::f64::consts::TAU);
            (std::f64::consts::TAU * f, f.sqrt().recip(), phase)
        })
        .collect();
    let at = move |t: f64| {
        sines
            .iter()
            .map(|(w, a, phase)| a * (w * t + phase).sin())
            .sum::<f64>()
    };
    // Its largest value, on a grid that is fine for its highest frequency, becomes 1.
    let grid = (seconds * high * 8.0).ceil().clamp(64.0, 1e6) as usize;
    let largest = (0..grid)
        .map(|k| at(seconds * k as f64 / grid as f64).abs())
        .fold(f64::MIN_POSITIVE, f64::max);
    Box::new(move |t| (at(t) / largest).clamp(-1.0, 1.0))
}

/// Levels drawn evenly from -1 to 1, every fourth one an end of the range, held for times drawn
/// evenly on a logarithmic scale: from a quarter period of the highest frequency to a sixth of the
/// part (eq. 2).
fn steps(seconds: f64, [_, high]: [f64; 2], random: &mut ChaCha8Rng) -> Wave {
    let shortest = (0.25 / high).min(seconds / 12.0);
    let longest = (seconds / 6.0).min(40.0 * shortest).max(shortest * 2.0);
    let mut edges = Vec::new();
    let mut t = 0.0;
    while t < seconds {
        let level: f64 = match edges.len() % 4 {
            0 => f64::from(random.random_range(0..2u8)) * 2.0 - 1.0,
            _ => random.random_range(-1.0..1.0),
        };
        edges.push((t, level));
        t += shortest * (longest / shortest).powf(random.random_range(0.0..1.0));
    }
    Box::new(move |t| {
        let next = edges.partition_point(|&(edge, _)| edge <= t);
        edges[next.saturating_sub(1)].1
    })
}

/// Triangles of 1/4, 1/2 and 1 of the range for a third of the part each; a pair of inputs a
/// quarter period apart, the next pair with one period more, so that no two move as one (eq. 3).
fn triangle(seconds: f64, index: usize) -> Wave {
    let stage = seconds / 3.0;
    let (periods, late) = ((index / 2 + 1) as f64, 0.25 * (index % 2) as f64);
    Box::new(move |t| {
        let size = [0.25, 0.5, 1.0][((t / stage) as usize).min(2)];
        let turn = (periods * t / stage - late).rem_euclid(1.0);
        // 0 at 0, 1 at a quarter, -1 at three quarters.
        let wave = 1.0 - 4.0 * ((turn + 0.25).rem_euclid(1.0) - 0.5).abs();
        size * wave
    })
}

/// A sine whose frequency rises from the lowest to the highest, by the same factor in equal times;
/// inputs sweep one after another (eq. 4).
fn chirp(seconds: f64, [low, high]: [f64; 2], (index, count): (usize, usize)) -> Wave {
    let own = seconds / count as f64;
    let (from, low) = (own * index as f64, low.max(1.0 / own).min(0.5 * high));
    let growth = (high / low).ln();
    Box::new(move |t| {
        let share = (t - from) / own;
        if !(0.0..=1.0).contains(&share) {
            return 0.0;
        }
        let turns = low * own * ((growth * share).exp() - 1.0) / growth;
        (std::f64::consts::TAU * turns).sin()
    })
}

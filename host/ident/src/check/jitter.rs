//! Samples taken at uneven times under even stamps: a delay that jitters.

use sinew_sim::unit::of_column;

use super::finding::{Check, number};
use super::series::quantile;
use crate::noise::scaled_difference;
use crate::recording::Recording;

/// Orders of the differences that show noise without motion. A delay that jitters looks alike in
/// both; motion that leaks through does not.
const ORDERS: [usize; 2] = [5, 7];

/// Agreement of the two, as a ratio.
const ALIKE: f64 = 1.5;

/// Fewest differences that tell.
const FEWEST: usize = 200;

/// Differences of a long recording that are looked at, evenly spread over it.
const LOOKED_AT: usize = 20_000;

/// Noise that the usual speed adds, in squares of the noise at rest, from which on it is said.
const WORTH: f64 = 3.0;

/// Deviations by which the slope is away from zero: independent differences are counted.
const SURE: f64 = 1.5;

/// Growth of the noise between the slower half of the motion and the fastest eighth, in squares: a
/// rounding grows no further once every sample is another step.
const GROWS: f64 = 4.0;

/// Noise that speed adds, in resolutions of the column: less may be its rounding.
const STEPS: f64 = 1.0;

/// `jittering_delay`: a position scatters about a smooth motion by its speed times a time. A force
/// or a supply may well be noisier where it changes.
pub(super) fn detect(recording: &Recording, name: &str, values: &[f64]) -> Option<Check> {
    if !matches!(of_column(name), "m" | "mm" | "um" | "rad" | "deg") {
        return None;
    }
    let [coarse, fine] = ORDERS.map(|order| Scatter::of(recording.t(), values, order));
    let (coarse, fine) = (coarse?, fine?);
    let ratio = coarse.slope / fine.slope;
    if !(ALIKE.recip()..ALIKE).contains(&ratio) {
        return None;
    }
    let jitter = fine.slope.sqrt();
    let added = jitter * fine.speed;
    let surely = [&coarse, &fine].iter().all(|s| s.surely_grows());
    let fine_enough = added > STEPS * resolution(values);
    if !surely || !fine_enough {
        return None;
    }
    let sentence = format!(
        "{name} scatters more the faster it moves: by {} at rest and {} at its usual speed, as samples \
         taken {} s early or late would (root mean square)",
        number(fine.rest.max(0.0).sqrt()),
        number((fine.rest.max(0.0) + added * added).sqrt()),
        number(jitter)
    );
    let remedy = "sample by a timer, or record the time at which each sample was taken";
    Some(Check::likely(
        recording,
        0,
        "jittering_delay",
        sentence,
        remedy,
    ))
}

/// Squares of the differences of one order, regressed on the squares of the speed.
struct Scatter {
    /// Noise at rest, squared.
    rest: f64,
    /// Time by which samples are early or late, squared; s².
    slope: f64,
    /// Root mean square of the speed.
    speed: f64,
    /// The slope in its standard deviations.
    sure: f64,
    /// Squares in the fastest eighth over those of the slower half.
    growth: f64,
    /// The part of the scatter of the squares that the speed takes is more than the position's.
    by_speed: bool,
}

impl Scatter {
    /// `None` of too few whole stretches, or where nothing moves.
    fn of(t: &[f64], values: &[f64], order: usize) -> Option<Self> {
        let usual = quantile(t.windows(2).map(|pair| pair[1] - pair[0]), 0.5);
        let mut rows: Vec<[f64; 3]> = Vec::new();
        let every = t.len().div_ceil(LOOKED_AT).max(1);
        let windows = t.windows(order + 1).zip(values.windows(order + 1));
        for (t, y) in windows.step_by(every) {
            let whole = t[order] - t[0] < 1.5 * usual * order as f64;
            if whole && y.iter().all(|y| y.is_finite()) {
                let difference = scaled_difference(t, y);
                let speed = slope(t, y);
                let mean = y.iter().sum::<f64>() / y.len() as f64;
                rows.push([difference * difference, speed * speed, mean]);
            }
        }
        if rows.len() < FEWEST {
            return None;
        }
        let count = rows.len() as f64;
        let middle = rows.iter().map(|row| row[2]).sum::<f64>() / count;
        let squares: Vec<f64> = rows.iter().map(|row| row[0]).collect();
        let speeds: Vec<f64> = rows.iter().map(|row| row[1]).collect();
        let places: Vec<f64> = rows.iter().map(|row| (row[2] - middle).powi(2)).collect();
        let line = Line::through(&speeds, &squares)?;
        let by_place = Line::through(&places, &squares);
        let half = quantile(speeds.iter().copied(), 0.5);
        let fast = quantile(speeds.iter().copied(), 0.875);
        let mean_of = |chosen: &dyn Fn(f64) -> bool| {
            let of = speeds
                .iter()
                .zip(&squares)
                .filter(|(speed, _)| chosen(**speed));
            let of: Vec<f64> = of.map(|(_, square)| *square).collect();
            of.iter().sum::<f64>() / of.len().max(1) as f64
        };
        Some(Self {
            rest: line.at_zero,
            slope: line.slope.max(0.0),
            speed: (speeds.iter().sum::<f64>() / count).sqrt(),
            // Neighbouring differences share all samples but one.
            sure: line.sure / ((order + 1) as f64).sqrt(),
            growth: mean_of(&|speed| speed >= fast) / mean_of(&|speed| speed <= half),
            by_speed: by_place.is_none_or(|place| place.sure < line.sure),
        })
    }

    fn surely_grows(&self) -> bool {
        let added = self.slope * self.speed * self.speed;
        self.sure > SURE
            && self.growth > GROWS
            && self.by_speed
            && added > WORTH * self.rest.max(0.0)
    }
}

/// A straight line through squares.
struct Line {
    at_zero: f64,
    slope: f64,
    sure: f64,
}

impl Line {
    fn through(x: &[f64], y: &[f64]) -> Option<Self> {
        let count = x.len() as f64;
        let (mx, my) = (x.iter().sum::<f64>() / count, y.iter().sum::<f64>() / count);
        let sxx: f64 = x.iter().map(|x| (x - mx).powi(2)).sum();
        let sxy: f64 = x.iter().zip(y).map(|(x, y)| (x - mx) * (y - my)).sum();
        if sxx <= 0.0 {
            return None;
        }
        let slope = sxy / sxx;
        let left = |x: &f64, y: &f64| (y - my - slope * (x - mx)).powi(2);
        // Squares scatter as much as they are large: each row brings its own.
        let spread = x.iter().zip(y).map(|(x, y)| (x - mx).powi(2) * left(x, y));
        let deviation = spread.sum::<f64>().sqrt() / sxx;
        Some(Self {
            at_zero: my - slope * mx,
            slope,
            sure: slope / deviation.max(f64::MIN_POSITIVE),
        })
    }
}

/// Slope of a straight line through some samples.
fn slope(t: &[f64], y: &[f64]) -> f64 {
    let count = t.len() as f64;
    let (mt, my) = (t.iter().sum::<f64>() / count, y.iter().sum::<f64>() / count);
    let over: f64 = t.iter().zip(y).map(|(t, y)| (t - mt) * (y - my)).sum();
    over / t.iter().map(|t| (t - mt).powi(2)).sum::<f64>()
}

/// Smallest step between two different values of a column.
fn resolution(values: &[f64]) -> f64 {
    let mut sorted: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let steps = sorted.windows(2).map(|pair| pair[1] - pair[0]);
    let least = steps
        .filter(|step| *step > 0.0)
        .fold(f64::INFINITY, f64::min);
    if least.is_finite() { least } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    use super::*;
    use crate::noise::gaussian;

    /// A motion of two frequencies; noise, times of a jitter, and a column's steps.
    fn recorded(noise: f64, jitter: f64, step: f64) -> Recording {
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let mut text = "t,q_m\n".to_owned();
        for k in 0..1500 {
            let t = 0.005 * f64::from(k);
            let at = t + jitter * gaussian(&mut random);
            let still = (t > 3.0).then_some(3.0).filter(|_| t < 4.0).unwrap_or(at);
            let mut q = 0.1 * (4.0 * still).sin() + 0.03 * (11.0 * still).sin();
            q += noise * gaussian(&mut random);
            if step > 0.0 {
                q = (q / step).round() * step;
            }
            text += &format!("{t:.6},{q:.9}\n");
        }
        Recording::parse(text.as_bytes(), "a.csv").expect("a recording")
    }

    fn found(recording: &Recording) -> Option<Check> {
        detect(
            recording,
            "q_m",
            recording.column("q_m").expect("it has one"),
        )
    }

    #[test]
    fn a_delay_that_jitters_is_named_with_its_time() {
        let check = found(&recorded(1e-4, 1e-3, 0.0)).expect("it jitters");
        assert_eq!((check.kind, check.certain), ("jittering_delay", false));
        let said = check.sentence.split("taken ").nth(1).expect("a time");
        let time: f64 = said
            .split(' ')
            .next()
            .and_then(|n| n.parse().ok())
            .expect("s");
        assert!((time / 1e-3 - 1.0).abs() < 0.2, "{}", check.sentence);
    }

    #[test]
    fn noise_alone_small_jitter_and_an_encoder_are_not() {
        assert!(found(&recorded(1e-3, 0.0, 0.0)).is_none());
        assert!(found(&recorded(1e-3, 3e-4, 0.0)).is_none());
        assert!(found(&recorded(0.0, 0.0, 2e-3)).is_none());
        assert!(found(&recorded(0.0, 0.0, 0.0)).is_none());
    }

    #[test]
    fn noise_that_grows_with_the_reading_is_not() {
        let mut random = ChaCha8Rng::seed_from_u64(3);
        let rows: String = (0..1500)
            .map(|k| {
                let t = 0.005 * f64::from(k);
                let q = 0.1 * (4.0 * t).sin();
                format!("{t:.6},{:.9}\n", q * (1.0 + 0.05 * gaussian(&mut random)))
            })
            .collect();
        let recording = Recording::parse(format!("t,q_m\n{rows}").as_bytes(), "a.csv");
        assert!(found(&recording.expect("a recording")).is_none());
    }
}

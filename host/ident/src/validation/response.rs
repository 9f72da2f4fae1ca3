//! Frequency responses by Welch's averages (docs/explanation/identification.md, eq. 14d and 14e).

use nalgebra::{Complex, DMatrix};

/// Frequencies at most; they lie at equal ratios.
const FREQUENCIES: usize = 100;
/// Fewest rows of a segment.
const SHORTEST: usize = 32;
/// Segments of all rows, before they overlap by half.
const SEGMENTS: usize = 5;
/// Smallest power of the inputs, as a part of the largest, that drives a response.
const DRIVEN: f64 = 1e-6;

/// Uniform samples of one recording.
#[derive(Debug, Clone)]
pub struct Block {
    /// Inputs.
    pub inputs: Vec<Vec<f64>>,
    /// Output.
    pub output: Vec<f64>,
}

/// Response of an output to each input.
#[derive(Debug, Clone)]
pub struct Response {
    /// Hz.
    pub frequency: Vec<f64>,
    /// By input, then by frequency: output over input; zero of an input that does not move.
    pub gain: Vec<Vec<Complex<f64>>>,
    /// Part of the output's power that the inputs explain linearly, 0 to 1.
    pub coherence: Vec<f64>,
}

/// Estimates the response over recordings with samples `dt` seconds apart. `None` where they are
/// too short, or where no input moves.
pub fn response(dt: f64, blocks: &[Block]) -> Option<Response> {
    let inputs = blocks.first()?.inputs.len();
    let moving: Vec<usize> = (0..inputs)
        .filter(|&i| {
            let mut all = blocks.iter().flat_map(|b| &b.inputs[i]);
            let first = all.next().copied();
            all.any(|v| Some(*v) != first)
        })
        .collect();
    let rows: usize = blocks.iter().map(|b| b.output.len()).sum();
    let longest = blocks.iter().map(|b| b.output.len()).max()?;
    let length = longest.min(rows / (SEGMENTS + 2 * moving.len()));
    if moving.is_empty() || length < SHORTEST || dt.is_nan() || dt <= 0.0 {
        return None;
    }
    let segments: Vec<(&Block, usize)> = blocks
        .iter()
        .flat_map(|block| {
            let last = (block.output.len() + 1).saturating_sub(length);
            (0..last).step_by(length / 2).map(move |from| (block, from))
        })
        .collect();
    // With fewer the inputs would explain anything.
    if segments.len() < 2 * moving.len() + 2 {
        return None;
    }
    let mut found = Response {
        frequency: Vec::new(),
        gain: vec![Vec::new(); inputs],
        coherence: Vec::new(),
    };
    let spectra: Vec<(usize, Spectra)> = bins(length)
        .into_iter()
        .map(|bin| (bin, Spectra::of(&segments, &moving, length, bin)))
        .collect();
    let most = spectra.iter().map(|(_, s)| s.driving()).fold(0.0, f64::max);
    for (bin, spectra) in spectra {
        if spectra.driving() <= DRIVEN * most {
            continue;
        }
        let Some((gain, coherence)) = spectra.solve() else {
            continue;
        };
        found.frequency.push(bin as f64 / (length as f64 * dt));
        found.coherence.push(coherence);
        for (i, of) in found.gain.iter_mut().enumerate() {
            let at = moving.iter().position(|&input| input == i);
            of.push(at.map_or(Complex::new(0.0, 0.0), |at| gain[at]));
        }
    }
    (!found.frequency.is_empty()).then_some(found)
}

/// Bins of a segment's spectrum, at about equal ratios, below half the sampling rate.
fn bins(length: usize) -> Vec<usize> {
    let last = (length / 2).saturating_sub(1).max(1);
    let mut all: Vec<usize> = (0..FREQUENCIES)
        .map(|k| {
            let part = k as f64 / (FREQUENCIES - 1) as f64;
            (last as f64).powf(part).round() as usize
        })
        .collect();
    all.dedup();
    all
}

/// Power spectra of inputs and output at one frequency, summed over segments.
struct Spectra {
    inputs: DMatrix<Complex<f64>>,
    cross: DMatrix<Complex<f64>>,
    output: f64,
}

impl Spectra {
    fn of(segments: &[(&Block, usize)], moving: &[usize], length: usize, bin: usize) -> Self {
        let count = moving.len();
        let mut all = Self {
            inputs: DMatrix::zeros(count, count),
            cross: DMatrix::zeros(1, count),
            output: 0.0,
        };
        for (block, from) in segments {
            let part = |column: &[f64]| transform(&column[*from..from + length], bin);
            let u: Vec<Complex<f64>> = moving.iter().map(|&i| part(&block.inputs[i])).collect();
            let y = part(&block.output);
            all.output += y.norm_sqr();
            for i in 0..count {
                all.cross[(0, i)] += y * u[i].conj();
                for j in 0..count {
                    all.inputs[(i, j)] += u[i] * u[j].conj();
                }
            }
        }
        all
    }

    fn driving(&self) -> f64 {
        self.inputs.diagonal().iter().map(|v| v.re).sum()
    }

    /// Response to each input, and coherence.
    fn solve(&self) -> Option<(Vec<Complex<f64>>, f64)> {
        // H S_uu = S_yu.
        let solved = self
            .inputs
            .transpose()
            .lu()
            .solve(&self.cross.transpose())?;
        let explained: Complex<f64> = (solved.iter().zip(self.cross.iter()))
            .map(|(gain, cross)| gain * cross.conj())
            .sum();
        let coherence = (explained.re / self.output).clamp(0.0, 1.0);
        let finite = solved.iter().all(|v| v.re.is_finite() && v.im.is_finite());
        (finite && coherence.is_finite()).then(|| (solved.iter().copied().collect(), coherence))
    }
}

/// One bin of the discrete Fourier transform of a segment without its mean, under Hann's window.
fn transform(segment: &[f64], bin: usize) -> Complex<f64> {
    let length = segment.len() as f64;
    let mean = segment.iter().sum::<f64>() / length;
    let turn = std::f64::consts::TAU / length;
    let (step, of_window) = (
        Complex::from_polar(1.0, -turn * bin as f64),
        Complex::from_polar(1.0, turn),
    );
    let (mut wave, mut window) = (Complex::new(1.0, 0.0), Complex::new(1.0, 0.0));
    let mut sum = Complex::new(0.0, 0.0);
    for value in segment {
        sum += wave * ((value - mean) * 0.5 * (1.0 - window.re));
        wave *= step;
        window *= of_window;
    }
    sum
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;
    use crate::noise::gaussian;

    fn noise(rows: usize, seed: u64) -> Vec<f64> {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        (0..rows).map(|_| gaussian(&mut random)).collect()
    }

    /// y(k) = pole y(k-1) + factor u(k-1).
    fn filtered(input: &[f64], pole: f64, factor: f64) -> Vec<f64> {
        let mut y = 0.0;
        let mut all = vec![0.0];
        for u in &input[..input.len() - 1] {
            y = pole * y + factor * u;
            all.push(y);
        }
        all
    }

    fn truth(frequency: f64, dt: f64, pole: f64, factor: f64) -> Complex<f64> {
        let z = Complex::from_polar(1.0, std::f64::consts::TAU * frequency * dt);
        Complex::new(factor, 0.0) / (z - pole)
    }

    #[test]
    fn a_filter_has_the_gain_and_phase_of_its_formula() {
        let input = noise(8000, 1);
        let block = Block {
            output: filtered(&input, 0.9, 0.2),
            inputs: vec![input],
        };
        let found = response(0.01, &[block]).unwrap();
        assert!(found.frequency.len() > 40);
        for (k, frequency) in found.frequency.iter().enumerate().skip(3) {
            let ratio = found.gain[0][k] / truth(*frequency, 0.01, 0.9, 0.2);
            assert!((ratio.norm() - 1.0).abs() < 0.05, "{frequency} Hz: {ratio}");
            assert!(ratio.arg().abs() < 0.05, "{frequency} Hz: {ratio}");
            assert!(found.coherence[k] > 0.98, "{}", found.coherence[k]);
        }
    }

    #[test]
    fn two_inputs_are_told_apart_and_a_still_one_has_none() {
        let (a, b) = (noise(20_000, 2), noise(20_000, 3));
        let sum = filtered(&a, 0.9, 0.2);
        let sum = sum.iter().zip(filtered(&b, 0.5, -1.0)).map(|(a, b)| a + b);
        let block = Block {
            output: sum.collect(),
            inputs: vec![a, b, vec![3.0; 20_000]],
        };
        let found = response(0.01, &[block]).unwrap();
        for (k, frequency) in found.frequency.iter().enumerate().skip(5) {
            let of_a = found.gain[0][k] / truth(*frequency, 0.01, 0.9, 0.2);
            let of_b = found.gain[1][k] / truth(*frequency, 0.01, 0.5, -1.0);
            assert!((of_b - 1.0).norm() < 0.15, "{frequency} Hz: {of_b}");
            // Above 10 Hz the second input is ten times as loud.
            assert!((of_a - 1.0).norm() < 0.8, "{frequency} Hz: {of_a}");
            assert_eq!(found.gain[2][k].norm(), 0.0);
        }
    }

    #[test]
    fn noise_lowers_the_coherence() {
        let input = noise(8000, 4);
        let output = filtered(&input, 0.9, 0.2);
        let noisy = output.iter().zip(noise(8000, 5)).map(|(y, n)| y + n);
        let block = Block {
            output: noisy.collect(),
            inputs: vec![input],
        };
        let found = response(0.01, &[block]).unwrap();
        let high = found.coherence.iter().rev().take(10).sum::<f64>() / 10.0;
        assert!(found.coherence[2] > 0.5 && high < 0.3, "{high}");
    }

    #[test]
    fn short_or_still_recordings_have_no_response() {
        let block = |rows: usize, input: f64| Block {
            inputs: vec![vec![input; rows]],
            output: noise(rows, 6),
        };
        assert!(response(0.01, &[block(5000, 1.0)]).is_none());
        assert!(response(0.01, &[]).is_none());
        let short = Block {
            inputs: vec![noise(60, 7)],
            output: noise(60, 8),
        };
        assert!(response(0.01, &[short]).is_none());
    }
}

//! Decision variables of a plan: knots of every input, inside limits and rate limits
//! (docs/explanation/planning.md, eq. 1).

use sinew_ident::error::{Error, Result};
use sinew_sim::Plant;
use std::path::Path;

/// Part of a limit that is kept clear, so that it holds exactly after a change of units.
const CLEARANCE: f64 = 1e-9;

/// Limits of one input, SI.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Limits {
    pub low: f64,
    pub high: f64,
    /// Largest change per second; infinite without a rate limit.
    pub rate: f64,
    /// Largest magnitude within the limits: the unit of the decision variables.
    pub size: f64,
    /// First row: zero, or the limit next to it.
    pub start: f64,
}

/// Rows of a plan and the knots between which its commands are straight.
#[derive(Clone, Debug)]
pub(crate) struct Layout {
    /// Time of each row, s.
    pub t: Vec<f64>,
    /// Row of each knot; the first is row 0, where the command is [`Limits::start`].
    rows: Vec<usize>,
    pub limits: Vec<Limits>,
}

impl Layout {
    /// Knots at equal distances, at most one a row.
    ///
    /// # Errors
    /// `File` where an input has no `limit`.
    pub fn new(plant: &Plant, file: &Path, t: Vec<f64>, knots: usize) -> Result<Self> {
        let last = t.len() - 1;
        let knots = knots.clamp(1, last);
        let rows = (0..=knots).map(|knot| (knot * last + knots / 2) / knots);
        let limits = plant.inputs().iter().map(|input| {
            let Some((low, high)) = input.limit else {
                let message = format!("actuator `{}` has no `limit`", input.actuator);
                return Err(Error::file(file, message)
                    .at(input.line, 1)
                    .expected("`limit = [lower, upper]`: what it may be driven with"));
            };
            let (middle, half) = ((low + high) / 2.0, (high - low) / 2.0 * (1.0 - CLEARANCE));
            let (low, high) = (middle - half, middle + half);
            Ok(Limits {
                low,
                high,
                rate: input.rate_limit.unwrap_or(f64::INFINITY) * (1.0 - CLEARANCE),
                size: low.abs().max(high.abs()).max(f64::MIN_POSITIVE),
                start: 0.0f64.clamp(low, high),
            })
        });
        Ok(Self {
            rows: rows.collect(),
            limits: limits.collect::<Result<_>>()?,
            t,
        })
    }

    /// Free knots of one input.
    pub fn knots(&self) -> usize {
        self.rows.len() - 1
    }

    /// Number of decision variables: knots of the first input, then of the second, and so on.
    pub fn variables(&self) -> usize {
        self.knots() * self.limits.len()
    }

    /// Largest change from the knot before to free knot `knot`, in units of the variables.
    pub fn change(&self, input: usize, knot: usize) -> f64 {
        let seconds = self.t[self.rows[knot + 1]] - self.t[self.rows[knot]];
        self.limits[input].rate * seconds / self.limits[input].size
    }

    /// Range of an input's variables.
    pub fn range(&self, input: usize) -> [f64; 2] {
        let limits = self.limits[input];
        [limits.low / limits.size, limits.high / limits.size]
    }

    /// Value of the fixed first knot, in units of the variables.
    pub fn origin(&self, input: usize) -> f64 {
        self.limits[input].start / self.limits[input].size
    }

    /// Brings variables inside all limits: each knot as near as the one before it allows.
    pub fn project(&self, x: &mut [f64]) {
        let knots = self.knots();
        for (input, x) in x.chunks_mut(knots).enumerate() {
            let [low, high] = self.range(input);
            let mut last = self.origin(input);
            for (knot, x) in x.iter_mut().enumerate() {
                let change = self.change(input, knot);
                *x = x.clamp(last - change, last + change).clamp(low, high);
                last = *x;
            }
        }
    }

    /// Variables at rest: every knot at its start.
    pub fn rest(&self) -> Vec<f64> {
        let inputs = 0..self.limits.len();
        inputs
            .flat_map(|input| vec![self.origin(input); self.knots()])
            .collect()
    }

    /// Left knot and share of the right knot of each row.
    pub fn shares(&self) -> Vec<(usize, f64)> {
        let mut shares = Vec::with_capacity(self.t.len());
        for (knot, pair) in self.rows.windows(2).enumerate() {
            let length = (pair[1] - pair[0]) as f64;
            shares.extend((0..pair[1] - pair[0]).map(|row| (knot, row as f64 / length)));
        }
        shares.push((self.knots() - 1, 1.0));
        shares
    }

    /// Commands of every row, SI, one column an input.
    pub fn commands(&self, x: &[f64]) -> Vec<Vec<f64>> {
        let shares = self.shares();
        let knots = self.knots();
        let column = |(limits, x): (&Limits, &[f64])| {
            let at = |knot: usize| match knot.checked_sub(1) {
                Some(free) => limits.size * x[free],
                None => limits.start,
            };
            let mut last = limits.start;
            let rows = shares.iter().enumerate().map(|(row, &(knot, share))| {
                let wanted = at(knot) + share * (at(knot + 1) - at(knot));
                let seconds = self.t[row] - self.t[row.saturating_sub(1)];
                let change = limits.rate * seconds;
                // Interpolation rounds; the limits hold to the last bit.
                let within = if row == 0 || change.is_infinite() {
                    wanted
                } else {
                    wanted.clamp(last - change, last + change)
                };
                last = within.clamp(limits.low, limits.high);
                last
            });
            rows.collect()
        };
        self.limits
            .iter()
            .zip(x.chunks(knots))
            .map(column)
            .collect()
    }
}

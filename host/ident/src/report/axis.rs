//! Range and ticks of an axis.

/// An axis laid out: ends and ticks in shown units.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Layout {
    /// Shown value at the low end.
    pub low: f64,
    /// Shown value at the high end, above `low`.
    pub high: f64,
    /// Positions of the ticks, within the ends.
    pub ticks: Vec<f64>,
    /// Digits behind the point in a tick's label.
    decimals: usize,
    /// Labels need an exponent.
    scientific: bool,
    /// Ends are powers of ten; ticks are values.
    pub logarithmic: bool,
}

/// Ends that hold `low..=high` and about `count` ticks at 1, 2 or 5 times a power of ten.
///
/// `snug` leaves the ends at the data, as a time axis wants; otherwise there is a margin of 6 %.
/// A range without extent is widened, one that is not finite becomes 0 to 1.
pub(super) fn lay_out(low: f64, high: f64, count: usize, snug: bool) -> Layout {
    let (mut low, mut high) = if low.is_finite() && high.is_finite() && low <= high {
        (low, high)
    } else {
        (0.0, 1.0)
    };
    if high - low <= 1e-12 * high.abs().max(low.abs()) {
        let half = if low == 0.0 { 1.0 } else { 0.1 * low.abs() };
        (low, high) = (low - half, high + half);
    } else if !snug {
        let margin = 0.06 * (high - low);
        (low, high) = (low - margin, high + margin);
    }
    let step = nice_step((high - low) / count.max(1) as f64);
    let first = (low / step - 1e-9).ceil();
    let last = (high / step + 1e-9).floor();
    let ticks: Vec<f64> = (0..=(last - first).max(0.0) as usize)
        .map(|i| (first + i as f64) * step)
        .collect();
    let decimals = (-step.log10().floor()).clamp(0.0, 12.0) as usize;
    let largest = low.abs().max(high.abs());
    Layout {
        low,
        high,
        ticks,
        decimals,
        scientific: largest >= 1e6 || step < 1e-4,
        logarithmic: false,
    }
}

/// Decades that have ticks at 2 and 5 as well.
const FEW_DECADES: f64 = 3.0;

/// A logarithmic axis: its ends are the powers of ten of `low..=high`, its ticks are values at 1,
/// and over three decades or fewer at 2 and 5, times powers of ten.
///
/// Values that are not above zero have no place on it; a range of such becomes 1 to 10.
pub(super) fn lay_out_logarithmic(low: f64, high: f64) -> Layout {
    let (low, high) = if low > 0.0 && low <= high && high.is_finite() {
        (low.log10(), high.log10())
    } else {
        (0.0, 1.0)
    };
    let (low, high) = if high - low < 1e-6 {
        (low - 0.5, high + 0.5)
    } else {
        (low, high)
    };
    let digits: &[f64] = if high - low > FEW_DECADES {
        &[1.0]
    } else {
        &[1.0, 2.0, 5.0]
    };
    let ticks = (low.floor() as i32..=high.ceil() as i32)
        .flat_map(|power| digits.iter().map(move |digit| digit * 10f64.powi(power)))
        .filter(|tick| (low - 1e-9..=high + 1e-9).contains(&tick.log10()));
    Layout {
        low,
        high,
        ticks: ticks.collect(),
        decimals: 0,
        scientific: low < -4.0 || high > 6.0,
        logarithmic: true,
    }
}

/// The smallest of 1, 2, 5 times a power of ten that is not below `raw`.
fn nice_step(raw: f64) -> f64 {
    let power = 10f64.powf(raw.log10().floor());
    [1.0, 2.0, 5.0, 10.0]
        .into_iter()
        .map(|digit| digit * power)
        .find(|step| *step >= raw * (1.0 - 1e-9))
        .unwrap_or(10.0 * power)
}

impl Layout {
    /// A tick's label, with a true minus sign.
    pub fn label(&self, tick: f64) -> String {
        // `-0` is a rounding error of `first * step`.
        let tick = if !self.logarithmic && tick.abs() < 1e-9 * (self.high - self.low) {
            0.0
        } else {
            tick
        };
        let text = if self.scientific {
            format!("{tick:e}")
        } else if self.logarithmic {
            let decimals = (-tick.log10().floor()).max(0.0) as usize;
            format!("{tick:.decimals$}")
        } else {
            format!("{tick:.*}", self.decimals)
        };
        text.replace('-', "−")
    }

    /// Position along the axis, 0 at the low end and 1 at the high.
    pub fn fraction(&self, value: f64) -> f64 {
        let value = if self.logarithmic {
            value.log10()
        } else {
            value
        };
        (value - self.low) / (self.high - self.low)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        let time = lay_out(0.0, 24.84, 8, true);
        assert_eq!(time.ticks, [0.0, 5.0, 10.0, 15.0, 20.0]);
        assert_eq!((time.low, time.high), (0.0, 24.84));
        let error = lay_out(-0.0123, 0.0098, 5, false);
        assert_eq!(
            error
                .ticks
                .iter()
                .map(|tick| error.label(*tick))
                .collect::<Vec<_>>(),
            ["−0.010", "−0.005", "0.000", "0.005", "0.010"]
        );
    }

    #[test]
    fn a_logarithmic_axis_has_ticks_at_round_values() {
        let few = lay_out_logarithmic(0.3, 50.0);
        let labels: Vec<String> = few.ticks.iter().map(|tick| few.label(*tick)).collect();
        assert_eq!(labels, ["0.5", "1", "2", "5", "10", "20", "50"]);
        assert!((few.fraction(0.3)).abs() < 1e-12 && (few.fraction(50.0) - 1.0).abs() < 1e-12);
        let middle = (0.3_f64 * 50.0).sqrt();
        assert!((few.fraction(middle) - 0.5).abs() < 1e-12);
        assert_eq!(lay_out_logarithmic(1e-2, 1e3).ticks.len(), 6);
        for (low, high) in [(0.0, 0.0), (-1.0, 5.0), (f64::INFINITY, f64::NEG_INFINITY)] {
            let axis = lay_out_logarithmic(low, high);
            assert!(axis.low < axis.high && !axis.ticks.is_empty());
        }
    }

    #[test]
    fn an_empty_or_endless_range_still_has_ticks() {
        for (low, high) in [
            (0.0, 0.0),
            (5.0, 5.0),
            (-3.0, -3.0),
            (f64::NAN, 1.0),
            (f64::INFINITY, f64::NEG_INFINITY),
            (1e-300, 1e-300),
        ] {
            let axis = lay_out(low, high, 5, false);
            assert!(
                axis.low < axis.high && !axis.ticks.is_empty(),
                "{low} {high} {axis:?}"
            );
            assert!(axis.ticks.len() < 20);
        }
    }
}

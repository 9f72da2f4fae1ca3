//! Numbers as people read them: three digits that count, and a unit of the right size.

/// Units whose multiples people use, with the multiples that make sense.
const PREFIXED: &[(&str, &[(f64, &str)])] = &[
    ("m", &[(1e-9, "nm"), (1e-6, "µm"), (1e-3, "mm"), (1.0, "m")]),
    ("s", &[(1e-9, "ns"), (1e-6, "µs"), (1e-3, "ms"), (1.0, "s")]),
    ("m/s", &[(1e-6, "µm/s"), (1e-3, "mm/s"), (1.0, "m/s")]),
    ("rad", &[(1e-6, "µrad"), (1e-3, "mrad"), (1.0, "rad")]),
    ("rad/s", &[(1e-3, "mrad/s"), (1.0, "rad/s")]),
    ("N", &[(1e-3, "mN"), (1.0, "N"), (1e3, "kN"), (1e6, "MN")]),
    (
        "N m",
        &[(1e-6, "µN m"), (1e-3, "mN m"), (1.0, "N m"), (1e3, "kN m")],
    ),
    ("V", &[(1e-6, "µV"), (1e-3, "mV"), (1.0, "V"), (1e3, "kV")]),
    ("A", &[(1e-6, "µA"), (1e-3, "mA"), (1.0, "A")]),
    ("Pa", &[(1.0, "Pa"), (1e3, "kPa"), (1e6, "MPa")]),
];

/// Below this size in a unit, the next smaller one reads better: 94 mm, but 0.25 m.
const SMALLEST: f64 = 0.1;

/// The factor and symbol in which a number of about `size` (absolute, SI) in `unit` reads best.
///
/// The identity for a unit without multiples, for zero and for what is not finite.
pub(super) fn multiple(size: f64, unit: &str) -> (f64, &str) {
    let multiples = PREFIXED
        .iter()
        .find(|(known, _)| *known == unit)
        .map(|(_, multiples)| *multiples);
    let Some(multiples) = multiples.filter(|_| size > 0.0 && size.is_finite()) else {
        return (1.0, unit);
    };
    let mut best = multiples[0];
    for &(factor, symbol) in multiples {
        if size >= SMALLEST * factor {
            best = (factor, symbol);
        }
    }
    best
}

/// A number with its unit, in the multiple that reads best, to three significant digits.
///
/// ```
/// # use sinew_ident::report::quantity;
/// assert_eq!(quantity(2.7163e-3, "m"), "2.72 mm");
/// assert_eq!(quantity(93.06, "kg"), "93.1 kg");
/// assert_eq!(quantity(f64::NAN, "m"), "–");
/// ```
pub fn quantity(value: f64, unit: &str) -> String {
    let (factor, symbol) = multiple(value.abs(), unit);
    let number = significant(value / factor, 3);
    if symbol.is_empty() || symbol == "1" || !value.is_finite() {
        number
    } else {
        format!("{number} {symbol}")
    }
}

/// A number of things, in the singular for one.
///
/// ```
/// # use sinew_ident::report::count;
/// assert_eq!((count(1, "step"), count(2, "step")), ("1 step".into(), "2 steps".into()));
/// ```
pub fn count(n: usize, noun: &str) -> String {
    format!("{n} {noun}{}", if n == 1 { "" } else { "s" })
}

/// The shortest text that reads back as the number; with an exponent below 1e-5 and from 1e16 on,
/// where the plain one would be a row of zeros.
///
/// ```
/// # use sinew_ident::report::exact;
/// assert_eq!(exact(-0.1), "-0.1");
/// assert_eq!(exact(1e300), "1e300");
/// ```
pub fn exact(value: f64) -> String {
    let size = value.abs();
    if size == 0.0 || !size.is_finite() || (1e-5..1e16).contains(&size) {
        value.to_string()
    } else {
        format!("{value:e}")
    }
}

/// A number to so many significant digits; plain from 1e-4 to 1e6, with an exponent outside. A dash
/// for what is not a number.
///
/// ```
/// # use sinew_ident::report::significant;
/// assert_eq!(significant(0.012345, 3), "0.0123");
/// assert_eq!(significant(-12345.6, 3), "−12346");
/// assert_eq!(significant(1.5e-7, 2), "1.5e−7");
/// ```
pub fn significant(value: f64, digits: usize) -> String {
    if value.is_nan() {
        return "–".to_owned();
    }
    let digits = digits.max(1);
    let text = if value == 0.0 || value.is_infinite() {
        format!("{value}")
    } else {
        // The exponent after rounding: 9.996 to three digits is 10.0.
        let scientific = format!("{value:.*e}", digits - 1);
        let exponent: i32 = scientific
            .rsplit_once('e')
            .and_then(|(_, text)| text.parse().ok())
            .unwrap_or(0);
        if (-4..6).contains(&exponent) {
            let decimals = (digits as i32 - 1 - exponent).max(0) as usize;
            format!("{value:.decimals$}")
        } else {
            scientific
        }
    };
    text.replace('-', "−")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounding_carries_into_the_next_digit() {
        assert_eq!(significant(9.996, 3), "10.0");
        assert_eq!(significant(0.000_099_99, 2), "0.00010");
        assert_eq!(significant(999_999.9, 2), "1.0e6");
        assert_eq!(significant(0.0, 3), "0");
    }

    #[test]
    fn the_multiple_fits_the_size() {
        for (value, unit, text) in [
            (0.094, "m", "94.0 mm"),
            (0.25, "m", "0.250 m"),
            (4.6e-6, "m", "4.60 µm"),
            (-0.000_2, "rad", "−0.200 mrad"),
            (1234.0, "N", "1.23 kN"),
            (0.0, "m", "0 m"),
            (0.5, "1", "0.500"),
            (3.0, "furlong", "3.00 furlong"),
        ] {
            assert_eq!(quantity(value, unit), text);
        }
    }
}

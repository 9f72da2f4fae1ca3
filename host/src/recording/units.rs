//! Units at the end of a column's name: `q_mm` is in millimetres.

/// A unit that a column's name may end in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unit {
    /// As it stands in the name: `mm_s`.
    pub suffix: &'static str,
    /// As a person writes it: `mm/s`.
    pub symbol: &'static str,
    /// The SI unit of the same quantity, as a person writes it: `m/s`.
    pub si: &'static str,
    /// SI value of one: 0.001.
    pub factor: f64,
    /// What it measures.
    pub quantity: Quantity,
}

/// What a signal measures, as far as its unit tells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// Metres.
    Length,
    /// Radians.
    Angle,
    /// Metres per second.
    Velocity,
    /// Radians per second.
    AngularVelocity,
    /// Acceleration of a slide or a hinge.
    Acceleration,
    /// Newtons.
    Force,
    /// Newton metres.
    Torque,
    /// Volts, amperes, pascals, a plain number: what an amplifier, a valve or a program is told.
    Drive,
    /// Anything else.
    Other,
}

const DEGREE: f64 = std::f64::consts::PI / 180.0;
const RPM: f64 = std::f64::consts::PI / 30.0;

/// Every suffix that is understood. Where two end a name, the longer wins (`_m_s` before `_s`).
pub const UNITS: &[Unit] = &[
    unit("m", "m", "m", 1.0, Quantity::Length),
    unit("cm", "cm", "m", 1e-2, Quantity::Length),
    unit("mm", "mm", "m", 1e-3, Quantity::Length),
    unit("um", "µm", "m", 1e-6, Quantity::Length),
    unit("rad", "rad", "rad", 1.0, Quantity::Angle),
    unit("mrad", "mrad", "rad", 1e-3, Quantity::Angle),
    unit("deg", "°", "rad", DEGREE, Quantity::Angle),
    unit("m_s", "m/s", "m/s", 1.0, Quantity::Velocity),
    unit("mm_s", "mm/s", "m/s", 1e-3, Quantity::Velocity),
    unit("rad_s", "rad/s", "rad/s", 1.0, Quantity::AngularVelocity),
    unit("deg_s", "°/s", "rad/s", DEGREE, Quantity::AngularVelocity),
    unit("rpm", "rpm", "rad/s", RPM, Quantity::AngularVelocity),
    unit("m_s2", "m/s²", "m/s²", 1.0, Quantity::Acceleration),
    unit("rad_s2", "rad/s²", "rad/s²", 1.0, Quantity::Acceleration),
    unit("N", "N", "N", 1.0, Quantity::Force),
    unit("mN", "mN", "N", 1e-3, Quantity::Force),
    unit("kN", "kN", "N", 1e3, Quantity::Force),
    unit("Nm", "N m", "N m", 1.0, Quantity::Torque),
    unit("mNm", "mN m", "N m", 1e-3, Quantity::Torque),
    unit("V", "V", "V", 1.0, Quantity::Drive),
    unit("mV", "mV", "V", 1e-3, Quantity::Drive),
    unit("kV", "kV", "V", 1e3, Quantity::Drive),
    unit("A", "A", "A", 1.0, Quantity::Drive),
    unit("mA", "mA", "A", 1e-3, Quantity::Drive),
    unit("Pa", "Pa", "Pa", 1.0, Quantity::Drive),
    unit("kPa", "kPa", "Pa", 1e3, Quantity::Drive),
    unit("bar", "bar", "Pa", 1e5, Quantity::Drive),
    unit("1", "1", "1", 1.0, Quantity::Drive),
    unit("s", "s", "s", 1.0, Quantity::Other),
    unit("ms", "ms", "s", 1e-3, Quantity::Other),
    unit("us", "µs", "s", 1e-6, Quantity::Other),
    unit("Hz", "Hz", "Hz", 1.0, Quantity::Other),
    unit("K", "K", "K", 1.0, Quantity::Other),
];

const fn unit(
    suffix: &'static str,
    symbol: &'static str,
    si: &'static str,
    factor: f64,
    quantity: Quantity,
) -> Unit {
    Unit {
        suffix,
        symbol,
        si,
        factor,
        quantity,
    }
}

/// The unit that `name` ends in, or `None` where it has none that is known.
///
/// ```
/// # use sinew::recording::units::unit_of;
/// assert_eq!(unit_of("qd_mm_s").map(|unit| unit.symbol), Some("mm/s"));
/// assert_eq!(unit_of("speed_furlongs"), None);
/// ```
pub fn unit_of(name: &str) -> Option<&'static Unit> {
    UNITS
        .iter()
        .filter(|unit| {
            name.strip_suffix(unit.suffix)
                .is_some_and(|stem| stem.ends_with('_'))
        })
        .max_by_key(|unit| unit.suffix.len())
}

/// The unit as a person writes it; an unknown suffix as it stands, nothing where there is none.
pub fn symbol_of(name: &str) -> &str {
    match unit_of(name) {
        Some(unit) => unit.symbol,
        None => name.rsplit_once('_').map_or("", |(_, suffix)| suffix),
    }
}

/// The name without its unit: `qd` of `qd_m_s`.
pub fn stem_of(name: &str) -> &str {
    match unit_of(name) {
        Some(unit) => &name[..name.len() - unit.suffix.len() - 1],
        None => name.rsplit_once('_').map_or(name, |(stem, _)| stem),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_suffix_wins() {
        for (name, symbol, stem) in [
            ("q_m", "m", "q"),
            ("qd_m_s", "m/s", "qd"),
            ("load_angle_deg", "°", "load_angle"),
            ("u_1", "1", "u"),
            ("delay_ms", "ms", "delay"),
            ("speed_furlongs", "furlongs", "speed"),
            ("plain", "", "plain"),
        ] {
            assert_eq!((symbol_of(name), stem_of(name)), (symbol, stem), "{name}");
        }
    }

    #[test]
    fn every_suffix_is_listed_once() {
        for (index, unit) in UNITS.iter().enumerate() {
            assert!(
                UNITS[..index]
                    .iter()
                    .all(|other| other.suffix != unit.suffix),
                "{}",
                unit.suffix
            );
        }
    }
}

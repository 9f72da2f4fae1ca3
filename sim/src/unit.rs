//! Units: of parameters by the motion they belong to, of columns by their suffix, and the factor
//! that a `unit` key brings to SI.

use std::fmt;

use crate::suggest;

/// Kind of a coordinate: a length or an angle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// Along a line: m, N, kg.
    Slide,
    /// About an axis: rad, N m, kg m^2.
    Hinge,
}

/// Physical quantity of a parameter; with a [`Motion`] it becomes a unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Mass or moment of inertia.
    Inertia,
    /// Force or torque.
    Force,
    /// Length or angle.
    Coordinate,
    /// Speed or angular speed.
    Velocity,
    /// Force per coordinate.
    Stiffness,
    /// Force per coordinate squared.
    QuadraticStiffness,
    /// Force per coordinate cubed.
    CubicStiffness,
    /// Force per velocity.
    Damping,
    /// Force per velocity squared.
    Drag,
    /// Cycles of a ripple per coordinate, times 2 pi.
    WaveNumber,
    /// An angle whatever the motion.
    Phase,
    /// A plain number.
    Ratio,
    /// Seconds.
    Time,
    /// Rates of Bouc-Wen hysteresis: per coordinate, to the power of its exponent.
    Memory,
    /// Play: a coordinate at a spring or tendon, an input at an actuator.
    Gap,
    /// Input of an actuator.
    Input,
    /// One over what an actuator takes.
    PerInput,
    /// One over what a sensor reads.
    PerReading,
    /// One over its square.
    PerReadingSquared,
}

impl Quantity {
    /// The unit's name in SI.
    pub fn unit(self, motion: Motion) -> &'static str {
        use Motion::{Hinge, Slide};
        match (self, motion) {
            (Self::Inertia, Slide) => "kg",
            (Self::Inertia, Hinge) => "kg m^2",
            (Self::Force, Slide) => "N",
            (Self::Force, Hinge) => "N m",
            (Self::Coordinate, Slide) => "m",
            (Self::Coordinate, Hinge) => "rad",
            (Self::Velocity, Slide) => "m/s",
            (Self::Velocity, Hinge) => "rad/s",
            (Self::Stiffness, Slide) => "N/m",
            (Self::Stiffness, Hinge) => "N m/rad",
            (Self::QuadraticStiffness, Slide) => "N/m^2",
            (Self::QuadraticStiffness, Hinge) => "N m/rad^2",
            (Self::CubicStiffness, Slide) => "N/m^3",
            (Self::CubicStiffness, Hinge) => "N m/rad^3",
            (Self::Damping, Slide) => "N s/m",
            (Self::Damping, Hinge) => "N m s/rad",
            (Self::Drag, Slide) => "N s^2/m^2",
            (Self::Drag, Hinge) => "N m s^2/rad^2",
            (Self::WaveNumber, Slide) => "rad/m",
            (Self::WaveNumber, Hinge) => "1",
            (Self::Phase, _) => "rad",
            (Self::Ratio | Self::Input | Self::PerInput, _) => "1",
            (Self::PerReading | Self::PerReadingSquared, _) => "1",
            (Self::Time, _) => "s",
            (Self::Memory, Slide) => "m^-exponent",
            (Self::Memory, Hinge) => "rad^-exponent",
            (Self::Gap, motion) => Self::Coordinate.unit(motion),
        }
    }

    /// The unit for a person who has no rig yet: of slides and of hinges, or by the signal.
    pub fn unit_in_words(self) -> String {
        match self {
            Self::Input => "unit of the input".to_owned(),
            Self::PerInput => "1 / unit of the input".to_owned(),
            Self::PerReading => "1 / unit of the reading".to_owned(),
            Self::PerReadingSquared => "1 / unit of the reading squared".to_owned(),
            Self::Gap => "m or rad; at an actuator the unit of its input".to_owned(),
            Self::Ratio => "no unit".to_owned(),
            _ => {
                let [slide, hinge] = [Motion::Slide, Motion::Hinge].map(|motion| self.unit(motion));
                if slide == hinge {
                    slide.to_owned()
                } else {
                    format!("{slide} or {hinge}")
                }
            }
        }
    }

    /// The unit at an actuator or a sensor whose input or reading is measured in `base`.
    pub(crate) fn unit_of(self, base: &str) -> String {
        let base = if base.is_empty() { "1" } else { base };
        match self {
            Self::Input | Self::Gap => base.to_owned(),
            Self::PerInput | Self::PerReading => ratio("1", base),
            Self::PerReadingSquared if base == "1" => "1".to_owned(),
            Self::PerReadingSquared if base.contains(['/', ' ']) => format!("1/({base})^2"),
            Self::PerReadingSquared => format!("1/{base}^2"),
            other => other.unit(Motion::Slide).to_owned(),
        }
    }
}

/// A unit that a column may be written in: the spelling in a column's name, the spelling for
/// people, and what one of it is in SI.
struct Known {
    suffix: &'static str,
    text: &'static str,
    si: f64,
}

const fn known(suffix: &'static str, text: &'static str, si: f64) -> Known {
    Known { suffix, text, si }
}

const DEGREE: f64 = std::f64::consts::PI / 180.0;

/// Longest spellings first is not needed: a suffix is compared whole.
const KNOWN: &[Known] = &[
    known("m", "m", 1.0),
    known("km", "km", 1e3),
    known("cm", "cm", 1e-2),
    known("mm", "mm", 1e-3),
    known("um", "um", 1e-6),
    known("rad", "rad", 1.0),
    known("mrad", "mrad", 1e-3),
    known("deg", "deg", DEGREE),
    known("rev", "rev", 2.0 * std::f64::consts::PI),
    known("s", "s", 1.0),
    known("ms", "ms", 1e-3),
    known("us", "us", 1e-6),
    known("m_s", "m/s", 1.0),
    known("mm_s", "mm/s", 1e-3),
    known("rad_s", "rad/s", 1.0),
    known("deg_s", "deg/s", DEGREE),
    known("rpm", "rpm", std::f64::consts::PI / 30.0),
    known("N", "N", 1.0),
    known("kN", "kN", 1e3),
    known("mN", "mN", 1e-3),
    known("Nm", "N m", 1.0),
    known("Nmm", "N mm", 1e-3),
    known("mNm", "mN m", 1e-3),
    known("V", "V", 1.0),
    known("kV", "kV", 1e3),
    known("mV", "mV", 1e-3),
    known("A", "A", 1.0),
    known("mA", "mA", 1e-3),
    known("T", "T", 1.0),
    known("mT", "mT", 1e-3),
    known("uT", "uT", 1e-6),
    known("percent", "%", 1e-2),
    known("1", "1", 1.0),
];

/// Error of a unit that is not known.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct UnknownUnit {
    /// Help line: the nearest unit and the list.
    pub help: String,
}

impl fmt::Display for UnknownUnit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.help)
    }
}

impl std::error::Error for UnknownUnit {}

/// Factor of `unit` (a `unit` key: `mm`, `deg`, `mm_s` or `mm/s`) to SI.
///
/// ```
/// use sinew_sim::unit::factor;
///
/// assert_eq!(factor("mm"), Ok(1e-3));
/// let unknown = factor("mn").unwrap_err();
/// assert!(unknown.to_string().starts_with("did you mean `"), "{unknown}");
/// ```
///
/// # Errors
/// The unit is not known.
pub fn factor(unit: &str) -> Result<f64, UnknownUnit> {
    KNOWN
        .iter()
        .find(|known| known.suffix == unit || known.text == unit)
        .map(|known| known.si)
        .ok_or_else(|| {
            let names: Vec<&str> = KNOWN.iter().map(|known| known.suffix).collect();
            UnknownUnit {
                help: suggest::help(unit, "known units", &names),
            }
        })
}

/// The unit at the end of a column's name, for people: `qd_m_s` gives `m/s`, `u_V` gives `V`. An
/// unknown suffix is given as it stands, a name without one gives nothing.
///
/// ```
/// assert_eq!(sinew_sim::unit::of_column("qd_m_s"), "m/s");
/// assert_eq!(sinew_sim::unit::of_column("level_furlong"), "furlong");
/// assert_eq!(sinew_sim::unit::of_column("u"), "");
/// ```
pub fn of_column(column: &str) -> &str {
    let suffixes = column.match_indices('_').map(|(at, _)| &column[at + 1..]);
    for suffix in suffixes {
        if let Some(known) = KNOWN.iter().find(|known| known.suffix == suffix) {
            return known.text;
        }
    }
    column.rsplit_once('_').map_or("", |(_, suffix)| suffix)
}

/// The SI unit of what is written in `unit`, both as [`of_column`] gives them; one that is not
/// known as it stands.
///
/// ```
/// assert_eq!(sinew_sim::unit::si("kV"), "V");
/// assert_eq!(sinew_sim::unit::si("deg/s"), "rad/s");
/// assert_eq!(sinew_sim::unit::si("furlong"), "furlong");
/// ```
pub fn si(unit: &str) -> &str {
    match unit {
        "km" | "cm" | "mm" | "um" => "m",
        "mrad" | "deg" | "rev" => "rad",
        "ms" | "us" => "s",
        "mm/s" => "m/s",
        "deg/s" | "rpm" => "rad/s",
        "kN" | "mN" => "N",
        "N mm" | "mN m" => "N m",
        "kV" | "mV" => "V",
        "mA" => "A",
        "mT" | "uT" => "T",
        "%" => "1",
        other => other,
    }
}

/// The unit of a ratio, `1` where the two cancel.
pub(crate) fn ratio(over: &str, under: &str) -> String {
    match (over, under) {
        (over, under) if over == under => "1".to_owned(),
        (over, "" | "1") => over.to_owned(),
        (over, under) if under.contains(['/', ' ']) => format!("{over}/({under})"),
        (over, under) => format!("{over}/{under}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_known_suffix_is_the_unit() {
        assert_eq!(of_column("q_m"), "m");
        assert_eq!(of_column("tip_speed_rad_s"), "rad/s");
        assert_eq!(of_column("q_parsec_m"), "m");
        assert_eq!(of_column("tau_Nm"), "N m");
        assert_eq!(of_column("u_1"), "1");
    }

    #[test]
    fn every_unit_has_its_own_in_si() {
        for known in KNOWN {
            let base = KNOWN.iter().find(|other| other.text == si(known.text));
            assert!(base.is_some_and(|base| base.si == 1.0), "{}", known.text);
            assert_eq!(
                known.si == 1.0,
                si(known.text) == known.text,
                "{}",
                known.text
            );
        }
    }

    #[test]
    fn factors_bring_to_si() {
        assert_eq!(factor("mm"), Ok(1e-3));
        assert_eq!(factor("mm/s"), Ok(1e-3));
        assert!((factor("deg").unwrap_or(0.0) * 180.0 - std::f64::consts::PI).abs() < 1e-15);
        assert!(factor("degs").is_err_and(|unknown| unknown.help.contains("did you mean `deg`?")));
    }

    #[test]
    fn ratios_cancel() {
        assert_eq!(ratio("m", "m"), "1");
        assert_eq!(ratio("N", "V"), "N/V");
        assert_eq!(ratio("N m", "1"), "N m");
        assert_eq!(ratio("m", "m/s"), "m/(m/s)");
    }
}

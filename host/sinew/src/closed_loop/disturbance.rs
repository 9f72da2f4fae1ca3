//! A load at the inputs that no controller is told of: it is added to the commands on their way to
//! the plant.

/// Its size, as a share of half an input's range.
const SHARE: f64 = 0.2;

/// Its course over a run; zero for the first quarter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Disturbance {
    /// None.
    #[default]
    None,
    /// A fifth of half the input's range, from a quarter of the run on.
    Step,
    /// Rises to a fifth of half the input's range, from a quarter of the run to its end.
    Ramp,
    /// A sine of that amplitude, four periods over the last three quarters of the run.
    Sine,
}

impl Disturbance {
    /// As on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Step => "step",
            Self::Ramp => "ramp",
            Self::Sine => "sine",
        }
    }

    /// In units of half an input's range, at a share of the run from 0 to 1.
    pub fn at(self, share: f64) -> f64 {
        let since = (share - 0.25) / 0.75;
        if since < 0.0 {
            return 0.0;
        }
        SHARE
            * match self {
                Self::None => 0.0,
                Self::Step => 1.0,
                Self::Ramp => since,
                Self::Sine => (8.0 * std::f64::consts::PI * since).sin(),
            }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_course_begins_at_a_quarter_and_has_its_size() {
        for (course, half, end) in [
            (Disturbance::None, 0.0, 0.0),
            (Disturbance::Step, 0.2, 0.2),
            (Disturbance::Ramp, 0.2 / 3.0, 0.2),
            (
                Disturbance::Sine,
                0.2 * (8.0 * std::f64::consts::PI / 3.0).sin(),
                0.0,
            ),
        ] {
            assert_eq!(course.at(0.24), 0.0);
            assert!((course.at(0.5) - half).abs() < 1e-12, "{course:?}");
            assert!((course.at(1.0) - end).abs() < 1e-12, "{course:?}");
        }
    }
}

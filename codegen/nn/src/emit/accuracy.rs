//! Accuracy of tanh, and so of sigmoid, which is made of it: a tolerance chooses the kernel.

use crate::NetworkError;

/// Accuracy of tanh and sigmoid. The slope of tanh is `1 - y^2` of the kernel's value `y`, so
/// that it is within twice the value's error of the true one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Accuracy {
    /// Within 2e-7, at about twice the instructions of the next: with an exponential.
    Precise,
    /// Within 2e-6: a rational function of degrees 7 and 6.
    #[default]
    Quick,
    /// Within 5e-5: degrees 5 and 4.
    Coarse,
    /// Within 9e-4: degrees 3 and 4.
    Rough,
    /// Within 3e-3: degrees 3 and 2.
    Rougher,
}

impl Accuracy {
    /// From the most exact to the cheapest.
    pub const ALL: [Self; 5] = [
        Self::Precise,
        Self::Quick,
        Self::Coarse,
        Self::Rough,
        Self::Rougher,
    ];

    /// Largest error of tanh over all numbers (absolute; swept in
    /// `codegen/kernels/tests/tolerances.rs`).
    #[must_use]
    pub fn error(self) -> f64 {
        match self {
            Self::Precise => 2e-7,
            Self::Quick => 2e-6,
            Self::Coarse => 5e-5,
            Self::Rough => 9e-4,
            Self::Rougher => 3e-3,
        }
    }

    /// The cheapest whose error is within a tolerance.
    ///
    /// # Errors
    /// [`NetworkError::Option`]: it is no positive number, or smaller than every error.
    pub fn within(tolerance: f64) -> Result<Self, NetworkError> {
        if !(tolerance > 0.0 && tolerance < 1.0) {
            return Err(NetworkError::option(format!(
                "a tolerance of tanh is a number between 0 and 1, not {tolerance}"
            )));
        }
        let cheapest = Self::ALL.into_iter().rev();
        let mut fit = cheapest.filter(|accuracy| accuracy.error() <= tolerance);
        let least = Self::Precise.error();
        fit.next().ok_or_else(|| {
            NetworkError::option(format!(
                "no tanh is within {tolerance:e}: the most exact is within {least:e}"
            ))
        })
    }

    /// The kernels' module beside `math/activation.rs`, which has [`Accuracy::Quick`].
    pub(super) fn module(self) -> Option<&'static str> {
        match self {
            Self::Precise => Some("precise"),
            Self::Quick => None,
            Self::Coarse => Some("coarse"),
            Self::Rough => Some("rough"),
            Self::Rougher => Some("rougher"),
        }
    }
}

/// From the text of a tolerance, `1e-4`.
impl std::str::FromStr for Accuracy {
    type Err = NetworkError;

    fn from_str(text: &str) -> Result<Self, NetworkError> {
        let number = text.trim().parse();
        let number = number.map_err(|_| {
            NetworkError::option(format!("a tolerance of tanh is a number, not {text:?}"))
        })?;
        Self::within(number)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tolerance_takes_the_cheapest_that_keeps_it() {
        let chosen = |text: &str| text.parse::<Accuracy>();
        assert_eq!(chosen("2e-6"), Ok(Accuracy::default()));
        assert_eq!(chosen("1e-4"), Ok(Accuracy::Coarse));
        assert_eq!(chosen("1e-3"), Ok(Accuracy::Rough));
        assert_eq!(chosen("0.5"), Ok(Accuracy::Rougher));
        assert_eq!(chosen("1.9e-6"), Ok(Accuracy::Precise));
        for accuracy in Accuracy::ALL {
            assert_eq!(Accuracy::within(accuracy.error()), Ok(accuracy));
        }
    }

    #[test]
    fn what_no_kernel_keeps_is_refused_in_words() {
        for text in ["1e-9", "0", "-1e-3", "nan", "inf", "1", "small", ""] {
            let error = text.parse::<Accuracy>().expect_err(text).to_string();
            assert!(error.contains("tanh"), "{text}: {error}");
        }
    }
}

//! The only home of transcendental functions of this crate.
//!
//! They are libm's, not the system's, so that the golden vectors in a committed model are the same
//! bytes whichever machine printed them.

/// Hyperbolic tangent in double precision, below 1 ulp.
pub fn tanh(x: f64) -> f64 {
    libm::tanh(x)
}

/// Exponential function.
pub fn exp(x: f64) -> f64 {
    libm::exp(x)
}

/// Natural logarithm.
pub fn ln(x: f64) -> f64 {
    libm::log(x)
}

/// Square root.
pub fn sqrt(x: f64) -> f64 {
    libm::sqrt(x)
}

/// Error function.
pub fn erf(x: f64) -> f64 {
    libm::erf(x)
}

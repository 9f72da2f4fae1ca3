//! The only home of transcendental functions in this crate.
//!
//! They come from libm, in Rust, and not from the system's C library: a simulation gives the same
//! bits on every machine (docs/decisions/0002-one-home-of-transcendentals.md). The square root is
//! correctly rounded everywhere and stays the processor's.

pub(crate) fn sin(x: f64) -> f64 {
    libm::sin(x)
}

pub(crate) fn cos(x: f64) -> f64 {
    libm::cos(x)
}

/// Both, to the bit as one by one, for little more than one.
pub(crate) fn sin_cos(x: f64) -> (f64, f64) {
    libm::sincos(x)
}

pub(crate) fn exp(x: f64) -> f64 {
    libm::exp(x)
}

pub(crate) fn ln(x: f64) -> f64 {
    libm::log(x)
}

pub(crate) fn tanh(x: f64) -> f64 {
    libm::tanh(x)
}

/// Cumulative distribution of the standard normal deviate.
pub(crate) fn normal_share(x: f64) -> f64 {
    0.5 * libm::erfc(-x * std::f64::consts::FRAC_1_SQRT_2)
}

pub(crate) fn sqrt(x: f64) -> f64 {
    x.sqrt()
}

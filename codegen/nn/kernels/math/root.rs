//! Square root and its reciprocal, by Newton's iteration.

/// `1 / sqrt(x)` for positive x. Relative error 3e-7; 0 gives infinity, a negative number or NaN
/// gives NaN. Below the smallest normal number x counts as 0.
#[inline(always)]
pub fn reciprocal_root(x: f32) -> f32 {
    if x < f32::MIN_POSITIVE {
        return if x < 0.0 { f32::NAN } else { f32::INFINITY };
    }
    if x == f32::INFINITY {
        return 0.0;
    }
    // Half the exponent with its sign turned; off by 3.5 % at most.
    let mut r = f32::from_bits(0x5f37_59df - (x.to_bits() >> 1));
    for _ in 0..3 {
        // The smallest squares would leave f32: `x r` comes first.
        r = r * (1.5 - 0.5 * (x * r) * r);
    }
    r
}

/// `sqrt(x)`. Relative error 3e-7; a negative number or NaN gives NaN. Below the smallest normal
/// number x counts as 0.
#[inline(always)]
pub fn root(x: f32) -> f32 {
    if (0.0..f32::MIN_POSITIVE).contains(&x) {
        return 0.0;
    }
    if x == f32::INFINITY {
        return x;
    }
    x * reciprocal_root(x)
}

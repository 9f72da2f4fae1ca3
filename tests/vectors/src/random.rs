//! Numbers from a seed.

/// Xorshift: the same cases on every machine.
pub struct Random(pub u64);

impl Random {
    /// Uniform in -1 to 1.
    pub fn signed(&mut self) -> f32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 40) as f32 / (1_u64 << 23) as f32 - 1.0
    }

    /// Uniform in 0 to 1.
    pub fn unit(&mut self) -> f32 {
        0.5 * (self.signed() + 1.0)
    }

    /// Uniform in -scale to scale.
    pub fn array<const N: usize>(&mut self, scale: f32) -> [f32; N] {
        core::array::from_fn(|_| scale * self.signed())
    }

    /// As [`Random::array`], in rows.
    pub fn matrix<const N: usize, const M: usize>(&mut self, scale: f32) -> [[f32; N]; M] {
        core::array::from_fn(|_| self.array(scale))
    }
}

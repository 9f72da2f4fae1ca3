//! Matrices as they lie in flash, row by row: floats, or integers of eight bits with a scale for
//! each row.

use crate::number::Number;

/// A weight as it is stored.
pub trait Weight: Copy {
    /// As it is computed with.
    fn value(self) -> f32;
}

impl Weight for f32 {
    #[inline(always)]
    fn value(self) -> f32 {
        self
    }
}

impl Weight for i8 {
    #[inline(always)]
    fn value(self) -> f32 {
        f32::from(self)
    }
}

/// `OUT` rows of weights, each to be multiplied by a gain of its own.
pub trait Rows<const OUT: usize> {
    /// A row: its weights, perhaps in arrays of arrays.
    type Row;

    /// The rows, before their gains.
    fn rows(&self) -> &[Self::Row; OUT];

    /// Factor of row `r`.
    fn gain(&self, r: usize) -> f32;

    /// `gain t`.
    fn scaled<N: Number>(&self, r: usize, t: N) -> N;

    /// Initial value of a weighted sum of a row with this bias.
    fn start<N: Number>(&self, bias: N) -> N;

    /// The weighted sum of row `r`, its gain and bias in it, from what was begun at
    /// [`Rows::start`].
    fn end<N: Number>(&self, r: usize, sum: N, bias: N) -> N;
}

impl<T, const OUT: usize> Rows<OUT> for [T; OUT] {
    type Row = T;

    #[inline(always)]
    fn rows(&self) -> &[T; OUT] {
        self
    }

    #[inline(always)]
    fn gain(&self, _r: usize) -> f32 {
        1.0
    }

    #[inline(always)]
    fn scaled<N: Number>(&self, _r: usize, t: N) -> N {
        t
    }

    #[inline(always)]
    fn start<N: Number>(&self, bias: N) -> N {
        bias
    }

    #[inline(always)]
    fn end<N: Number>(&self, _r: usize, sum: N, _bias: N) -> N {
        sum
    }
}

/// Rows of integers: weight `w` stands for `scale w`.
pub struct Int8<T, const OUT: usize> {
    /// The integers.
    pub rows: [T; OUT],
    /// The gain of each row.
    pub scale: [f32; OUT],
}

impl<T, const OUT: usize> Rows<OUT> for Int8<T, OUT> {
    type Row = T;

    #[inline(always)]
    fn rows(&self) -> &[T; OUT] {
        &self.rows
    }

    #[inline(always)]
    fn gain(&self, r: usize) -> f32 {
        self.scale.get(r).copied().unwrap_or(0.0)
    }

    #[inline(always)]
    fn scaled<N: Number>(&self, r: usize, t: N) -> N {
        t.weigh(self.gain(r))
    }

    #[inline(always)]
    fn start<N: Number>(&self, _bias: N) -> N {
        N::ZERO
    }

    #[inline(always)]
    fn end<N: Number>(&self, r: usize, sum: N, bias: N) -> N {
        bias + sum.weigh(self.gain(r))
    }
}

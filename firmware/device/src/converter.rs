//! Converter codes to physical units and back: what a board hands over is a code and its full
//! scale.

/// A straight line between a converter's two ends: physical value at code 0 and at full scale.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    /// Physical value of code 0.
    pub zero: f32,
    /// Physical value of full scale.
    pub full: f32,
}

impl Span {
    /// The model's range of a signal: `offset - span` to `offset + span`, -1 to 1 in model units.
    pub const fn of_model(span: f32, offset: f32) -> Self {
        Self {
            zero: offset - span,
            full: offset + span,
        }
    }

    /// A measured code as a physical value; NaN, a missing sample, at either end of the converter
    /// (a broken wire or a short pulls it there) and for a full scale of 0.
    pub fn physical(&self, code: u16, full_scale: u16) -> f32 {
        if code == 0 || code >= full_scale {
            return f32::NAN;
        }
        let share = f32::from(code) / f32::from(full_scale);
        self.zero + (self.full - self.zero) * share
    }

    /// The code, 0 to `full_scale`, for a physical value: the nearest, ends for what lies beyond. A
    /// value that is not a number gives `None`: leave the output as it is.
    pub fn code(&self, physical: f32, full_scale: u16) -> Option<u16> {
        let range = self.full - self.zero;
        let share = (physical - self.zero) / range;
        if !share.is_finite() {
            return None;
        }
        // Rounded to the nearest; the cast saturates.
        Some((share.clamp(0.0, 1.0) * f32::from(full_scale) + 0.5) as u16)
    }
}

//! Converter codes to physical units and back: what a board hands over is a code and its full
//! scale.

/// A straight line between a converter's two ends: physical value at code 0 and at full scale.
///
/// ```
/// use sinew_device::converter::Span;
///
/// // A 12-bit converter over -10 to 10 N.
/// let force = Span { zero: -10.0, full: 10.0 };
/// assert_eq!(force.code(0.0, 4095), Some(2048));
/// assert!((force.physical(2048, 4095) - 0.002).abs() < 0.001);
/// // A broken wire pulls the input to one end: a missing sample.
/// assert!(force.physical(4095, 4095).is_nan());
/// ```
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

/// Scale of a quadrature encoder whose 16-bit counter the board hands over.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Encoder {
    /// Physical units of one count; negative where it counts backwards.
    pub unit_per_count: f32,
    /// Physical value where the board starts.
    pub start: f32,
}

/// Position of an encoder beyond the 16 bits of its counter.
///
/// Two readings may be 32,767 counts apart at most: an encoder of 4,096 counts a turn then makes
/// less than eight turns in a period of the loop.
///
/// ```
/// use sinew_device::converter::{Counter, Encoder};
///
/// let encoder = Encoder { unit_per_count: 0.001, start: 0.5 };
/// let mut counter = Counter::new();
/// counter.advance(65_530);
/// // The 16 bits wrapped; the position did not jump.
/// let position = encoder.physical(counter.advance(4));
/// assert!((position - 0.51).abs() < 1e-6);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counter {
    last: Option<u16>,
    total: i32,
}

impl Counter {
    /// A counter that calls its first reading 0.
    pub const fn new() -> Self {
        Self {
            last: None,
            total: 0,
        }
    }

    /// Counts since the first reading; it stays at the ends of its range rather than wrap.
    pub fn advance(&mut self, raw: u16) -> i32 {
        let change = raw.wrapping_sub(self.last.unwrap_or(raw)).cast_signed();
        self.last = Some(raw);
        self.total = self.total.saturating_add(i32::from(change));
        self.total
    }
}

impl Encoder {
    /// Counts since the start as a physical value. Beyond 2^24 counts the last ones are lost.
    pub fn physical(&self, counts: i32) -> f32 {
        self.start + self.unit_per_count * counts as f32
    }
}

/// Scale of a sensor.
///
/// ```
/// use sinew_device::converter::{Counter, Scale, Span};
///
/// let scale = Scale::Converter(Span { zero: -1.0, full: 1.0 });
/// let mut counter = Counter::default();
/// assert_eq!(scale.physical(2_047, 4_094, &mut counter), 0.0);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scale {
    /// A code of an analogue-to-digital converter.
    Converter(Span),
    /// The counter of an encoder.
    Encoder(Encoder),
}

impl Scale {
    /// A raw reading as a physical value; NaN, a missing sample, as [`Span::physical`].
    pub fn physical(&self, raw: u16, full_scale: u16, counter: &mut Counter) -> f32 {
        match self {
            Self::Converter(span) => span.physical(raw, full_scale),
            Self::Encoder(encoder) => encoder.physical(counter.advance(raw)),
        }
    }
}

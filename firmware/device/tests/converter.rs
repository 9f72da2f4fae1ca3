//! Codes and counts to physical values.

use sinew_device::converter::{Counter, Encoder, Scale, Span};

#[test]
fn a_counter_goes_on_where_its_sixteen_bits_wrap() {
    let mut counter = Counter::new();
    let mut position: i32 = 0;
    let mut state = 0x2545_f491_u32;
    for k in 0..100_000 {
        state ^= state << 13;
        state ^= state >> 17;
        state ^= state << 5;
        // The largest steps are among them.
        let change = (state as i16).max(-i16::MAX);
        position += if k == 0 { 0 } else { i32::from(change) };
        // The first reading may be anything.
        let raw = (position as u16).wrapping_add(40_000);
        assert_eq!(counter.advance(raw), position, "reading {k}");
    }
}

#[test]
fn a_counter_stays_at_the_end_of_its_range() {
    let mut counter = Counter::new();
    let mut raw: u16 = 0;
    counter.advance(raw);
    for _ in 0..70_000 {
        raw = raw.wrapping_add(32_767);
        counter.advance(raw);
    }
    assert_eq!(counter.advance(raw), i32::MAX);
    assert!(counter.advance(raw.wrapping_sub(100)) < i32::MAX);
}

#[test]
fn an_encoder_has_a_start_a_scale_and_a_direction() {
    let scale = Scale::Encoder(Encoder {
        unit_per_count: -0.5,
        start: 3.0,
    });
    let mut counter = Counter::new();
    // 0 and full scale are counts as any other, and no broken wire.
    let values = [0, 4, u16::MAX, 4095].map(|raw| scale.physical(raw, 4095, &mut counter));
    assert_eq!(values, [3.0, 1.0, 3.5, 3.0 - 0.5 * 4095.0]);
}

#[test]
fn a_converter_at_its_end_is_a_missing_sample() {
    let scale = Scale::Converter(Span {
        zero: -1.0,
        full: 1.0,
    });
    let mut counter = Counter::new();
    let mut value = |raw| scale.physical(raw, 4094, &mut counter);
    assert!(value(0).is_nan() && value(4094).is_nan() && value(u16::MAX).is_nan());
    assert_eq!(value(2047), 0.0);
}

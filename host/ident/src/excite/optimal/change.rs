//! Changes of a design: one segment moved, replaced, split, joined with the next or exchanged with
//! another.

use rand::Rng;
use rand_chacha::ChaCha8Rng;

use super::exchange::Library;
use super::segment::Segment;
use crate::excite::Options;

/// A design that differs from another in one or two segments.
pub(super) fn changed(
    design: &[Segment],
    library: &Library,
    options: &Options,
    random: &mut ChaCha8Rng,
) -> Vec<Segment> {
    let mut design = design.to_vec();
    let place = random.random_range(0..design.len());
    let here = design[place];
    let half = here.with_length(here.length / 2);
    match random.random_range(0..6u8) {
        0 if half.length > 0 => {
            let other = half.neighbour(options, random);
            design.splice(place..=place, [half, other]);
        }
        1 if half.length > 0 => {
            let drawn = drawn(library, half.length, random);
            design.splice(place..=place, [half, drawn]);
        }
        2 => design[place] = drawn(library, here.length, random),
        3 => {
            let other = random.random_range(0..design.len());
            design.swap(place, other);
        }
        4 if design
            .get(place + 1)
            .is_some_and(|next| next.length == here.length) =>
        {
            let joined = here.with_length(2 * here.length);
            design.splice(place..=place + 1, [joined]);
        }
        _ => design[place] = here.neighbour(options, random),
    }
    design
}

/// A segment of the library, as long as is asked.
fn drawn(library: &Library, length: usize, random: &mut ChaCha8Rng) -> Segment {
    library.segments[library.draw(length, random)].with_length(length)
}

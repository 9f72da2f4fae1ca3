//! A rectifier of eight units between two dense layers: nothing comes back through a unit that it
//! shuts.

use crate::layers::dense::{column, dense_back, dense_seed};
use crate::layers::rows::{Rows, Weight};

/// Units of the rectifier.
const UNITS: usize = 8;

/// Adjoints of the input of two dense layers, one result for each output: `t_x = W1' D W2'
/// diag(outer)`. `D` has a one for each unit that the rectifier between them leaves open, `outer`
/// are the slopes of what follows.
///
/// Shapes: `a` is what the rectifier gave; `w1` is `[UNITS][IN]`, `w2` is `[OUT][UNITS]`. Cost:
/// `(IN + 1) OUT` multiply-adds for each of 4, 6, 7 or 8 units, whichever are the fewest that hold
/// the open ones.
#[inline(always)]
pub fn rectified_back<W1: Weight, W2: Weight, const IN: usize, const OUT: usize>(
    w2: &impl Rows<OUT, Row = [W2; UNITS]>,
    outer: &[f32; OUT],
    a: &[f32; UNITS],
    w1: &impl Rows<UNITS, Row = [W1; IN]>,
    t_x: &mut [[f32; OUT]; IN],
) {
    let open = list(a);
    if open < 1 << (3 * 5) {
        few::<4, W1, W2, IN, OUT>(w2, outer, open, w1, t_x);
    } else if open >= 1 << (3 * 8) {
        let mut t = [[0.0; OUT]; UNITS];
        dense_seed(w2, outer, &mut t);
        dense_back(w1, &t, t_x);
    } else if open < 1 << (3 * 7) {
        few::<6, W1, W2, IN, OUT>(w2, outer, open, w1, t_x);
    } else {
        few::<7, W1, W2, IN, OUT>(w2, outer, open, w1, t_x);
    }
}

/// The numbers of the open units in three bits each, the first one lowest, and a one above the
/// last: `n` of them make it at least `2^3n` and less than twice that. A NaN is open.
#[inline(always)]
fn list(a: &[f32; UNITS]) -> u32 {
    let mut open = 1;
    for (h, a) in a.iter().enumerate().rev() {
        let with = open << 3 | h as u32;
        open = if *a <= 0.0 { open } else { with };
    }
    open
}

/// [`rectified_back`] through at most `K` open units. Where there are fewer, others stand in and
/// count nothing.
#[inline(always)]
fn few<const K: usize, W1: Weight, W2: Weight, const IN: usize, const OUT: usize>(
    w2: &impl Rows<OUT, Row = [W2; UNITS]>,
    outer: &[f32; OUT],
    open: u32,
    w1: &impl Rows<UNITS, Row = [W1; IN]>,
    t_x: &mut [[f32; OUT]; IN],
) {
    let unit = |k: usize| (open >> (3 * k)) as usize % UNITS;
    let t: [[f32; OUT]; K] = core::array::from_fn(|k| {
        let h = unit(k);
        let counts = if open >> (3 * k) > 1 { 1.0 } else { 0.0 };
        core::array::from_fn(|r| {
            let t = outer[r] * w2.gain(r) * w2.rows()[r][h].value();
            w1.scaled(h, t * counts)
        })
    });
    let rows: [&[W1; IN]; K] = core::array::from_fn(|k| &w1.rows()[unit(k)]);
    // Two inputs a turn, written out: else it is the compiler's choice, which depends on what else
    // it sees.
    let (twos, rest) = t_x.split_at_mut(IN - IN % 2);
    let done = twos.len();
    for (i, two) in twos.chunks_exact_mut(2).enumerate() {
        for (c, t_x) in two.iter_mut().enumerate() {
            *t_x = column(rows, &t, 2 * i + c);
        }
    }
    for (c, t_x) in rest.iter_mut().enumerate() {
        *t_x = column(rows, &t, done + c);
    }
}

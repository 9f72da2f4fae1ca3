//! LDL' factorisation that notices an indefinite matrix and shifts it
//! (docs/explanation/controller.md, eq. 9).
#![allow(
    clippy::needless_range_loop,
    reason = "one index runs through several arrays and their neighbours, as in the equations"
)]

/// Pivots below this fraction of the largest diagonal element count as not positive.
const PIVOT_FLOOR: f32 = 1e-6;

/// First shift, as a fraction of the largest diagonal element.
const FIRST_SHIFT: f32 = 1e-3;

/// Solves `(A + shift I) x = b` for the symmetric `a` (its lower triangle is read) with the first
/// shift out of 0, a small one, and Gershgorin's bound that makes the pivots positive.
///
/// Returns the shift; `b` is overwritten with x. Cost: `N^3 / 6` multiply-adds, at most three
/// times. A NaN in `a` or `b` ends as NaN in x.
pub fn solve<const N: usize>(a: &[[f32; N]; N], b: &mut [f32; N]) -> f32 {
    let mut scale = 0.0_f32;
    for (i, row) in a.iter().enumerate() {
        let d = row[i].abs();
        if d > scale {
            scale = d;
        }
    }
    let mut l = const { [[0.0; N]; N] };
    let mut shift = 0.0;
    if !factor(a, shift, PIVOT_FLOOR * scale, &mut l) {
        shift = FIRST_SHIFT * scale;
        if !factor(a, shift, PIVOT_FLOOR * scale, &mut l) {
            // On a flat cost the second part alone limits the step, to a thousand model units.
            let steepest = b
                .iter()
                .fold(0.0, |m, b| if b.abs() > m { b.abs() } else { m });
            shift = 2.0 * row_sum(a) + 1e-3 * steepest + f32::MIN_POSITIVE;
            // Diagonally dominant now; a false here means NaN or infinity, which x then shows.
            factor(a, shift, 0.0, &mut l);
        }
    }
    substitute(&l, b);
    shift
}

/// Largest sum of magnitudes in a row of the symmetric matrix.
fn row_sum<const N: usize>(a: &[[f32; N]; N]) -> f32 {
    let mut sums = [0.0_f32; N];
    for (i, row) in a.iter().enumerate() {
        for (j, value) in row.iter().enumerate().take(i + 1) {
            sums[i] += value.abs();
            if j < i {
                sums[j] += value.abs();
            }
        }
    }
    sums.iter().fold(0.0, |m, s| if *s > m { *s } else { m })
}

/// `A + shift I = L D L'`; unit L below the diagonal of `l`, 1/D on it. False, with `l` unfinished,
/// at the first pivot that is not above `floor`.
#[inline(never)]
fn factor<const N: usize>(
    a: &[[f32; N]; N],
    shift: f32,
    floor: f32,
    l: &mut [[f32; N]; N],
) -> bool {
    // Row by row: L[i][j] needs the rows above it only.
    for i in 0..N {
        let mut pivot = a[i][i] + shift;
        for j in 0..i {
            // l[i][j] holds (L D)[i][j] until the pivot of this row is known.
            let mut value = a[i][j];
            for k in 0..j {
                value -= l[i][k] * l[j][k];
            }
            l[i][j] = value;
        }
        for j in 0..i {
            let ld = l[i][j];
            let unit = ld * l[j][j];
            pivot -= unit * ld;
            l[i][j] = unit;
        }
        if !(pivot > floor) {
            l[i][i] = f32::NAN;
            return false;
        }
        l[i][i] = 1.0 / pivot;
    }
    true
}

/// Forward, diagonal and backward substitution.
fn substitute<const N: usize>(l: &[[f32; N]; N], b: &mut [f32; N]) {
    for i in 0..N {
        let mut value = b[i];
        for j in 0..i {
            value -= l[i][j] * b[j];
        }
        b[i] = value;
    }
    for i in (0..N).rev() {
        let mut value = b[i] * l[i][i];
        for j in i + 1..N {
            value -= l[j][i] * b[j];
        }
        b[i] = value;
    }
}

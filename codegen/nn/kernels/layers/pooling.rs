//! Pools over one or two dimensions, channels last.

use crate::layers::window::Window;
use crate::number::Number;

/// The largest element of each window, channel by channel; padding counts for nothing. A NaN in a
/// window that begins with it stays.
#[inline(always)]
pub fn max_pool<N: Number, const LEN: usize, const OUT: usize, const C: usize>(
    window: &Window,
    x: &[N; LEN],
    y: &mut [N; OUT],
) {
    let mut outputs = y.chunks_exact_mut(C);
    for p in 0..window.output[0] {
        for q in 0..window.output[1] {
            let Some(y) = outputs.next() else { return };
            for (c, y) in y.iter_mut().enumerate() {
                if let Some((_, x)) = largest::<_, C>(window, x, [p, q], c) {
                    *y = x;
                }
            }
        }
    }
}

/// Cell and value of the largest element of channel `c` for output `at`; the first, if several are.
#[inline(always)]
fn largest<N: Number, const C: usize>(
    window: &Window,
    x: &[N],
    at: [usize; 2],
    c: usize,
) -> Option<(usize, N)> {
    let mut best: Option<(usize, N)> = None;
    for i in 0..window.size[0] {
        for j in 0..window.size[1] {
            let place = window.place(at[0], at[1], i, j);
            let found = place.and_then(|at| Some((at, *x.chunks_exact(C).nth(at)?.get(c)?)));
            if let Some((place, x)) = found {
                if best.is_none_or(|(_, most)| x.value() > most.value()) {
                    best = Some((place, x));
                }
            }
        }
    }
    best
}

/// Adjoints of `y` to adjoints of `x`: each goes to the largest element.
#[inline(always)]
pub fn max_pool_back<
    N: Number,
    const LEN: usize,
    const OUT: usize,
    const C: usize,
    const R: usize,
>(
    window: &Window,
    x: &[N; LEN],
    t_y: &[[N; R]; OUT],
    t_x: &mut [[N; R]; LEN],
) {
    *t_x = [[N::ZERO; R]; LEN];
    let mut outputs = t_y.chunks_exact(C);
    for p in 0..window.output[0] {
        for q in 0..window.output[1] {
            let Some(t_y) = outputs.next() else { return };
            for (c, t_y) in t_y.iter().enumerate() {
                let place = largest::<_, C>(window, x, [p, q], c).map(|(place, _)| place);
                let cell = place.and_then(|at| t_x.chunks_exact_mut(C).nth(at));
                if let Some(t_x) = cell.and_then(|cell| cell.get_mut(c)) {
                    for (t_x, t_y) in t_x.iter_mut().zip(t_y) {
                        *t_x = *t_x + *t_y;
                    }
                }
            }
        }
    }
}

/// `1 / n`, with n the elements of the window for output `at`: all of them, or those within the
/// image.
#[inline(always)]
fn share(window: &Window, count_padding: bool, at: [usize; 2]) -> f32 {
    if count_padding {
        return 1.0 / (window.size[0] * window.size[1]) as f32;
    }
    let mut count = 0;
    for i in 0..window.size[0] {
        for j in 0..window.size[1] {
            count += u32::from(window.place(at[0], at[1], i, j).is_some());
        }
    }
    1.0 / count as f32
}

/// The mean of each window, channel by channel.
#[inline(always)]
pub fn average_pool<N: Number, const LEN: usize, const OUT: usize, const C: usize>(
    window: &Window,
    count_padding: bool,
    x: &[N; LEN],
    y: &mut [N; OUT],
) {
    let mut outputs = y.chunks_exact_mut(C);
    for p in 0..window.output[0] {
        for q in 0..window.output[1] {
            let Some(y) = outputs.next() else { return };
            let share = share(window, count_padding, [p, q]);
            y.fill(N::ZERO);
            for i in 0..window.size[0] {
                for j in 0..window.size[1] {
                    let place = window.place(p, q, i, j);
                    if let Some(cell) = place.and_then(|at| x.chunks_exact(C).nth(at)) {
                        for (y, x) in y.iter_mut().zip(cell) {
                            *y = *y + *x;
                        }
                    }
                }
            }
            for y in y {
                *y = y.weigh(share);
            }
        }
    }
}

/// Adjoints of `y` to adjoints of `x`: each in equal parts to its window.
#[inline(always)]
pub fn average_pool_back<
    N: Number,
    const LEN: usize,
    const OUT: usize,
    const C: usize,
    const R: usize,
>(
    window: &Window,
    count_padding: bool,
    t_y: &[[N; R]; OUT],
    t_x: &mut [[N; R]; LEN],
) {
    *t_x = [[N::ZERO; R]; LEN];
    let mut outputs = t_y.chunks_exact(C);
    for p in 0..window.output[0] {
        for q in 0..window.output[1] {
            let Some(t_y) = outputs.next() else { return };
            let share = share(window, count_padding, [p, q]);
            for i in 0..window.size[0] {
                for j in 0..window.size[1] {
                    let place = window.place(p, q, i, j);
                    if let Some(cell) = place.and_then(|at| t_x.chunks_exact_mut(C).nth(at)) {
                        for (t_x, t_y) in cell.iter_mut().zip(t_y) {
                            for (t_x, t_y) in t_x.iter_mut().zip(t_y) {
                                *t_x = *t_x + t_y.weigh(share);
                            }
                        }
                    }
                }
            }
        }
    }
}

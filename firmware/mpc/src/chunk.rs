//! Runs of `C` elements within an array, by number: `as_chunks` of Rust 1.88, for older compilers.

/// Run `n` of the whole ones; `None` beyond them.
#[inline(always)]
pub fn chunk<T, const LEN: usize, const C: usize>(array: &[T; LEN], n: usize) -> Option<&[T; C]> {
    // First whether it is one of them: from that the compiler knows that both ends lie within.
    if n >= LEN / C {
        return None;
    }
    array.get(n * C..)?.first_chunk()
}

/// As [`chunk`], to be written.
#[inline(always)]
pub fn chunk_mut<T, const LEN: usize, const C: usize>(
    array: &mut [T; LEN],
    n: usize,
) -> Option<&mut [T; C]> {
    if n >= LEN / C {
        return None;
    }
    array.get_mut(n * C..)?.first_chunk_mut()
}

#[cfg(test)]
mod tests {
    use super::{chunk, chunk_mut};

    #[test]
    fn only_whole_runs_are_found() {
        let array = [0, 1, 2, 3, 4, 5, 6];
        assert_eq!(chunk(&array, 1), Some(&[3, 4, 5]));
        assert_eq!(chunk::<_, 7, 3>(&array, 2), None);
        assert_eq!(chunk::<_, 7, 3>(&array, usize::MAX), None);
        assert_eq!(chunk(&array, 2), Some(&[4, 5]));
        assert_eq!(chunk::<_, 7, 2>(&array, 3), None);
    }

    #[test]
    fn only_whole_runs_are_written() {
        let mut array = [0; 7];
        for n in [0, 1, 2, usize::MAX] {
            if let Some(run) = chunk_mut::<_, 7, 3>(&mut array, n) {
                *run = [n + 1; 3];
            }
        }
        assert_eq!(array, [1, 1, 1, 2, 2, 2, 0]);
    }
}

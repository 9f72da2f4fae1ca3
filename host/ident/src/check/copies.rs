//! Recordings that hold the same rows twice.

use super::finding::Check;
use crate::recording::Recording;

/// `same_recording`: the second file of each pair with the same times and columns.
pub(super) fn detect(recordings: &[Recording]) -> Vec<Check> {
    let mut found = Vec::new();
    for (index, recording) in recordings.iter().enumerate() {
        let earlier = recordings[..index].iter();
        let Some(first) = earlier.into_iter().find(|other| same(other, recording)) else {
            continue;
        };
        let sentence = format!(
            "the same rows as in {}: two recordings that are fitted count twice, and intervals \
             are too narrow by sqrt 2; a test on rows that were fitted proves nothing",
            first.path().display()
        );
        let remedy = "leave one of the two out, or cut the recording in two parts";
        found.push(Check::likely(
            recording,
            0,
            "same_recording",
            sentence,
            remedy,
        ));
    }
    found
}

/// Equal times and columns, to the bit.
fn same(one: &Recording, other: &Recording) -> bool {
    let equal = |a: &[f64], b: &[f64]| {
        a.len() == b.len() && a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits())
    };
    equal(one.t(), other.t())
        && one.columns().len() == other.columns().len()
        && one.columns().iter().all(|column| {
            (other.column(&column.name)).is_some_and(|values| equal(&column.values, values))
        })
}

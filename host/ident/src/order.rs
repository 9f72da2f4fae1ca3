//! Sorting by numbers.
//!
//! Lists of any type are sorted by an order of their keys, so that the sort is compiled once: one
//! for each of forty lists was a fifteenth of the crate's code. Equal items keep their order.

/// Sorts numbers upwards; NaN is last.
pub(crate) fn sort(numbers: &mut [f64]) {
    numbers.sort_unstable_by(f64::total_cmp);
}

/// Sorts items by a number, upwards.
pub(crate) fn sort_up<T>(items: &mut Vec<T>, key: impl Fn(&T) -> f64) {
    let keys: Vec<f64> = items.iter().map(key).collect();
    permute(items, &indices(&keys));
}

/// Sorts items by a number, downwards.
pub(crate) fn sort_down<T>(items: &mut Vec<T>, key: impl Fn(&T) -> f64) {
    sort_up(items, |item| -key(item));
}

/// Indices of numbers, upwards.
fn indices(keys: &[f64]) -> Vec<usize> {
    let mut indices: Vec<usize> = (0..keys.len()).collect();
    indices.sort_by(|&a, &b| keys[a].total_cmp(&keys[b]));
    indices
}

fn permute<T>(items: &mut Vec<T>, order: &[usize]) {
    let mut left: Vec<Option<T>> = items.drain(..).map(Some).collect();
    items.extend(order.iter().filter_map(|&index| left[index].take()));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn items_are_sorted_as_the_sort_of_the_standard_library_does() {
        let keys = [
            0.3,
            -0.0,
            f64::NAN,
            0.0,
            -1.0,
            f64::INFINITY,
            0.3,
            -f64::INFINITY,
            0.0,
        ];
        let items: Vec<(f64, usize)> = keys.iter().copied().zip(0..).collect();
        let labels = |items: &[(f64, usize)]| items.iter().map(|it| it.1).collect::<Vec<_>>();
        let (mut ours, mut theirs) = (items.clone(), items.clone());
        sort_up(&mut ours, |item| item.0);
        theirs.sort_by(|a, b| a.0.total_cmp(&b.0));
        assert_eq!(labels(&ours), labels(&theirs));
        let (mut ours, mut theirs) = (items.clone(), items);
        sort_down(&mut ours, |item| item.0);
        theirs.sort_by(|a, b| b.0.total_cmp(&a.0));
        assert_eq!(labels(&ours), labels(&theirs));
        let mut numbers = keys;
        sort(&mut numbers);
        assert!(numbers[8].is_nan() && numbers[0] == -f64::INFINITY);
    }
}

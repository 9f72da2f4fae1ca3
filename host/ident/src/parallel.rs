//! Loops on all cores.
//!
//! Every loop of the crate runs through one call of the scheduler, which is compiled once: a
//! generic one for each of 24 loops was a tenth of the crate's code. Results stand in the order of
//! the items, whoever finished first.

use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use rayon::iter::{IntoParallelIterator, ParallelIterator};

use crate::error::Result;

/// Result of `work` for each index below `count`.
pub(crate) fn indexed<R: Send>(count: usize, work: &(dyn Fn(usize) -> R + Sync)) -> Vec<R> {
    let slots: Vec<Mutex<Option<R>>> = (0..count).map(|_| Mutex::new(None)).collect();
    run(count, &|index| {
        let result = work(index);
        *slots[index].lock().expect("one index writes one slot") = Some(result);
    });
    let results = slots.into_iter().map(|slot| {
        let result = slot
            .into_inner()
            .expect("a panic of the work has passed on");
        result.expect("every index was run")
    });
    results.collect()
}

/// Result of `work` for each item.
pub(crate) fn map<T: Sync, R: Send>(items: &[T], work: impl Fn(&T) -> R + Sync) -> Vec<R> {
    indexed(items.len(), &|index| work(&items[index]))
}

/// Result of `work` for each item, which it takes.
pub(crate) fn map_owned<T: Send, R: Send>(items: Vec<T>, work: impl Fn(T) -> R + Sync) -> Vec<R> {
    let items: Vec<Mutex<Option<T>>> = items.into_iter().map(|it| Mutex::new(Some(it))).collect();
    indexed(items.len(), &|index| {
        let item = items[index]
            .lock()
            .expect("one index takes one item")
            .take();
        work(item.expect("every index is run once"))
    })
}

/// As [`indexed`]; `None` as soon as one is `None`, and no further index is begun then.
pub(crate) fn all<R: Send>(
    count: usize,
    work: &(dyn Fn(usize) -> Option<R> + Sync),
) -> Option<Vec<R>> {
    let failed = AtomicBool::new(false);
    let results = indexed(count, &|index| {
        if failed.load(Ordering::Relaxed) {
            return None;
        }
        let result = work(index);
        if result.is_none() {
            failed.store(true, Ordering::Relaxed);
        }
        result
    });
    results.into_iter().collect()
}

/// As [`map`], and no further item is begun after an error.
///
/// # Errors
/// The error of the first item, in their order, among those that were begun.
pub(crate) fn try_map<T: Sync, R: Send>(
    items: &[T],
    work: impl Fn(&T) -> Result<R> + Sync,
) -> Result<Vec<R>> {
    let failed = AtomicBool::new(false);
    let results = map(items, |item| {
        if failed.load(Ordering::Relaxed) {
            return None;
        }
        let result = work(item);
        if result.is_err() {
            failed.store(true, Ordering::Relaxed);
        }
        Some(result)
    });
    results.into_iter().flatten().collect()
}

fn run(count: usize, work: &(dyn Fn(usize) + Sync)) {
    (0..count).into_par_iter().for_each(work);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Error;

    #[test]
    fn results_stand_in_the_order_of_the_items() {
        let squares = indexed(1000, &|index| index * index);
        assert!(
            squares
                .iter()
                .enumerate()
                .all(|(index, &it)| it == index * index)
        );
        let words: Vec<String> = (0..100).map(|index| index.to_string()).collect();
        assert_eq!(map(&words, |word| word.clone()), words);
        assert_eq!(map_owned(words.clone(), |word| word), words);
        assert_eq!(all(100, &|index| Some(index.to_string())), Some(words));
        assert!(indexed(0, &|index| index).is_empty());
    }

    #[test]
    fn one_failure_fails_all_and_begins_no_further_item() {
        assert_eq!(all(1000, &|index| (index != 700).then_some(index)), None);
        let begun = Mutex::new(0);
        let items: Vec<usize> = (0..100_000).collect();
        let tried = try_map(&items, |&item| {
            *begun.lock().unwrap() += 1;
            if item % 2 == 0 {
                Ok(item)
            } else {
                Err(Error::failed(format!("item {item}")))
            }
        });
        assert!(tried.unwrap_err().to_string().starts_with("item "));
        assert!(*begun.lock().unwrap() < items.len() / 2, "it went on");
    }
}

//! Progress of the search, counted.

use crate::diagnose::time_budget::TimeBudget;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Callback with a part of the search, how much of it is done, and of how much.
pub(crate) type Callback<'a> = dyn Fn(&str, usize, usize) + Sync + 'a;

/// A part of the search, by its name.
#[derive(Clone, Copy)]
pub(crate) struct Progress<'a> {
    pub callback: &'a Callback<'a>,
    pub what: &'a str,
    /// Time that the whole search may take.
    pub time: &'a TimeBudget,
}

/// A number of like things to do.
pub(crate) struct Count<'a> {
    callback: &'a Callback<'a>,
    name: String,
    done: AtomicUsize,
    of: usize,
}

impl<'a> Progress<'a> {
    /// A count of so many things; reported as it begins.
    pub fn count(self, part: &str, of: usize) -> Count<'a> {
        let name = format!("{}: {part}", self.what);
        (self.callback)(&name, 0, of);
        Count {
            callback: self.callback,
            name,
            done: AtomicUsize::new(0),
            of,
        }
    }
}

impl Count<'_> {
    /// One more is done.
    pub fn one(&self) {
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        (self.callback)(&self.name, done, self.of);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use super::*;

    #[test]
    fn a_leg_is_heard_of_from_none_to_all() {
        let heard = Mutex::new(Vec::new());
        let callback = |what: &str, done: usize, of: usize| {
            let mut heard = heard.lock().expect("nobody else holds it");
            heard.push(format!("{what} {done}/{of}"));
        };
        let progress = Progress {
            callback: &callback,
            what: "one effect",
            time: &TimeBudget::default(),
        };
        let count = progress.count("fitted", 2);
        count.one();
        count.one();
        let heard = heard.lock().expect("nobody else holds it");
        let wanted = [
            "one effect: fitted 0/2",
            "one effect: fitted 1/2",
            "one effect: fitted 2/2",
        ];
        assert_eq!(heard[..], wanted);
    }
}

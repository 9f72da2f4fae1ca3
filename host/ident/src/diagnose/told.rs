//! What the search is doing, counted.

use std::sync::atomic::{AtomicUsize, Ordering};

/// Who hears what is being done, how much of it is, and of how much.
pub(super) type Hears<'a> = dyn Fn(&str, usize, usize) + Sync + 'a;

/// A part of the search, by its name.
#[derive(Clone, Copy)]
pub(super) struct Told<'a> {
    pub hears: &'a Hears<'a>,
    pub what: &'a str,
}

/// A number of like things to do.
pub(super) struct Leg<'a> {
    hears: &'a Hears<'a>,
    name: String,
    done: AtomicUsize,
    of: usize,
}

impl<'a> Told<'a> {
    /// A leg of so many; heard of as it begins.
    pub fn leg(self, leg: &str, of: usize) -> Leg<'a> {
        let name = format!("{}: {leg}", self.what);
        (self.hears)(&name, 0, of);
        Leg {
            hears: self.hears,
            name,
            done: AtomicUsize::new(0),
            of,
        }
    }
}

impl Leg<'_> {
    /// One more is done.
    pub fn one(&self) {
        let done = self.done.fetch_add(1, Ordering::Relaxed) + 1;
        (self.hears)(&self.name, done, self.of);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use super::*;

    #[test]
    fn a_leg_is_heard_of_from_none_to_all() {
        let heard = Mutex::new(Vec::new());
        let hears = |what: &str, done: usize, of: usize| {
            let mut heard = heard.lock().expect("nobody else holds it");
            heard.push(format!("{what} {done}/{of}"));
        };
        let told = Told {
            hears: &hears,
            what: "one effect",
        };
        let leg = told.leg("fitted", 2);
        leg.one();
        leg.one();
        let heard = heard.lock().expect("nobody else holds it");
        let wanted = [
            "one effect: fitted 0/2",
            "one effect: fitted 1/2",
            "one effect: fitted 2/2",
        ];
        assert_eq!(heard[..], wanted);
    }
}

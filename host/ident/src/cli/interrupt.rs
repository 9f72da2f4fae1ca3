//! Ctrl-C of a verb that can answer with the best so far.

use std::process::ExitCode;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, PoisonError};

use crate::diagnose::Stop;

/// Exit status after Ctrl-C, with an answer or without one.
pub const STATUS: u8 = 130;

/// Work that the next Ctrl-C ends, and what the program says then; none where it ends the program.
static LISTENING: Mutex<Option<(Stop, &str)>> = Mutex::new(None);

/// Line of a search that is ended.
const SEARCH: &str = "answering with the best so far; Ctrl-C again ends at once";

/// Some search has been ended so.
static INTERRUPTED: AtomicBool = AtomicBool::new(false);

fn listening() -> std::sync::MutexGuard<'static, Option<(Stop, &'static str)>> {
    LISTENING.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A request that the first Ctrl-C makes, for as long as it is kept.
pub struct Interrupt {
    /// The request.
    pub stop: Stop,
}

impl Interrupt {
    /// Listens from now on, for a search that can answer with the best so far.
    pub fn listen() -> Self {
        Self::saying(SEARCH)
    }

    /// Listens from now on; `line` is printed when the request comes.
    pub fn saying(line: &'static str) -> Self {
        let stop = Stop::default();
        *listening() = Some((stop.clone(), line));
        Self { stop }
    }
}

impl Drop for Interrupt {
    fn drop(&mut self) {
        *listening() = None;
    }
}

/// Takes a Ctrl-C: true where a search ends with what it has, false where the program has to end,
/// as it does the second time. For the handler of the program.
pub fn is_taken() -> bool {
    let search = listening();
    let Some((stop, line)) = search.as_ref().filter(|(stop, _)| !stop.is_asked()) else {
        return false;
    };
    stop.ask();
    INTERRUPTED.store(true, Ordering::Relaxed);
    eprintln!("\n{line}");
    true
}

/// Exit status of a verb that has done what it could; `code` where nobody interrupted it.
pub fn status(code: u8) -> ExitCode {
    ExitCode::from(if INTERRUPTED.load(Ordering::Relaxed) {
        STATUS
    } else {
        code
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_ctrl_c_ends_the_search_and_the_second_the_program() {
        assert!(!is_taken(), "nobody listens");
        let search = Interrupt::listen();
        assert!(is_taken() && search.stop.is_asked());
        assert!(!is_taken());
        drop(search);
        let next = Interrupt::listen();
        assert!(!next.stop.is_asked());
    }
}

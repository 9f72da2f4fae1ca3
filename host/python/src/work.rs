//! Long work in a thread of its own, so that Python stays responsive.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

use crate::data::refused;

/// Interval at which signals are looked for and progress is reported.
const TICK: Duration = Duration::from_millis(50);

/// Progress of work: what is done, how many of how many.
type News = (String, usize, usize);

/// Connection of running work to its caller.
#[derive(Clone, Default)]
pub struct Caller {
    interrupted: Arc<AtomicBool>,
    news: Arc<Mutex<Option<News>>>,
}

/// Payload of the unwinding that ends interrupted work.
struct Interrupted;

impl Caller {
    /// Leaves progress for the caller. Unwinds where the caller was interrupted: the fit has no
    /// other way to end early.
    pub fn tell(&self, what: &str, done: usize, of: usize) {
        if self.interrupted.load(Ordering::Relaxed) {
            // No panic: the hook that prints panics does not run.
            std::panic::resume_unwind(Box::new(Interrupted));
        }
        let mut news = self.news.lock().unwrap_or_else(PoisonError::into_inner);
        *news = Some((what.to_owned(), done, of));
    }
}

/// Runs work without the GIL. Ctrl-C ends the work and raises `KeyboardInterrupt`; `stop` hears of
/// it as well. `progress(what, done, of)` is called in the calling thread.
///
/// # Errors
/// `ValueError` with the text of the work's error; what a signal handler or `progress` raises.
pub fn run<T: Send, E: std::fmt::Display + Send>(
    py: Python<'_>,
    progress: Option<Py<PyAny>>,
    stop: impl Fn() + Sync,
    work: impl FnOnce(&Caller) -> Result<T, E> + Send,
) -> PyResult<T> {
    let caller = Caller::default();
    let of_work = caller.clone();
    py.detach(|| {
        std::thread::scope(|scope| {
            let (done, outcome) = channel();
            let worker = scope.spawn(move || {
                let result = work(&of_work);
                // Nobody listens where the caller was interrupted.
                let _ = done.send(());
                result
            });
            let mut raised = None;
            while let Err(RecvTimeoutError::Timeout) = outcome.recv_timeout(TICK) {
                if raised.is_some() {
                    continue;
                }
                if let Err(error) = Python::attach(|py| tick(py, &caller, progress.as_ref())) {
                    caller.interrupted.store(true, Ordering::Relaxed);
                    stop();
                    raised = Some(error);
                }
            }
            let result = worker.join();
            match (raised, result) {
                (Some(error), _) => Err(error),
                (None, Ok(result)) => result.map_err(refused),
                (None, Err(_)) => Err(PyRuntimeError::new_err("the computation failed")),
            }
        })
    })
}

/// Signals and progress, in the calling thread.
fn tick(py: Python<'_>, caller: &Caller, progress: Option<&Py<PyAny>>) -> PyResult<()> {
    py.check_signals()?;
    let news = caller
        .news
        .lock()
        .unwrap_or_else(PoisonError::into_inner)
        .take();
    if let (Some((what, done, of)), Some(progress)) = (news, progress) {
        progress.call1(py, (what, done, of))?;
    }
    Ok(())
}

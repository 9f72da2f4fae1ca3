//! Child processes that never outlive this one by more than a signal's delay.

use std::io;
use std::process::{Child, ChildStdin, ChildStdout, Command, ExitStatus};
use std::sync::{Mutex, PoisonError};

/// Children that run at this moment, for the handler of Ctrl-C.
static RUNNING: Mutex<Vec<u32>> = Mutex::new(Vec::new());

/// A child that is killed when it is dropped, and by [`kill_all`].
pub struct Guarded(Child);

impl Guarded {
    /// Starts `command`.
    ///
    /// # Errors
    /// What the operating system says.
    pub fn spawn(command: &mut Command) -> io::Result<Self> {
        let child = command.spawn()?;
        running().push(child.id());
        Ok(Self(child))
    }

    /// Process number.
    pub fn id(&self) -> u32 {
        self.0.id()
    }

    /// The pipe to it, once.
    pub fn stdin(&mut self) -> Option<ChildStdin> {
        self.0.stdin.take()
    }

    /// The pipe from it, once.
    pub fn stdout(&mut self) -> Option<ChildStdout> {
        self.0.stdout.take()
    }

    /// Its exit status if it has ended.
    ///
    /// # Errors
    /// What the operating system says.
    pub fn try_wait(&mut self) -> io::Result<Option<ExitStatus>> {
        self.0.try_wait()
    }

    /// Waits for its end and says how it ended.
    pub fn wait(&mut self) -> String {
        match self.0.wait() {
            Ok(status) => status.to_string(),
            Err(error) => error.to_string(),
        }
    }
}

impl Drop for Guarded {
    fn drop(&mut self) {
        running().retain(|id| *id != self.0.id());
        // Both fail only when the process has ended already.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Kills every child: for a handler of Ctrl-C, just before it ends the process.
///
/// Even without it none would stay: a device ends when its pipe closes, which the kernel does.
pub fn kill_all() {
    for id in running().drain(..) {
        // `kill` is POSIX's own program; std can signal a child only through its handle.
        let _ = Command::new("kill").args(["-KILL", &id.to_string()]).status();
    }
}

fn running() -> std::sync::MutexGuard<'static, Vec<u32>> {
    RUNNING.lock().unwrap_or_else(PoisonError::into_inner)
}

//! Child processes that never outlive this one by more than a signal's delay.

use std::io;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStderr, ChildStdin, ChildStdout, Command, ExitStatus};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

use nix::sys::signal::{Signal, killpg};
use nix::unistd::Pid;
use tempfile::TempDir;

/// Child processes that end with this process, for the handler of Ctrl-C.
static LIVE: Mutex<Live> = Mutex::new(Live {
    children: Vec::new(),
    folders: Vec::new(),
});

struct Live {
    children: Vec<u32>,
    folders: Vec<PathBuf>,
}

/// Tries to start a program that somebody still writes.
const BUSY_TRIES: usize = 50;

/// Pause between two of them.
const BUSY_PAUSE: Duration = Duration::from_millis(20);

/// A temporary folder for a child to work in. It goes when it is dropped, and by [`kill_all`].
pub struct Workplace(Option<TempDir>);

impl Workplace {
    /// An empty folder.
    ///
    /// # Errors
    /// Error of the operating system.
    pub fn new() -> io::Result<Self> {
        // Under the lock: there is no folder that `kill_all` does not know.
        let mut live = live();
        let folder = tempfile::tempdir()?;
        live.folders.push(folder.path().to_path_buf());
        Ok(Self(Some(folder)))
    }

    /// Its folder.
    pub fn path(&self) -> &Path {
        // It is taken by `drop` alone.
        self.0.as_ref().map_or(Path::new(""), TempDir::path)
    }
}

impl Drop for Workplace {
    fn drop(&mut self) {
        let mut live = live();
        live.folders.retain(|other| other != self.path());
        self.0 = None;
    }
}

/// A child that is killed, with all that it started, when it is dropped and by [`kill_all`].
///
/// It leads a process group of its own: cargo's compilers die with cargo, and the terminal's Ctrl-C
/// reaches this program alone, which then decides.
pub struct Guarded {
    child: Child,
    ended: Option<ExitStatus>,
}

impl Guarded {
    /// Starts `command`. A program that was just written may be open for writing a moment longer,
    /// in a child that another thread starts at that time: it is tried again for a second.
    ///
    /// # Errors
    /// Error of the operating system.
    pub fn spawn(command: &mut Command) -> io::Result<Self> {
        let busy = |error: &io::Error| error.kind() == io::ErrorKind::ExecutableFileBusy;
        for _ in 0..BUSY_TRIES {
            match Self::spawn_once(command) {
                Err(error) if busy(&error) => thread::sleep(BUSY_PAUSE),
                other => return other,
            }
        }
        Self::spawn_once(command)
    }

    fn spawn_once(command: &mut Command) -> io::Result<Self> {
        // Under the lock: no child can come into being that `kill_all` does not know.
        let mut live = live();
        let child = command.process_group(0).spawn()?;
        live.children.push(child.id());
        Ok(Self { child, ended: None })
    }

    /// Process number, which is its group's as well.
    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// The pipe to it, once.
    pub fn stdin(&mut self) -> Option<ChildStdin> {
        self.child.stdin.take()
    }

    /// The pipe from it, once.
    pub fn stdout(&mut self) -> Option<ChildStdout> {
        self.child.stdout.take()
    }

    /// The pipe of its complaints, once.
    pub fn stderr(&mut self) -> Option<ChildStderr> {
        self.child.stderr.take()
    }

    /// Its exit status if it has ended.
    ///
    /// # Errors
    /// Error of the operating system.
    pub fn try_wait(&mut self) -> io::Result<Option<ExitStatus>> {
        if self.ended.is_none() {
            // Under the lock: once it is reaped its number may become another process's.
            let mut live = live();
            self.ended = self.child.try_wait()?;
            if self.ended.is_some() {
                live.children.retain(|other| *other != self.child.id());
            }
        }
        Ok(self.ended)
    }

    /// Waits for its end.
    ///
    /// # Errors
    /// Error of the operating system.
    pub fn wait(&mut self) -> io::Result<ExitStatus> {
        loop {
            if let Some(status) = self.try_wait()? {
                return Ok(status);
            }
            std::thread::sleep(std::time::Duration::from_millis(2));
        }
    }
}

impl Drop for Guarded {
    fn drop(&mut self) {
        let mut live = live();
        if self.ended.is_none() {
            live.children.retain(|other| *other != self.child.id());
            kill(self.child.id());
            // Fails only when there is no such child any more.
            let _ = self.child.wait();
        }
    }
}

/// While it lives no child starts, and nobody learns that one was killed.
#[must_use = "hold it until the process ends"]
pub struct AllKilled {
    _held: MutexGuard<'static, Live>,
}

/// Kills every child and removes their folders: for the handler of Ctrl-C, which holds the result
/// until it ends the process, so that the rest of the program does not report the children's death
/// as a failure.
pub fn kill_all() -> AllKilled {
    let mut live = live();
    for child in live.children.drain(..) {
        kill(child);
    }
    for folder in live.folders.drain(..) {
        // A temporary folder that cannot be removed is the system's to clear away.
        let _ = std::fs::remove_dir_all(folder);
    }
    AllKilled { _held: live }
}

/// Kills a process group that has not been waited for.
fn kill(id: u32) {
    if let Ok(group) = i32::try_from(id) {
        // Fails only when the whole group has ended already.
        let _ = killpg(Pid::from_raw(group), Signal::SIGKILL);
    }
}

fn live() -> MutexGuard<'static, Live> {
    // A panic cannot leave it half-changed: push, retain and drain are the only changes.
    LIVE.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{BufRead, BufReader};
    use std::process::Stdio;
    use std::time::Instant;

    #[test]
    fn a_program_that_is_still_being_written_starts_once_it_is_closed() {
        let folder = tempfile::tempdir().unwrap();
        let program = folder.path().join("program");
        std::fs::copy("/bin/true", &program).unwrap();
        let written = std::fs::OpenOptions::new().append(true).open(&program);
        let written = written.unwrap();
        let start = || Guarded::spawn(&mut Command::new(&program));
        let busy = start().err().map(|error| error.kind());
        assert_eq!(busy, Some(io::ErrorKind::ExecutableFileBusy));
        let closing = thread::spawn(move || {
            thread::sleep(Duration::from_millis(100));
            drop(written);
        });
        assert!(start().is_ok());
        closing.join().unwrap();
    }

    #[test]
    fn a_dropped_child_takes_its_own_children_along() {
        let mut command = Command::new("sh");
        command
            .args(["-c", "sleep 1000 & echo $!; wait"])
            .stdout(Stdio::piped());
        let mut child = Guarded::spawn(&mut command).unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout().unwrap())
            .read_line(&mut line)
            .unwrap();
        let grandchild = PathBuf::from(format!("/proc/{}/stat", line.trim()));
        let alive =
            || std::fs::read_to_string(&grandchild).is_ok_and(|stat| !stat.contains(") Z "));
        assert!(alive(), "nothing to take along");
        drop(child);
        let patience = Instant::now() + Duration::from_secs(10);
        while alive() && Instant::now() < patience {
            std::thread::sleep(Duration::from_millis(5));
        }
        assert!(!alive());
    }

    #[test]
    fn a_workplace_goes_with_what_is_in_it() {
        let workplace = Workplace::new().unwrap();
        let path = workplace.path().to_path_buf();
        std::fs::write(path.join("log"), "x").unwrap();
        drop(workplace);
        assert!(!path.exists());
        assert!(!live().folders.contains(&path));
    }

    #[test]
    fn how_a_child_ended_can_be_asked_twice() {
        let mut child = Guarded::spawn(Command::new("sh").args(["-c", "exit 7"])).unwrap();
        assert_eq!(child.wait().unwrap().code(), Some(7));
        assert_eq!(
            child.try_wait().unwrap().and_then(|status| status.code()),
            Some(7)
        );
    }
}

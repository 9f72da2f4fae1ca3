//! Child processes that never outlive this one by more than a signal's delay.

use std::io;
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStderr, ChildStdin, ChildStdout, Command, ExitStatus};
use std::sync::{Mutex, MutexGuard, PoisonError};

use nix::sys::signal::{Signal, killpg};
use nix::unistd::Pid;
use tempfile::TempDir;

/// Children that run at this moment, for the handler of Ctrl-C.
static RUNNING: Mutex<Vec<Running>> = Mutex::new(Vec::new());

struct Running {
    id: u32,
    folder: Option<PathBuf>,
}

/// A child that is killed, with all that it started, when it is dropped and by [`kill_all`].
///
/// It leads a process group of its own: cargo's compilers die with cargo, and the terminal's Ctrl-C reaches
/// this program alone, which then decides.
pub struct Guarded {
    child: Child,
    folder: Option<TempDir>,
    ended: Option<ExitStatus>,
}

impl Guarded {
    /// Starts `command`.
    ///
    /// # Errors
    /// What the operating system says.
    pub fn spawn(command: &mut Command) -> io::Result<Self> {
        Self::start(command, None)
    }

    /// Starts `command` in a working folder of its own, which goes when the child does.
    ///
    /// # Errors
    /// What the operating system says.
    pub fn spawn_in(folder: TempDir, command: &mut Command) -> io::Result<Self> {
        command.current_dir(folder.path());
        Self::start(command, Some(folder))
    }

    fn start(command: &mut Command, folder: Option<TempDir>) -> io::Result<Self> {
        // Under the lock: no child can come into being that `kill_all` does not know.
        let mut running = running();
        let child = command.process_group(0).spawn()?;
        let path = folder.as_ref().map(|f| f.path().to_path_buf());
        running.push(Running {
            id: child.id(),
            folder: path,
        });
        Ok(Self {
            child,
            folder,
            ended: None,
        })
    }

    /// Process number, which is its group's as well.
    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// Its working folder, where it has one of its own.
    pub fn folder(&self) -> Option<&Path> {
        self.folder.as_ref().map(TempDir::path)
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
    /// What the operating system says.
    pub fn try_wait(&mut self) -> io::Result<Option<ExitStatus>> {
        if self.ended.is_none() {
            // Under the lock: once it is reaped its number may become another process's.
            let mut running = running();
            self.ended = self.child.try_wait()?;
            if self.ended.is_some() {
                running.retain(|other| other.id != self.child.id());
            }
        }
        Ok(self.ended)
    }

    /// Waits for its end.
    ///
    /// # Errors
    /// What the operating system says.
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
        let mut running = running();
        if self.ended.is_none() {
            running.retain(|other| other.id != self.child.id());
            kill(self.child.id());
            // Fails only when there is no such child any more.
            let _ = self.child.wait();
        }
    }
}

/// While it lives no child starts, and nobody learns that one was killed.
#[must_use = "hold it until the process ends"]
pub struct AllKilled {
    _held: MutexGuard<'static, Vec<Running>>,
}

/// Kills every child and removes its folder: for the handler of Ctrl-C, which holds the result until it
/// ends the process, so that the rest of the program does not report the children's death as a failure.
pub fn kill_all() -> AllKilled {
    let mut running = running();
    for child in running.drain(..) {
        kill(child.id);
        if let Some(folder) = child.folder {
            // A temporary folder that cannot be removed is the system's to clear away.
            let _ = std::fs::remove_dir_all(folder);
        }
    }
    AllKilled { _held: running }
}

/// Kills a process group that has not been waited for.
fn kill(id: u32) {
    if let Ok(group) = i32::try_from(id) {
        // Fails only when the whole group has ended already.
        let _ = killpg(Pid::from_raw(group), Signal::SIGKILL);
    }
}

fn running() -> MutexGuard<'static, Vec<Running>> {
    RUNNING.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{BufRead, BufReader};
    use std::process::Stdio;

    #[test]
    fn a_dropped_child_takes_its_own_children_and_its_folder_with_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().to_path_buf();
        let mut command = Command::new("sh");
        command
            .args(["-c", "sleep 1000 & echo $!; wait"])
            .stdout(Stdio::piped());
        let mut child = Guarded::spawn_in(folder, &mut command).unwrap();
        let mut line = String::new();
        BufReader::new(child.stdout().unwrap())
            .read_line(&mut line)
            .unwrap();
        let grandchild = PathBuf::from(format!("/proc/{}/stat", line.trim()));
        let alive =
            || std::fs::read_to_string(&grandchild).is_ok_and(|stat| !stat.contains(") Z "));
        assert!(alive() && path.exists(), "nothing to take along");
        drop(child);
        let patience = std::time::Instant::now() + std::time::Duration::from_secs(10);
        while alive() && std::time::Instant::now() < patience {
            std::thread::sleep(std::time::Duration::from_millis(5));
        }
        assert!(!alive() && !path.exists());
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

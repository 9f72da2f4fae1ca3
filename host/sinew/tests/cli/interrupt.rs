//! Ctrl-C, at any moment: exit status 130, no child left, no file half written.

use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::desk::{Desk, checkout, images};
use nix::sys::signal::{Signal, kill};
use nix::unistd::Pid;

/// Longest wait for anything: an image is linked with optimisation across crates, on a busy
/// machine.
const PATIENCE: Duration = Duration::from_secs(400);

/// Polls until `done`, and says whether it came to that.
fn wait_for(patience: Duration, mut done: impl FnMut() -> bool) -> bool {
    let deadline = Instant::now() + patience;
    while Instant::now() < deadline {
        if done() {
            return true;
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    false
}

/// Running processes that have to do with `folder`: by their command line, their environment or the
/// folder they work in. Each by its command line.
fn around(folder: &Path) -> Vec<String> {
    let needle = folder.as_os_str().as_encoded_bytes();
    let holds = |path: PathBuf| {
        std::fs::read(path).is_ok_and(|bytes| bytes.windows(needle.len()).any(|w| w == needle))
    };
    let mut found = Vec::new();
    for entry in std::fs::read_dir("/proc")
        .expect("this is a Linux")
        .flatten()
    {
        if !entry
            .file_name()
            .as_encoded_bytes()
            .iter()
            .all(u8::is_ascii_digit)
        {
            continue;
        }
        let process = entry.path();
        let works_there =
            std::fs::read_link(process.join("cwd")).is_ok_and(|path| path.starts_with(folder));
        // A process that has ended has neither, even while nobody has waited for it.
        if works_there || holds(process.join("cmdline")) || holds(process.join("environ")) {
            let line = std::fs::read(process.join("cmdline")).unwrap_or_default();
            let line = String::from_utf8_lossy(&line).replace('\0', " ");
            found.push(line.trim().to_string());
        }
    }
    found
}

/// `sinew LINE` on a desk, its own temporary files on the desk too.
fn start(desk: &Desk, line: &str) -> Child {
    std::fs::create_dir_all(desk.path("tmp")).expect("the folder can be made");
    desk.command(line)
        .env("TMPDIR", desk.path("tmp"))
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts")
}

/// The process has a handler for SIGINT, signal 2: before that it would die of it, as any program
/// does.
fn listens(process: u32) -> bool {
    let status = std::fs::read_to_string(format!("/proc/{process}/status")).unwrap_or_default();
    let caught = status.lines().find_map(|line| line.strip_prefix("SigCgt:"));
    caught
        .and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok())
        .is_some_and(|mask| mask & 2 != 0)
}

/// Sends SIGINT to the program alone, and holds it to its promises.
fn interrupt(desk: &Desk, mut child: Child, when: &str) {
    let id = Pid::from_raw(i32::try_from(child.id()).expect("a process number fits"));
    assert!(
        wait_for(PATIENCE, || listens(child.id())),
        "{when}: it takes no notice of signals"
    );
    kill(id, Signal::SIGINT).expect("the program runs");
    let told = Instant::now();
    let ended = wait_for(PATIENCE, || {
        child
            .try_wait()
            .expect("the program is a child of the test")
            .is_some()
    });
    let took = told.elapsed();
    assert!(ended, "{when}: it does not end");
    let output = child.wait_with_output().expect("the program has ended");
    let words = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(130), "{when}: {words}");
    assert!(words.contains("stopped"), "{when}: {words}");
    assert!(
        !words.contains("error:"),
        "{when}: a child's death was taken for a failure: {words}"
    );
    assert!(
        took < Duration::from_secs(5),
        "{when}: it took {took:?} to end"
    );

    let home = desk.path("");
    let gone = wait_for(Duration::from_secs(10), || around(&home).is_empty());
    assert!(gone, "{when}: {:?} are left", around(&home));
    for file in files(&home) {
        let name = file
            .file_name()
            .map(|name| name.to_string_lossy().into_owned())
            .unwrap_or_default();
        let length = std::fs::metadata(&file).map(|m| m.len()).unwrap_or(0);
        assert!(
            !name.ends_with(".tmp") && length > 0,
            "{when}: {} is half written",
            file.display()
        );
    }
    let left: Vec<_> = std::fs::read_dir(desk.path("tmp"))
        .expect("the folder is there")
        .flatten()
        .collect();
    assert!(
        left.is_empty(),
        "{when}: temporary files are left: {left:?}"
    );
}

#[test]
fn a_reader_that_goes_away_ends_it_in_silence() {
    for results in ["--out f.toml", "--json -"] {
        let (reader, writer) = std::io::pipe().expect("a pipe can be made");
        drop(reader);
        let (status, words) = fit_into(results, writer.into());
        // Beside a file on standard output, the numbers for a person go to standard error.
        assert!(!words.contains("error: "), "{words}");
        assert_eq!(status, Some(141), "{results}: {words}");
    }
}

#[test]
fn a_full_disk_behind_standard_output_is_an_error() {
    for (results, file) in [("--out f.toml", "standard output"), ("--json -", "-")] {
        let full = std::fs::File::options().write(true).open("/dev/full");
        let (status, words) = fit_into(results, full.expect("a device").into());
        let expected = format!("error: {file}: cannot be written: No space left on device");
        let last = words.trim_end().lines().last();
        assert!(
            last.is_some_and(|line| line.starts_with(&expected)),
            "{words}"
        );
        assert_eq!(status, Some(1), "{words}");
        assert!(!words.contains("panicked"), "{words}");
    }
}

/// Status and standard error of a fit that writes to this standard output.
fn fit_into(results: &str, output: Stdio) -> (Option<i32>, String) {
    let desk = Desk::new();
    desk.bring("rigs/mass-spring-damper.toml")
        .bring("rigs/mass-spring-damper.fit.csv");
    let mut command = desk.command(&format!(
        "fit mass-spring-damper.toml --fit mass-spring-damper.fit.csv {results}"
    ));
    let output = command.stdout(output).stderr(Stdio::piped()).output();
    let output = output.expect("the program starts");
    let words = String::from_utf8_lossy(&output.stderr).into_owned();
    (output.status.code(), words)
}

/// Every file of the desk.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).expect("a folder").flatten() {
        if entry.file_type().is_ok_and(|kind| kind.is_dir()) {
            found.extend(files(&entry.path()));
        } else {
            found.push(entry.path());
        }
    }
    found
}

fn skip(reason: &str) {
    // Written, not printed: the test harness would swallow the output of a test that "passes".
    let _ = writeln!(std::io::stderr(), "SKIPPED: {reason}");
}

/// Three coupled hinges with the signals of the stored reference model: a loop that needs no
/// training.
pub fn reference_desk() -> Desk {
    let desk = Desk::new();
    let mut rig = String::from("format = \"sinew-rig/1\"\nname = \"three hinges\"\n");
    for body in ["1", "2", "3"] {
        // Writing to a String cannot fail.
        let _ = writeln!(
            rig,
            r#"
[[body]]
name = "hinge{body}"
motion = "hinge"
inertia = {{ value = 1.0, min = 0.1 }}
[[spring]]
name = "spring{body}"
from = "{}"
to = "hinge{body}"
stiffness = 500.0
[[damper]]
name = "damper{body}"
from = "ground"
to = "hinge{body}"
damping = 20.0
[[sensor]]
name = "encoder{body}"
reads = "hinge{body}.position"
signal = "y{body}""#,
            if body == "3" { "hinge1" } else { "ground" }
        );
        if body != "3" {
            let _ = writeln!(
                rig,
                "[[actuator]]\nname = \"drive{body}\"\ndrives = \"hinge{body}\"\ninput = \"u{body}\"\n\
                 gain = 500.0\nlimit = [-0.9, 0.9]\nrate_limit = 7.2"
            );
        }
    }
    desk.write("rig.toml", &rig);
    let mut input = String::from("t,u1,u2\n");
    for k in 0..600 {
        let t = f64::from(k) / 120.0;
        let square = |period: f64| {
            if (t / period).fract() < 0.5 {
                0.6
            } else {
                -0.6
            }
        };
        let _ = writeln!(input, "{t},{},{}", square(1.0), square(1.7));
    }
    desk.write("input.csv", &input);
    desk.succeed("simulate rig.toml --input input.csv --out signals.csv --quiet");
    let signals = desk.read("signals.csv");
    let rows = signals.lines().zip(input.lines()).map(|(signals, input)| {
        let inputs = input
            .split_once(',')
            .map(|(_, inputs)| inputs)
            .unwrap_or_default();
        format!("{signals},{inputs}\n")
    });
    desk.write("recording.csv", &rows.collect::<String>());
    desk
}

#[test]
fn while_it_fits_and_trains() {
    for wait_ms in [0, 2000, 4500] {
        let desk = Desk::new();
        desk.bring("rigs/mass-spring-damper.toml")
            .bring("rigs/mass-spring-damper.fit.csv");
        let child = start(
            &desk,
            "build mass-spring-damper.toml --fit mass-spring-damper.fit.csv --board host --out out",
        );
        std::thread::sleep(Duration::from_millis(wait_ms));
        interrupt(&desk, child, &format!("after {wait_ms} ms"));
    }
}

#[test]
fn while_cargo_builds_and_while_the_board_runs() {
    let desk = reference_desk();
    // The board's dependencies are built once.
    let cache = images();
    let model = checkout().join("models/reference-s");
    let qemu = Command::new("qemu-system-arm")
        .arg("--version")
        .output()
        .is_ok();
    let line = |board: &str| {
        format!(
            "pil rig.toml {} --fit recording.csv --board {board} --out out --build-dir {}",
            model.display(),
            cache.display()
        )
    };
    let running = |word: &str| {
        around(&desk.path(""))
            .iter()
            .any(|line| line.contains(word))
    };

    let child = start(&desk, &line("host"));
    assert!(
        wait_for(PATIENCE, || running("cargo build")),
        "cargo never ran"
    );
    interrupt(&desk, child, "while cargo builds");

    let (board, program) = if qemu {
        ("qemu", "qemu-system-arm -machine")
    } else {
        ("host", "sinew-board-host")
    };
    let child = start(&desk, &line(board));
    assert!(
        wait_for(PATIENCE, || running(program)),
        "{program} never ran"
    );
    interrupt(&desk, child, "while the board runs");

    // What was left is no hindrance.
    desk.succeed(&line(board));
    if !qemu {
        skip("no qemu-system-arm (cargo xtask setup): Ctrl-C was tried on the host's build");
    }
}

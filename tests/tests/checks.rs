//! The checks that a device makes of itself, on this computer and in QEMU; a board with a probe
//! runs the same list (docs/how-to/port-a-board.md).

use std::process::{Command, Stdio};

use sinew::device::{Workplace, decode_log};
use sinew::pipeline::footprint::count;
use sinew::project::checks as checks_of;
use sinew_device::checks::{self, Golden, Subject, Wrong};
use sinew_device::clock::Clock;
use sinew_device::for_each_check;
use sinew_model_reference_s::control::Session;
use sinew_model_reference_s::golden::GOLDEN;
use sinew_model_reference_s::session;
use sinew_tests::{image, skip};

/// This computer's time says nothing about a chip's.
struct NoClock;

impl Clock for NoClock {
    fn ticks(&self) -> u32 {
        0
    }
}

fn subject() -> Subject<Session, NoClock> {
    Subject {
        session: session(),
        clock: NoClock,
        period_ticks: 0,
    }
}

/// The vectors, all outputs `off` too large.
fn golden(off: f32) -> impl Iterator<Item = Golden> {
    GOLDEN.iter().map(move |golden| {
        let jacobian = golden.jacobian.iter().flatten();
        Golden::new(
            &golden.x,
            golden.y.iter().map(|v| *v as f32 + off),
            jacobian.map(|v| *v as f32 + off),
        )
    })
}

macro_rules! on_this_computer {
    ($($name:ident)*) => { $(
        #[test]
        fn $name() {
            assert_eq!(checks::$name(subject, golden(0.0)), Ok(()));
        }
    )* };
}
for_each_check!(on_this_computer);

#[test]
fn a_network_that_is_another_is_found_out() {
    let found = checks::the_network_is_that_of_double_precision(subject, golden(1e-3));
    assert!(matches!(found, Err(Wrong::Off(_))), "{found:?}");
    let found = checks::its_derivatives_are_those_of_double_precision(subject, golden(1e-3));
    assert!(matches!(found, Err(Wrong::Off(_))), "{found:?}");
    let none = checks::the_network_is_that_of_double_precision(subject, std::iter::empty());
    assert_eq!(none, Err(Wrong::Nothing));
}

#[test]
fn all_of_them_hold_in_qemu() {
    if let Some(reason) = image::cannot_run() {
        return skip(reason);
    }
    let cache = image::cache();
    let program = checks_of(&image::root(), &cache).unwrap_or_else(|error| panic!("{error}"));
    let folder = Workplace::new().expect("a temporary folder");
    let log = folder.path().join("log");
    let status = Command::new("sh")
        .arg(image::runner())
        .arg(&program)
        .env("LOG", &log)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .status()
        .expect("QEMU was there a moment ago");
    let log = std::fs::read(&log).expect("QEMU wrote a log");
    let log = decode_log(&program, &log).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(status.code(), Some(0), "{log}");
    let names = {
        macro_rules! names {
            ($($name:ident)*) => { [$(stringify!($name)),*] };
        }
        for_each_check!(names)
    };
    for name in names {
        assert!(log.contains(&format!("{name} ... ok")), "{name}:\n{log}");
    }
}

#[test]
fn no_step_takes_more_than_its_parts_as_often_as_they_may_occur() {
    if let Some(reason) = image::cannot_run() {
        return skip(reason);
    }
    let steps = count(&image::root(), &image::cache()).unwrap_or_else(|error| panic!("{error}"));
    println!("{steps:?}");
    assert!(steps.steps >= 400 && steps.mean > 10_000);
    assert!(
        steps.mean < steps.longest && steps.longest <= steps.bound,
        "{steps:?}"
    );
}

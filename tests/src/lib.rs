//! Common parts of the tests of `tests/tests`: the images of this checkout, the reference problem's
//! plant, and the loop around it. Talking to a device is `sinew::device`.

pub mod board;
pub mod callgraph;
pub mod closed_loop;
pub mod gdb;
pub mod image;
pub mod reference;
pub mod rtt;
pub mod snapshot;
pub mod state_demo;

use std::io::Write;

/// Says why a test cannot run here; the caller returns. `cargo xtask test` counts these and lists
/// them.
pub fn skip(reason: &str) {
    // Written, not printed: the test harness would swallow the output of a test that "passes".
    let _ = writeln!(std::io::stdout(), "SKIPPED: {reason}");
}

//! Common start of every program of this board.

use sinew_board_runtime::{self as runtime, Parts};
use static_cell::StaticCell;

use crate::executor::Executor;
use crate::time;

static EXECUTOR: StaticCell<Executor> = StaticCell::new();

/// Starts the time base and makes the parts, in statics: as locals of a task they would be built on
/// the stack first, in a frame that stays. First thing in `main`, once.
#[inline(never)]
pub fn start() -> (&'static mut Executor, Parts) {
    let parts = runtime::start();
    time::init();
    (EXECUTOR.init_with(Executor::new), parts)
}

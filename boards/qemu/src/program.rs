//! What every program of this board starts with.

use model::control::Session;
use static_cell::StaticCell;

use crate::executor::Executor;
use crate::link::Link;
use crate::{stack, time};

static EXECUTOR: StaticCell<Executor> = StaticCell::new();
static SESSION: StaticCell<Session> = StaticCell::new();
static LINK: StaticCell<Link> = StaticCell::new();

/// The long-lived parts, in statics: as locals of a task they would be built on the stack first, in a frame
/// that stays.
pub struct Parts {
    /// Runs the tasks.
    pub executor: &'static mut Executor,
    /// Answers messages.
    pub session: &'static mut Session,
    /// Messages from bytes.
    pub link: &'static mut Link,
}

/// Paints the stack, starts the time base, makes the parts. First thing in `main`, once.
#[inline(never)]
pub fn start() -> Parts {
    stack::paint();
    time::init();
    Parts {
        executor: EXECUTOR.init_with(Executor::new),
        session: SESSION.init_with(model::session),
        link: LINK.init_with(Link::new),
    }
}

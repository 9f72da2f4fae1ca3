//! The part that all boards share. A board adds clocks, pins and drivers behind the trait
//! [`Board`]; `docs/how-to/port-a-board.md` shows the way.
//!
//! A frame's bytes go through [`link`], a tick of the timer through [`serve()`], converter codes
//! through [`wiring`]. Whether anything may move, `sinew_device::session` decides.

#![no_std]
#![allow(
    async_fn_in_trait,
    reason = "one executor in thread mode: no future is sent anywhere"
)]

pub mod checks;
pub mod link;
pub mod newest;
pub mod outbox;
pub mod pacer;
pub mod probe;
pub mod restart;
pub mod scales;
pub mod serve;
pub mod stack;
pub mod wiring;

pub use model;
pub use serve::{Board, serve};

use link::Link;
use model::control::Session;
use static_cell::StaticCell;

static SESSION: StaticCell<Session> = StaticCell::new();
static LINK: StaticCell<Link> = StaticCell::new();

/// Parts of a program: the controller with frames around it, and its end of the link.
pub struct Parts {
    /// The controller.
    pub session: &'static mut Session,
    /// The link.
    pub link: &'static mut Link,
}

/// Paints the stack and makes the parts. First thing in `main`, once.
// Not inlined: what the initial values need of the stack is given back before control begins.
#[inline(never)]
pub fn start() -> Parts {
    stack::paint();
    Parts {
        session: SESSION.init_with(model::session),
        link: LINK.init_with(Link::new),
    }
}

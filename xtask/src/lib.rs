//! Child processes, the repository's folders and the toolchain: shared by the tasks and by
//! `tests/evaluation`.

mod apt;
pub mod process;
pub mod setup;
mod unpacked;

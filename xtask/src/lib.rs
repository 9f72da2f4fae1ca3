//! Child processes, the repository's folders and the toolchain: shared by the tasks and by
//! `tests/evaluation`.

pub mod process;
pub mod setup;

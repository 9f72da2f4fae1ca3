//! The sources of firmware and boards as they were when this program was built (host/build.rs).

include!(concat!(env!("OUT_DIR"), "/sources.rs"));

//! The `sinew` program as its users meet it. One test program, because linking is the slow part.

mod adopt;
mod browser;
mod calibrate;
mod commission;
mod compare;
mod convert;
mod desk;
mod excite;
mod fit_static;
mod fleet;
mod how_to;
mod identify;
mod import;
mod interrupt;
mod learn;
mod outputs;
mod pages;
mod plan;
mod projects;
mod refusals;
mod results;
mod schema;
mod settle;
mod simulate;
mod toolchain;
mod wire;

//! The `sinew` program: see [`sinew::cli`].

use std::process::ExitCode;

fn main() -> ExitCode {
    sinew::cli::main()
}

//! The program `sinew-ident`: `sinew fit`, `diagnose`, `excite` and `mjcf` without the trainer.

use std::process::ExitCode;

fn main() -> ExitCode {
    sinew_ident::cli::main()
}

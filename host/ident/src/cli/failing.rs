//! Ends of a program: an error on standard error, and standard output that takes no more.

use std::process::ExitCode;

use super::colour;
use crate::error::{Error, Kind};

/// Status that a shell gives to a program which a closed pipe has killed.
const CLOSED_PIPE: u8 = 128 + 13;

/// Status of an error, which is printed. Where the reader of standard output has gone away
/// (`sinew fit .. --json - | head -1`) there is nobody to tell: 141, without a word.
pub fn status(error: &Error) -> ExitCode {
    if let Kind::Write { path, source, .. } = error.kind()
        && source.kind() == std::io::ErrorKind::BrokenPipe
        && sinew_files::is_output(path)
    {
        return ExitCode::from(CLOSED_PIPE);
    }
    colour::on_error(format!("error: {error}"));
    ExitCode::from(error.exit_code())
}

/// Makes a failing `println` end the program as [`status()`] would: it panics otherwise, where the
/// reader has gone away or the disk behind standard output is full. What `tidy` returns is held
/// until the process is gone.
pub fn end_with_standard_output<Held>(tidy: impl Fn() -> Held + Send + Sync + 'static) {
    let usual = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        let words = panic.payload_as_str().unwrap_or_default();
        let Some((stream, reason)) = words
            .strip_prefix("failed printing to ")
            .and_then(|words| words.split_once(": "))
        else {
            return usual(panic);
        };
        let _held = tidy();
        let closed = reason.contains("Broken pipe");
        // Standard error itself may be what takes no more: then there is nobody to tell.
        if stream == "stdout" && !closed {
            colour::on_error(format!(
                "error: standard output: cannot be written: {reason}"
            ));
        }
        std::process::exit(if closed { CLOSED_PIPE.into() } else { 1 });
    }));
}

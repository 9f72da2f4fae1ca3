//! The firmware's defmt log, decoded with the strings that stand in its image.

use std::fmt::Write as _;
use std::path::Path;

use defmt_decoder::{DecodeError, Table};

use sinew_ident::error::{Error, Result};

/// The log as text, a line a message; bytes that are no message are counted at its end.
///
/// # Errors
/// The image cannot be read or carries no defmt strings.
pub fn decode_log(image: &Path, log: &[u8]) -> Result<String> {
    let data = std::fs::read(image).map_err(|e| Error::read(image, e))?;
    let table = Table::parse(&data)
        .map_err(|e| Error::file(image, format!("its log strings cannot be read: {e}")))?
        .ok_or_else(|| Error::file(image, "no log strings").expected("firmware that uses defmt"))?;
    let mut decoder = table.new_stream_decoder();
    decoder.received(log);
    let (mut text, mut damaged) = (String::new(), 0);
    loop {
        match decoder.decode() {
            Ok(frame) => {
                let level = frame.level().map_or("     ", |l| l.as_str());
                let time = frame
                    .display_timestamp()
                    .map(|t| t.to_string())
                    .unwrap_or_default();
                // Writing to a String cannot fail.
                let _ = writeln!(text, "{time:>12} {level:<5} {}", frame.display_message());
            }
            Err(DecodeError::UnexpectedEof) => break,
            Err(DecodeError::Malformed) => {
                damaged += 1;
                if !table.encoding().can_recover() {
                    break;
                }
            }
        }
    }
    if damaged > 0 {
        let _ = writeln!(text, "{damaged} messages were damaged");
    }
    Ok(text)
}

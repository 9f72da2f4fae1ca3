//! A [`Recording`] to CSV text.

use std::fmt::Write;

use super::Recording;

pub(super) fn to_csv(recording: &Recording) -> String {
    let mut text = String::with_capacity(recording.len() * (recording.columns.len() + 1) * 12);
    text.push('t');
    for column in &recording.columns {
        text.push(',');
        push_name(&mut text, &column.name);
    }
    text.push('\n');
    for (row, t) in recording.t.iter().enumerate() {
        push_number(&mut text, *t);
        for column in &recording.columns {
            text.push(',');
            push_number(&mut text, column.values[row]);
        }
        text.push('\n');
    }
    text
}

/// The shortest decimal text that reads back as the same bits; nothing for a missing sample.
fn push_number(text: &mut String, value: f64) {
    if !value.is_nan() {
        // `{:?}` is `{}` with an exponent where that is shorter. Writing to a String cannot fail.
        let _ = write!(text, "{value:?}");
    }
}

fn push_name(text: &mut String, name: &str) {
    if name.contains([',', '"', '#']) {
        text.push('"');
        text.push_str(&name.replace('"', "\"\""));
        text.push('"');
    } else {
        text.push_str(name);
    }
}

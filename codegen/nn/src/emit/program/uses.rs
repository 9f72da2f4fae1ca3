//! The `use` lines of a printed network.

use crate::emit::kernels;
use crate::emit::plan::Plan;

/// The `use` lines for the kernels that the text names.
pub(super) fn print(plan: &Plan<'_>, text: &str) -> String {
    let words: std::collections::HashSet<&str> = text
        .split(|c: char| !c.is_alphanumeric() && c != '_')
        .collect();
    // A function is named where it is called; a field may have the same name.
    let is_named = |item: &str| {
        let called = [
            format!(" {item}("),
            format!(" {item}::<"),
            format!("({item}("),
            format!("&{item}("),
        ];
        item.starts_with(char::is_uppercase) && words.contains(item)
            || called.iter().any(|call| text.contains(call.as_str()))
    };
    let mut lines = String::new();
    for (module, items) in kernels::ITEMS {
        let mut named: Vec<&str> = items
            .iter()
            .copied()
            .filter(|item| is_named(item))
            .collect();
        // rustfmt sorts types after functions.
        named.sort_by_key(|item| (item.starts_with(char::is_uppercase), *item));
        let list = named.join(", ");
        match named.as_slice() {
            [] => {}
            [one] => lines.push_str(&format!("use crate::{module}::{one};\n")),
            _ => lines.push_str(&format!("use crate::{module}::{{{list}}};\n")),
        }
    }
    let cells: Vec<&str> = ["gru", "lstm", "rnn"]
        .into_iter()
        .filter(|module| words.contains(module))
        .collect();
    match cells.as_slice() {
        [] => {}
        [one] => lines.push_str(&format!("use crate::layers::{one};\n")),
        _ => lines.push_str(&format!("use crate::layers::{{{}}};\n", cells.join(", "))),
    }
    if plan.network.has_tables() {
        lines.push_str("use crate::weights;\n");
    }
    let mut sorted: Vec<&str> = lines.lines().collect();
    sorted.sort_unstable();
    sorted.into_iter().map(wrapped).collect()
}

/// A `use` line as rustfmt would break it.
fn wrapped(line: &str) -> String {
    const WIDTH: usize = 100;
    let parts = line.split_once('{').filter(|_| line.len() > WIDTH);
    let Some((path, list)) = parts else {
        return format!("{line}\n");
    };
    let mut rows = vec![String::from("   ")];
    for item in list.trim_end_matches("};").split(", ") {
        if rows
            .last()
            .is_some_and(|row| row.len() + item.len() + 2 > WIDTH)
        {
            rows.push("   ".into());
        }
        if let Some(row) = rows.last_mut() {
            row.push_str(&format!(" {item},"));
        }
    }
    format!("{path}{{\n{}\n}};\n", rows.join("\n"))
}

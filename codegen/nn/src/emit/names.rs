//! Names of layers as Rust identifiers.

use std::collections::HashSet;

/// Words that a printed file uses for something else, or Rust does.
const TAKEN: &[&str] = &[
    "a", "abstract", "add", "as", "async", "await", "become", "box", "break", "const", "continue",
    "crate", "do", "dual", "dyn", "else", "enum", "extern", "false", "final", "fn", "for",
    "forward", "gen", "h", "if", "impl", "in", "input", "jacobian", "let", "loop", "macro",
    "match", "mod", "more", "move", "mut", "override", "predict", "priv", "pub", "ref", "return",
    "row", "rows", "seed", "self", "state", "static", "step", "steps", "struct", "super", "t",
    "trait", "true", "try", "type", "typeof", "unsafe", "unsized", "use", "virtual", "weights",
    "where", "while", "x", "y", "yield",
];

/// Longest that is kept of a name.
const MAX: usize = 40;

/// An identifier for each name, in the same order, no two alike.
pub(super) fn identifiers<'a>(names: impl Iterator<Item = &'a str>) -> Vec<String> {
    let mut taken: HashSet<String> = TAKEN.iter().map(|&word| word.into()).collect();
    names
        .map(|name| {
            let stem = identifier(name);
            let mut unique = stem.clone();
            let mut number = 2;
            while !taken.insert(unique.clone()) {
                unique = format!("{stem}_{number}");
                number += 1;
            }
            unique
        })
        .collect()
}

/// `Dense_1/BiasAdd` becomes `dense_1_bias_add`.
fn identifier(name: &str) -> String {
    let mut text = String::new();
    let mut small = false;
    for c in name.chars().take(256) {
        if c.is_ascii_alphanumeric() {
            if c.is_ascii_uppercase() && small {
                text.push('_');
            }
            small = c.is_ascii_lowercase();
            text.push(c.to_ascii_lowercase());
        } else {
            small = false;
            if !text.is_empty() && !text.ends_with('_') {
                text.push('_');
            }
        }
        if text.len() >= MAX {
            break;
        }
    }
    let text = text.trim_end_matches('_');
    if text.starts_with(|c: char| c.is_ascii_lowercase()) {
        text.into()
    } else {
        format!("layer_{text}").trim_end_matches('_').into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_become_identifiers_of_their_own() {
        let names = ["Dense_1/BiasAdd", "dense 1 bias-add", "7", "fn", "été", "x"];
        let found = identifiers(names.into_iter());
        let expected = [
            "dense_1_bias_add",
            "dense_1_bias_add_2",
            "layer_7",
            "fn_2",
            "t_2",
            "x_2",
        ];
        assert_eq!(found, expected);
    }
}

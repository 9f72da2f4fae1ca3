//! Lengths of functions: those that are too long are counted against a budget that falls.

use anyhow::{Context, Result};

use crate::modules::tokens::{Token, tokens};
use crate::prose::budget;

/// A function with more lines, from `fn` to its closing brace, is a long one.
const LONG: usize = 90;
/// Key of the table `[code]` of `tests/budgets.toml`.
const KEY: &str = "functions_over_90_lines";

/// Long functions of a source file, a line each: place, name and length.
pub fn long(path: &str, text: &str) -> Vec<String> {
    let tokens = tokens(text);
    let functions = (0..tokens.len()).filter_map(|at| {
        let [keyword, name] = tokens.get(at..at + 2)? else {
            return None;
        };
        // `fn(` is a type.
        (keyword.is("fn") && name.is_word()).then_some(())?;
        let lines = end(&tokens[at..])? + 1 - keyword.line;
        let (line, name) = (keyword.line, &name.text);
        (lines > LONG).then(|| format!("{path}:{line}: {name} has {lines} lines"))
    });
    functions.collect()
}

/// Line of the brace that closes a function's body; `None` for a declaration without a body.
fn end(tokens: &[Token]) -> Option<usize> {
    let (mut parentheses, mut braces) = (0_usize, 0_usize);
    for token in tokens {
        match token.text.as_str() {
            "(" | "[" => parentheses += 1,
            ")" | "]" => parentheses = parentheses.saturating_sub(1),
            ";" if parentheses == 0 && braces == 0 => return None,
            // In a signature, of the length of an array.
            "{" if braces > 0 || parentheses == 0 => braces += 1,
            "}" if braces == 1 => return Some(token.line),
            "}" => braces = braces.saturating_sub(1),
            _ => {}
        }
    }
    None
}

/// Prints the number of long functions beside its budget; a line where it is over it.
///
/// # Errors
/// The budget lacks the number.
pub fn against(long: &[String], budgets: &str) -> Result<Option<String>> {
    let budget = budget(budgets, "code", KEY)
        .with_context(|| format!("tests/budgets.toml has no [code] {KEY}"))?;
    let found = long.len();
    let line = format!("{KEY} {found}, budget {budget}");
    let lower = if (found as f64) < budget {
        format!(": lower the budget to {found}")
    } else {
        String::new()
    };
    println!("{line}{lower}");
    let over = found as f64 > budget;
    Ok(over.then(|| format!("tests/budgets.toml: {line}; --list names the places")))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A function of so many lines, with what is no brace of its own in the way.
    fn function(lines: usize) -> String {
        let head = "    fn f<const N: usize>(a: [u8; { N }], g: fn(u8) -> u8) -> &'static str {\n";
        let filling = "        let x = '{'; // }\n".repeat(lines - 3);
        format!("{head}{filling}        \"}}\"\n    }}\n")
    }

    #[test]
    fn a_function_counts_from_its_name_to_its_closing_brace() {
        let none: [&str; 0] = [];
        assert_eq!(long("a.rs", &function(90)), none);
        let text = format!("//! Page.\n\n{}{}", function(91), function(4));
        assert_eq!(long("a.rs", &text), ["a.rs:3: f has 91 lines"]);
    }

    #[test]
    fn a_declaration_has_no_body() {
        let declared = format!("trait T {{\n    fn f(&self);\n}}\n{}", "// \n".repeat(100));
        assert_eq!(long("a.rs", &declared), [""; 0]);
    }

    #[test]
    fn more_long_functions_than_the_budget_are_refused() {
        let budgets = "[prose]\nx = 1\n\n[code]\nfunctions_over_90_lines = 1\n";
        let long = ["a".to_owned(), "b".to_owned()];
        assert_eq!(against(&long[..1], budgets).expect("a budget"), None);
        assert!(against(&long, budgets).expect("a budget").is_some());
        assert!(against(&long, "[prose]\n").is_err());
    }
}

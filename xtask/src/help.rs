//! `cargo xtask help`.

use crate::Verb;

/// One line a verb, aligned.
pub fn print(verbs: &[Verb]) {
    println!("cargo xtask VERB\n");
    let head = |verb: &Verb| format!("{} {}", verb.name, verb.arguments);
    let width = verbs.iter().map(|verb| head(verb).len()).max().unwrap_or(0);
    for verb in verbs {
        println!("  {:width$}  {}", head(verb), verb.line);
    }
    println!();
}

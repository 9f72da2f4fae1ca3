//! `cargo xtask help`.

use anyhow::Result;

/// A verb: its name, its arguments, its purpose in one line, and the function that runs it.
pub struct Verb {
    pub name: &'static str,
    pub arguments: &'static str,
    pub line: &'static str,
    pub run: fn(&[String]) -> Result<()>,
}

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

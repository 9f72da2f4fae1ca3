//! Rule between the modules of a crate: flags of the command line are declared in `cli` alone.

use std::path::Path;

use super::graph::Graph;
use super::tokens::tokens;

/// Module that holds the command line of a crate.
const CLI: &str = "cli";

/// Files outside `cli` that name clap, each as a line; none in a crate without such a module.
pub fn flags_outside_cli(graph: &Graph, text: &impl Fn(&Path) -> Option<String>) -> Vec<String> {
    let in_cli = |module: &[String]| module.first().is_some_and(|name| name == CLI);
    if !graph.modules.iter().any(|module| in_cli(module)) {
        return Vec::new();
    }
    let files = graph.files.iter().zip(&graph.modules);
    files
        .filter(|(_, module)| !in_cli(module))
        .filter_map(|(file, _)| {
            let source = text(file)?;
            let tokens = tokens(&source);
            let line = tokens.iter().find(|token| token.is("clap"))?.line;
            let file = file.display();
            Some(format!("{file}:{line}: clap outside the module `{CLI}`"))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(files: &[(&str, &str)]) -> Vec<String> {
        let text = |path: &Path| {
            let file = files.iter().find(|(name, _)| Path::new(name) == path);
            file.map(|(_, text)| (*text).to_string())
        };
        let graph = Graph::of_crate(Path::new("lib.rs"), &text).expect("every module has a file");
        flags_outside_cli(&graph, &text)
    }

    #[test]
    fn flags_belong_in_cli() {
        let verb = "use clap::Args;\n#[derive(Args)]\npub struct Flags;";
        let room = "// clap in a comment\n#[derive(clap::Args)]\npub struct Flags;";
        let files = [
            ("lib.rs", "mod cli;\nmod room;"),
            ("cli/mod.rs", "mod verb;"),
            ("cli/verb.rs", verb),
            ("room.rs", room),
        ];
        assert_eq!(found(&files), ["room.rs:2: clap outside the module `cli`"]);
        let without_cli = [("lib.rs", "mod room;"), ("room.rs", room)];
        assert_eq!(found(&without_cli), Vec::<String>::new());
    }
}

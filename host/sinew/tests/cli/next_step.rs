//! The step that comes next: every verb ends with it, and one place of the program writes it.

use crate::outputs::{QUICK, Written, desk, run};

/// Verbs after which nothing comes.
const LAST: [&str; 1] = ["completions"];

/// Names of the verbs, from the page of the command line.
fn verbs() -> Vec<&'static str> {
    let cli = include_str!("../../../../docs/reference/cli.md");
    let names = cli
        .lines()
        .filter_map(|line| line.strip_prefix("### `sinew "));
    names.map(|name| name.trim_end_matches('`')).collect()
}

/// Source of a verb.
fn source(verb: &str) -> String {
    let here = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let places = ["src/cli", "../ident/src/cli"].map(|folder| here.join(folder));
    let files = places.map(|folder| std::fs::read_to_string(folder.join(format!("{verb}.rs"))));
    files.into_iter().flatten().collect()
}

#[test]
fn every_verb_says_what_comes_next_in_the_one_way() {
    let verbs = verbs();
    assert!(verbs.len() > 25, "{verbs:?}");
    for verb in verbs {
        let text = source(verb);
        assert!(!text.is_empty(), "no source of {verb}");
        let is_last = LAST.contains(&verb);
        assert_eq!(text.contains(".next("), !is_last, "{verb}");
        for other in ["println!(\"next:", "line(\"next:", "format!(\"next:"] {
            assert!(!text.contains(other), "{verb} writes `next:` by itself");
        }
        // What `--quiet` keeps back and a document moves aside goes through one place.
        let around = text.replace("eprint", "").contains("print!(")
            || text.replace("eprint", "").contains("println!(");
        assert_eq!(around, is_last, "{verb} prints past `Said`");
    }
}

#[test]
fn the_next_step_is_the_last_line_and_quiet_leaves_warnings_alone() {
    let desk = desk();
    let mut seen = Vec::new();
    for (line, flag) in QUICK {
        let verb = line.split_whitespace().next().unwrap_or_default();
        if seen.contains(&verb) || verb == "explain" {
            continue;
        }
        seen.push(verb);
        let said = |line: &str| {
            let written: Written = (line.to_owned().leak(), flag);
            let output = run(&desk, written, "made.file");
            let errors = String::from_utf8_lossy(&output.stderr).into_owned();
            assert_eq!(output.status.code(), Some(0), "{line}\n{errors}");
            let text = String::from_utf8_lossy(&output.stdout).into_owned();
            (text, errors)
        };
        let loud = line.replace(" --quiet", "");
        let (text, _) = said(&loud);
        let last = text.lines().last().unwrap_or_default();
        assert!(last.starts_with("next: "), "{loud}\n{text}");
        let again = if verb == "new" { " --force" } else { "" };
        let (text, errors) = said(&format!("{loud}{again} --quiet"));
        assert_eq!(text, "", "{loud} --quiet");
        let remark = errors.lines().find(|line| !line.starts_with("warning: "));
        assert_eq!(remark, None, "{loud} --quiet\n{errors}");
    }
    assert!(seen.len() >= 11, "{seen:?}");
}

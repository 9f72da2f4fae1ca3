//! Rules between crates: what a crate must not depend on, through whatever others.

use anyhow::Result;
use xtask::process::{self, cargo};

/// Names that may not stand in the tree of a crate's normal dependencies.
enum Forbidden {
    /// Any crate at all.
    Everything,
    /// Every crate of this workspace but those named.
    OursBut(&'static [&'static str]),
    /// The named ones, and those whose name goes on behind a dash.
    These(&'static [&'static str]),
}

/// ARCHITECTURE.md, "Folders".
const RULES: &[(&str, &[Forbidden])] = &[
    ("sinew-mpc", &[Forbidden::Everything]),
    ("sinew-device", &[Forbidden::OursBut(&["sinew-mpc"])]),
    (
        "sinew-nn",
        &[Forbidden::OursBut(&["sinew-files", "sinew-kernels"])],
    ),
    ("sinew-sim", &[Forbidden::OursBut(&[])]),
    ("sinew-wiring", &[Forbidden::OursBut(&[])]),
    (
        "sinew-ident",
        &[
            Forbidden::These(&["burn", "clap", "nix"]),
            Forbidden::OursBut(&["sinew-convert", "sinew-files", "sinew-sim"]),
        ],
    ),
    ("sinew-convert", &[Forbidden::OursBut(&[])]),
    ("sinew-prefer", &[Forbidden::OursBut(&[])]),
    ("sinew-search", &[Forbidden::OursBut(&[])]),
    (
        "sinew-share",
        &[
            Forbidden::These(&["burn", "clap", "nix"]),
            Forbidden::OursBut(&[
                "sinew-convert",
                "sinew-files",
                "sinew-ident",
                "sinew-search",
                "sinew-sim",
            ]),
        ],
    ),
    (
        "sinew-imitate",
        &[
            Forbidden::These(&["burn", "clap", "nix"]),
            Forbidden::OursBut(&["sinew-convert", "sinew-files", "sinew-ident", "sinew-sim"]),
        ],
    ),
    (
        "sinew-plan",
        &[
            Forbidden::These(&["burn", "clap", "nix"]),
            Forbidden::OursBut(&["sinew-convert", "sinew-files", "sinew-ident", "sinew-sim"]),
        ],
    ),
];

/// The rules that the workspace breaks, each as a line.
///
/// # Errors
/// Cargo cannot say what depends on what.
pub fn broken() -> Result<Vec<String>> {
    let mut wrong = Vec::new();
    for (package, rules) in RULES {
        let mut tree = cargo(&["tree", "--package", package, "--edges", "normal"]);
        tree.args(["--target", "all", "--prefix", "none", "--format", "{p}"]);
        let Some(tree) = process::answer(&mut tree) else {
            println!("no package {package} yet");
            continue;
        };
        wrong.extend(breaches(package, rules, &tree));
    }
    Ok(wrong)
}

/// The rules that a tree breaks; its first line is the package itself.
fn breaches(package: &str, rules: &[Forbidden], tree: &str) -> Vec<String> {
    let mut names: Vec<&str> = (tree.lines().skip(1))
        .filter_map(|line| line.split_whitespace().next())
        .collect();
    names.sort_unstable();
    names.dedup();
    let forbidden = |name: &str| {
        rules.iter().any(|rule| match rule {
            Forbidden::Everything => true,
            Forbidden::OursBut(allowed) => name.starts_with("sinew") && !allowed.contains(&name),
            Forbidden::These(these) => these.iter().any(|one| {
                name.strip_prefix(one)
                    .is_some_and(|rest| rest.is_empty() || rest.starts_with('-'))
            }),
        })
    };
    (names.iter())
        .filter(|name| forbidden(name))
        .map(|name| format!("{package} depends on {name}, which it must not know"))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::{Forbidden, breaches};

    #[test]
    fn a_crate_that_must_depend_on_nothing() {
        assert_eq!(breaches("a", &[Forbidden::Everything], "a v1").len(), 0);
        assert_eq!(
            breaches(
                "a",
                &[Forbidden::Everything],
                "a v1\nlibm v0.2\nlibm v0.2 (*)"
            )
            .len(),
            1
        );
    }

    #[test]
    fn a_family_of_crates_counts_by_its_first_word() {
        let rules = [Forbidden::These(&["burn", "nix"])];
        let found = breaches("a", &rules, "a v1\nburn-core v1\nburning v1\nnix v1");
        assert_eq!(found.len(), 2, "{found:?}");
    }

    #[test]
    fn ours_but_the_named() {
        let rules = [Forbidden::OursBut(&["sinew-sim"])];
        let found = breaches("a", &rules, "a v1\nsinew-sim v1\nsinew-mpc v1\nlibm v1");
        assert_eq!(found, ["a depends on sinew-mpc, which it must not know"]);
    }
}

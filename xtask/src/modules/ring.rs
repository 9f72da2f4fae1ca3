//! Rings of a graph: its strongly connected parts of more than one file.
//!
//! A parent may define what its children take and call them: a trait, those who implement it, and
//! their list. So a ring that lies in one folder and holds the folder's own `mod.rs` is looked at
//! without that file. The top file of a crate has no such right.

use std::collections::{BTreeSet, VecDeque};
use std::path::Path;

use super::graph::Graph;

/// Files that depend on each other, each ring in ascending order.
pub fn rings(graph: &Graph) -> Vec<Vec<usize>> {
    let mut found = Vec::new();
    let mut open = vec![BTreeSet::from_iter(0..graph.files.len())];
    while let Some(files) = open.pop() {
        for part in parts(graph, &files) {
            match parent(graph, &part) {
                Some(parent) => {
                    open.push(part.into_iter().filter(|file| *file != parent).collect())
                }
                None => found.push(part),
            }
        }
    }
    found.sort();
    found
}

/// The file of a part that all others of the part are modules below.
fn parent(graph: &Graph, part: &[usize]) -> Option<usize> {
    let holds = |file: &usize| {
        let module = &graph.modules[*file];
        let below = |other: &usize| graph.modules[*other].starts_with(module);
        !module.is_empty() && part.iter().all(below)
    };
    part.iter().copied().find(holds)
}

/// Strongly connected parts of more than one file, by the edges between these files.
fn parts(graph: &Graph, files: &BTreeSet<usize>) -> Vec<Vec<usize>> {
    let mut parts = BTreeSet::new();
    let mut left = files.clone();
    while let Some(file) = left.pop_first() {
        let reached = reachable(graph, files, file);
        let part: Vec<usize> = (reached.iter().copied())
            .filter(|other| reachable(graph, files, *other).contains(&file))
            .collect();
        // A file that reaches itself does so through another: edges to itself are not kept.
        if part.len() > 1 {
            left.retain(|other| !part.contains(other));
            parts.insert(part);
        }
    }
    parts.into_iter().collect()
}

fn reachable(graph: &Graph, files: &BTreeSet<usize>, from: usize) -> BTreeSet<usize> {
    let mut reached = BTreeSet::new();
    let mut open = vec![from];
    while let Some(file) = open.pop() {
        for &next in graph.edges[file].keys().filter(|next| files.contains(next)) {
            if reached.insert(next) {
                open.push(next);
            }
        }
    }
    reached
}

/// The files of a ring, and its shortest round with the line that makes each step.
pub fn description(graph: &Graph, ring: &[usize], root: &Path) -> String {
    let name = |file: usize| {
        let path = &graph.files[file];
        path.strip_prefix(root)
            .unwrap_or(path)
            .display()
            .to_string()
    };
    let names: Vec<String> = ring.iter().map(|&file| name(file)).collect();
    let mut text = format!("a ring of {} files: {}", ring.len(), names.join(", "));
    // A ring has a round through each of its files.
    let rounds = ring.iter().filter_map(|&file| round(graph, ring, file));
    if let Some(shortest) = rounds.min_by_key(Vec::len) {
        for (at, &from) in shortest.iter().enumerate() {
            let to = shortest[(at + 1) % shortest.len()];
            let (line, words) = &graph.edges[from][&to];
            text += &format!("\n    {}:{line}: {words} (in {})", name(from), name(to));
        }
    }
    text
}

/// Shortest way from a file of a ring back to itself.
fn round(graph: &Graph, ring: &[usize], start: usize) -> Option<Vec<usize>> {
    let mut came: Vec<Option<usize>> = vec![None; graph.files.len()];
    let mut queue = VecDeque::from([start]);
    while let Some(file) = queue.pop_front() {
        for &next in graph.edges[file].keys().filter(|next| ring.contains(next)) {
            if next == start {
                let mut way = vec![file];
                while let Some(before) = came[*way.last()?].filter(|_| way.last() != Some(&start)) {
                    way.push(before);
                }
                way.reverse();
                return Some(way);
            }
            if came[next].is_none() {
                came[next] = Some(file);
                queue.push_back(next);
            }
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rings of a made-up crate, as names of files.
    fn rings_of(files: &[(&str, &str)]) -> Vec<Vec<String>> {
        let text = |path: &Path| {
            let found = files.iter().find(|(name, _)| Path::new(name) == path);
            found.map(|(_, text)| text.to_string())
        };
        let graph =
            Graph::of_crate(Path::new("src/lib.rs"), &text).expect("every module has a file");
        let name = |file: &usize| graph.files[*file].display().to_string();
        rings(&graph)
            .iter()
            .map(|ring| {
                let text = description(&graph, ring, Path::new(""));
                assert!(text.lines().count() > 2, "no round: {text}");
                let mut names: Vec<String> = ring.iter().map(name).collect();
                names.sort();
                names
            })
            .collect()
    }

    #[test]
    fn two_files_that_take_from_each_other_are_a_ring() {
        let found = rings_of(&[
            ("src/lib.rs", "mod a; mod b; mod c;"),
            ("src/a.rs", "use crate::b::B; pub struct A;"),
            ("src/b.rs", "pub struct B; fn f() { super::a::A; }"),
            (
                "src/c.rs",
                "use crate::{a::A, b::{self, B}}; fn f() { b::g() }",
            ),
        ]);
        assert_eq!(found, [["src/a.rs", "src/b.rs"]]);
    }

    #[test]
    fn three_files_around_are_a_ring() {
        let found = rings_of(&[
            ("src/lib.rs", "mod a; mod b; mod c;"),
            ("src/a.rs", "use crate::b; pub fn a() { b::b() }"),
            ("src/b.rs", "use crate::c::c as d; pub fn b() { d() }"),
            ("src/c.rs", "pub fn c() { crate::a::a() }"),
        ]);
        assert_eq!(found, [["src/a.rs", "src/b.rs", "src/c.rs"]]);
    }

    #[test]
    fn a_parent_that_hands_on_is_in_no_ring() {
        let found = rings_of(&[
            (
                "src/lib.rs",
                "pub mod fit; pub use fit::Fit; pub use fit::score::*;",
            ),
            (
                "src/fit/mod.rs",
                "mod score; mod start; pub use start::Fit; pub use score::Score;",
            ),
            ("src/fit/start.rs", "pub struct Fit;"),
            (
                "src/fit/score.rs",
                "use super::Fit; use crate::Fit as F; pub struct Score; fn f() -> crate::Score {}",
            ),
        ]);
        assert!(found.is_empty(), "{found:?}");
    }

    #[test]
    fn a_parent_may_define_and_call() {
        let found = rings_of(&[
            ("src/lib.rs", "pub mod fit;"),
            (
                "src/fit/mod.rs",
                "mod score; mod start; pub struct Fit; fn f() { score::g(); start::h() }",
            ),
            ("src/fit/score.rs", "use super::Fit; pub fn g() {}"),
            (
                "src/fit/start.rs",
                "use super::{Fit, score::g}; pub fn h() {}",
            ),
        ]);
        assert!(found.is_empty(), "{found:?}");
    }

    #[test]
    fn children_are_looked_at_without_their_parent() {
        let found = rings_of(&[
            ("src/lib.rs", "pub mod fit;"),
            (
                "src/fit/mod.rs",
                "mod score; mod start; pub struct Fit; fn f() { score::g() }",
            ),
            (
                "src/fit/score.rs",
                "use super::Fit; pub fn g() { super::start::h() }",
            ),
            (
                "src/fit/start.rs",
                "use super::score; pub fn h() { score::g() }",
            ),
        ]);
        assert_eq!(found, [["src/fit/score.rs", "src/fit/start.rs"]]);
    }

    #[test]
    fn a_ring_of_two_folders_is_found_through_their_parents() {
        let found = rings_of(&[
            ("src/lib.rs", "pub mod a; pub mod b;"),
            (
                "src/a/mod.rs",
                "mod deep; pub struct A; pub fn f() { deep::g() }",
            ),
            ("src/a/deep.rs", "pub fn g() { crate::b::B }"),
            ("src/b.rs", "use crate::a::A; pub struct B;"),
        ]);
        assert_eq!(found, [["src/a/deep.rs", "src/a/mod.rs", "src/b.rs"]]);
    }

    #[test]
    fn the_top_of_a_crate_has_no_such_right() {
        let found = rings_of(&[
            ("src/lib.rs", "mod a; pub struct T; pub fn f() { a::g() }"),
            ("src/a.rs", "use crate::T; pub fn g() {}"),
        ]);
        assert_eq!(found, [["src/a.rs", "src/lib.rs"]]);
    }

    #[test]
    fn a_ring_through_names_that_are_handed_on_is_found() {
        let found = rings_of(&[
            ("src/lib.rs", "pub mod a; pub mod b; pub use b::*;"),
            ("src/a.rs", "use crate::B; pub struct A;"),
            ("src/b/mod.rs", "mod deep; pub use deep::B;"),
            ("src/b/deep.rs", "pub struct B { a: crate::a::A }"),
        ]);
        assert_eq!(found, [["src/a.rs", "src/b/deep.rs"]]);
    }

    #[test]
    fn tests_comments_and_strings_are_left_out() {
        let found = rings_of(&[
            ("src/lib.rs", "mod a; mod b; #[cfg(test)] mod helpers;"),
            (
                "src/a.rs",
                "pub struct A;\n/// [`crate::b::B`]\n#[cfg(test)]\nuse crate::b::{B, C};\n#[cfg(test)]\n\
                 mod tests { use crate::b::B; #[test] fn f() { crate::b::B; } }\nconst T: &str = \"crate::b::B\";",
            ),
            ("src/b.rs", "use crate::a::A; pub struct B;"),
        ]);
        assert!(found.is_empty(), "{found:?}");
    }

    #[test]
    fn what_follows_a_test_is_not_left_out() {
        let found = rings_of(&[
            ("src/lib.rs", "mod a; mod b;"),
            (
                "src/a.rs",
                "#[cfg(test)]\n#[allow(x)]\nfn f<A, B>(x: [u8; 3]) -> u8 { 1 }\n#[cfg(test)] const X: S = S { a: 1 };\n\
                 pub struct A { b: crate::b::B }",
            ),
            ("src/b.rs", "use crate::a::A; pub struct B;"),
        ]);
        assert_eq!(found, [["src/a.rs", "src/b.rs"]]);
    }
}

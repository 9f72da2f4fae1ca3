//! What the linked images hold and what they do not: no heap, and no way from the control step to a panic.

use sinew::project::{Board, image::sizes};
use sinew_tests::callgraph::CallGraph;
use sinew_tests::{image, skip};

#[test]
fn the_control_step_has_no_way_to_a_panic() {
    if let Some(reason) = image::cannot_run() {
        return skip(reason);
    }
    let built = image::build(Board::Qemu).unwrap_or_else(|error| panic!("{error}"));
    let data = std::fs::read(&built.lockstep).expect("just built");
    let graph = CallGraph::read(&data).unwrap_or_else(|error| panic!("{error}"));
    // There is something to find: the image does hold panics, and main can reach one.
    let main = graph.named(&["main"]);
    let reached = main.iter().any(|main| {
        graph
            .reach(*main)
            .functions
            .iter()
            .any(|n| image::is_panic(n))
    });
    assert!(
        reached,
        "no panic anywhere, or calls are not followed: nothing is tested"
    );

    for parts in [["ControlLoop", "4step"], ["ControlLoop", "9open_loop"]] {
        let starts = graph.named(&parts);
        assert_eq!(starts.len(), 1, "{parts:?} in the image");
        let reach = graph.reach(starts[0]);
        let bad: Vec<&String> = reach
            .functions
            .iter()
            .filter(|name| image::is_panic(name))
            .collect();
        assert!(bad.is_empty(), "{parts:?} can reach {bad:?}");
        assert!(
            reach.indirect.is_empty(),
            "{parts:?} calls through registers in {:?}",
            reach.indirect
        );
        println!("{parts:?}: {} functions", reach.functions.len());
    }
}

#[test]
fn no_image_has_a_heap() {
    if let Some(reason) = image::cannot_run() {
        return skip(reason);
    }
    let built = image::build(Board::Qemu).unwrap_or_else(|error| panic!("{error}"));
    for path in [Some(built.lockstep), built.free].into_iter().flatten() {
        let sizes = sizes(&path).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(sizes.heap_bytes, 0, "{}", path.display());
    }
}

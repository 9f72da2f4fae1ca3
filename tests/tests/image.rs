//! Content of the linked images, and what they lack: no heap, and no way from the control step to a
//! panic.

use std::path::Path;

use sinew::project::wired::wired;
use sinew::project::{Board, Optimise, compile, image::sizes, write, write_wired};
use sinew_model::store;
use sinew_tests::callgraph::CallGraph;
use sinew_tests::{image, skip};

/// The control step of an image reaches no panic, and calls nothing that cannot be followed.
fn check_calls(image: &Path) {
    let data = std::fs::read(image).expect("just built");
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
fn the_control_step_has_no_way_to_a_panic() {
    if let Some(reason) = image::cannot_run() {
        return skip(reason);
    }
    let built = image::build(Board::Qemu).unwrap_or_else(|error| panic!("{error}"));
    check_calls(&built.lockstep);
}

#[test]
fn an_image_for_size_takes_less_flash_and_has_no_way_to_a_panic_either() {
    if let Some(reason) = image::cannot_run() {
        return skip(reason);
    }
    let quick = image::build(Board::Qemu).unwrap_or_else(|error| panic!("{error}"));
    let quick = sizes(&quick.lockstep).unwrap_or_else(|error| panic!("{error}"));
    let model = store::load(&image::root().join("models/reference-s"));
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("small");
    write(
        &folder,
        &model.expect("the file ships with the project"),
        Optimise::Size,
    )
    .unwrap_or_else(|error| panic!("{error}"));
    // Where no other image is put in its place.
    let small = compile(&folder, Board::Qemu, &folder.join("target"));
    let small = small.unwrap_or_else(|error| panic!("{error}"));
    check_calls(&small.lockstep);
    let small = sizes(&small.lockstep).unwrap_or_else(|error| panic!("{error}"));
    assert!(
        3 * small.flash_bytes < 2 * quick.flash_bytes,
        "{small:?} beside {quick:?}"
    );
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

#[test]
fn a_wired_nucleo_links_with_every_kind_of_wire() {
    if let Some(reason) = image::cannot_run() {
        return skip(reason);
    }
    let root = image::root();
    let spec = store::load(&root.join("models/demo-state")).expect("a committed model");
    let folder = tempfile::tempdir().expect("a folder");
    let text = std::fs::read_to_string(root.join("docs/reference/demo.wiring.toml"))
        .expect("is committed");
    // The other encoder and a servo; then a voltage and a pulse without a sign.
    let other = text
        .replace("[\"PA6\", \"PA7\"]", "[\"PB6\", \"PB7\"]")
        .replace("\"signed\"", "\"servo\"")
        .replace("\"PA8\"", "\"PC9\"")
        .replace("direction", "# ");
    let plain = other
        .replace("\"servo\"", "\"pwm\"")
        .replace("\"PC9\"", "\"PA11\"")
        .replace("\"encoder\"", "\"adc\"")
        .replace("pins = [\"PB6\", \"PB7\"]", "pin = \"PA5\"")
        .replace("counts_per_unit", "at_full")
        .replace("at_start", "at_zero");
    let mut images = Vec::new();
    for text in [text, other, plain] {
        let file = folder.path().join("wiring.toml");
        std::fs::write(&file, text).expect("written");
        let sources =
            wired(Some(&file), &spec, Some("stm32f446")).unwrap_or_else(|e| panic!("{e}"));
        let project = folder.path().join("project");
        write_wired(&project, &spec, Optimise::Speed, &sources).unwrap_or_else(|e| panic!("{e}"));
        // With build outputs of its own: cargo would put it in the place of the plain board's.
        let cache = image::cache().join("wired");
        let built = compile(&project, Board::Stm32f446, &cache).unwrap_or_else(|e| panic!("{e}"));
        let sizes = sizes(&built.lockstep).expect("an image");
        println!("{} B of flash", sizes.flash_bytes);
        images.push(std::fs::read(&built.lockstep).expect("just built"));
    }
    assert!(images[0] != images[1] && images[1] != images[2]);
}

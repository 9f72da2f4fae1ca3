//! Content of the linked images, and what they lack: no heap, and no way from the control step to a
//! panic.

use std::path::Path;

use sinew::project::wired::{of_rig, wired};
use sinew::project::{Board, Optimise, build, image::sizes, write, write_wired};
use sinew_model::spec::{
    Activation, ControlSpec, Dense, Layer, ModelSpec, OutputForm, Signal as ModelSignal,
};
use sinew_model::store;
use sinew_sim::Rig;
use sinew_tests::callgraph::CallGraph;
use sinew_tests::{image, skip};
use sinew_wiring::{Signal, Signals};

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
    let small = build(&folder, Board::Qemu, Some(&image::cache()));
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

/// A controller of these signals whose network has not been trained: an image's pins and scales do
/// not ask for more.
fn untrained(signals: &Signals) -> ModelSpec {
    let signal = |of: &Signal| ModelSignal {
        name: of.name.clone(),
        unit: of.unit.clone(),
        span: 1.0,
        offset: 0.0,
    };
    let (inputs, outputs) = (signals.actuators.len(), signals.sensors.len());
    let row = vec![0.1; inputs + outputs];
    let layer = Dense::from_rows(&vec![row; outputs], vec![0.0; outputs], Activation::Linear);
    let end = |k: usize| {
        let ranges = signals.actuators.iter().map(|of| of.range);
        let ends = ranges.map(|range| range.expect("the rig has limits")[k]);
        ends.collect::<Vec<f64>>()
    };
    ModelSpec {
        name: "untrained".into(),
        period_s: 1.0 / signals.rate_hz,
        inputs: signals.actuators.iter().map(signal).collect(),
        outputs: signals.sensors.iter().map(signal).collect(),
        channels: vec![],
        past_inputs: 1,
        past_outputs: 1,
        form: OutputForm::Increment,
        skip: None,
        layers: vec![Layer::Dense(layer.expect("one length"))],
        control: ControlSpec {
            horizon: 3,
            control_horizon: 1,
            move_blocks: vec![],
            first_step: 1,
            tracking_weight: vec![1.0; outputs],
            move_suppression: vec![0.1; inputs],
            command_weight: 0.0,
            budget: None,
            observer_gain: 1.0,
            lower: end(0),
            upper: end(1),
            rate_limit: vec![f64::INFINITY; inputs],
            safe: end(0),
            disturbance_gain: 0.2,
            iterations: 1,
            max_missing_samples: 3,
            value: None,
        },
        state: None,
        soft_sensor: None,
        golden: vec![],
    }
}

/// Image of a wired controller.
fn wired_image(folder: &Path, text: &str, spec: &ModelSpec, board: Board) -> Vec<u8> {
    let file = folder.join("wiring.toml");
    std::fs::write(&file, text).expect("written");
    let sources = wired(Some(&file), spec, Some(board.folder()), false)
        .unwrap_or_else(|e| panic!("{e}\n{text}"));
    let project = folder.join("project");
    write_wired(&project, spec, Optimise::Speed, &sources).unwrap_or_else(|e| panic!("{e}"));
    let built = build(&project, board, Some(&image::cache())).unwrap_or_else(|e| panic!("{e}"));
    let sizes = sizes(&built.lockstep).expect("an image");
    println!("{}: {} B of flash", board.folder(), sizes.flash_bytes);
    std::fs::read(&built.lockstep).expect("just built")
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
    let image = |text: &str| wired_image(folder.path(), text, &spec, Board::Stm32f446);
    let images = [text, other, plain].map(|text| image(&text));
    assert!(images[0] != images[1] && images[1] != images[2]);
}

#[test]
fn a_wired_kit_links_with_every_kind_of_wire() {
    if let Some(reason) = image::cannot_run() {
        return skip(reason);
    }
    let root = image::root();
    let spec = store::load(&root.join("models/demo-state")).expect("a committed model");
    let folder = tempfile::tempdir().expect("a folder");
    let text = std::fs::read_to_string(root.join("docs/reference/demo.wiring.toml"))
        .expect("is committed");
    let text = text
        .replace("stm32f446", "nrf52840")
        .replace("[\"PA6\", \"PA7\"]", "[\"P0.26\", \"P0.27\"]")
        .replace("\"PA8\"", "\"P1.08\"")
        .replace("\"PB10\"", "\"P0.03\"");
    // A voltage and a servo.
    let other = text
        .replace("\"signed\"", "\"servo\"")
        .replace("direction", "# ")
        .replace("\"encoder\"", "\"adc\"")
        .replace("pins = [\"P0.26\", \"P0.27\"]", "pin = \"P0.05\"")
        .replace("counts_per_unit", "at_full")
        .replace("at_start", "at_zero");
    let image = |text: &str| wired_image(folder.path(), text, &spec, Board::Nrf52840);
    let images = [text, other].map(|text| image(&text));
    assert!(images[0] != images[1]);
}

/// Six high-voltage channels: `sinew wire` proposes their pins, and they link.
#[test]
fn a_wired_hasel_platform_links_on_both_boards() {
    if let Some(reason) = image::cannot_run() {
        return skip(reason);
    }
    let rig = image::root().join("rigs/hasel.toml");
    let text = std::fs::read_to_string(rig).expect("the rig ships");
    let rig = Rig::parse(&text, "hasel.toml").expect("the rig is sound");
    let signals = of_rig(&rig).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!((signals.sensors.len(), signals.actuators.len()), (3, 6));
    let spec = untrained(&signals);
    let folder = tempfile::tempdir().expect("a folder");
    for board in [Board::Stm32f446, Board::Nrf52840] {
        let pins = sinew_wiring::board(board.folder()).expect("a board with pins");
        let text = sinew_wiring::propose(&signals, pins).expect("pins enough");
        let text = text.replace("at_zero = nan", "at_zero = -0.02");
        let text = text.replace("at_full = nan", "at_full = 0.02");
        wired_image(folder.path(), &text, &spec, board);
    }
}

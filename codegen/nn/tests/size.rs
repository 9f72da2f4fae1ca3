//! Figures of `sinew size` against images that are linked for the boards: the bytes that a network
//! adds to a firmware that has a runtime, vectors and a main loop of its own.

use std::fmt::Write as _;
use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use sinew_nn::emit::{Options, Weights, emit};
use sinew_nn::footprint::{self, BOARDS};
use sinew_nn::{Network, import, target};

/// Relative tolerance of the figures.
const TOLERANCE: f64 = 0.05;

/// Networks and the boards that they are linked for. Every board is met, and on one of them every
/// kind.
const CASES: [(&str, Weights, &[&str]); 4] = [
    (
        "keras-mlp.keras",
        Weights::Float32,
        &["stm32f446", "nrf52840", "qemu"],
    ),
    ("keras-gru-stream.keras", Weights::Float32, &["stm32f446"]),
    ("keras-classifier.keras", Weights::Float32, &["nrf52840"]),
    ("h5-conv2d.h5", Weights::Int8, &["stm32f446"]),
];

/// Writes a file that differs: cargo goes by the time.
fn put(path: &Path, text: &str) {
    if fs::read_to_string(path).is_ok_and(|old| old == text) {
        return;
    }
    fs::create_dir_all(path.parent().expect("the path lies in a folder"))
        .expect("the folder is writable");
    fs::write(path, text).expect("the folder is writable");
}

#[test]
fn what_size_says_is_what_a_network_adds_to_a_linked_image() {
    if !target::is_installed() {
        let text = format!("\nSKIPPED: cargo for {} is not here\n", target::TARGET);
        std::io::stderr()
            .write_all(text.as_bytes())
            .expect("standard error");
        return;
    }
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("size");
    let networks = CASES.map(|(file, weights, boards)| {
        let path = here.join("tests/frameworks/models").join(file);
        let network = import::read(&path).unwrap_or_else(|error| panic!("{file}: {error}"));
        let options = Options {
            weights,
            ..Options::default()
        };
        (network, options, boards)
    });
    firmware(&folder.join("linked"), &networks);
    for board in BOARDS {
        let name = board.name;
        target::build(&folder.join("linked"), name).unwrap_or_else(|error| panic!("{error}"));
    }
    let release = folder
        .join("linked/target")
        .join(target::TARGET)
        .join("release");
    let linked = |board: &str, program: &str| {
        footprint::sections(&release.join(format!("{board}-{program}")))
            .expect("the image is linked")
    };
    for (network, options, boards) in &networks {
        let said = footprint::memory(network, options, &folder.join("said"));
        let [(flash, ram), _] = said.unwrap_or_else(|error| panic!("{error}"));
        for board in *boards {
            let (with, without) = (linked(board, &network.name), linked(board, "nothing"));
            let (added, added_ram) = (with.0 - without.0, with.1 - without.1);
            println!(
                "{} on {board}: {flash} B said, {added} B linked",
                network.name
            );
            assert!(added > 1000, "there is nothing to compare: {added} B");
            let error = (flash as f64 - added as f64) / added as f64;
            assert!(
                error.abs() <= TOLERANCE,
                "{} on {board}: {flash} B of flash said, {added} B linked: {:.1} %",
                network.name,
                100.0 * error
            );
            assert_eq!(ram, added_ram, "RAM of {} on {board}", network.name);
        }
    }
}

/// Networks whose layers are added up: dense ones, a kept state, convolutions and pools, integers.
const IN_LAYERS: [(&str, Weights); 4] = [
    ("keras-mlp.keras", Weights::Float32),
    ("keras-gru-stream.keras", Weights::Float32),
    ("keras-classifier.keras", Weights::Float32),
    ("h5-conv2d.h5", Weights::Int8),
];

#[test]
fn the_layers_add_up_to_the_network() {
    if !target::is_installed() {
        let text = format!("\nSKIPPED: cargo for {} is not here\n", target::TARGET);
        let _ = std::io::stderr().write_all(text.as_bytes());
        return;
    }
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("layers");
    for (file, weights) in IN_LAYERS {
        let path = here.join("tests/frameworks/models").join(file);
        let network = import::read(&path).unwrap_or_else(|error| panic!("{file}: {error}"));
        let options = Options {
            weights,
            ..Options::default()
        };
        let whole = footprint::measure(&network, &options, &folder);
        let whole = whole.unwrap_or_else(|error| panic!("{error}"));
        let layers = footprint::layers(&network, &options, &folder);
        let layers = layers.unwrap_or_else(|error| panic!("{error}"));
        let table = footprint::layer_table(&layers, &whole.predict);
        println!("{file}\n{table}");
        let widest = table
            .lines()
            .take(layers.len() + 2)
            .map(|line| line.chars().count());
        assert!(widest.max() <= Some(80), "{file}: wider than a terminal");
        let sum = |of: &dyn Fn(&footprint::Layer) -> u64| layers.iter().map(of).sum::<u64>();
        assert_eq!(
            sum(&|layer| layer.weight_bytes),
            whole.weight_bytes,
            "{file}"
        );
        let flash = sum(&|layer| layer.weight_bytes + layer.code_bytes.unwrap_or(0));
        let share = flash as f64 / whole.predict.flash_bytes as f64;
        assert!((0.6..1.4).contains(&share), "{file}: {share} of the flash");
        for layer in layers.iter().filter(|layer| layer.weight_bytes > 0) {
            assert!(
                layer.code_bytes > Some(0),
                "{file}: no code of {}",
                layer.name
            );
        }
        let Some(instructions) = whole.predict.instructions else {
            let _ = std::io::stderr().write_all(b"\nSKIPPED: no QEMU\n");
            return;
        };
        let share = sum(&|layer| layer.instructions.unwrap_or(0)) as f64 / instructions as f64;
        assert!(
            (0.9..1.1).contains(&share),
            "{file}: {share} of the instructions"
        );
        let stack = layers.iter().filter_map(|layer| layer.stack_bytes).max();
        let (deepest, predict) = (stack.unwrap_or(0), whole.predict.stack_bytes.unwrap_or(0));
        let share = deepest as f64 / predict as f64;
        // Less than the unpainted frames of who measures is not seen.
        let is_seen = predict > 600;
        assert!(
            !is_seen || (0.6..1.4).contains(&share),
            "{file}: {deepest} B of stack, {predict} B as a whole"
        );
        let ram = sum(&|layer| layer.ram_bytes.unwrap_or(0));
        assert!(
            ram >= 4 * network.outputs() as u64,
            "{file}: {ram} B of values"
        );
    }
}

/// A workspace with a package for each board, whose programs are `BOARD-nothing` and one for each
/// network.
fn firmware(folder: &Path, networks: &[(Network, Options, &[&str])]) {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    for (network, options, _) in networks {
        for file in emit(network, options).expect("the network is valid") {
            put(&folder.join(&network.name).join(file.path), &file.text);
        }
    }
    let mut members = String::new();
    for board in BOARDS {
        let package = folder.join(board.name);
        let memory = here.join("../../boards").join(board.name).join("memory.x");
        put(
            &package.join("memory.x"),
            &fs::read_to_string(memory).expect("a board has one"),
        );
        put(
            &package.join("build.rs"),
            include_str!("../src/footprint/probe/build_script.rs"),
        );
        let program = |name: &str| format!("{}-{name}", board.name);
        put(
            &package.join(format!("src/bin/{}.rs", program("nothing"))),
            &PROGRAM
                .replace("{state}", "")
                .replace("{inputs}", "4")
                .replace("{call}", "[x[0] + x[1], x[2], x[3]]"),
        );
        let mut dependencies = String::new();
        for (network, _, boards) in networks {
            if !boards.contains(&board.name) {
                continue;
            }
            let name = &network.name;
            writeln!(dependencies, "{name} = {{ path = \"../{name}\" }}")
                .expect("writing to a String cannot fail");
            let library = name.replace('-', "_");
            let (state, call) = if network.state() > 0 {
                (
                    format!("static mut STATE: {library}::State = {library}::State::new();\n"),
                    format!("{library}::predict(unsafe {{ &mut *(&raw mut STATE) }}, &x)"),
                )
            } else {
                (String::new(), format!("{library}::predict(&x)"))
            };
            put(
                &package.join(format!("src/bin/{}.rs", program(name))),
                &PROGRAM
                    .replace("{state}", &state)
                    .replace("{inputs}", &network.inputs().to_string())
                    .replace("{call}", &call),
            );
        }
        put(
            &package.join("Cargo.toml"),
            &format!(
                "[package]\nname = \"{}\"\nedition = \"2024\"\nversion = \"0.0.0\"\n\n[dependencies]\ncortex-m-rt = \"0.7.7\"\n{dependencies}",
                board.name
            ),
        );
        write!(members, "\"{}\", ", board.name).expect("writing to a String cannot fail");
    }
    put(
        &folder.join("Cargo.toml"),
        &format!(
            "[workspace]\nresolver = \"3\"\nmembers = [{members}]\n\n[profile.release]\nlto = \"fat\"\ncodegen-units = 1\npanic = \"abort\"\n"
        ),
    );
    if !folder.join("Cargo.lock").exists() {
        let lock = here.join("../../boards/qemu/Cargo.lock");
        put(
            &folder.join("Cargo.lock"),
            &fs::read_to_string(lock).expect("the file is committed"),
        );
    }
}

/// A firmware that reads numbers, does something with them, and writes the results.
const PROGRAM: &str = r#"//! Linked, not run.
#![no_std]
#![no_main]

{state}
#[cortex_m_rt::entry]
fn main() -> ! {
    loop {
        let mut x = [0.0_f32; {inputs}];
        read(&mut x);
        write(&{call});
    }
}

const PORT: *mut f32 = 0x4000_0000 as *mut f32;

/// Not inlined, so that it is as long for every length.
#[inline(never)]
fn read(x: &mut [f32]) {
    for x in x {
        *x = unsafe { PORT.read_volatile() };
    }
}

#[inline(never)]
fn write(y: &[f32]) {
    for y in y {
        unsafe { PORT.write_volatile(*y) };
    }
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {}
}
"#;

//! What a network takes on a board, before anything is flashed: it is compiled and linked for the target, and
//! run in QEMU, which counts instructions and stack.

use std::path::Path;

use object::{Object, ObjectSection, SectionFlags, SectionKind};

use crate::emit::{Options, Weights, emit};
use crate::files;
use crate::summary::thousands;
use crate::{Network, target};

pub mod probe;

/// A board, for the estimate of time and the shares.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Board {
    /// As `--board` has it.
    pub name: &'static str,
    /// Core clock; none where there is no clock to speak of.
    pub clock_hz: Option<f64>,
    /// Flash of the part.
    pub flash_bytes: u64,
    /// RAM of the part.
    pub ram_bytes: u64,
}

/// The boards.
pub const BOARDS: [Board; 3] = [
    Board {
        name: "stm32f446",
        clock_hz: Some(180e6),
        flash_bytes: 512 << 10,
        ram_bytes: 128 << 10,
    },
    Board {
        name: "nrf52840",
        clock_hz: Some(64e6),
        flash_bytes: 1 << 20,
        ram_bytes: 256 << 10,
    },
    Board {
        name: "qemu",
        clock_hz: None,
        flash_bytes: 4 << 20,
        ram_bytes: 4 << 20,
    },
];

/// Cycles an instruction takes on a Cortex-M4F, by a table of instruction timings: an estimate, measured on no
/// board.
pub const CYCLES_PER_INSTRUCTION: f64 = 1.7;

/// What one function takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Cost {
    /// Code, weights and initial values, with what they call.
    pub flash_bytes: u64,
    /// State.
    pub ram_bytes: u64,
    /// Deepest stack of a call; none without QEMU.
    pub stack_bytes: Option<u64>,
    /// Instructions of a call; none without QEMU.
    pub instructions: Option<u64>,
}

/// What a network takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Size {
    /// `predict` alone.
    pub predict: Cost,
    /// `predict` and `predict_with_jacobian` in one image; instructions and stack are those of the latter.
    pub jacobian: Cost,
    /// What of the flash are weights.
    pub weight_bytes: u64,
}

/// Compiles the network in `folder`, which is kept for the next time, and runs it.
///
/// # Errors
/// The network cannot be emitted, or what cargo says. Without QEMU there are no instructions and no stack.
pub fn measure(network: &Network, options: &Options, folder: &Path) -> Result<Size, String> {
    let [predict, jacobian] = memory(network, options, folder)?;
    let image = probe::build(folder)?;
    let said = probe::run(&image).ok();
    let cost = |name: &str, (flash_bytes, ram_bytes)| {
        let line = said.as_ref().and_then(|said| {
            said.lines().find_map(|line| {
                line.strip_prefix("cost ")?
                    .strip_prefix(name)?
                    .strip_prefix(' ')
            })
        });
        let mut numbers = line.unwrap_or("").split(' ').map(|word| word.parse().ok());
        Cost {
            flash_bytes,
            ram_bytes,
            instructions: numbers.next().flatten(),
            stack_bytes: numbers.next().flatten(),
        }
    };
    Ok(Size {
        predict: cost("predict", predict),
        jacobian: cost("jacobian", jacobian),
        weight_bytes: network
            .folded()
            .weight_bytes(options.weights == Weights::Int8) as u64,
    })
}

/// Flash and RAM of `predict` alone, and of `predict` and `predict_with_jacobian`: compiled and linked in
/// `folder`, with nothing else in the image.
///
/// # Errors
/// The network cannot be emitted, or what cargo says.
pub fn memory(
    network: &Network,
    options: &Options,
    folder: &Path,
) -> Result<[(u64, u64); 2], String> {
    write(network, options, folder)?;
    target::build(folder, "bare")?;
    let release = folder.join("target").join(target::TARGET).join("release");
    Ok([
        sections(&release.join("predict"))?,
        sections(&release.join("jacobian"))?,
    ])
}

/// Bytes of an image in flash and in RAM.
///
/// # Errors
/// It is no ELF file.
pub fn sections(path: &Path) -> Result<(u64, u64), String> {
    let place = path.display();
    let data = std::fs::read(path).map_err(|error| format!("{place}: {error}"))?;
    let file = object::File::parse(&*data).map_err(|error| format!("{place}: {error}"))?;
    let (mut flash, mut ram) = (0, 0);
    for section in file.sections() {
        let SectionFlags::Elf { sh_flags, .. } = section.flags() else {
            continue;
        };
        // Unwinding tables are in no image that is flashed.
        let name = section.name().unwrap_or("");
        if sh_flags.0 & object::elf::SHF_ALLOC.0 == 0 || name.starts_with(".ARM.ex") {
            continue;
        }
        let writable = sh_flags.0 & object::elf::SHF_WRITE.0 != 0;
        if writable {
            ram += section.size();
        }
        if section.kind() != SectionKind::UninitializedData {
            flash += section.size();
        }
    }
    Ok((flash, ram))
}

fn write(network: &Network, options: &Options, folder: &Path) -> Result<(), String> {
    let stateful = network.state() > 0;
    let name = &network.name;
    let library = name.replace('-', "_");
    let put = |path: &str, text: &str| {
        files::write_changed(&folder.join(path), text.as_bytes()).map_err(|error| error.to_string())
    };
    for file in emit(network, options).map_err(|error| error.to_string())? {
        put(&format!("network/{}", file.path), &file.text)?;
    }
    probe::write(folder)?;
    let package = |name: &str, dependencies: &str| {
        format!(
            "[package]\nname = \"{name}\"\nedition = \"2024\"\nversion = \"0.0.0\"\n\n[dependencies]\n{dependencies}"
        )
    };
    let dependency = format!("{name} = {{ path = \"../network\" }}\n");
    put("cases/Cargo.toml", &package("cases", &dependency))?;
    put("bare/Cargo.toml", &package("bare", &dependency))?;
    put(
        "bare/build.rs",
        "fn main() {\n    for option in [\"--gc-sections\", \"-e_start\"] {\n        println!(\"cargo:rustc-link-arg-bins={option}\");\n    }\n}\n",
    )?;
    put(
        "Cargo.toml",
        "[workspace]\nresolver = \"3\"\nmembers = [\"network\", \"cases\", \"image\", \"bare\"]\n\n\
         [profile.release]\nlto = \"fat\"\ncodegen-units = 1\npanic = \"abort\"\ndebug = false\n",
    )?;
    let (state, given) = if stateful {
        ("State, ", "black_box(&mut state), ")
    } else {
        ("", "")
    };
    let (rows, columns) = if stateful {
        ("RESULTS", "VARIABLES")
    } else {
        ("OUTPUTS", "INPUTS")
    };
    let uses = if stateful {
        "INPUTS, RESULTS, VARIABLES"
    } else {
        "INPUTS, OUTPUTS"
    };
    let declare = if stateful {
        "    let mut state = State::new();\n"
    } else {
        ""
    };
    put(
        "cases/src/lib.rs",
        &format!(
            "//! The network, measured.\n#![no_std]\n\nuse core::hint::black_box;\n\nuse {library}::{{{state}{uses}, predict, predict_with_jacobian}};\n{}\n/// Measures.\npub fn run(bench: &mut dyn Bench) {{\n    let x = [0.1; INPUTS];\n    let mut jacobian = [[0.0; {rows}]; {columns}];\n{declare}    bench.measure(\"predict\", &mut || {{\n        let _ = black_box(predict({given}black_box(&x)));\n    }});\n    bench.measure(\"jacobian\", &mut || {{\n        let _ = black_box(predict_with_jacobian({given}black_box(&x), black_box(&mut jacobian)));\n    }});\n}}\n",
            probe::BENCH
        ),
    )?;
    let statics = if stateful {
        "static mut STATE: State = State::new();\n"
    } else {
        ""
    };
    let given = if stateful {
        "&mut *(&raw mut STATE), "
    } else {
        ""
    };
    for (name, call, last) in [
        ("predict", "", ""),
        (
            "jacobian",
            &*format!(
                "    // SAFETY: as above.\n    let jacobian = unsafe {{ &mut *jacobian.cast::<[[f32; {rows}]; {columns}]>() }};\n    // SAFETY: as above.\n    unsafe {{ *y = predict_with_jacobian({given}x, jacobian) }};\n"
            ),
            ", jacobian: *mut f32",
        ),
    ] {
        let more = if last.is_empty() {
            String::new()
        } else {
            format!(", {rows}, {columns}, predict_with_jacobian")
        };
        let mut names: Vec<&str> = format!("{state}INPUTS, OUTPUTS, predict{more}")
            .leak()
            .split(", ")
            .collect();
        names.sort_unstable();
        names.dedup();
        let names = names.join(", ");
        put(
            &format!("bare/src/bin/{name}.rs"),
            &format!(
                "//! What is flashed of the network, and nothing else.\n#![no_std]\n#![no_main]\n\nuse {library}::{{{names}}};\n\n{statics}\n/// # Safety\n/// It is never run.\n#[unsafe(no_mangle)]\npub unsafe extern \"C\" fn _start(x: *const f32, y: *mut f32{last}) {{\n    // SAFETY: it is never run.\n    let (x, y) = unsafe {{ (&*x.cast::<[f32; INPUTS]>(), &mut *y.cast::<[f32; OUTPUTS]>()) }};\n    // SAFETY: as above.\n    unsafe {{ *y = predict({given}x) }};\n{call}}}\n\n#[panic_handler]\nfn panic(_: &core::panic::PanicInfo<'_>) -> ! {{\n    loop {{}}\n}}\n"
            ).replace("    unsafe { *y = predict(x) };", "    *y = predict(x);").replace("    // SAFETY: as above.\n    *y = predict(x);", "    *y = predict(x);")
             .replace("    // SAFETY: as above.\n    unsafe { *y = predict_with_jacobian(x, jacobian) };", "    *y = predict_with_jacobian(x, jacobian);"),
        )?;
    }
    Ok(())
}

/// The figures for one board, as a table.
#[must_use]
pub fn table(network: &Network, size: &Size, board: &Board) -> String {
    let mut text = format!(
        "{} on {}\n\n{:<24} {:>10} {:>10} {:>10} {:>14} {:>12}\n",
        network.name, board.name, "", "flash, B", "RAM, B", "stack, B", "instructions", "time, us"
    );
    let number = |n: Option<u64>| n.map_or("-".into(), |n| thousands(n as usize));
    for (name, cost) in [
        ("predict", &size.predict),
        ("with jacobian", &size.jacobian),
    ] {
        let time = match (cost.instructions, board.clock_hz) {
            (Some(n), Some(clock)) => {
                format!("{:.1}", n as f64 * CYCLES_PER_INSTRUCTION / clock * 1e6)
            }
            _ => "-".into(),
        };
        text += &format!(
            "{name:<24} {:>10} {:>10} {:>10} {:>14} {time:>12}\n",
            thousands(cost.flash_bytes as usize),
            thousands(cost.ram_bytes as usize),
            number(cost.stack_bytes),
            number(cost.instructions),
        );
    }
    let share = |part: u64, whole: u64| 100.0 * part as f64 / whole as f64;
    text += &format!(
        "\nOf the flash, {} B are weights. `predict` takes {:.2} % of the board's flash and, with its stack,\n{:.2} % of its RAM.",
        thousands(size.weight_bytes as usize),
        share(size.predict.flash_bytes, board.flash_bytes),
        share(
            size.predict.ram_bytes + size.predict.stack_bytes.unwrap_or(0),
            board.ram_bytes
        ),
    );
    text += if size.predict.instructions.is_none() {
        " Instructions and stack need QEMU (cargo xtask setup).\n"
    } else if board.clock_hz.is_some() {
        " Flash, RAM, stack and instructions are measured on the linked\nimage in QEMU; time is an estimate at 1.7 cycles an instruction, measured on no board.\n"
    } else {
        " QEMU counts instructions and knows no time.\n"
    };
    text
}

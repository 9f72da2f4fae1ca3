//! Instructions of the filter's parts: ours, and those that nalgebra and micromath make
//! (docs/decisions/0111).

use std::collections::BTreeSet;
use std::fs;
use std::io::Read;
use std::path::Path;

use anyhow::{Context, Result, ensure};
use serde_json::{Map, Value, json};

use super::image;
use xtask::process::{self, root, target_folder};
use xtask::setup::{self, Extent};

/// Programs of `tests/parts`, each a feature.
const PROGRAMS: [&str; 3] = ["ours", "nalgebra", "micromath"];

/// Parts, in the order in which each program counts them.
const PARTS: [&str; 6] = [
    "time update, 2 of 7",
    "measurement update, 7",
    "the same without Joseph's form",
    "11 readings of 8 states",
    "tanh of 14 units",
    "square root",
];

/// Counts, prints and returns the section.
///
/// # Errors
/// An image does not build or run.
pub fn run() -> Result<Value> {
    let toolchain = setup::run(Extent::Build)?;
    let folder = root().join("tests/parts");
    let mut counts = Vec::new();
    let mut branches = Vec::new();
    for program in PROGRAMS {
        let arguments = ["--quiet", "--features", program];
        process::run(&mut toolchain.board_cargo(&folder, "build", &arguments))?;
        let elf = target_folder().join(format!("bench/parts.{program}.elf"));
        fs::create_dir_all(elf.parent().context("an image has a folder")?)?;
        let built = target_folder().join("boards/thumbv7em-none-eabihf/release/sinew-parts");
        fs::copy(built, &elf)?;
        counts.push(count(&elf)?);
        branches.push(branches_to_panics(&fs::read(&elf)?)?);
    }
    println!("| part | {} |", PROGRAMS.join(" | "));
    println!("|---|{}", "--:|".repeat(PROGRAMS.len()));
    let mut section = Map::new();
    for (k, part) in PARTS.iter().enumerate() {
        let said = |counted: &Option<(u64, f32)>| match counted {
            Some((count, value)) => format!("{count} ({value:.5})"),
            None => "—".into(),
        };
        let cells: Vec<String> = counts.iter().map(|of| said(&of[k])).collect();
        println!("| {part} | {} |", cells.join(" | "));
        let named = PROGRAMS.iter().zip(&counts);
        let named = named.map(|(program, of)| {
            let count = of[k].map(|counted| counted.0);
            ((*program).to_string(), json!(count))
        });
        section.insert((*part).into(), Value::Object(named.collect()));
    }
    println!("| branches to a panic | {branches:?} |");
    section.insert("branches_to_panics".into(), json!(branches));
    Ok(section.into())
}

/// Instructions and result of each part; `None` where the program does not have it.
fn count(elf: &Path) -> Result<Vec<Option<(u64, f32)>>> {
    let mut child = image::start(elf)?;
    let mut bytes = Vec::new();
    let output = child.stdout.as_mut().context("the child has an output")?;
    output.read_to_end(&mut bytes)?;
    child.wait()?;
    let word = |b: &[u8]| u32::from_le_bytes([b[0], b[1], b[2], b[3]]);
    let pairs = bytes.chunks_exact(8);
    let pairs: Vec<(u32, f32)> = pairs
        .map(|b| (word(&b[..4]), f32::from_bits(word(&b[4..]))))
        .collect();
    ensure!(pairs.len() == PARTS.len() + 1, "the image broke off");
    let empty = pairs[PARTS.len()].0;
    let counted = pairs[..PARTS.len()]
        .iter()
        .map(|(ticks, value)| (*ticks > 0).then(|| (image::instructions(ticks - empty), *value)));
    Ok(counted.collect())
}

/// Branches of a Thumb-2 image to functions that panic.
fn branches_to_panics(elf: &[u8]) -> Result<usize> {
    let word = |at: usize| -> Option<usize> {
        let bytes = elf.get(at..at + 4)?;
        Some(u32::from_le_bytes(bytes.try_into().ok()?) as usize)
    };
    let half = |at: usize| -> Option<usize> {
        let bytes = elf.get(at..at + 2)?;
        Some(usize::from(u16::from_le_bytes(bytes.try_into().ok()?)))
    };
    let cut = "the image is cut off";
    let (headers, sections) = (word(32).context(cut)?, half(48).context(cut)?);
    let field = |section: usize, field: usize| word(headers + 40 * section + 4 * field);
    let mut panics = BTreeSet::new();
    for section in (0..sections).filter(|s| field(*s, 1) == Some(2)) {
        let (at, size) = (field(section, 4), field(section, 5));
        let names = field(section, 6).and_then(|names| field(names, 4));
        let (at, names) = (at.context(cut)?, names.context(cut)?);
        for symbol in (at..at + size.context(cut)?).step_by(16) {
            let name = elf.get(names + word(symbol).context(cut)?..).context(cut)?;
            let end = name.iter().position(|byte| *byte == 0).context(cut)?;
            let name = String::from_utf8_lossy(&name[..end]);
            if ["panicking", "slice_index_fail", "unwrap_failed"]
                .iter()
                .any(|word| name.contains(word))
            {
                panics.insert(word(symbol + 4).context(cut)? & !1);
            }
        }
    }
    ensure!(!panics.is_empty(), "the image has no function that panics");
    let mut count = 0;
    // Sections that hold code.
    for section in (0..sections).filter(|s| field(*s, 2).is_some_and(|flags| flags & 4 != 0)) {
        let [address, at, size] = [3, 4, 5].map(|k| field(section, k).unwrap_or(0));
        for offset in (0..size.saturating_sub(3)).step_by(2) {
            let (Some(first), Some(second)) = (half(at + offset), half(at + offset + 2)) else {
                break;
            };
            // BL and B.W (Armv7-M Architecture Reference Manual, A7.7.12 and A7.7.18).
            let branch = first & 0xf800 == 0xf000
                && (second & 0xd000 == 0xd000 || second & 0xd000 == 0x9000);
            if !branch {
                continue;
            }
            let sign = first >> 10 & 1;
            let [i1, i2] = [13, 11].map(|bit| 1 - ((second >> bit & 1) ^ sign));
            let reach =
                sign << 24 | i1 << 23 | i2 << 22 | (first & 0x3ff) << 12 | (second & 0x7ff) << 1;
            let from = address + offset + 4;
            let to = (from + reach).checked_sub(sign << 25);
            count += usize::from(to.is_some_and(|to| panics.contains(&to)));
        }
    }
    Ok(count)
}

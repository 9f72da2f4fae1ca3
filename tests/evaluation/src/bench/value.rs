//! Short horizons with a cost-to-go at their end, beside horizons without one, on the reference
//! problem: instructions in QEMU and tracking of the plant.

use std::fs;

use anyhow::{Context, Result};
use serde_json::{Map, Value, json};
use sinew_model::emit::EmitOptions;
use sinew_model::spec::ValueSpec;
use sinew_model::{reference, regenerate, store, value};

use super::image::{self, Content};
use super::lockstep::close;
use xtask::process::{root, target_folder};
use xtask::setup::{self, Extent};

/// Rows of the reference behind the horizon that the cost-to-go takes.
const AHEAD: usize = 4;

/// A controller of network S.
struct Case {
    name: &'static str,
    horizon: usize,
    /// Blocks of equal moves.
    blocks: &'static [usize],
    /// Rows and operating points of the cost-to-go; none of either: it has none.
    value: (usize, usize),
}

const fn case(
    name: &'static str,
    horizon: usize,
    blocks: &'static [usize],
    value: (usize, usize),
) -> Case {
    Case {
        name,
        horizon,
        blocks,
        value,
    }
}

const CASES: &[Case] = &[
    case("N1", 1, &[1], (0, 0)),
    case("N3", 3, &[1, 2], (0, 0)),
    case("N5", 5, &[2, 2], (0, 0)),
    case("N10", 10, &[2, 2, 3, 3], (0, 0)),
    case("N1_one_row", 1, &[1], (1, 5)),
    case("N1_one_point", 1, &[1], (2, 1)),
    case("N1_value", 1, &[1], (2, 5)),
    case("N2_value", 2, &[2], (2, 5)),
    case("N3_value", 3, &[3], (2, 5)),
    case("N3_value_two_moves", 3, &[1, 2], (2, 5)),
];

/// Counts, prints and returns `terminal_value`.
///
/// # Errors
/// An image does not build or run.
pub fn run() -> Result<Value> {
    let toolchain = setup::run(Extent::Build)?;
    let mut section = Map::new();
    println!("blocks, rows, points, mean, largest, tracking, flash, statics, stack");
    for case in CASES {
        let name = write(case)?;
        let elf = image::build(&toolchain, &name, "count", Content::Ours)?;
        let run = close(&elf, &name)?;
        let (mean, most) = run.mean_and_most();
        let (flash, statics) = image::sizes(&elf)?;
        println!(
            "{}: {:?}, {}, {}, {mean}, {most}, {:.4}, {flash}, {statics}, {}",
            case.name, case.blocks, case.value.0, case.value.1, run.tracking_rms, run.stack
        );
        section.insert(
            case.name.into(),
            json!({
                "horizon": case.horizon, "blocks": case.blocks,
                "rows": case.value.0, "points": case.value.1,
                "mean": mean, "max": most, "tracking_rms": run.tracking_rms,
                "image_flash_bytes": flash, "image_static_bytes": statics,
                "stack_bytes": run.stack,
            }),
        );
    }
    Ok(section.into())
}

/// The crate of a case in `target/bench/models`, and its name.
fn write(case: &Case) -> Result<String> {
    let read = |file: &str| {
        let path = root().join("models/reference").join(file);
        fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()))
    };
    let mut spec = reference::import(&read("S.json")?, &read("problem.json")?, 1, &[])?;
    spec.name = format!("bench-s-{}", case.name.to_lowercase().replace('_', "-"));
    spec.control.horizon = case.horizon;
    spec.control.control_horizon = case.blocks.iter().sum();
    spec.control.move_blocks = case.blocks.to_vec();
    if case.value.0 > 0 {
        let motions = reference::motions(&read("reference.csv")?)?;
        spec.control.value = Some(ValueSpec {
            rows: case.value.0,
            ahead: AHEAD,
            points: value::along(&motions, case.value.1),
        });
    }
    let folder = target_folder().join("bench/models").join(&spec.name);
    store::save(&folder, &spec)?;
    let options = EmitOptions {
        firmware: root().join("firmware").display().to_string(),
        ..EmitOptions::default()
    };
    regenerate::write(&folder, &folder, &options)?;
    Ok(spec.name)
}

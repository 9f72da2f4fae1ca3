//! Resources of a controller on a board, before anything is flashed: its linked images, and its
//! steps counted in QEMU.

use std::path::Path;

use serde_json::{Value, json};
use sinew_model::spec::ModelSpec;
use sinew_model::work;
use sinew_nn::footprint::{CYCLES_PER_INSTRUCTION, Fit};

use crate::device::{Device, decode_log};
use crate::project::{self, Board, Chip, Optimise, Sizes, board_folder, image};
use sinew_ident::cli::progress::Stage;
use sinew_ident::error::{Error, Result};
use sinew_ident::report::{self, Table, quantity, significant};

/// Instructions in a tick of QEMU's counter: 40 ns and 32 ns (boards/qemu/README.md).
const INSTRUCTIONS_PER_TICK: f64 = 1.25;

/// Instructions of control steps in QEMU, at random states with random references.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Steps {
    /// Steps counted.
    pub steps: u64,
    /// Instructions of one, in the mean.
    pub mean: u64,
    /// Of the longest.
    pub longest: u64,
    /// Every part of a step at its longest, as often as it may occur
    /// (docs/explanation/controller.md, section 5).
    pub bound: u64,
    /// Deepest stack of a step, bytes.
    pub stack_bytes: u64,
    /// Of the parts of an optimisation, each at its longest.
    pub parts: Parts,
}

/// Instructions of the parts of an optimisation, counted, and as a budget counts them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Parts {
    /// An evaluation of J.
    pub rollout: u64,
    /// A gradient with Hessian.
    pub derivative: u64,
    /// A factorisation with all around it.
    pub factorisation: u64,
}

/// A board's row.
pub struct OnBoard {
    chip: &'static Chip,
    name: &'static str,
    /// Sizes of its image, or the linker's words about a memory that is too small.
    sizes: Result<Sizes>,
}

impl OnBoard {
    /// The image and the stack of a step beside the chip's memories; none for an image that the
    /// linker refused.
    fn fit(&self, steps: &Steps) -> Option<Fit> {
        let sizes = self.sizes.as_ref().ok()?;
        Some(Fit {
            flash_bytes: sizes.flash_bytes,
            ram_bytes: sizes.ram_bytes + steps.stack_bytes,
            flash_of_board: self.chip.flash_bytes.into(),
            ram_of_board: self.chip.ram_bytes.into(),
            stack_bytes: Some(steps.stack_bytes),
        })
    }

    /// Estimated seconds of so many instructions.
    fn time_s(&self, instructions: u64) -> f64 {
        instructions as f64 * CYCLES_PER_INSTRUCTION / f64::from(self.chip.clock_hz)
    }

    /// Returns true if the longest step ends within the period.
    fn fits_period(&self, spec: &ModelSpec, steps: &Steps) -> bool {
        self.time_s(steps.longest) <= spec.period_s
    }

    /// One line: `fits`, or what is too small; and the time of a step, where it is too long.
    fn verdict(&self, spec: &ModelSpec, steps: &Steps) -> String {
        let memory = match (self.fit(steps), &self.sizes) {
            (Some(fit), _) => fit.words(),
            (None, Err(words)) => format!("does not fit: {words}"),
            (None, Ok(_)) => String::new(),
        };
        let time = if self.fits_period(spec, steps) {
            String::new()
        } else {
            format!(
                "; too slow: the longest step takes {} of a period of {}",
                quantity(self.time_s(steps.longest), "s"),
                quantity(spec.period_s, "s")
            )
        };
        format!("{:<10} {memory}{time}", self.name)
    }
}

/// The linker's line about a memory that is too small, if it has one.
fn overflow(words: &str) -> Option<String> {
    let mut lines = words.lines();
    let line = lines.find(|line| line.contains("will not fit in region"))?;
    let at = line.find("section")?;
    Some(line.get(at..)?.trim().to_string())
}

/// Counts the steps of the project in `folder`.
///
/// # Errors
/// It does not build or run, or its checks of itself fail.
pub fn count(folder: &Path, cache: &Path) -> Result<Steps> {
    let program = project::checks(folder, cache)?;
    let runner = board_folder(folder, Board::Qemu).join("run.sh");
    let end = Device::qemu(&runner, &program)?.end()?;
    let log = decode_log(&program, &end.log)?;
    if end.status != Some(0) {
        return Err(Error::failed(format!(
            "the checks of the firmware fail in QEMU:\n{log}"
        )));
    }
    parse(&log).ok_or_else(|| Error::failed(format!("no counts in the firmware's log:\n{log}")))
}

/// The line `ticks: steps 400 mean 1 longest 2 bound 3 stack 4 rollout 5 derivative 6
/// factorisation 7` of a log.
fn parse(log: &str) -> Option<Steps> {
    let (_, line) = log.split_once("ticks: ")?;
    let words: Vec<&str> = line.lines().next()?.split_whitespace().collect();
    let after = |name: &str| -> Option<f64> {
        let at = words.iter().position(|word| *word == name)?;
        words.get(at + 1)?.parse().ok()
    };
    let instructions = |name| Some((after(name)? * INSTRUCTIONS_PER_TICK).round() as u64);
    Some(Steps {
        steps: after("steps")? as u64,
        mean: instructions("mean")?,
        longest: instructions("longest")?,
        bound: instructions("bound")?,
        stack_bytes: after("stack")? as u64,
        parts: Parts {
            rollout: instructions("rollout")?,
            derivative: instructions("derivative")?,
            factorisation: instructions("factorisation")?,
        },
    })
}

/// Counts the steps of a model's controller, and links its image for each of `boards`; build
/// outputs go to `cache`.
///
/// # Errors
/// It does not build or run.
pub fn measure(
    spec: &ModelSpec,
    boards: &[Board],
    optimise: Optimise,
    cache: &Path,
    quiet: bool,
) -> Result<(Steps, Vec<OnBoard>)> {
    let folder = cache.join("projects").join(&spec.name);
    eprint!(
        "{}",
        project::kept(&project::write(&folder, spec, optimise)?)
    );
    let stage = Stage::begin("count its steps in QEMU", quiet);
    let steps = count(&folder, cache)?;
    stage.end(report::count(steps.steps as usize, "step"));
    let mut rows = Vec::new();
    for board in boards {
        let Some(chip) = board.chip() else { continue };
        let stage = Stage::begin(format!("link it for {}", board.folder()), quiet);
        let sizes = match project::compile(&folder, *board, cache) {
            Ok(built) => Ok(image::sizes(&built.lockstep)?),
            Err(error) => Err(overflow(&error.to_string())
                .map(Error::failed)
                .ok_or(error)?),
        };
        stage.end(match &sizes {
            Ok(sizes) => format!("{} B of flash", sizes.flash_bytes),
            Err(_) => "does not fit".to_string(),
        });
        rows.push(OnBoard {
            chip,
            name: board.folder(),
            sizes,
        });
    }
    Ok((steps, rows))
}

/// One row a board. Time and power are estimates.
pub fn table(spec: &ModelSpec, steps: &Steps, rows: &[OnBoard]) -> Table {
    let period_s = spec.period_s;
    let caption = format!(
        "controller of {}, a step every {}: {} instructions in the mean of {}, {} in the longest, {} by the bound; {} B of stack",
        spec.name,
        quantity(period_s, "s"),
        steps.mean,
        steps.steps,
        steps.longest,
        steps.bound,
        steps.stack_bytes
    );
    let titles = [
        "board",
        "#flash, B",
        "#of it",
        "#RAM, B",
        "#of it",
        "#step, mean",
        "#longest",
        "#bound",
        "#of the period",
        "#power",
    ];
    let share = |part: u64, of: u32| format!("{:.1} %", 100.0 * part as f64 / f64::from(of));
    let linked = rows.iter().filter_map(|row| Some((row, row.fit(steps)?)));
    linked.fold(Table::new(caption, titles), |table, (row, fit)| {
        let chip = row.chip;
        let time = |instructions| row.time_s(instructions);
        let busy = (time(steps.mean) / period_s).min(1.0);
        let current_ma = busy * chip.run_current_ma + (1.0 - busy) * chip.sleep_current_ma;
        table.row([
            row.name.to_string(),
            fit.flash_bytes.to_string(),
            share(fit.flash_bytes, chip.flash_bytes),
            fit.ram_bytes.to_string(),
            share(fit.ram_bytes, chip.ram_bytes),
            quantity(time(steps.mean), "s"),
            quantity(time(steps.longest), "s"),
            quantity(time(steps.bound), "s"),
            format!("{:.1} %", 100.0 * time(steps.longest) / period_s),
            format!("{} mW", significant(current_ma * chip.supply_v, 3)),
        ])
    })
}

/// A line for each board: it fits, or what is too small or too slow.
pub fn verdicts(spec: &ModelSpec, steps: &Steps, rows: &[OnBoard]) -> String {
    let lines = rows.iter().map(|row| row.verdict(spec, steps) + "\n");
    lines.collect()
}

/// The parts of an optimisation: instructions counted, and those that a budget counts.
pub fn parts(spec: &ModelSpec, steps: &Steps) -> Table {
    let counted = work::parts(spec);
    let caption = match spec.control.budget {
        None => "parts of an optimisation; no budget".to_string(),
        Some(budget) if budget < counted.least() => format!(
            "parts of an optimisation; budget {budget} instructions, less than the {} of one \
             iteration: nothing is optimised",
            counted.least()
        ),
        Some(budget) => format!("parts of an optimisation; budget {budget} instructions"),
    };
    let titles = ["part", "#instructions, longest", "#in a budget"];
    let rows = [
        ("evaluation of J", steps.parts.rollout, counted.rollout),
        (
            "gradient with Hessian",
            steps.parts.derivative,
            counted.derivative,
        ),
        (
            "factorisation",
            steps.parts.factorisation,
            counted.factorisation,
        ),
    ];
    rows.iter().fold(
        Table::new(caption, titles),
        |table, (name, most, weight)| {
            table.row([name.to_string(), most.to_string(), weight.to_string()])
        },
    )
}

/// The same for programs, SI.
pub fn json(spec: &ModelSpec, steps: &Steps, rows: &[OnBoard]) -> Value {
    let boards = rows.iter().map(|row| {
        let (chip, fit) = (row.chip, row.fit(steps));
        let time = |instructions| row.time_s(instructions);
        let busy = (time(steps.mean) / spec.period_s).min(1.0);
        let current_ma = busy * chip.run_current_ma + (1.0 - busy) * chip.sleep_current_ma;
        json!({
            "board": row.name,
            "fits": fit.is_some_and(|fit| fit.fits()),
            "fits_period": row.fits_period(spec, steps),
            "flash_bytes": fit.map(|fit| fit.flash_bytes),
            "ram_bytes": fit.map(|fit| fit.ram_bytes),
            "mean_s": time(steps.mean),
            "longest_s": time(steps.longest),
            "bound_s": time(steps.bound),
            "power_W": 1e-3 * current_ma * chip.supply_v,
        })
    });
    let counted = work::parts(spec);
    let parts = |counted: u64, in_a_budget: u32| {
        json!({
            "instructions": counted,
            "in_a_budget": in_a_budget,
        })
    };
    json!({
        "period_s": spec.period_s,
        "steps": steps.steps,
        "instructions_per_step": {
            "mean": steps.mean, "max": steps.longest, "bound": steps.bound,
        },
        "parts": {
            "rollout": parts(steps.parts.rollout, counted.rollout),
            "derivative": parts(steps.parts.derivative, counted.derivative),
            "factorisation": parts(steps.parts.factorisation, counted.factorisation),
        },
        "stack_bytes": steps.stack_bytes,
        "boards": boards.collect::<Vec<_>>(),
    })
}

/// Accuracy of the figures.
pub const REMARK: &str = "\
Flash and RAM are the linked image's, RAM with the stack of a control step. Instructions are counted in QEMU at random states with
random references; the bound is every part of a step at its longest, as often as it can occur. Times and power are estimates, measured
on no board: 1.7 cycles an instruction, and the data sheet's currents for running during the mean step and sleeping after it.
";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_read_from_the_firmwares_log() {
        let log = "0.1 INFO it holds ... ok\n0.2 INFO ticks: steps 400 mean 800 longest 1600 bound 4000 stack 2832 rollout 400 derivative 480 factorisation 80\n";
        let steps = Steps {
            steps: 400,
            mean: 1000,
            longest: 2000,
            bound: 5000,
            stack_bytes: 2832,
            parts: Parts {
                rollout: 500,
                derivative: 600,
                factorisation: 100,
            },
        };
        assert_eq!(parse(log), Some(steps));
        assert_eq!(parse("0.1 INFO it holds ... ok\n"), None);
    }

    #[test]
    fn a_chip_whose_ram_the_stack_exceeds_is_said_and_so_is_a_step_that_is_too_long() {
        let spec = sinew_model::store::load(
            &std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/reference-s"),
        )
        .expect("a committed model");
        let steps = |stack_bytes, longest| Steps {
            steps: 1,
            mean: longest,
            longest,
            bound: longest,
            stack_bytes,
            parts: Parts {
                rollout: 1,
                derivative: 1,
                factorisation: 1,
            },
        };
        let row = |sizes| OnBoard {
            chip: Board::Stm32f446.chip().expect("a board with a chip"),
            name: "stm32f446",
            sizes,
        };
        let linked = || {
            row(Ok(Sizes {
                flash_bytes: 50_000,
                ram_bytes: 4_000,
                heap_bytes: 0,
            }))
        };
        let small = verdicts(&spec, &steps(8_000, 1_000), &[linked()]);
        assert_eq!(small, "stm32f446  fits: 9.54 % of flash, 9.16 % of RAM\n");
        let deep = verdicts(&spec, &steps(148_548, 1_000), &[linked()]);
        assert_eq!(
            deep,
            "stm32f446  does not fit: 152,548 B of RAM (148,548 B of it stack), the board has \
             131,072 B\n"
        );
        let slow = verdicts(&spec, &steps(8_000, 1 << 40), &[linked()]);
        assert!(
            slow.contains("; too slow: the longest step takes"),
            "{slow}"
        );
        let said = "error: x\n  = note: rust-lld: error: section '.text' will not fit in region \
                    'FLASH': overflowed by 1234 bytes\n";
        let words = overflow(said).expect("the linker says so");
        let refused = [row(Err(Error::failed(words)))];
        assert_eq!(
            verdicts(&spec, &steps(8_000, 1_000), &refused),
            "stm32f446  does not fit: section '.text' will not fit in region 'FLASH': overflowed \
             by 1234 bytes\n"
        );
        assert_eq!(overflow("error: something else"), None);
        let document = json(&spec, &steps(8_000, 1_000), &refused);
        assert_eq!(document["boards"][0]["fits"], false);
        assert!(document["boards"][0]["flash_bytes"].is_null());
    }
}

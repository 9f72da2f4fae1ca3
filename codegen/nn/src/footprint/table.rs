//! The figures of a network as a table.

use super::board::{BOARDS, Board};
use super::chip::CYCLES_PER_INSTRUCTION;
use super::cost::Footprint;
use super::fit::Fit;
use crate::Network;
use crate::summary::thousands;

/// The figures as a table: with times for one board, or, without one, for all alike. A line for
/// each board says whether it fits.
#[must_use]
pub fn table(network: &Network, footprint: &Footprint, board: Option<&Board>) -> String {
    let chip = board.and_then(|board| board.chip);
    let on = board.map_or(String::new(), |board| format!(" on {}", board.name));
    let mut text = format!(
        "{}{on}\n\n{:<14} {:>10} {:>10} {:>10} {:>14} {:>12}\n",
        network.name, "", "flash, B", "RAM, B", "stack, B", "instructions", "time, us"
    );
    let number = |n: Option<u64>| n.map_or("-".into(), |n| thousands(n as usize));
    let calls = [
        ("predict", &footprint.predict),
        ("with jacobian", &footprint.jacobian),
    ];
    for (name, cost) in calls {
        let time = match (cost.instructions, chip) {
            (Some(n), Some(chip)) => {
                let cycles = n as f64 * CYCLES_PER_INSTRUCTION;
                format!("{:.1}", cycles / f64::from(chip.clock_hz) * 1e6)
            }
            _ => "-".into(),
        };
        text += &format!(
            "{name:<14} {:>10} {:>10} {:>10} {:>14} {time:>12}\n",
            thousands(cost.flash_bytes as usize),
            thousands(cost.ram_bytes as usize),
            number(cost.stack_bytes),
            number(cost.instructions),
        );
    }
    text += &format!(
        "\nOf the flash, {} B are weights.",
        thousands(footprint.weight_bytes as usize)
    );
    text += if footprint.predict.instructions.is_none() {
        " Instructions and stack are unknown: there is no QEMU (cargo xtask\nsetup), or the network is larger than the memory of its board.\n\n"
    } else if chip.is_some() {
        " Flash, RAM, stack and instructions are measured on the linked\nimage in QEMU; time is an estimate at 1.7 cycles an instruction, measured on no board.\n\n"
    } else {
        " QEMU counts instructions and knows no time.\n\n"
    };
    for board in BOARDS
        .iter()
        .filter(|it| board.is_none_or(|one| one == *it))
    {
        for (name, cost) in calls {
            let fit = Fit::of(cost, board).words();
            text += &format!("{:<10} {name:<14} {fit}\n", board.name);
        }
    }
    text
}

//! The checks that a board makes of itself (`sinew_device::checks`), one after another. Ends with
//! status 0 when all hold and 4 when one does not; the log has a line for what control steps take,
//! and one for each.

#![no_std]
#![no_main]

use sinew_board_qemu::pac;
use sinew_board_qemu::semihosting::{ExitCode, exit};
use sinew_board_qemu::time::{self, Counter};
use sinew_board_runtime::checks::{golden, subject};
use sinew_board_runtime::model::control::{Controller, HORIZON, NS, NU, NY};
use sinew_board_runtime::{model, stack};
use sinew_device::checks::{self, CheckOutcome, Ticks, times};
use sinew_device::for_each_check;
use static_cell::StaticCell;

static CONTROLLER: StaticCell<Controller> = StaticCell::new();

/// Control steps that are timed.
const STEPS: u32 = 400;

/// Says how a check ended; whether it failed.
fn told(name: &str, outcome: CheckOutcome) -> bool {
    match outcome {
        Ok(()) => defmt::info!("{=str} ... ok", name),
        Err(wrong) => defmt::error!("{=str} ... FAILED: {}", name, wrong),
    }
    outcome.is_err()
}

#[cortex_m_rt::entry]
fn main() -> ! {
    stack::paint();
    time::init();
    // First: what the checks below have on the stack is not the controller's.
    let Ticks {
        steps,
        mean,
        longest,
        bound,
        parts,
    } = times::<_, NU, NY, NS, HORIZON>(
        CONTROLLER.init_with(model::control::controller),
        STEPS,
        &Counter,
    );
    let stack = stack::high_water_bytes();
    defmt::info!(
        "ticks: steps {=u32} mean {=u32} longest {=u32} bound {=u32} stack {=u32} \
         rollout {=u32} derivative {=u32} factorisation {=u32}",
        steps,
        mean,
        longest,
        bound,
        stack,
        parts.rollout,
        parts.derivative,
        parts.factorisation
    );
    let make = || subject(Counter, pac::CLOCK_HZ);
    let mut failed = false;
    macro_rules! run {
        ($($name:ident)*) => {
            $( failed |= told(stringify!($name), checks::$name(make, golden())); )*
        };
    }
    for_each_check!(run);
    exit(if failed {
        ExitCode::CheckFailed
    } else {
        ExitCode::Stopped
    })
}

//! Faults on order, for the tests of what happens then: the file `inject` in QEMU's working
//! directory says which one and at which tick, as `hang 120`. On this board only; without the file
//! nothing of it runs.

use sinew_board_runtime::stack;

use crate::semihosting;

/// Injected fault.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Fault {
    /// The control task stops for ever.
    Hang,
    /// An undefined instruction.
    Undefined,
    /// Every tick from then on takes longer than its period.
    Slow,
    /// The stack grows until little is left.
    Deep,
}

/// A fault that is to come.
#[derive(Clone, Copy)]
pub struct Inject {
    fault: Fault,
    at_tick: u32,
}

impl Inject {
    /// Reads the order, if there is one.
    pub fn read() -> Option<Self> {
        let mut text = [0; 32];
        let n = semihosting::read_file(c"inject", &mut text)?;
        let text = core::str::from_utf8(text.get(..n)?).ok()?;
        let (name, tick) = text.trim().split_once(' ')?;
        let fault = match name {
            "hang" => Fault::Hang,
            "undefined" => Fault::Undefined,
            "slow" => Fault::Slow,
            "deep" => Fault::Deep,
            _ => return None,
        };
        let at_tick = tick.parse().ok()?;
        Some(Self { fault, at_tick })
    }

    /// To be called every tick.
    pub fn tick(&self, tick: u32) {
        match self.fault {
            Fault::Slow if tick >= self.at_tick => cortex_m::asm::delay(400_000),
            _ if tick != self.at_tick => {}
            Fault::Slow => {}
            Fault::Hang => loop {
                cortex_m::asm::nop();
            },
            Fault::Undefined => cortex_m::asm::udf(),
            Fault::Deep => deeper(),
        }
    }
}

/// Uses stack until less than a kilobyte is left; ends because the stack is finite.
#[inline(never)]
fn deeper() {
    let ballast = [0_u8; 64];
    core::hint::black_box(&ballast);
    if stack::left_bytes() > 1024 {
        deeper();
    }
    core::hint::black_box(&ballast);
}

//! Every network under test on QEMU's Cortex-M4F: results, instructions, stack.
#![no_std]
#![no_main]

use core::fmt::Write as _;
use core::panic::PanicInfo;

use semihosting::io::{Stdout, Write as _};

const TIMER_CONTROL: *mut u32 = 0x4000_0000 as *mut u32;
const TIMER_VALUE: *mut u32 = 0x4000_0004 as *mut u32;
const TIMER_RELOAD: *mut u32 = 0x4000_0008 as *mut u32;

/// Bytes below the stack pointer that are painted before a call, and their paint.
const PAINTED: usize = 1 << 20;
const PAINT: u32 = 0xC5C5_C5C5;
/// Left unpainted: the frame of whoever paints. No call is reported to take less.
const MARGIN: usize = 256;

struct Machine {
    line: [u8; 4096],
    length: usize,
    out: Stdout,
    /// Counts of a call that does nothing.
    idle: u32,
}

impl core::fmt::Write for Machine {
    fn write_str(&mut self, text: &str) -> core::fmt::Result {
        for byte in text.bytes() {
            if self.length == self.line.len() {
                self.flush();
            }
            self.line[self.length] = byte;
            self.length += 1;
        }
        Ok(())
    }
}

impl Machine {
    fn flush(&mut self) {
        let _ = self.out.write_all(&self.line[..self.length]);
        self.length = 0;
    }

    /// Counts of the timer while `work` runs. 25.6 counts an instruction, at 1,024 ns each.
    #[inline(never)]
    fn counts(work: &mut dyn FnMut()) -> u32 {
        // SAFETY: the timer's value register, which only counts.
        let before = unsafe { TIMER_VALUE.read_volatile() };
        work();
        // SAFETY: as above.
        before.wrapping_sub(unsafe { TIMER_VALUE.read_volatile() })
    }
}

impl cases::Bench for Machine {
    fn numbers(&mut self, name: &str, values: &mut dyn Iterator<Item = f32>) {
        let _ = write!(self, "{name}");
        for value in values {
            let _ = write!(self, " {:08x}", value.to_bits());
        }
        let _ = writeln!(self);
        self.flush();
    }

    fn measure(&mut self, name: &str, work: &mut dyn FnMut()) {
        let local = 0_u32;
        let top = &raw const local as usize & !3;
        let bottom = top - PAINTED;
        // SAFETY: below this frame there is nothing but free stack: RAM is 4 MiB and statics are
        // few.
        unsafe {
            let mut word = bottom as *mut u32;
            while (word as usize) < top - MARGIN {
                word.write_volatile(PAINT);
                word = word.add(1);
            }
        }
        let counts = Self::counts(work);
        // SAFETY: as above.
        let deepest = unsafe {
            let mut word = bottom as *const u32;
            while word.read_volatile() == PAINT {
                word = word.add(1);
            }
            word as usize
        };
        let instructions = (counts.wrapping_sub(self.idle) as u64 * 40 + 512) / 1024;
        let _ = writeln!(self, "cost {name} {instructions} {}", top - deepest);
        self.flush();
    }
}

#[cortex_m_rt::entry]
fn main() -> ! {
    // SAFETY: the timer's registers; nothing else uses it.
    unsafe {
        TIMER_RELOAD.write_volatile(u32::MAX);
        TIMER_VALUE.write_volatile(u32::MAX);
        TIMER_CONTROL.write_volatile(1);
    }
    let Ok(out) = semihosting::io::stdout() else {
        semihosting::process::exit(2)
    };
    let mut machine = Machine {
        line: [0; 4096],
        length: 0,
        out,
        idle: 0,
    };
    machine.idle = Machine::counts(&mut || {});
    cases::run(&mut machine);
    semihosting::process::exit(0)
}

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    semihosting::process::exit(101)
}

//! One prediction on QEMU's Cortex-M4F, layer by layer: instructions and stack.
#![no_std]
#![no_main]

mod call;

use core::panic::PanicInfo;

use layered::LAYER_BYTES;
use semihosting::println;

const TIMER_CONTROL: *mut u32 = 0x4000_0000 as *mut u32;
const TIMER_VALUE: *mut u32 = 0x4000_0004 as *mut u32;
const TIMER_RELOAD: *mut u32 = 0x4000_0008 as *mut u32;

/// Bytes below the top that are painted before a layer, and their paint.
const PAINTED: usize = 1 << 20;
const PAINT: u32 = 0xC5C5_C5C5;
/// Left unpainted: the frame of whoever paints. No layer is reported to take less.
const MARGIN: usize = 64;

/// Counts and stack since the last mark.
struct Marks {
    top: usize,
    begun: u32,
    of_layers: [(u32, usize); LAYER_BYTES.len()],
}

impl Marks {
    #[inline(never)]
    fn mark(&mut self, layer: usize) {
        // SAFETY: the timer's value register, which only counts.
        let now = unsafe { TIMER_VALUE.read_volatile() };
        let stack = deepest(self.top);
        if let Some(own) = self.of_layers.get_mut(layer) {
            *own = (self.begun.wrapping_sub(now), stack);
        }
        paint(self.top);
        // SAFETY: as above.
        self.begun = unsafe { TIMER_VALUE.read_volatile() };
    }
}

#[inline(never)]
fn paint(top: usize) {
    let local = 0_u32;
    let end = (&raw const local as usize & !3) - MARGIN;
    let mut word = (top - PAINTED) as *mut u32;
    while (word as usize) < end {
        // SAFETY: below this frame there is nothing but free stack: RAM is 4 MiB and statics are
        // few.
        unsafe { word.write_volatile(PAINT) };
        word = word.wrapping_add(1);
    }
}

#[inline(never)]
fn deepest(top: usize) -> usize {
    let mut word = (top - PAINTED) as *const u32;
    // SAFETY: within the stack, whose used part ends the search.
    while (word as usize) < top && unsafe { word.read_volatile() } == PAINT {
        word = word.wrapping_add(1);
    }
    top - word as usize
}

#[inline(never)]
fn run(marks: &mut Marks) {
    let local = 0_u32;
    marks.top = &raw const local as usize & !3;
    call::call(&mut |layer| marks.mark(layer));
}

#[cortex_m_rt::entry]
fn main() -> ! {
    // SAFETY: the timer's registers; nothing else uses it.
    unsafe {
        TIMER_RELOAD.write_volatile(u32::MAX);
        TIMER_VALUE.write_volatile(u32::MAX);
        TIMER_CONTROL.write_volatile(1);
    }
    let mut marks = Marks {
        top: 0,
        begun: 0,
        of_layers: [(0, 0); LAYER_BYTES.len()],
    };
    run(&mut marks);
    // Two marks with nothing between them say what a mark takes.
    let idle = marks.of_layers[0].0;
    for (layer, (counts, stack)) in marks.of_layers.into_iter().enumerate().skip(1) {
        let instructions = (u64::from(counts.saturating_sub(idle)) * 40 + 512) / 1024;
        println!("layer {layer} {instructions} {stack} {}", LAYER_BYTES[layer]);
    }
    semihosting::process::exit(0)
}

#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    semihosting::process::exit(101)
}

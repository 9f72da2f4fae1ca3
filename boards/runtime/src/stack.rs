//! High-water mark of the stack: the free part is painted at start, and what is no longer paint was
//! used.

use core::ptr;

/// Unlikely as data, odd as an address.
const PAINT: u32 = 0xC5C5_C5C5;
/// Left unpainted below the stack pointer: the frame of `paint` and of an interrupt during it
/// (26 words with floating-point state).
const MARGIN_BYTES: usize = 256;

unsafe extern "C" {
    // Symbols of cortex-m-rt's link.x; only their addresses mean anything.
    static mut _stack_start: u32;
    static mut _stack_end: u32;
}

/// One past the highest address of the stack.
fn top() -> *mut u32 {
    &raw mut _stack_start
}

/// Lowest address that the stack may reach: the end of the statics.
fn bottom() -> *mut u32 {
    &raw mut _stack_end
}

/// Paints the unused part. Call it first thing in `main`.
pub fn paint() {
    let free = cortex_m::register::msp::read() as usize - MARGIN_BYTES;
    let mut word = bottom();
    while (word as usize) < free {
        // SAFETY: between the statics and the stack pointer, with a margin, lies memory of nobody.
        unsafe {
            word.write_volatile(PAINT);
            word = word.add(1);
        }
    }
}

/// Most bytes of stack in use at any time since `paint`, at least the margin.
///
/// Cost: 5 instructions per word never used, some 150,000 on this machine; not for the control
/// loop.
pub fn high_water_bytes() -> u32 {
    let mut word = bottom();
    // SAFETY: aligned words of RAM, read only.
    while word < top() && unsafe { ptr::read_volatile(word) } == PAINT {
        // SAFETY: at most one past the end, which is `top`.
        word = unsafe { word.add(1) };
    }
    (top() as usize - word as usize) as u32
}

/// Bytes of stack that were never in use since `paint`. Cost: 5 instructions for each word of them.
pub fn never_used_bytes() -> u32 {
    (top() as usize - bottom() as usize) as u32 - high_water_bytes()
}

/// Bytes between here and the end of the stack.
pub fn left_bytes() -> u32 {
    (cortex_m::register::msp::read() as usize).saturating_sub(bottom() as usize) as u32
}

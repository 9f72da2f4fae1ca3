//! Why the chip starts anew: two words of RAM that no start-up code touches.

use core::mem::MaybeUninit;
use core::ptr::{addr_of, addr_of_mut};

use sinew_device::mode::Cause;

/// Stands beside the cause: RAM after power-on holds anything.
const SEAL: u32 = 0x5AFE_57A7;

// `.uninit` is neither cleared nor loaded by cortex-m-rt.
#[unsafe(link_section = ".uninit.SINEW_RESTART")]
static mut NOTE: MaybeUninit<[u32; 2]> = MaybeUninit::uninit();

/// Leaves the cause for the next start. From any context, a fault included.
pub fn leave(cause: Cause) {
    // SAFETY: two aligned words that nothing else writes while a fault or a start is handled.
    unsafe {
        addr_of_mut!(NOTE)
            .cast::<[u32; 2]>()
            .write_volatile([SEAL, code(cause)])
    };
}

/// The cause that was left; a second call returns none.
pub fn take() -> Option<Cause> {
    // SAFETY: any bits are a valid [u32; 2]; volatile, so nothing is assumed about them.
    let [seal, code] = unsafe { addr_of!(NOTE).cast::<[u32; 2]>().read_volatile() };
    // SAFETY: as in `leave`.
    unsafe { addr_of_mut!(NOTE).cast::<[u32; 2]>().write_volatile([0, 0]) };
    let cause = match code {
        1 => Cause::Watchdog,
        2 => Cause::Fault,
        3 => Cause::BrownOut,
        _ => return None,
    };
    (seal == SEAL).then_some(cause)
}

const fn code(cause: Cause) -> u32 {
    match cause {
        Cause::Watchdog => 1,
        Cause::Fault => 2,
        Cause::BrownOut => 3,
        _ => 0,
    }
}

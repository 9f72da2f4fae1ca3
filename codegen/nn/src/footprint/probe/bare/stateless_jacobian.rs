//! The flashed part of the network, and nothing else.
#![no_std]
#![no_main]

use network::{INPUTS, OUTPUTS, predict, predict_with_jacobian};

/// # Safety
/// It is never run.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn _start(x: *const f32, y: *mut f32, jacobian: *mut f32) {
    // SAFETY: it is never run.
    let (x, y) = unsafe { (&*x.cast::<[f32; INPUTS]>(), &mut *y.cast::<[f32; OUTPUTS]>()) };
    *y = predict(x);
    // SAFETY: as above.
    let jacobian = unsafe { &mut *jacobian.cast::<[[f32; OUTPUTS]; INPUTS]>() };
    *y = predict_with_jacobian(x, jacobian);
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {}
}

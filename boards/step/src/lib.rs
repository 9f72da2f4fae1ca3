//! One control step as a C library: estimator, optimisation and limits together.
//!
//! `include/sinew_mpc.h` is the interface. There is one controller, at rest at the start, in
//! statics of this library; the functions are not reentrant: call them from one thread or interrupt
//! only.

#![no_std]

use core::cell::UnsafeCell;
use core::slice;

use model::control::{Controller, DECISIONS, HORIZON, MEASURED, NS, NU, NY};
use sinew_mpc::status::Status;

/// The controller and what its last step said.
struct State {
    controller: Controller,
    status: Status,
    cost: f32,
    iterations: u8,
}

struct Shared(UnsafeCell<State>);

// SAFETY: the interface is not reentrant, which its documentation demands of the caller.
unsafe impl Sync for Shared {}

static STATE: Shared = Shared(UnsafeCell::new(State {
    controller: model::control::controller(),
    status: Status::SignalLost,
    cost: 0.0,
    iterations: 0,
}));

/// One step, physical units.
///
/// `y_measured`: NY outputs, then MEASURED sensor channels, NaN where a value is missing.
/// `reference`: N2 rows of NY, the first for the next sample. `u_out`: NU commands, inside the
/// limits whatever came in. A null `y_measured` is a missing sample, a null `reference` one that
/// cannot be followed.
///
/// # Safety
/// Each pointer is null or valid for that many floats; no other call is in progress.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_mpc_step(
    y_measured: *const f32,
    reference: *const f32,
    u_out: *mut f32,
) {
    // SAFETY: no other call is in progress.
    let state = unsafe { &mut *STATE.0.get() };
    let (mut y, mut s) = ([f32::NAN; NY], [f32::NAN; NS]);
    if !y_measured.is_null() {
        // SAFETY: valid for NY + MEASURED floats.
        let given = unsafe { slice::from_raw_parts(y_measured, NY + MEASURED) };
        for (place, value) in y.iter_mut().chain(&mut s).zip(given) {
            *place = *value;
        }
    }
    // SAFETY: null, or valid for N2 rows of NY floats.
    let given = unsafe { reference.cast::<[[f32; NY]; HORIZON]>().as_ref() };
    let missing;
    let rows = if let Some(rows) = given {
        rows
    } else {
        missing = [[f32::NAN; NY]; HORIZON];
        &missing
    };
    let step = state.controller.step(&y, &s, rows);
    state.status = step.status;
    state.cost = step.cost;
    state.iterations = step.iterations;
    if !u_out.is_null() {
        // SAFETY: valid for NU floats.
        let out = unsafe { slice::from_raw_parts_mut(u_out, NU) };
        for (place, u) in out.iter_mut().zip(&step.u) {
            *place = *u;
        }
    }
}

/// Status of the last step: 0 converged, 1 iteration limit, 2 no decrease, 3 bad reference, 4 bad
/// settings, 5 prediction not finite, 6 lost (also before the first step).
#[unsafe(no_mangle)]
pub extern "C" fn sinew_mpc_last_status() -> u32 {
    // SAFETY: no other call is in progress.
    unsafe { (*STATE.0.get()).status as u32 }
}

/// Clears all state: history, disturbance, plan and the command applied last, which is the safe one
/// again.
#[unsafe(no_mangle)]
pub extern "C" fn sinew_reset() {
    // SAFETY: no other call is in progress.
    let state = unsafe { &mut *STATE.0.get() };
    state.controller = model::control::controller();
    state.status = Status::SignalLost;
}

/// Newton iterations, cost and plan of the last step: what the counting program reports.
pub fn last_plan() -> (u8, f32, [f32; DECISIONS]) {
    // SAFETY: no other call is in progress.
    let state = unsafe { &*STATE.0.get() };
    (state.iterations, state.cost, *state.controller.plan())
}

#[cfg(all(feature = "archive", not(test)))]
#[panic_handler]
fn stop(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {}
}

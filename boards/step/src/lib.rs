//! One control step as a C library: estimator, optimisation and limits together.
//!
//! `include/sinew_mpc.h` is the interface. There is one controller, at rest at the start, in
//! statics of this library; the functions are not reentrant: call them from one thread or interrupt
//! only.

#![no_std]

use core::cell::UnsafeCell;
use core::slice;

use model::control::{Controller, DECISIONS, HORIZON, MEASURED, NS, NU, NY};
use sinew_mpc::predictive_loop::PredictiveLoop;
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

/// The interface that every kind of controller has.
#[inline(always)]
fn interface(controller: &mut Controller) -> &mut impl PredictiveLoop<NU, NY, NS, HORIZON> {
    controller
}

/// Outputs, then sensor channels, at `given`; NaN where a value is missing, everywhere of null.
///
/// # Safety
/// `given` is null or valid for NY + MEASURED floats.
#[inline(always)]
unsafe fn readings(given: *const f32) -> ([f32; NY], [f32; NS]) {
    let (mut y, mut s) = ([f32::NAN; NY], [f32::NAN; NS]);
    if !given.is_null() {
        // SAFETY: valid for NY + MEASURED floats.
        let given = unsafe { slice::from_raw_parts(given, NY + MEASURED) };
        for (place, value) in y.iter_mut().chain(&mut s).zip(given) {
            *place = *value;
        }
    }
    (y, s)
}

/// Copies values to `out` unless it is null.
///
/// # Safety
/// `out` is null or valid for that many floats.
#[inline(always)]
unsafe fn copy(values: &[f32], out: *mut f32) {
    if !out.is_null() {
        // SAFETY: valid for as many floats.
        let out = unsafe { slice::from_raw_parts_mut(out, values.len()) };
        for (place, value) in out.iter_mut().zip(values) {
            *place = *value;
        }
    }
}

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
    // SAFETY: null, or valid for NY + MEASURED floats.
    let (y, s) = unsafe { readings(y_measured) };
    // SAFETY: null, or valid for N2 rows of NY floats.
    let given = unsafe { reference.cast::<[[f32; NY]; HORIZON]>().as_ref() };
    let missing;
    let rows = if let Some(rows) = given {
        rows
    } else {
        missing = [[f32::NAN; NY]; HORIZON];
        &missing
    };
    let step = interface(&mut state.controller).step(&y, &s, rows);
    state.status = step.status;
    state.cost = step.cost;
    state.iterations = step.iterations;
    // SAFETY: null, or valid for NU floats.
    unsafe { copy(&step.u, u_out) }
}

/// One step without an optimisation: towards the commands `u_asked`, or the safe ones where it is
/// null, inside the limits. The controller goes on estimating, so a change to
/// [`sinew_mpc_step`] has no bump.
///
/// # Safety
/// As [`sinew_mpc_step`]; `u_asked` is null or valid for NU floats.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_mpc_open_loop(
    y_measured: *const f32,
    u_asked: *const f32,
    u_out: *mut f32,
) {
    // SAFETY: no other call is in progress.
    let state = unsafe { &mut *STATE.0.get() };
    // SAFETY: null, or valid for NY + MEASURED floats.
    let (y, s) = unsafe { readings(y_measured) };
    // SAFETY: null, or valid for NU floats.
    let asked = unsafe { u_asked.cast::<[f32; NU]>().as_ref() };
    let step = interface(&mut state.controller).open_loop(&y, &s, asked);
    state.status = step.status;
    state.cost = step.cost;
    state.iterations = step.iterations;
    // SAFETY: null, or valid for NU floats.
    unsafe { copy(&step.u, u_out) }
}

/// The safe commands at once, without regard to the rate limit. Forgets the past, but not what a
/// controller with a state has learned of the plant. The next step controls again.
///
/// # Safety
/// `u_out` is null or valid for NU floats; no other call is in progress.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_mpc_emergency_stop(u_out: *mut f32) {
    // SAFETY: no other call is in progress.
    let state = unsafe { &mut *STATE.0.get() };
    state.status = Status::SignalLost;
    state.cost = 0.0;
    state.iterations = 0;
    let controller = interface(&mut state.controller);
    controller.emergency_stop();
    // SAFETY: null, or valid for NU floats.
    unsafe { copy(controller.applied(), u_out) }
}

/// Telemetry of the last step.
#[repr(C)]
pub struct Telemetry {
    /// Status, as [`sinew_mpc_last_status`].
    pub status: u32,
    /// Newton iterations.
    pub iterations: u32,
    /// Cost of the plan that is followed; 0 where nothing was optimised.
    pub cost: f32,
    /// Incomplete samples since the last reset.
    pub missed: u32,
}

/// Writes the telemetry of the last step.
///
/// # Safety
/// `out` is null or valid for one telemetry; no other call is in progress.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_mpc_telemetry(out: *mut Telemetry) {
    // SAFETY: no other call is in progress.
    let state = unsafe { &mut *STATE.0.get() };
    // SAFETY: null, or valid for one telemetry.
    if let Some(out) = unsafe { out.as_mut() } {
        *out = Telemetry {
            status: state.status as u32,
            iterations: u32::from(state.iterations),
            cost: state.cost,
            missed: interface(&mut state.controller).missed(),
        };
    }
}

/// Channels that are left out because the others contradict them: bit i is channel i, of the first
/// 32. Always 0 of a model that judges none.
#[unsafe(no_mangle)]
pub extern "C" fn sinew_mpc_left_out() -> u32 {
    // SAFETY: no other call is in progress.
    let state = unsafe { &mut *STATE.0.get() };
    interface(&mut state.controller).left_out().channels
}

/// Number of times that a channel was left out since the last reset.
#[unsafe(no_mangle)]
pub extern "C" fn sinew_mpc_times_left_out() -> u32 {
    // SAFETY: no other call is in progress.
    let state = unsafe { &mut *STATE.0.get() };
    interface(&mut state.controller).left_out().times
}

/// Writes the NY outputs as they are estimated, physical units; NaN while the signal is lost.
///
/// # Safety
/// `y_out` is null or valid for NY floats; no other call is in progress.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_mpc_estimate(y_out: *mut f32) {
    // SAFETY: no other call is in progress.
    let state = unsafe { &mut *STATE.0.get() };
    let estimate = if state.status == Status::SignalLost {
        [f32::NAN; NY]
    } else {
        interface(&mut state.controller).estimate()
    };
    // SAFETY: null, or valid for NY floats.
    unsafe { copy(&estimate, y_out) }
}

/// Writes the estimated disturbance, model units.
///
/// # Safety
/// `d_out` is null or valid for the model's number of disturbances; no other call is in progress.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn sinew_mpc_disturbance(d_out: *mut f32) {
    // SAFETY: no other call is in progress.
    let state = unsafe { &mut *STATE.0.get() };
    // SAFETY: null, or valid for as many floats.
    unsafe { copy(interface(&mut state.controller).disturbance(), d_out) }
}

/// Status of the last step: 0 converged, 1 iteration limit, 2 no decrease, 3 bad reference, 4 bad
/// settings, 5 prediction not finite, 6 lost (also before the first step), 8 open loop.
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

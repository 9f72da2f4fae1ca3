//! Counts the instructions of one prediction of the network in QEMU: its golden vectors in turn.
//!
//! Writes to the file `to_host`, as little-endian words: how many there are, then the ticks of each
//! call, then the ticks of two reads of the counter with nothing between.

#![no_std]
#![no_main]

#[path = "../timer.rs"]
mod timer;
#[path = "../vectors.rs"]
mod vectors;

use core::hint::black_box;

use model::control::{NS, NU, NY, PAST_INPUTS, PAST_OUTPUTS};
use model::golden::GOLDEN;
use semihosting::fs::File;
use semihosting::io::Write;
use semihosting::process;
use sinew_mpc::model::{Model, Regressor};
use sinew_mpc::network::unflatten;
use timer::ticks;

type Input = Regressor<NU, NY, NS, PAST_INPUTS, PAST_OUTPUTS>;
type Trace = <model::Network as Model<NU, NY, NS, PAST_INPUTS, PAST_OUTPUTS>>::Trace;

#[cortex_m_rt::entry]
fn main() -> ! {
    timer::start();
    let Ok(mut to_host) = File::create(c"to_host") else {
        process::exit(2)
    };
    let mut say = |word: u32| {
        if to_host.write_all(&word.to_le_bytes()).is_err() {
            process::exit(2)
        }
    };
    say(GOLDEN.len() as u32);
    for golden in &GOLDEN {
        let Some(x): Option<Input> = unflatten(&golden.x) else {
            process::exit(3)
        };
        let mut trace = model::Network::TRACE;
        let start = ticks();
        predict(black_box(&x), golden.x.as_ptr(), &mut trace);
        let spent = ticks().wrapping_sub(start);
        black_box(&trace);
        say(spent);
    }
    let start = ticks();
    say(ticks().wrapping_sub(start));
    process::exit(0)
}

#[cfg(not(feature = "peer"))]
#[inline(always)]
fn predict(x: &Input, _: *const f32, trace: &mut Trace) {
    black_box(model::Network.predict(x, trace));
}

#[cfg(feature = "peer")]
#[inline(always)]
fn predict(_: &Input, x: *const f32, _: &mut Trace) {
    unsafe extern "C" {
        fn peer_predict(x: *const f32, y: *mut f32);
    }
    let mut y = [0.0; NY];
    // SAFETY: the peer was printed for this network, whose golden input x is and whose outputs y
    // holds.
    unsafe { peer_predict(black_box(x), y.as_mut_ptr()) };
    black_box(y);
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    process::exit(101)
}

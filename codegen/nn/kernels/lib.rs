#![no_std]
#![forbid(unsafe_code)]
//! The arithmetic of emitted networks. The emitter copies from here, whole files at a time, what a
//! network needs, so that an emitted crate depends on nothing; here the files are compiled, checked
//! and tested. Equations: docs/reference/model-files.md.
//!
//! Every kernel is generic over [`number::Number`]: `f32` predicts, [`number::Dual`] also carries
//! one derivative. A kernel `x` has a partner `x_back`, which takes adjoints (derivatives of `R`
//! results with respect to each output) to adjoints of its inputs; run on dual numbers it gives
//! second derivatives. No kernel allocates, panics, or loops without a bound.

pub mod layers;
pub mod math;
pub mod number;

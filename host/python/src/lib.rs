//! Native half of the Python package `sinew_ident`: recordings in as columns of bytes, results out
//! as JSON and columns. The objects that users see are in `python/sinew_ident`.
//!
//! Numbers cross as little-endian doubles, so that the package needs no numpy at build time.

mod checked;
mod data;
mod diagnose;
mod fit;
mod rig;
mod simulate;
mod work;

use pyo3::prelude::*;

/// The module `sinew_ident._native`.
#[pymodule]
fn _native(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_class::<rig::NativeRig>()?;
    module.add_function(wrap_pyfunction!(fit::fit, module)?)?;
    module.add_function(wrap_pyfunction!(fit::check, module)?)?;
    module.add_function(wrap_pyfunction!(diagnose::diagnose, module)?)?;
    module.add_function(wrap_pyfunction!(simulate::simulate, module)?)?;
    module.add_function(wrap_pyfunction!(simulate::excite, module)?)?;
    Ok(())
}

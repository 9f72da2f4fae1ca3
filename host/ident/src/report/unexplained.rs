//! Warning of a signal that a refitted rig does not explain.

use super::quantity;
use crate::fit::SensorFit;

/// Warning for a person; `None` where the refitted rig explains the signal
/// ([`SensorFit::is_explained`]).
pub fn unexplained(fit: &SensorFit) -> Option<String> {
    (!fit.is_explained()).then(|| {
        format!(
            "the refitted rig misses {} by {} where it moves by {}: it lacks something, and what \
             is made of it will too. Is there a spring, is the input right? `sinew diagnose` \
             looks for what is missing",
            fit.signal,
            quantity(fit.rms, &fit.unit),
            quantity(fit.spread, &fit.unit)
        )
    })
}

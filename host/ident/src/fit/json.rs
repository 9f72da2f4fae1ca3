//! `sinew-fit/1`: the result of a fit for programs.

use serde_json::{Map, Value, json};

use super::{Fit, FittedParameter, SensorError, SensorFit};
use crate::check::Check;

/// Format of the document.
pub const FORMAT: &str = "sinew-fit/1";

/// Result of a fit as JSON, SI; `test` holds the errors on test recordings, rig as written and
/// refitted, one entry a sensor; `checks` the faults of the recordings that were seen before. A
/// number that is not finite is null.
pub fn json(found: &Fit, test: &[(SensorError, SensorError)], checks: &[Check]) -> Value {
    let parameter = |p: &FittedParameter| {
        let recordings = p.recordings.iter();
        let recordings: Vec<Value> = recordings.map(|own| json!(own)).collect();
        let value = json!({
            "as_written": p.as_written, "value": p.value, "unit": p.unit, "ci95": p.ci95,
            "at_bound": p.at_bound, "recordings": recordings,
        });
        (p.name.clone(), value)
    };
    let errors = |[as_written, refitted]: [f64; 2], [before, after]: [Option<f64>; 2]| {
        json!({
            "as_written_rms": finite(as_written), "fitted_rms": finite(refitted),
            "as_written_percent": before, "fitted_percent": after,
        })
    };
    let sensor = |s: &SensorFit| {
        let mut after = test.iter().filter(|(_, after)| after.signal == s.signal);
        let of_test = after.next().map(|(before, after)| {
            errors(
                [before.rms, after.rms],
                [before, after].map(SensorError::fit_percent),
            )
        });
        let value = json!({
            "unit": s.unit, "spread": finite(s.spread), "samples": s.samples,
            "explained": s.is_explained(),
            "fit": errors([s.as_written_rms, s.rms], s.fit_percent()), "test": of_test,
        });
        (s.signal.clone(), value)
    };
    json!({
        "format": FORMAT,
        "parameters": found.parameters.iter().map(parameter).collect::<Map<_, _>>(),
        "signals": found.sensors.iter().map(sensor).collect::<Map<_, _>>(),
        "warnings": crate::report::warnings(found),
        "checks": checks,
        "steps": found.steps,
        "seconds": found.seconds,
    })
}

/// Numbers of JSON are finite.
fn finite(number: f64) -> Option<f64> {
    number.is_finite().then_some(number)
}

//! `sinew-learn/1`: learned laws for programs.

use serde_json::{Map, Value, json};

use super::Learned;
use crate::fit::SensorError;

/// Format of the document.
pub const FORMAT: &str = "sinew-learn/1";

/// Result of learning as JSON, SI; `test` holds the errors on test recordings with straight lines
/// and with the laws, one entry a sensor. A number that is not finite is null.
pub fn json(learned: &Learned, test: &[(SensorError, SensorError)], seconds: f64) -> Value {
    let laws = learned.laws.iter().zip(&learned.targets);
    let laws = laws.map(|(law, target)| {
        let values = law.values();
        let value = json!({
            "kind": law.kind.noun(), "odd": law.odd, "monotone": law.monotone,
            "reach": law.reach, "unit": target.unit(), "places": law.shape().places(values.len()),
            "numbers": values, "number_unit": target.number_unit(),
            "straight": target.line(&learned.straight.rig),
        });
        (target.name().to_owned(), value)
    });
    let errors = |of: &[(SensorError, SensorError)], signal: &str| {
        let mut found = of.iter().filter(|(_, law)| law.signal == signal);
        found.next().map(|(straight, law)| {
            json!({ "straight_rms": finite(straight.rms), "law_rms": finite(law.rms) })
        })
    };
    let signals = learned.fit.iter().map(|(_, law)| {
        let signal = law.signal.as_str();
        let value = json!({
            "unit": law.unit, "fit": errors(&learned.fit, signal),
            "check": errors(&learned.check, signal), "test": errors(test, signal),
        });
        (signal.to_owned(), value)
    });
    let tried = learned.tried.iter();
    let tried: Vec<Value> = tried
        .map(|it| json!({ "width": it.width, "check": finite(it.check) }))
        .collect();
    json!({
        "format": FORMAT,
        "laws": laws.collect::<Map<_, _>>(),
        "signals": signals.collect::<Map<_, _>>(),
        "width": learned.width,
        "tried": tried,
        "seconds": seconds,
    })
}

/// Numbers of JSON are finite.
fn finite(number: f64) -> Option<f64> {
    number.is_finite().then_some(number)
}

//! Findings of a diagnosis: the types that `sinew-diagnosis/1` is written from
//! (docs/reference/results.md).

use std::collections::BTreeMap;

use serde::Serialize;

use crate::diagnose::details::Finalist;
use crate::diagnose::locate::regime::Regime;
use crate::fit::OwnValue;

/// The name of the format and its version.
pub const FORMAT: &str = "sinew-diagnosis/1";

/// Kind of a rival that is a bare number of the rig with another value.
pub const WRONG_NUMBER: &str = "wrong_number";

/// `sinew-diagnosis/1`.
#[derive(Clone, Debug, Serialize)]
pub struct Diagnosis {
    /// Always `sinew-diagnosis/1`.
    pub format: &'static str,
    /// The finding in a word.
    pub verdict: Verdict,
    /// The finding in a sentence.
    pub sentence: String,
    /// Nothing but noise is left.
    pub complete: bool,
    /// The missing physics, most important first.
    pub effects: Vec<FoundEffect>,
    /// Mismatch that no named effect takes; null where nothing but noise is left.
    pub remainder: Option<Remainder>,
    /// Basis of judgement of each signal: a free run, or windows with their own start states.
    pub judged: BTreeMap<String, String>,
    /// Explanations that were fitted to all recordings of the fit, the best first.
    pub candidates: Vec<Finalist>,
    /// Place and time of the mismatch; null where there is none.
    pub location: Option<Location>,
    /// Free-run errors by signal.
    pub fit: BTreeMap<String, SignalFit>,
    /// The rig's own free parameters.
    pub parameters: BTreeMap<String, Estimate>,
    /// Next experiment to record.
    pub next_experiment: String,
    /// Notes that a reader must know: inputs that held their last value, parameters that the data
    /// do not determine, recordings on which the corrected rig is worse.
    pub notes: Vec<String>,
    /// Wall time.
    pub seconds: f64,
    /// Faults of the recordings that were seen before the search.
    pub checks: Vec<crate::check::Check>,
    /// The rig with its parameters refitted and nothing added.
    #[serde(skip)]
    pub refitted: sinew_sim::Rig,
    /// The same, and mended where something was found.
    #[serde(skip)]
    pub mended: sinew_sim::Rig,
    /// Findings that the text and the plots say beyond the JSON.
    #[serde(skip)]
    pub details: crate::diagnose::Details,
}

/// One of the four findings.
///
/// ```
/// use sinew_ident::diagnose::Verdict;
///
/// assert_eq!(Verdict::MissingPhysics.name(), "missing_physics");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// The rig as written explains the recordings to within their noise.
    Consistent,
    /// It does after refitting its free parameters.
    Parameters,
    /// It does not; the named effects mend it on recordings that chose nothing.
    MissingPhysics,
    /// It does not, and no named effect does either.
    Unexplained,
}

impl Verdict {
    /// Its name in the JSON.
    pub fn name(self) -> &'static str {
        match self {
            Self::Consistent => "consistent",
            Self::Parameters => "parameters",
            Self::MissingPhysics => "missing_physics",
            Self::Unexplained => "unexplained",
        }
    }
}

/// One effect that the rig lacks.
#[derive(Clone, Debug, Serialize)]
pub struct FoundEffect {
    /// Its name in the vocabulary.
    pub kind: String,
    /// Its place.
    pub component: String,
    /// Signal of the rig that its strengths depend on, if they do.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub with: Option<String>,
    /// Its law with numbers.
    pub equation: String,
    /// For a person.
    pub sentence: String,
    /// Its parameters, SI.
    pub parameters: BTreeMap<String, Estimate>,
    /// Part that it removes of the mismatch that the rest of the findings leaves without it, on the
    /// check recordings.
    pub share: f64,
    /// 0.9 means right nine times in ten.
    pub confidence: f64,
    /// Alternatives.
    pub rivals: Vec<Rival>,
    /// Alternatives that these recordings cannot tell from it.
    pub indistinguishable_from: Vec<Rival>,
}

/// Mismatch that the findings leave.
#[derive(Clone, Debug, Serialize)]
pub struct Remainder {
    /// Part of the baseline's mismatch on the check recordings, beside noise.
    pub share: f64,
    /// Its root mean square in units of the noise; null where nothing could be simulated.
    pub above_noise: f64,
    /// The component at which a force explains it best.
    pub component: String,
    /// Quantity that the force follows.
    pub follows: String,
    /// For a person.
    pub sentence: String,
}

/// Another explanation.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Rival {
    /// Its name in the vocabulary, or `wrong_number` for a bare number of the rig.
    pub kind: String,
    /// Its place.
    pub component: String,
    /// Its probability.
    pub confidence: f64,
}

/// A number with its interval.
#[derive(Clone, Debug, Serialize)]
pub struct Estimate {
    /// SI.
    pub value: f64,
    /// Its unit.
    pub unit: String,
    /// Interval that holds it nineteen times in twenty; null where the data do not say.
    pub ci95: Option<[f64; 2]>,
    /// Own values of the recordings of all roles, each from that recording alone with all else as
    /// it is; absent where it does not differ by recording.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub recordings: Vec<OwnValue>,
}

/// Place and time of a mismatch.
#[derive(Clone, Debug, Serialize)]
pub struct Location {
    /// The component at which a force explains it best.
    pub component: String,
    /// Quantity that the force follows.
    pub follows: String,
    /// Intervals where it is largest.
    pub intervals: Vec<Interval>,
    /// Region of states in which the missing force acts; null where it is no force.
    pub regime: Option<Regime>,
}

/// A stretch of a recording.
#[derive(Clone, Debug, Serialize)]
pub struct Interval {
    /// s.
    pub t_start_s: f64,
    /// s.
    pub t_end_s: f64,
    /// The file.
    pub recording: String,
    /// Root mean square mismatch there, in units of the noise.
    pub score: f64,
}

/// Free-run errors of one signal, SI.
#[derive(Clone, Debug, Serialize)]
pub struct SignalFit {
    /// Its unit.
    pub unit: String,
    /// Over the recordings that estimated parameters.
    pub fit: Errors,
    /// Over those that decided what is believed.
    pub check: Errors,
    /// Over those that were only scored; null without any.
    pub test: Option<Errors>,
    /// Standard deviation of the measurement itself.
    pub noise_rms: f64,
}

/// Free-run errors over the recordings of one role, SI.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Errors {
    /// Of the rig as it came.
    pub as_written_rms: f64,
    /// Of the rig with its parameters refitted.
    pub before_rms: f64,
    /// Of the rig with what was found in it; null where free runs mean nothing: the signal was
    /// judged over windows, and the free run misses it by more than it moves.
    pub after_rms: Option<f64>,
    /// Of that rig over the windows that the signal was judged by, each from the start state that
    /// explains it best; null where it was judged over free runs.
    pub judged_rms: Option<f64>,
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The example of docs/reference/results.md, letter for letter; what others read their answers
    /// by.
    const EXAMPLE: &str = r#"{ "format": "sinew-diagnosis/1",
  "verdict": "missing_physics",
  "sentence": "Dry friction of 20.1 N at carriage is missing from the model.",
  "complete": true,
  "effects": [ { "kind": "coulomb_friction", "component": "carriage",
      "equation": "F = -20.1 N sign(v)", "sentence": "...", "share": 0.99,
      "parameters": { "level": { "value": 20.1, "unit": "N", "ci95": [19.8, 20.4] } },
      "confidence": 0.99,
      "rivals": [ { "kind": "stribeck_friction", "component": "carriage", "confidence": 0.01 } ],
      "indistinguishable_from": [ ] } ],
  "remainder": null, "judged": { "q_m": "free runs of whole recordings" }, "candidates": [ ],
  "location": { "component": "carriage", "follows": "sign of velocity",
      "intervals": [ { "t_start_s": 1.2, "t_end_s": 1.5, "recording": "A.csv", "score": 9.1 } ],
      "regime": { "component": "carriage", "axis": "velocity", "unit": "m/s",
                  "below": -1.2e-3, "above": 1.1e-3, "share": 0.94, "agreement": 0.99 } },
  "fit": { "q_m": { "unit": "m",
      "fit":   { "as_written_rms": 4.0e-3, "before_rms": 1.2e-3, "after_rms": 9.0e-5, "judged_rms": null },
      "check": { "as_written_rms": 4.0e-3, "before_rms": 1.3e-3, "after_rms": 9.6e-5, "judged_rms": null },
      "test":  { "as_written_rms": 4.0e-3, "before_rms": 1.3e-3, "after_rms": 9.5e-5, "judged_rms": null },
      "noise_rms": 8.8e-5 } },
  "parameters": { "carriage.inertia": { "value": 95.2, "unit": "kg", "ci95": [94.0, 96.1] } },
  "next_experiment": "...", "notes": [], "checks": [], "seconds": 1.9 }"#;

    fn json(diagnosis: &Diagnosis) -> serde_json::Value {
        serde_json::to_value(diagnosis).expect("the value has a JSON form")
    }

    #[test]
    fn the_json_is_the_contracts_example_key_for_key() {
        let expected: serde_json::Value = serde_json::from_str(EXAMPLE).expect("the text is JSON");
        let written = json(&crate::diagnose::example::carriage());
        assert_eq!(plain(written), plain(expected));
    }

    /// Numbers by value: a JSON library may keep the digits that a number was written with.
    fn plain(value: serde_json::Value) -> serde_json::Value {
        use serde_json::Value;
        match value {
            Value::Number(number) => Value::String(format!("{:?}", number.as_f64())),
            Value::Array(list) => list.into_iter().map(plain).collect(),
            Value::Object(map) => map.into_iter().map(|(k, v)| (k, plain(v))).collect(),
            other => other,
        }
    }

    #[test]
    fn keys_without_anything_to_say_are_null_and_not_absent() {
        let mut nothing = crate::diagnose::example::carriage();
        nothing.verdict = Verdict::Consistent;
        nothing.effects.clear();
        nothing.location = None;
        for fit in nothing.fit.values_mut() {
            fit.test = None;
        }
        for estimate in nothing.parameters.values_mut() {
            estimate.ci95 = None;
        }
        let json = json(&nothing);
        assert_eq!(json["verdict"], "consistent");
        let null = Some(&serde_json::Value::Null);
        assert_eq!(json.get("location"), null);
        assert_eq!(json["fit"]["q_m"].get("test"), null);
        assert_eq!(json["parameters"]["carriage.inertia"].get("ci95"), null);
        assert_eq!(json["effects"], serde_json::json!([]));
    }

    #[test]
    fn a_remainder_and_a_refused_candidate_are_written_key_for_key() {
        let mut graded = crate::diagnose::example::carriage();
        graded.complete = false;
        graded.remainder = Some(Remainder {
            share: 0.17,
            above_noise: 6.1,
            component: "carriage".into(),
            follows: "position".into(),
            sentence: "...".into(),
        });
        graded.candidates = vec![Finalist {
            name: "end_stop at carriage".into(),
            parameters: 6,
            fit_error: 0.7,
            check_error: 0.9,
            remainder: 0.8,
            probability: 0.02,
            lost: "...".into(),
        }];
        let json = json(&graded);
        let expected = serde_json::json!({ "share": 0.17, "above_noise": 6.1,
            "component": "carriage", "follows": "position", "sentence": "..." });
        assert_eq!(json["remainder"], expected);
        assert_eq!(json["complete"], false);
        let expected = serde_json::json!([{ "name": "end_stop at carriage", "parameters": 6,
            "fit_error": 0.7, "check_error": 0.9, "remainder": 0.8, "probability": 0.02,
            "refused": "..." }]);
        assert_eq!(json["candidates"], expected);
    }

    #[test]
    fn verdicts_are_written_as_the_contract_has_them() {
        let written = |verdict: Verdict| {
            let json = serde_json::to_value(verdict).expect("the value has a JSON form");
            assert_eq!(json, verdict.name());
            json
        };
        assert_eq!(written(Verdict::Consistent), "consistent");
        assert_eq!(written(Verdict::Parameters), "parameters");
        assert_eq!(written(Verdict::MissingPhysics), "missing_physics");
        assert_eq!(written(Verdict::Unexplained), "unexplained");
    }
}

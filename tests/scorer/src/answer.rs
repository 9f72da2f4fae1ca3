//! Answer of `sinew diagnose` about a case: the part of its JSON (docs/explanation/diagnosis.md)
//! that is scored.

use std::collections::BTreeMap;

use serde::Deserialize;

/// One answer.
#[derive(Clone, Debug, Deserialize)]
pub struct Answer {
    /// `consistent`, `parameters`, `missing_physics` or `unexplained`.
    pub verdict: String,
    /// Effects that are named, most important first.
    pub effects: Vec<Named>,
    /// Errors of each signal.
    pub fit: BTreeMap<String, Signal>,
    /// Seconds that it says it took.
    pub seconds: f64,
}

/// One effect that is named.
#[derive(Clone, Debug, Deserialize)]
pub struct Named {
    /// A name of the vocabulary.
    pub kind: String,
    /// Component that it acts on.
    pub component: String,
    /// Its parameters in SI.
    pub parameters: BTreeMap<String, Value>,
    /// Frequency with which such a statement is meant to be right.
    pub confidence: f64,
    /// Effects that cannot be told apart from it.
    pub indistinguishable_from: Vec<Other>,
}

/// A parameter's value.
#[derive(Clone, Debug, Deserialize)]
pub struct Value {
    /// SI.
    pub value: f64,
}

/// A kind at a place, beside the one that is named.
#[derive(Clone, Debug, Deserialize)]
pub struct Other {
    /// A name of the vocabulary.
    pub kind: String,
    /// Component that it would act on.
    pub component: String,
}

/// Errors of one signal.
#[derive(Clone, Debug, Deserialize)]
pub struct Signal {
    /// On the recording that is only scored; none where there was none.
    pub test: Option<Errors>,
}

/// Free-run errors of one signal on the recordings of one role.
#[derive(Clone, Debug, Deserialize)]
pub struct Errors {
    /// With what is named in the model; none where free runs mean nothing.
    pub after_rms: Option<f64>,
}

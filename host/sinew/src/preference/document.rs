//! The file of answers, sinew-preferences/1 (docs/reference/results.md).

use std::path::Path;

use serde::{Deserialize, Serialize};
use sinew_ident::error::{Error, Result};
use sinew_prefer::{Answer, Choice};

use crate::closed_loop::mpc::Weights;

/// Format of the file.
pub const FORMAT: &str = "sinew-preferences/1";

/// Candidates and answers of one model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Document {
    format: String,
    /// Fingerprint of the model whose weights are compared.
    pub model: String,
    /// Seed of the candidates.
    pub seed: u64,
    /// Number of weights that were drawn.
    pub drawn: usize,
    /// Names of the features.
    pub features: Vec<String>,
    /// The candidates.
    pub candidates: Vec<Settings>,
    /// Answers, in the order in which they were given.
    pub answers: Vec<Given>,
}

/// One candidate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Q, one an output.
    pub tracking_weight: Vec<f64>,
    /// Lambda, one an input.
    pub move_suppression: Vec<f64>,
    /// Gain of the disturbance estimate.
    pub disturbance_gain: f64,
    /// Its features.
    pub features: Vec<f64>,
}

impl Settings {
    /// Those of weights and of the features of their loop.
    pub fn of(weights: &Weights, features: &[f64]) -> Self {
        Self {
            tracking_weight: weights.tracking_weight.clone(),
            move_suppression: weights.move_suppression.clone(),
            disturbance_gain: weights.disturbance_gain,
            features: features.to_vec(),
        }
    }
}

/// One answer of one person.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Given {
    /// Name of the person.
    pub who: String,
    /// Index of the candidate that was called A.
    pub a: usize,
    /// Index of the candidate that was called B.
    pub b: usize,
    /// `a`, `b` or `alike`.
    pub answer: String,
}

impl Given {
    /// An answer as it is stored.
    pub fn new(who: &str, answer: Answer) -> Self {
        let word = match answer.choice {
            Choice::First => "a",
            Choice::Second => "b",
            Choice::Alike => "alike",
        };
        Self {
            who: who.to_owned(),
            a: answer.first,
            b: answer.second,
            answer: word.to_owned(),
        }
    }

    fn choice(&self) -> Option<Choice> {
        match self.answer.as_str() {
            "a" => Some(Choice::First),
            "b" => Some(Choice::Second),
            "alike" => Some(Choice::Alike),
            _ => None,
        }
    }
}

impl Document {
    /// One without answers.
    pub fn new(model: String, (seed, drawn): (u64, usize), candidates: Vec<Settings>) -> Self {
        let features = super::Feature::ALL.map(|feature| feature.key.to_owned());
        Self {
            format: FORMAT.to_owned(),
            model,
            seed,
            drawn,
            features: features.to_vec(),
            candidates,
            answers: Vec::new(),
        }
    }

    /// Reads one; `None` where there is no such file.
    ///
    /// # Errors
    /// A file that is none, an answer about a candidate that is not there, or an unknown answer.
    pub fn read(path: &Path) -> Result<Option<Self>> {
        let text = match std::fs::read_to_string(path) {
            Ok(text) => text,
            Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(e) => return Err(Error::file(path, format!("cannot be read: {e}"))),
        };
        let wrong = |what: String| {
            Error::file(path, what).help("name another file, or move this one away to begin again")
        };
        let found: Self =
            serde_json::from_str(&text).map_err(|e| wrong(format!("no {FORMAT}: {e}")))?;
        if found.format != FORMAT {
            return Err(wrong(format!(
                "expected {FORMAT}, found {:?}",
                found.format
            )));
        }
        let candidates = found.candidates.len();
        for (k, given) in found.answers.iter().enumerate() {
            if given.choice().is_none() {
                return Err(wrong(format!(
                    "answers[{k}].answer: expected a, b or alike, found {:?}",
                    given.answer
                )));
            }
            if given.a >= candidates || given.b >= candidates || given.a == given.b {
                return Err(wrong(format!(
                    "answers[{k}]: expected two different ones of {candidates} candidates, found \
                     {} and {}",
                    given.a, given.b
                )));
            }
        }
        Ok(Some(found))
    }

    /// Writes it.
    ///
    /// # Errors
    /// A file that cannot be written.
    pub fn write(&self, path: &Path) -> Result<()> {
        let text = serde_json::to_string_pretty(self)
            .map_err(|e| Error::failed(format!("answers cannot be written: {e}")))?;
        Ok(sinew_files::write(path, text + "\n")?)
    }

    /// Answers of one person.
    pub fn of(&self, who: &str) -> Vec<Answer> {
        let own = self.answers.iter().filter(|given| given.who == who);
        let answer = |given: &Given| {
            Some(Answer {
                first: given.a,
                second: given.b,
                choice: given.choice()?,
            })
        };
        own.filter_map(answer).collect()
    }

    /// Names of all people who answered, in the order of their first answer.
    pub fn people(&self) -> Vec<&str> {
        let mut all: Vec<&str> = Vec::new();
        for given in &self.answers {
            if !all.contains(&given.who.as_str()) {
                all.push(&given.who);
            }
        }
        all
    }
}

//! Parameters that a device estimates, as columns of a recording (docs/reference/recording.md).

use std::path::Path;

use sinew_device::protocol::Parameters;
use sinew_ident::error::Result;
use sinew_ident::recording::{Column, Recording};
use sinew_model::fingerprint;
use sinew_model::spec::{ModelSpec, Parameter};

use crate::closed_loop::scenario::Run;

/// Start of the comment line that says which model a device carried.
const MODEL: &str = "# model ";

/// Columns of the parameters that a model's filter estimates; none where it estimates none.
#[derive(Clone, Debug, Default)]
pub struct Columns {
    parameters: Vec<Parameter>,
    fingerprint: u32,
}

impl Columns {
    /// Those of a model.
    pub fn of(spec: &ModelSpec) -> Self {
        let state = spec.state.as_ref();
        Self {
            parameters: state.map_or(Vec::new(), |state| state.parameters.clone()),
            fingerprint: fingerprint(spec),
        }
    }

    /// The model estimates no parameter.
    pub const fn is_empty(&self) -> bool {
        self.parameters.is_empty()
    }

    /// The parameters, in the model's order.
    pub fn parameters(&self) -> &[Parameter] {
        &self.parameters
    }

    /// Names of the columns: estimate and standard deviation of each parameter.
    pub fn names(&self) -> impl Iterator<Item = String> {
        let names = self.parameters.iter().map(|it| it.name.as_str());
        names.flat_map(|name| [estimate(name), deviation(name)])
    }

    /// Values of the columns, SI, NaN for what is no number; `None` where the device has told
    /// another number of parameters.
    pub fn values(&self, known: &Parameters) -> Option<Vec<f64>> {
        let count = self.parameters.len();
        if known.theta.len() != count || known.variance.len() != count {
            return None;
        }
        let pairs = known.theta.iter().zip(&known.variance);
        let values = self.parameters.iter().zip(pairs);
        let values = values.flat_map(|(parameter, (theta, variance))| {
            let unit = parameter.value * parameter.spread;
            [
                parameter.value + unit * f64::from(*theta),
                unit.abs() * f64::from(*variance).sqrt(),
            ]
        });
        // What is no number is missing, as a reading would be.
        let known = values.map(|value| if value.is_finite() { value } else { f64::NAN });
        Some(known.collect())
    }

    /// Comment line of a file with these columns: the fingerprint of the model.
    pub fn model_line(&self) -> String {
        format!("{MODEL}{:08x}", self.fingerprint)
    }
}

/// Text of a closed loop as a recording: commands, measured outputs, and what was learned after a
/// step in the row of that step. `inputs` and `outputs` are the columns of the signals.
///
/// # Errors
/// Two columns have the same name.
pub fn recorded(
    path: &Path,
    columns: &Columns,
    run: &Run,
    learned: &[(usize, Parameters)],
    (inputs, outputs): (Vec<&str>, Vec<&str>),
) -> Result<String> {
    let mut all: Vec<Column> = Vec::new();
    for (names, rows) in [(inputs, &run.u), (outputs, &run.measured)] {
        all.extend(names.iter().enumerate().map(|(i, name)| Column {
            name: (*name).into(),
            values: rows.iter().map(|row| row[i]).collect(),
        }));
    }
    let mut own: Vec<Column> = columns
        .names()
        .map(|name| Column {
            name,
            values: vec![f64::NAN; run.t.len()],
        })
        .collect();
    for (step, known) in learned {
        for (column, value) in own
            .iter_mut()
            .zip(columns.values(known).unwrap_or_default())
        {
            if let Some(place) = column.values.get_mut(*step) {
                *place = value;
            }
        }
    }
    all.extend(own);
    let recording = Recording::new(path, run.t.clone(), all)?;
    Ok(format!("{}\n{}", columns.model_line(), recording.to_csv()))
}

/// Column of the estimate of a parameter.
pub fn estimate(parameter: &str) -> String {
    format!("learned_{parameter}")
}

/// Column of its standard deviation.
pub fn deviation(parameter: &str) -> String {
    format!("deviation_{parameter}")
}

/// Fingerprint of the model that the device of a recording carried, as its comments say it.
pub fn model_of(text: &str) -> Option<&str> {
    let comments = text.lines().take_while(|line| line.starts_with('#'));
    let mut said = comments.filter_map(|line| line.strip_prefix(MODEL));
    said.next().map(str::trim)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// Two parameters of a usual device of 2 kg and -0.5 N.
    pub(crate) fn two() -> Columns {
        let of = |name: &str, value: f64| Parameter {
            name: name.into(),
            value,
            spread: 0.15,
            noise: 0.02,
            lower: -2.5,
            upper: 2.5,
        };
        Columns {
            parameters: vec![of("mass.inertia", 2.0), of("load.level", -0.5)],
            fingerprint: 0x00ab_12cd,
        }
    }

    pub(crate) fn known(theta: &[f32], variance: &[f32]) -> Parameters {
        Parameters {
            theta: theta.iter().copied().collect(),
            variance: variance.iter().copied().collect(),
        }
    }

    #[test]
    fn estimates_are_told_in_si_with_their_deviations() {
        let columns = two();
        let names: Vec<String> = columns.names().collect();
        assert_eq!(
            names,
            [
                "learned_mass.inertia",
                "deviation_mass.inertia",
                "learned_load.level",
                "deviation_load.level"
            ]
        );
        let values = columns.values(&known(&[1.0, 2.0], &[0.25, 0.0]));
        let values = values.expect("two parameters were told");
        for (value, wanted) in values.iter().zip([2.3, 0.15, -0.65, 0.0]) {
            assert!((value - wanted).abs() < 1e-9, "{values:?}");
        }
        assert_eq!(columns.values(&known(&[1.0], &[0.25])), None);
        let broken = columns.values(&known(&[f32::INFINITY, 0.0], &[-1.0, f32::NAN]));
        let broken = broken.expect("two parameters were told");
        assert!([0, 1, 3].iter().all(|i| broken[*i].is_nan()), "{broken:?}");
    }

    #[test]
    fn the_model_of_a_file_is_read_from_its_comments_alone() {
        let text = format!("# status: 0\n{}\nt,q_m\n0,1\n", two().model_line());
        assert_eq!(model_of(&text), Some("00ab12cd"));
        assert_eq!(model_of("t,q_m\n0,1\n# model 00ab12cd\n"), None);
    }
}

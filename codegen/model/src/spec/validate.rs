//! The checks of a specification. Everything after them relies on what they hold.

use std::collections::HashSet;
use std::fmt::Display;

use super::limits::{
    MAX_CHANNELS, MAX_GOLDEN, MAX_LAYERS, MAX_NAME, MAX_PARAMETERS, MAX_REGRESSOR, MAX_SIGNALS,
    MAX_WIDTH,
};
use super::{Activation, Layer, ModelSpec, OutputForm, Role, Signal, SpecError};
use crate::evaluate;
use sinew_nn::is_package_name;
use sinew_nn::literal::count;

/// A golden vector may differ from the network in double precision by this much of 1 + |y|: the
/// tools that supply them compute in f32 themselves.
const GOLDEN_TOLERANCE: f64 = 1e-4;

impl ModelSpec {
    /// Checks everything that the emitter, the evaluator and the firmware rely on: names, counts,
    /// shapes along the network, finite weights, a control problem that fits the signals.
    ///
    /// # Errors
    /// The first [`SpecError`] in the order of `model.toml`.
    pub fn validate(&self) -> Result<(), SpecError> {
        if !is_package_name(&self.name) {
            return Err(SpecError::Name {
                name: self.name.clone(),
                max: MAX_NAME,
            });
        }
        check("period_s", self.period_s, "1e-5 to 1000 seconds", |p| {
            (1e-5..=1000.0).contains(&p)
        })?;
        self.validate_signals()?;
        self.validate_regressor()?;
        self.validate_soft_sensor()?;
        self.validate_state()?;
        self.validate_layers()?;
        self.validate_skip()?;
        self.control
            .validate(self.inputs.len(), self.outputs.len())?;
        self.validate_value()?;
        self.validate_golden()
    }

    /// The signals of one role.
    #[must_use]
    pub fn signals(&self, role: Role) -> &[Signal] {
        match role {
            Role::Input => &self.inputs,
            Role::Output => &self.outputs,
            Role::Channel => &self.channels,
        }
    }

    fn validate_state(&self) -> Result<(), SpecError> {
        let with_state = self.form == OutputForm::State;
        check(
            "form",
            self.form.name(),
            "\"state\" with [[state]] alone",
            |_| with_state == self.state.is_some(),
        )?;
        let Some(state) = &self.state else {
            return Ok(());
        };
        for (key, past) in [
            ("past_inputs", self.past_inputs),
            ("past_outputs", self.past_outputs),
        ] {
            check(key, past, "1: a state is all of the past", |p| p == 1)?;
        }
        let hidden = match &self.layers[..] {
            [Layer::Dense(hidden), Layer::Dense(_)] => Some(hidden.activation),
            _ => None,
        };
        let layers = "a dense layer with tanh and a linear one, for a model with a state";
        check("layer", self.layers.len(), layers, |_| {
            hidden == Some(Activation::Tanh) && self.skip.is_some()
        })?;
        state.validate(self.outputs.len() + self.seen_channels().len())
    }

    /// A cost-to-go is computed for a model on past readings without channels, at points that go
    /// one way.
    fn validate_value(&self) -> Result<(), SpecError> {
        let Some(value) = &self.control.value else {
            return Ok(());
        };
        let channels = self.seen_channels().len() + self.hidden_state_len();
        check(
            "control.terminal",
            "value",
            "no terminal for a model with a state, with channels or with a recurrent layer, whose \
             cost-to-go is not computed; it is for networks of dense layers on past readings",
            |_| channels == 0 && self.state.is_none(),
        )?;
        check(
            "control.value.points",
            value.points.len(),
            "each further than the one before along the way from the first to the last",
            |_| value.goes_one_way(&self.outputs),
        )
    }

    fn validate_signals(&self) -> Result<(), SpecError> {
        let mut names = HashSet::new();
        for role in Role::ALL {
            let (min, max) = match role {
                Role::Input | Role::Output => (1, MAX_SIGNALS),
                Role::Channel => (0, MAX_CHANNELS),
            };
            let signals = self.signals(role);
            let found = signals.len();
            if !(min..=max).contains(&found) {
                return Err(SpecError::SignalCount {
                    role,
                    found,
                    min,
                    max,
                });
            }
            for (index, signal) in signals.iter().enumerate() {
                signal.validate(role, index)?;
                if !names.insert(&signal.name) {
                    return Err(SpecError::DuplicateName {
                        role,
                        index,
                        name: signal.name.clone(),
                    });
                }
            }
        }
        Ok(())
    }

    fn validate_regressor(&self) -> Result<(), SpecError> {
        for (key, past) in [
            ("past_inputs", self.past_inputs),
            ("past_outputs", self.past_outputs),
        ] {
            check(key, past, format!("1 to {MAX_REGRESSOR}"), |p| {
                (1..=MAX_REGRESSOR).contains(&p)
            })?;
        }
        if self.point_len() > MAX_REGRESSOR {
            return Err(SpecError::RegressorTooLong {
                found: self.point_len(),
                composition: self.composition(),
                max: MAX_REGRESSOR,
            });
        }
        Ok(())
    }

    /// Composition of the regressor, in words.
    fn composition(&self) -> String {
        let hidden = match self.hidden_state_len() {
            0 => String::new(),
            n => format!(", {} of hidden state", count(n, "value")),
        };
        format!(
            "{} of {}, {} of {}, {}{hidden}",
            count(self.past_inputs, "value"),
            count(self.inputs.len(), "input"),
            count(self.past_outputs, "value"),
            count(self.outputs.len(), "output"),
            count(self.seen_channels().len(), "channel"),
        )
    }

    fn validate_layers(&self) -> Result<(), SpecError> {
        let count = self.layers.len();
        if !(1..=MAX_LAYERS).contains(&count) {
            return Err(SpecError::LayerCount {
                found: count,
                max: MAX_LAYERS,
            });
        }
        let mut expected = self.regressor_len();
        for (layer, this) in self.layers.iter().enumerate() {
            let shape = this.to_string();
            let found = this.inputs();
            if found != expected {
                return Err(if layer == 0 {
                    let composition = self.composition();
                    SpecError::RegressorMismatch {
                        shape,
                        found,
                        expected,
                        composition,
                    }
                } else {
                    SpecError::Chain {
                        layer,
                        shape,
                        found,
                        expected,
                    }
                });
            }
            expected = this.outputs();
            if !(1..=MAX_WIDTH).contains(&expected) {
                return Err(SpecError::Width {
                    layer,
                    shape,
                    width: expected,
                    max: MAX_WIDTH,
                });
            }
            this.validate(layer)?;
        }
        if let Layer::Recurrent(_) = &self.layers[count - 1] {
            return Err(SpecError::RecurrentLast {
                layer: count - 1,
                shape: self.layers[count - 1].to_string(),
            });
        }
        if expected != self.predicted_len() {
            return Err(SpecError::OutputMismatch {
                layer: count - 1,
                shape: self.layers[count - 1].to_string(),
                found: expected,
                expected: self.predicted_len(),
            });
        }
        if self.parameters() > MAX_PARAMETERS {
            return Err(SpecError::Parameters {
                found: self.parameters(),
                max: MAX_PARAMETERS,
            });
        }
        Ok(())
    }

    fn validate_skip(&self) -> Result<(), SpecError> {
        let Some(weights) = &self.skip else {
            return Ok(());
        };
        let expected = self.predicted_len() * self.regressor_len();
        if weights.len() != expected {
            return Err(SpecError::SkipLength {
                found: weights.len(),
                expected,
            });
        }
        let last = self.layers.len() - 1;
        if self.layers[last].activation() != Some(Activation::Linear) {
            return Err(SpecError::SkipActivation {
                layer: last,
                shape: self.layers[last].to_string(),
            });
        }
        match weights.iter().position(|value| !value.is_finite()) {
            Some(index) => Err(SpecError::SkipNonFinite {
                index,
                value: weights[index],
            }),
            None => Ok(()),
        }
    }

    fn validate_golden(&self) -> Result<(), SpecError> {
        check(
            "golden",
            self.golden.len(),
            format!("at most {MAX_GOLDEN} vectors"),
            |n| n <= MAX_GOLDEN,
        )?;
        for (index, golden) in self.golden.iter().enumerate() {
            for (what, found, expected) in [
                ("x", golden.x.len(), self.point_len()),
                ("y", golden.y.len(), self.predicted_len()),
            ] {
                if found != expected {
                    return Err(SpecError::GoldenLength {
                        index,
                        what,
                        found,
                        expected,
                    });
                }
            }
            let x: Vec<f64> = golden.x.iter().copied().map(f64::from).collect();
            let y = evaluate::predict(self, &x);
            for (output, (&expected, &found)) in golden.y.iter().zip(&y).enumerate() {
                let close = (expected - found).abs() <= GOLDEN_TOLERANCE * (1.0 + found.abs());
                // Written so that a NaN on either side is not close.
                if !close {
                    return Err(SpecError::GoldenDisagrees {
                        index,
                        output,
                        expected,
                        found,
                    });
                }
            }
        }
        Ok(())
    }
}

/// `Ok` if `accepts(value)`, otherwise a [`SpecError::Value`].
pub(super) fn check<T: Copy + Display>(
    key: impl Into<String>,
    value: T,
    expected: impl Into<String>,
    accepts: impl FnOnce(T) -> bool,
) -> Result<(), SpecError> {
    if accepts(value) {
        return Ok(());
    }
    Err(SpecError::Value {
        key: key.into(),
        value: value.to_string(),
        expected: expected.into(),
    })
}

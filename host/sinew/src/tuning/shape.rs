//! Horizons that a tuning tries, each a firmware of its own.

use sinew_device::protocol::MAX_PREVIEW;
use sinew_ident::error::{Error, Result};
use sinew_model::spec::ModelSpec;

/// Horizons of a firmware: its const parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shape {
    /// Steps predicted.
    pub horizon: usize,
    /// Steps decided.
    pub control_horizon: usize,
}

impl Shape {
    /// The shapes to try, the model's own first. Without any asked for: the model's, and what
    /// differs from it in one horizon, as far as a firmware carries it.
    ///
    /// # Errors
    /// One that was asked for and that no firmware could carry.
    pub fn candidates(
        spec: &ModelSpec,
        horizons: &[usize],
        control_horizons: &[usize],
    ) -> Result<Vec<Self>> {
        let own = Self {
            horizon: spec.control.horizon,
            control_horizon: spec.control.control_horizon,
        };
        let shape = |horizon: usize, control_horizon: usize| Self {
            horizon,
            control_horizon,
        };
        let mut shapes = Vec::new();
        if horizons.is_empty() && control_horizons.is_empty() {
            let (n, nc) = (own.horizon, own.control_horizon);
            let near = [
                own,
                shape(n / 2, nc.min(n / 2)),
                shape(n + n / 2, nc),
                shape(n, nc / 2),
                shape(n, (2 * nc).min(n)),
            ];
            shapes.extend(near.into_iter().filter(|s| s.of(spec).is_ok()));
        } else {
            let or_own = |asked: &[usize], own: usize| match asked {
                [] => vec![own],
                asked => asked.to_vec(),
            };
            for n in or_own(horizons, own.horizon) {
                for nc in or_own(control_horizons, own.control_horizon.min(n)) {
                    shape(n, nc).of(spec).map_err(|e| {
                        Error::arguments(format!(
                            "horizon {n} with control horizon {nc} is no firmware: {e}"
                        ))
                        .help("name others with --horizons and --control-horizons")
                    })?;
                    shapes.push(shape(n, nc));
                }
            }
        }
        let mut kept: Vec<Self> = Vec::new();
        for shape in shapes {
            if !kept.contains(&shape) {
                kept.push(shape);
            }
        }
        Ok(kept)
    }

    /// The model with these horizons; blocks of moves are kept where they still fit.
    pub(super) fn of(self, spec: &ModelSpec) -> Result<ModelSpec> {
        let mut spec = spec.clone();
        if self.control_horizon != spec.control.control_horizon {
            spec.control.move_blocks.clear();
        }
        spec.control.first_step = spec.control.first_step.min(self.horizon.max(1));
        spec.control.horizon = self.horizon;
        spec.control.control_horizon = self.control_horizon;
        let preview = spec.control.preview().saturating_mul(spec.outputs.len());
        if preview > MAX_PREVIEW {
            return Err(Error::arguments(format!(
                "it previews {preview} values of the reference, and a frame carries {MAX_PREVIEW}"
            )));
        }
        spec.validate()
            .map_err(|error| Error::arguments(error.to_string()))?;
        Ok(spec)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn horizons_are_those_that_a_firmware_carries() {
        let folder =
            std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/reference-s");
        let spec = sinew_model::store::load(&folder).expect("the model is committed");
        let of = |n: &[usize], nc: &[usize]| Shape::candidates(&spec, n, nc);
        let near = of(&[], &[]).expect("the model's own shape is a candidate");
        assert_eq!(near[0].horizon, spec.control.horizon);
        assert!(near.len() > 2 && near.iter().all(|s| s.of(&spec).is_ok()));
        let asked = of(&[6, 8, 6], &[2]).expect("a firmware carries both");
        assert_eq!(asked.iter().map(|s| s.horizon).collect::<Vec<_>>(), [6, 8]);
        for (n, nc) in [(0, 1), (4, 5), (129, 2), (100, 2), (4, 0)] {
            let refusal = of(&[n], &[nc]).expect_err("no firmware");
            assert_eq!(refusal.exit_code(), 2, "{n}, {nc}: {refusal}");
        }
    }
}

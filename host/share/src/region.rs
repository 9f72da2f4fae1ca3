//! Public region in which devices are looked for (docs/explanation/sharing.md, eq. 1).

use sinew_ident::error::{Error, Result};
use sinew_ident::fleet::parameters;
use sinew_ident::population::{Axis, Scale};
use sinew_sim::{Plant, Rig};

/// One axis of the region.
#[derive(Clone, Debug, PartialEq)]
pub struct Side {
    /// The parameter; its mean is the middle of the region.
    pub axis: Axis,
    /// Slot of the parameter in the plant.
    pub slot: usize,
    /// Half the width in coordinates: of the logarithm, or of the parameter itself.
    pub half: f64,
}

/// Half-axes of an ellipsoid of parameters about those of the rig. They follow from the rig and
/// from options alone, never from a recording.
#[derive(Clone, Debug, PartialEq)]
pub struct Region {
    /// One axis a free parameter, in the plant's order.
    pub sides: Vec<Side>,
}

/// Largest coordinate before clipping: a parameter of zero has an infinite logarithm.
const FARTHEST: f64 = 1e6;

impl Region {
    /// The region of a rig: each parameter within a factor of the rig's value, `factors` naming
    /// those with a factor of their own. A parameter whose value is zero lies within its `min` and
    /// `max`.
    ///
    /// # Errors
    /// `Arguments` for a factor of 1 or less and for a name that is no free parameter; `File` for a
    /// rig without free parameters and for a zero without bounds.
    pub fn new(rig: &Rig, plant: &Plant, factor: f64, factors: &[(String, f64)]) -> Result<Self> {
        let names = parameters(plant);
        for given in std::iter::once(factor).chain(factors.iter().map(|(_, it)| *it)) {
            if !(given > 1.0 && given <= 1e3) {
                let expectation = "a factor above 1 and at most 1000";
                return Err(Error::must_be("--within", expectation, given)
                    .help("for example --within 2: from half the rig's value to twice it"));
            }
        }
        if let Some((name, _)) = factors.iter().find(|(it, _)| !names.contains(&it.as_str())) {
            let message = format!("--within: the rig leaves no `{name}` free");
            return Err(Error::arguments(message).expected(names.join(", ")));
        }
        if names.is_empty() {
            let message = "the rig has no free parameter";
            return Err(Error::file(&rig.file, message)
                .expected("parameters in which the devices differ, as `{ value = ... }`"));
        }
        let side = |name: &str| {
            let own = factors.iter().rfind(|(it, _)| it == name);
            side(rig, plant, name, own.map_or(factor, |(_, it)| *it))
        };
        Ok(Self {
            sides: names.into_iter().map(side).collect::<Result<_>>()?,
        })
    }

    /// Number of parameters.
    pub fn size(&self) -> usize {
        self.sides.len()
    }

    /// Place of a device in the region (eq. 1): within a unit ball about the middle. A device
    /// outside is moved to its surface, straight towards the middle.
    pub fn place(&self, values: &[f64]) -> Vec<f64> {
        let each = self.sides.iter().zip(values);
        let mut place: Vec<f64> = each
            .map(|(side, value)| {
                let middle = side.axis.coordinate(side.axis.mean);
                let at = (side.axis.coordinate(*value) - middle) / side.half;
                if at.is_nan() {
                    0.0
                } else {
                    at.clamp(-FARTHEST, FARTHEST)
                }
            })
            .collect();
        clip(&mut place);
        place
    }

    /// Parameters of a place, SI.
    pub fn values(&self, place: &[f64]) -> Vec<f64> {
        let each = self.sides.iter().zip(place);
        each.map(|(side, at)| {
            let middle = side.axis.coordinate(side.axis.mean);
            side.axis.value(middle + side.half * at)
        })
        .collect()
    }

    /// Parameters of a place by their names, SI; the bounds of the rig are kept.
    pub fn within_bounds(&self, plant: &Plant, place: &[f64]) -> Vec<(&str, f64)> {
        let each = self.sides.iter().zip(self.values(place));
        each.map(|(side, value)| {
            let parameter = &plant.parameters()[side.slot];
            let low = parameter.min.unwrap_or(f64::NEG_INFINITY);
            let high = parameter.max.unwrap_or(f64::INFINITY);
            (side.axis.name.as_str(), value.max(low).min(high))
        })
        .collect()
    }
}

/// Moves a place that is outside the unit ball to its surface.
pub(crate) fn clip(place: &mut [f64]) {
    let size = place.iter().map(|x| x * x).sum::<f64>().sqrt();
    if size > 1.0 {
        place.iter_mut().for_each(|x| *x /= size);
    }
}

fn side(rig: &Rig, plant: &Plant, name: &str, factor: f64) -> Result<Side> {
    let slot = plant.slot(name).unwrap_or(usize::MAX);
    let Some(parameter) = plant.parameters().get(slot) else {
        return Err(Error::failed(format!("the plant has no `{name}`")));
    };
    let axis = |scale, mean| Axis {
        name: parameter.name.clone(),
        unit: parameter.unit.clone(),
        scale,
        mean,
    };
    if parameter.value != 0.0 {
        return Ok(Side {
            axis: axis(Scale::Log, parameter.value),
            slot,
            half: factor.ln(),
        });
    }
    match (parameter.min, parameter.max) {
        (Some(low), Some(high)) if low < high => Ok(Side {
            axis: axis(Scale::Linear, 0.5 * (low + high)),
            slot,
            half: 0.5 * (high - low),
        }),
        _ => {
            let message = format!("`{name}` is 0 in the rig, and no factor of that is a region");
            Err(Error::file(&rig.file, message)
                .expected("a `min` and a `max` that do not come from the devices")
                .help("or write another value, from the catalogue"))
        }
    }
}

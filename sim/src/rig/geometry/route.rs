//! An entry of a path that follows a chain or holds a plate.

use super::Route;
use crate::effects::Sign;
use crate::error::Error;
use crate::math;
use crate::rig::names::Names;
use crate::rig::reader::TableReader;
use crate::rig::{Rig, Tendon};

/// Keys that make an entry of a path a route, and those that go with them.
const KEYS: [&[&str]; 2] = [
    &["chain", "radius", "angle", "segments"],
    &["plate", "x", "y"],
];

/// The route that an entry of a path describes; none where it names a body.
pub(in crate::rig) fn read_route(
    part: &TableReader,
    names: &Names,
    rig: &Rig,
) -> Result<Option<Route>, Error> {
    let [chain, plate] = KEYS;
    if part.has("chain") {
        part.allow(chain)?;
        let chain = names.chain(part, "chain")?;
        let most = rig.geometry.chains[chain].segments;
        return Ok(Some(Route::Chain {
            chain,
            radius: part.parameter("radius", Sign::Positive)?,
            angle: part.parameter_or("angle", Sign::Any, 0.0)?,
            segments: part.count("segments", 1, most)?.unwrap_or(most),
        }));
    }
    if part.has("plate") {
        part.allow(plate)?;
        return Ok(Some(Route::Plate {
            plate: names.plate(part, "plate")?,
            x: part.parameter_or("x", Sign::Any, 0.0)?,
            y: part.parameter_or("y", Sign::Any, 0.0)?,
        }));
    }
    Ok(None)
}

/// True for two entries that follow one chain or hold one plate.
pub(in crate::rig) fn same_place(a: &Route, b: &Route) -> bool {
    match (a, b) {
        (Route::Chain { chain: a, .. }, Route::Chain { chain: b, .. }) => a == b,
        (Route::Plate { plate: a, .. }, Route::Plate { plate: b, .. }) => a == b,
        _ => false,
    }
}

impl Tendon {
    /// Its arms at the bodies of its path as the rig is written, those that follow from its routes
    /// included (docs/explanation/geometry.md, eq. 2a and 5): (index of the body, m or 1).
    pub fn arms(&self, rig: &Rig) -> Vec<(usize, f64)> {
        let own = self.path.iter().map(|(body, arm)| (*body, arm.value));
        let mut arms: Vec<(usize, f64)> = own.collect();
        for route in &self.routes {
            match route {
                Route::Chain {
                    chain,
                    radius,
                    angle,
                    segments,
                } => {
                    let first = rig.geometry.chains[*chain].first_body;
                    let about_x = radius.value * math::sin(angle.value);
                    let about_y = -radius.value * math::cos(angle.value);
                    for k in 0..*segments {
                        arms.extend([(first + 2 * k, about_x), (first + 2 * k + 1, about_y)]);
                    }
                }
                Route::Plate { plate, x, y } => {
                    let first = rig.geometry.plates[*plate].first_body;
                    arms.extend([(first, 1.0), (first + 1, y.value), (first + 2, -x.value)]);
                }
            }
        }
        arms
    }
}

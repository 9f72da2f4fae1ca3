//! An entry of a path that follows a chain or holds a plate.

use super::Route;
use crate::effects::Sign;
use crate::error::Error;
use crate::rig::Rig;
use crate::rig::names::Names;
use crate::rig::reader::Reader;

/// Keys that make an entry of a path a route, and those that go with them.
const KEYS: [&[&str]; 2] = [
    &["chain", "radius", "angle", "segments"],
    &["plate", "x", "y"],
];

/// The route that an entry of a path describes; none where it names a body.
pub(in crate::rig) fn read_route(
    part: &Reader,
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

/// Whether two entries follow one chain or hold one plate.
pub(in crate::rig) fn same_place(a: &Route, b: &Route) -> bool {
    match (a, b) {
        (Route::Chain { chain: a, .. }, Route::Chain { chain: b, .. }) => a == b,
        (Route::Plate { plate: a, .. }, Route::Plate { plate: b, .. }) => a == b,
        _ => false,
    }
}

//! `sinew-shared/1`: what was released and under which budget, for programs.

use serde_json::{Value, json};
use sinew_ident::population::Scale;

use crate::budget::Budget;
use crate::recordings::{Inputs, name};
use crate::region::Region;
use crate::statistics::{Release, sensitivity};
use crate::synthesis::Shared;

/// Format of the document.
pub const FORMAT: &str = "sinew-shared/1";

/// Release as JSON. All of it is public: settings, the noisy sums, and what follows from them.
pub fn json(
    region: &Region,
    (budget, release, shared): (&Budget, &Release, &Shared),
    inputs: &Inputs,
    seed: Option<u64>,
) -> Value {
    let side = |(k, side): (usize, &crate::region::Side)| {
        let ends = [-1.0, 1.0].map(|end| {
            let mut place = vec![0.0; region.size()];
            place[k] = end;
            region.values(&place)[k]
        });
        let scale = match side.axis.scale {
            Scale::Log => "log",
            Scale::Linear => "linear",
        };
        json!({
            "name": side.axis.name, "unit": side.axis.unit, "scale": scale, "region": ends,
            "mean": mean(region, k, &shared.places),
            "expected_error": side.half * release.deviation(),
        })
    };
    let of = shared.places.len();
    json!({
        "format": FORMAT,
        "private": seed.is_none(),
        "seed": seed,
        "unit_of_privacy": "device",
        "neighbours": "one device replaced by another",
        "epsilon": budget.epsilon,
        "delta": budget.delta,
        "rho": budget.rho(),
        "devices": release.devices,
        "sensitivity": sensitivity(release.size),
        "noise_variance": release.variance,
        "noisy_sums": release.sums,
        "distance": shared.distance,
        "parameters": region.sides.iter().enumerate().map(side).collect::<Vec<_>>(),
        "inputs": {
            "kind": inputs.design.kind.name(),
            "seconds": inputs.design.seconds,
            "rate_hz": inputs.design.rate_hz,
            "amplitude": inputs.design.amplitude,
            "noise": inputs.noise,
        },
        "recordings": (1..=of).map(|k| name(k, of)).collect::<Vec<_>>(),
    })
}

/// Mean of a parameter over synthetic devices, SI; the geometric one on the scale of logarithms.
pub fn mean(region: &Region, parameter: usize, places: &[Vec<f64>]) -> f64 {
    let middle = places.iter().map(|it| it[parameter]).sum::<f64>() / places.len().max(1) as f64;
    let mut place = vec![0.0; region.size()];
    place[parameter] = middle;
    region.values(&place)[parameter]
}

//! Private side: recordings of devices become places in the public region, and bits become noise.

use std::sync::atomic::{AtomicUsize, Ordering};

use rand::rngs::OsRng;
use rand::{SeedableRng, TryRngCore};
use rand_chacha::ChaCha20Rng;
use rayon::prelude::*;
use sinew_ident::error::{Error, Kind, Result};
use sinew_ident::fit::{FitOptions, fit};
use sinew_ident::fleet::Recorded;
use sinew_sim::Rig;

use crate::region::Region;

/// Private places of devices in the public region.
#[derive(Clone, Debug)]
pub struct Places {
    /// Place of each device. One whose recordings cannot be fitted is at the middle, as one that
    /// differs in nothing: its failure would tell of it.
    pub each: Vec<Vec<f64>>,
    /// Number of devices that could not be fitted. It is private: for the owner's eyes.
    pub unfitted: usize,
}

/// Finds the place of each device by a fit of its own. No device's place depends on another's
/// recordings. `progress` hears of the number that is done.
///
/// # Errors
/// The user has stopped it.
pub fn places(
    rig: &Rig,
    region: &Region,
    devices: &[Recorded],
    progress: &(dyn Fn(usize) + Sync),
) -> Result<Places> {
    let done = AtomicUsize::new(0);
    let place = |device: &Recorded| -> Result<Option<Vec<f64>>> {
        let options = FitOptions {
            search_only: true,
            ..FitOptions::default()
        };
        let found = fit(rig, &device.recordings, &options, &mut |_| {});
        progress(1 + done.fetch_add(1, Ordering::Relaxed));
        match found {
            Ok(found) => {
                let value = |name: &str| {
                    let own = found.parameters.iter().find(|it| it.name == name);
                    own.map_or(f64::NAN, |it| it.value)
                };
                let values: Vec<f64> = region.sides.iter().map(|s| value(&s.axis.name)).collect();
                Ok(Some(region.place(&values)))
            }
            Err(error) if matches!(error.kind(), Kind::Interrupted) => Err(error),
            Err(_) => Ok(None),
        }
    };
    let found = devices.par_iter().map(place);
    let found = found.collect::<Result<Vec<_>>>()?;
    let unfitted = found.iter().filter(|place| place.is_none()).count();
    let middle = || vec![0.0; region.size()];
    let each = found.into_iter().map(|place| place.unwrap_or_else(middle));
    Ok(Places {
        each: each.collect(),
        unfitted,
    })
}

/// Generator for the noise: of 256 bits of the operating system, or of a seed that anyone can try.
///
/// # Errors
/// The operating system gives no random bits.
pub fn random(seed: Option<u64>) -> Result<ChaCha20Rng> {
    if let Some(seed) = seed {
        return Ok(ChaCha20Rng::seed_from_u64(seed));
    }
    let mut bits = [0; 32];
    OsRng.try_fill_bytes(&mut bits).map_err(|error| {
        Error::failed(format!(
            "the operating system gives no random bits: {error}"
        ))
    })?;
    Ok(ChaCha20Rng::from_seed(bits))
}

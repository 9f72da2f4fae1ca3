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

/// Place of each device in the region. A device whose recordings cannot be fitted is at the
/// middle, as one that differs in nothing: its failure would tell of it. No device's place depends
/// on another's recordings. `progress` hears of the number that is done.
///
/// # Errors
/// The user has stopped it.
pub fn places(
    rig: &Rig,
    region: &Region,
    devices: &[Recorded],
    progress: &(dyn Fn(usize) + Sync),
) -> Result<Vec<Vec<f64>>> {
    let done = AtomicUsize::new(0);
    let place = |device: &Recorded| -> Result<Vec<f64>> {
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
                Ok(region.place(&values))
            }
            Err(error) if matches!(error.kind(), Kind::Interrupted) => Err(error),
            Err(_) => Ok(vec![0.0; region.size()]),
        }
    };
    devices.par_iter().map(place).collect()
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

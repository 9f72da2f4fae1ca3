//! Fit and checks.

use pyo3::prelude::*;
use sinew_ident::check::{Check, determine};
use sinew_ident::error::Result;
use sinew_ident::fit::json::json;
use sinew_ident::fit::{FitOptions, free_runs, pool, score};

use crate::checked::refuse;
use crate::data::{RawRecording, RawRun, raw_run, recordings, refused};
use crate::rig::NativeRig;
use crate::work;

/// Result of a fit: JSON, the refitted rig, and the free runs of the recordings of the fit and of
/// the test, as written and refitted.
type RawFit = (String, NativeRig, Vec<(String, RawRun, RawRun)>);

/// Fits a rig.
#[pyfunction]
pub fn fit(
    py: Python<'_>,
    rig: &NativeRig,
    fit: Vec<RawRecording>,
    test: Vec<RawRecording>,
    progress: Option<Py<PyAny>>,
) -> PyResult<RawFit> {
    let (fitted, tests) = (recordings(fit)?, recordings(test)?);
    let (found, tested, checks, runs) = work::run(
        py,
        progress,
        || {},
        |caller| -> Result<_> {
            let checks = sinew_ident::check::check(&[&fitted[..], &tests].concat(), Some(&rig.rig));
            refuse(&checks)?;
            let found =
                sinew_ident::fit::fit(&rig.rig, &fitted, &FitOptions::default(), &mut |p| {
                    caller.tell(&format!("stage {}", p.stage), p.step, 0);
                })?;
            let (before, after) = (free_runs(&rig.rig, &tests)?, free_runs(&found.rig, &tests)?);
            let tested: Vec<_> = if tests.is_empty() {
                Vec::new()
            } else {
                score(&rig.rig, &tests)?
                    .into_iter()
                    .zip(pool(&after))
                    .collect()
            };
            let of_fit = found.as_written_runs.iter().zip(&found.runs);
            let of_fit = of_fit.map(|pair| ("fit", pair));
            let of_test = before.iter().zip(&after).map(|pair| ("test", pair));
            let runs = of_fit.chain(of_test);
            let runs = runs.map(|(role, (a, b))| (role.to_owned(), raw_run(a), raw_run(b)));
            let runs: Vec<_> = runs.collect();
            Ok((found, tested, checks, runs))
        },
    )?;
    let document = json(&found, &tested, &checks).to_string();
    Ok((document, NativeRig::new(found.rig, rig.file.as_str()), runs))
}

/// Checks recordings: JSON as of `sinew check`.
#[pyfunction]
#[pyo3(name = "check")]
pub fn check(
    py: Python<'_>,
    of: Vec<RawRecording>,
    rig: Option<PyRef<'_, NativeRig>>,
) -> PyResult<String> {
    let of = recordings(of)?;
    let rig = rig.map(|rig| rig.rig.clone());
    let (found, determined) = work::run(
        py,
        None,
        || {},
        |_| -> Result<_> {
            let found = sinew_ident::check::check(&of, rig.as_ref());
            let sound = !found.iter().any(|check: &Check| check.certain);
            let rig = rig.as_ref().filter(|_| sound);
            Ok((found, rig.and_then(|rig| determine(rig, &of))))
        },
    )?;
    let document = serde_json::json!({
        "format": "sinew-check/1", "checks": found, "determined": determined,
    });
    serde_json::to_string(&document).map_err(refused)
}

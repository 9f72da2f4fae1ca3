//! Diagnosis.

use std::time::Duration;

use pyo3::prelude::*;
use sinew_ident::check::check;
use sinew_ident::diagnose::output::{self, Shown};
use sinew_ident::diagnose::{DiagnoseOptions, Recordings, Stop, diagnose as search};
use sinew_ident::error::Result;
use sinew_ident::fit::free_run;
use sinew_ident::recording::Recording;
use sinew_ident::report::Provenance;

use crate::checked::refuse;
use crate::data::{RawRecording, RawRun, raw_run, recordings, refused};
use crate::rig::NativeRig;
use crate::work;

/// Result of a diagnosis: JSON, text, page, the refitted and the corrected rig, and the free runs
/// of every recording, refitted and corrected, with its role.
type RawDiagnosis = (
    String,
    String,
    String,
    NativeRig,
    NativeRig,
    Vec<(String, RawRun, RawRun)>,
);

/// Finds the physics that a rig lacks.
#[pyfunction]
#[expect(
    clippy::too_many_arguments,
    reason = "keyword arguments of a Python function"
)]
pub fn diagnose(
    py: Python<'_>,
    rig: &NativeRig,
    fit: Vec<RawRecording>,
    check: Vec<RawRecording>,
    test: Vec<RawRecording>,
    seed: u64,
    time_limit: Option<f64>,
    progress: Option<Py<PyAny>>,
) -> PyResult<RawDiagnosis> {
    let recordings = Recordings {
        fit: recordings(fit)?,
        check: recordings(check)?,
        test: recordings(test)?,
    };
    let time_limit = time_limit.map(Duration::try_from_secs_f64).transpose();
    let time_limit = time_limit.map_err(|e| refused(format!("time_limit must be seconds: {e}")))?;
    let stop = Stop::default();
    let options = DiagnoseOptions {
        seed,
        time_limit,
        stop: stop.clone(),
        ..DiagnoseOptions::default()
    };
    work::run(
        py,
        progress,
        || stop.ask(),
        |caller| {
            found(rig, &recordings, &options, &|what, done, of| {
                caller.tell(what, done, of)
            })
        },
    )
}

/// The result for Python.
fn found(
    rig: &NativeRig,
    recordings: &Recordings,
    options: &DiagnoseOptions,
    progress: &(dyn Fn(&str, usize, usize) + Sync),
) -> Result<RawDiagnosis> {
    let roles = [
        ("fit", &recordings.fit),
        ("check", &recordings.check),
        ("test", &recordings.test),
    ];
    let roles = roles.into_iter();
    let shown: Vec<Shown<'_>> = roles
        .flat_map(|(role, of)| of.iter().map(move |recording| Shown { role, recording }))
        .collect();
    let all: Vec<Recording> = shown.iter().map(|it| it.recording.clone()).collect();
    let checks = check(&all, Some(&rig.rig));
    refuse(&checks)?;
    let options = DiagnoseOptions {
        checks,
        ..options.clone()
    };
    let found = search(&rig.rig, recordings, &options, progress)?;
    let made = Provenance::new("sinew_ident.diagnose").seed(options.seed);
    let page = output::report(&found, &rig.rig, &shown, &made)?.to_html();
    let mut runs = Vec::new();
    for Shown { role, recording } in &shown {
        let [before, after] = [&found.refitted, &found.mended].map(|rig| free_run(rig, recording));
        runs.push(((*role).to_owned(), raw_run(&before?), raw_run(&after?)));
    }
    let text = output::text(&found);
    let corrected = sinew_sim::Rig::parse(&output::mended(&found), &rig.file)?;
    let refitted = NativeRig::new(found.refitted.clone(), rig.file.as_str());
    let corrected = NativeRig::new(corrected, rig.file.as_str());
    Ok((output::json(&found)?, text, page, refitted, corrected, runs))
}

//! `sinew fit`: the rig's free parameters from recordings.

use std::path::PathBuf;

use clap::Args;
use sinew_sim::Rig;

use super::Recordings;
use super::exit_code;
use super::overwrite;
use super::progress::Stage;
use super::repair::Repairs;
use super::said::Said;
use crate::error::Result;
use crate::fit::json::json;
use crate::fit::{FitOptions, fit, free_runs, pool, require, score};
use crate::report::{count, own_value, quantity, warnings};

/// Arguments of `sinew fit`.
#[derive(Args)]
pub struct Arguments {
    /// The rig file (TOML).
    pub rig: PathBuf,
    #[command(flatten)]
    recordings: Recordings,
    #[command(flatten)]
    repairs: Repairs,
    /// File for the fitted rig; its comments are kept.
    #[arg(long, value_name = "TOML")]
    out: Option<PathBuf>,
    /// File for the result as JSON (sinew-fit/1); `-` is standard output.
    #[arg(long, value_name = "JSON")]
    json: Option<PathBuf>,
    /// End with status 3 for an undetermined parameter and with 4 for an unexplained signal.
    #[arg(long)]
    exit_code: bool,
    /// No progress.
    #[arg(long)]
    quiet: bool,
}

/// Returns the exit status.
///
/// # Errors
/// A bad file, or a rig that cannot be fitted.
pub fn run(arguments: &Arguments) -> Result<u8> {
    let Recordings { fit: fitted, test } = &arguments.recordings;
    let fitted = fitted.iter().map(|path| ("--fit", path.as_path()));
    let tests = test.iter().map(|path| ("--test", path.as_path()));
    overwrite::refuse(
        std::iter::once(("the rig", arguments.rig.as_path()))
            .chain(fitted)
            .chain(tests),
        [
            ("--out", arguments.out.as_deref()),
            ("--json", arguments.json.as_deref()),
        ],
    )?;
    let rig = Rig::load(&arguments.rig)?;
    let (recordings, tests) = (
        arguments.repairs.read(&arguments.recordings.fit)?,
        arguments.repairs.read(&arguments.recordings.test)?,
    );
    require(&rig, recordings.iter().chain(&tests))?;
    let all = recordings.iter().chain(&tests);
    arguments.repairs.before(&rig, all, arguments.quiet)?;
    let stage = Stage::begin("fit the rig to the recordings", arguments.quiet);
    let found = fit(&rig, &recordings, &FitOptions::default(), &mut |p| {
        stage.say(format!(
            "stage {}, step {}, {:.2} % of the signal",
            p.stage,
            p.step,
            100.0 * p.error
        ));
    })?;
    stage.end(count(found.steps, "step"));
    let said = Said::beside([arguments.out.as_deref(), arguments.json.as_deref()]);

    for p in &found.parameters {
        let interval = match p.ci95 {
            Some([low, high]) => {
                format!("{} to {}", quantity(low, &p.unit), quantity(high, &p.unit))
            }
            None if p.at_bound => "at its bound".into(),
            None => "not determined by these recordings".into(),
        };
        said.line(format!(
            "{:<32} {:>14} → {:>14}   ({interval})",
            p.name,
            quantity(p.as_written, &p.unit),
            quantity(p.value, &p.unit)
        ));
        for own in &p.recordings {
            said.line(format!("    {}: {}", own.recording, own_value(own)));
        }
    }
    for held in &found.held {
        said.line(format!(
            "{}: {} samples of {} are missing and held their last value",
            held.recording, held.missing, held.column
        ));
    }
    for s in &found.sensors {
        said.line(format!(
            "fit   {}: free-run error {} as written, {} refitted",
            s.signal,
            quantity(s.as_written_rms, &s.unit),
            quantity(s.rms, &s.unit)
        ));
    }
    let mut tested = Vec::new();
    if !tests.is_empty() {
        let runs = free_runs(&found.rig, &tests)?;
        for own in runs.iter().flat_map(|run| &run.own) {
            said.line(format!(
                "test  {}: {} {}, from this recording alone",
                own.recording,
                own.name,
                own_value(own)
            ));
        }
        tested = score(&rig, &tests)?.into_iter().zip(pool(&runs)).collect();
        for (before, after) in &tested {
            said.line(format!(
                "test  {}: free-run error {} as written, {} refitted",
                after.signal,
                quantity(before.rms, &after.unit),
                quantity(after.rms, &after.unit)
            ));
        }
    }
    for warning in warnings(&found) {
        said.line(format!("warning: {warning}"));
    }
    if let Some(path) = &arguments.json {
        let text = format!("{:#}\n", json(&found, &tested));
        sinew_files::write(path, text)?;
        said.wrote(path);
    }
    match &arguments.out {
        Some(path) => {
            sinew_files::write(path, found.rig.to_toml())?;
            said.wrote(path);
            said.line(format!("next: {}", diagnosis(arguments)));
        }
        None => said.line("nothing written; --out RIG.toml keeps the fitted rig"),
    }
    Ok(match arguments.exit_code {
        true => exit_code::of_fit(&found),
        false => 0,
    })
}

/// Command line that looks for physics that the rig lacks.
fn diagnosis(arguments: &Arguments) -> String {
    let Recordings { fit, test } = &arguments.recordings;
    let mut line = format!("sinew diagnose {}", arguments.rig.display());
    for (flag, paths) in [("--fit", fit), ("--test", test)] {
        for path in paths {
            line += &format!(" {flag} {}", path.display());
        }
    }
    line + &arguments.repairs.flags()
}

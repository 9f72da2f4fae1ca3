//! `sinew diagnose`: what physics a rig lacks.

use std::path::{Path, PathBuf};
use std::time::Duration;

use clap::Args;
use sinew_sim::Rig;

use super::Common;
use super::exit_code;
use super::interrupt::Interrupt;
use super::overwrite;
use super::progress::Stage;
use super::repair::Repairs;
use super::said::Said;
use crate::diagnose::output::{self, Shown};
use crate::diagnose::{DiagnoseOptions, Diagnosis, Recordings, Verdict, diagnose};
use crate::error::{Error, Result};
use crate::fit::require;
use crate::mechanism::changes;
use crate::report::Provenance;

/// Arguments of `sinew diagnose`.
#[derive(Args)]
pub struct Arguments {
    /// The rig file (TOML): what is believed.
    pub rig: PathBuf,
    /// A recording (CSV) that estimates parameters; may be repeated.
    #[arg(long, value_name = "CSV", required = true)]
    fit: Vec<PathBuf>,
    /// A recording that decides between explanations; may be repeated.
    ///
    /// Without one, part of --fit is set aside.
    #[arg(long, value_name = "CSV")]
    check: Vec<PathBuf>,
    /// A recording that is only scored, once, at the end; may be repeated.
    #[arg(long, value_name = "CSV")]
    test: Vec<PathBuf>,
    /// File for the findings as JSON (sinew-diagnosis/1); `-` is standard output.
    ///
    /// Without it they are printed for a person.
    #[arg(long, value_name = "JSON")]
    json: Option<PathBuf>,
    /// File for a page: plots, findings, next step.
    #[arg(long, value_name = "HTML")]
    report: Option<PathBuf>,
    /// File for the corrected rig; the rig's own text and comments are kept.
    #[arg(long, visible_alias = "out", value_name = "TOML")]
    rig_out: Option<PathBuf>,
    /// File for the corrected rig as MuJoCo's MJCF.
    #[arg(long, value_name = "XML")]
    mjcf: Option<PathBuf>,
    /// MJCF of your own that the rig came from: what to change in it is listed beside --mjcf.
    #[arg(long, value_name = "XML", requires = "mjcf")]
    changes: Option<PathBuf>,
    /// Seconds after which nothing more is tried; the answer is the best so far.
    ///
    /// Judging it takes a little longer. Ctrl-C does the same at once, and ends with status 130.
    #[arg(long, value_name = "S", value_parser = seconds)]
    time_limit: Option<Duration>,
    /// End with status 3 for missing physics and with 4 for an unexplained mismatch.
    #[arg(long)]
    exit_code: bool,
    #[command(flatten)]
    common: Common,
    #[command(flatten)]
    repairs: Repairs,
}

fn seconds(text: &str) -> Result<Duration> {
    let seconds = text.parse().ok().filter(|seconds: &f64| *seconds > 0.0);
    let limit = seconds.and_then(|seconds| Duration::try_from_secs_f64(seconds).ok());
    limit.ok_or_else(|| {
        Error::arguments(format!(
            "must be seconds above 0, got {text}, for example 60"
        ))
    })
}

/// Returns the exit status.
///
/// # Errors
/// Arguments that contradict each other, a bad file, or a rig that cannot be fitted.
pub fn run(arguments: &Arguments) -> Result<u8> {
    super::roles::refuse_two(roles(arguments))?;
    refuse_overwriting(arguments)?;
    let rig = Rig::load(&arguments.rig)?;
    if let Some(original) = &arguments.changes {
        // Better refused now than after the search.
        changes(&rig, original)?;
    }
    let quiet = arguments.common.quiet;
    let recordings = Recordings {
        fit: arguments.repairs.read(&arguments.fit, quiet)?,
        check: arguments.repairs.read(&arguments.check, quiet)?,
        test: arguments.repairs.read(&arguments.test, quiet)?,
    };
    let all = [&recordings.fit, &recordings.check, &recordings.test];
    require(&rig, all.into_iter().flatten())?;
    let checks = arguments
        .repairs
        .before(&rig, all.into_iter().flatten(), quiet)?;
    let stage = Stage::begin("diagnose", quiet);
    let interrupt = Interrupt::listen();
    let options = DiagnoseOptions {
        seed: arguments.common.seed,
        time_limit: arguments.time_limit,
        stop: interrupt.stop.clone(),
        checks,
        ..DiagnoseOptions::default()
    };
    let told = |what: &str, done: usize, of: usize| stage.count(done, of, what);
    let found = diagnose(&rig, &recordings, &options, &told)?;
    drop(interrupt);
    stage.end(verdict(&found));
    leave(arguments, &rig, &recordings, &found)?;
    Ok(if arguments.exit_code {
        exit_code::of_verdict(found.verdict)
    } else {
        0
    })
}

/// The contract's word for the verdict, for a line of progress.
fn verdict(found: &Diagnosis) -> String {
    let names: Vec<&str> = found.effects.iter().map(|e| e.kind.as_str()).collect();
    match names[..] {
        [] => found.verdict.name().to_owned(),
        _ => names.join(", "),
    }
}

/// Prints and writes what was asked for.
fn leave(
    arguments: &Arguments,
    rig: &Rig,
    recordings: &Recordings,
    found: &Diagnosis,
) -> Result<()> {
    let quiet = arguments.common.quiet;
    let mut written: Vec<&Path> = Vec::new();
    let said = Said::beside(
        [
            arguments.json.as_deref(),
            arguments.report.as_deref(),
            arguments.rig_out.as_deref(),
            arguments.mjcf.as_deref(),
        ],
        quiet,
    );
    match &arguments.json {
        Some(path) => {
            sinew_files::write(path, output::json(found)?)?;
            written.push(path);
            said.line(&found.sentence);
        }
        None => said.line(output::text(found).trim_end()),
    }
    if let Some(path) = &arguments.report {
        let shown: Vec<Shown<'_>> = [
            ("fit", &recordings.fit),
            ("check", &recordings.check),
            ("test", &recordings.test),
        ]
        .into_iter()
        .flat_map(|(role, of)| of.iter().map(move |recording| Shown { role, recording }))
        .collect();
        let made = Provenance::typed().seed(arguments.common.seed);
        output::report(found, rig, &shown, &made)?.write(path)?;
        written.push(path);
    }
    if let Some(path) = &arguments.rig_out {
        sinew_files::write(path, output::mended(found))?;
        written.push(path);
    }
    if let Some(path) = &arguments.mjcf {
        super::mjcf::write(&found.mended, path, quiet)?;
        if let Some(original) = &arguments.changes {
            let said = Said::beside([Some(path.as_path())], quiet);
            super::mjcf::write_changes(&found.mended, original, path, said)?;
        }
        written.push(path);
    }
    for path in written {
        said.wrote(path);
    }
    said.next(next(arguments, found));
    Ok(())
}

/// The command that comes next: the corrected rig is fitted, or more is recorded.
fn next(arguments: &Arguments, found: &Diagnosis) -> String {
    let rig = arguments.rig.display();
    let flags = |flag: &str, paths: &[PathBuf]| -> String {
        let each = paths.iter();
        each.map(|path| format!(" {flag} {}", path.display()))
            .collect()
    };
    let fit = flags("--fit", &arguments.fit);
    let test = flags("--test", &arguments.test);
    let out = arguments.rig_out.as_ref();
    let out = out.filter(|out| !sinew_files::is_output(out));
    match (found.effects.is_empty(), out) {
        (false, Some(out)) => format!("sinew train {}{fit}{test} --out model", out.display()),
        (false, None) => {
            let check = flags("--check", &arguments.check);
            format!("sinew diagnose {rig}{fit}{check}{test} --rig-out corrected.toml")
        }
        (true, _) if found.verdict != Verdict::Unexplained => {
            format!("sinew train {rig}{fit}{test} --out model")
        }
        (true, _) => format!("sinew excite {rig} --design --out excitation.csv"),
    }
}

fn roles(arguments: &Arguments) -> [(&'static str, &Vec<PathBuf>); 3] {
    [
        ("--fit", &arguments.fit),
        ("--check", &arguments.check),
        ("--test", &arguments.test),
    ]
}

/// No result may replace what it was made from, or another result.
fn refuse_overwriting(arguments: &Arguments) -> Result<()> {
    let recordings = roles(arguments).into_iter();
    let recordings = recordings.flat_map(|(flag, paths)| paths.iter().map(move |p| (flag, p)));
    let recordings = recordings.map(|(flag, path)| (flag, path.as_path()));
    overwrite::refuse(
        std::iter::once(("the rig", arguments.rig.as_path()))
            .chain(arguments.changes.as_deref().map(|path| ("--changes", path)))
            .chain(recordings),
        [
            ("--json", arguments.json.as_deref()),
            ("--report", arguments.report.as_deref()),
            ("--rig-out", arguments.rig_out.as_deref()),
            ("--mjcf", arguments.mjcf.as_deref()),
        ],
    )
}

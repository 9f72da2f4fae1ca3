//! `sinew fit`: the rig's free parameters from recordings.

use std::path::{Path, PathBuf};

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
use crate::fit::{
    Fit, FitOptions, FreeRun, Progress, fit, fit_rests, fit_text, free_runs, pool, require,
    require_rests, rests,
};
use crate::fleet::is_of;
use crate::population::Fleet;
use crate::recording::Recording;
use crate::report::{Provenance, count, own_value, quantity, unseen, warnings};
use crate::validation::{FitPage, fit_page};

/// Arguments of `sinew fit`.
#[derive(Args)]
pub struct Arguments {
    /// The rig file (TOML).
    pub rig: PathBuf,
    #[command(flatten)]
    recordings: Recordings,
    /// The files are tables of rests: a row has inputs and the readings once nothing moves.
    #[arg(long = "static")]
    at_rest: bool,
    /// The fleet that the device is of (sinew-fleet/1, from `sinew fleet`): its prior.
    ///
    /// One second of a new device is then enough for what its fleet has in common.
    #[arg(long, value_name = "TOML", conflicts_with = "at_rest")]
    fleet: Option<PathBuf>,
    /// File for the fitted rig; its comments are kept.
    #[arg(long, value_name = "TOML")]
    out: Option<PathBuf>,
    /// File for the result as JSON (sinew-fit/1); `-` is standard output.
    #[arg(long, value_name = "JSON")]
    json: Option<PathBuf>,
    /// File for a page: measured over simulated, residuals, frequency response, coverage.
    #[arg(long, value_name = "HTML")]
    report: Option<PathBuf>,
    /// End with status 3 for an undetermined parameter and with 4 for an unexplained signal.
    #[arg(long)]
    exit_code: bool,
    /// Print warnings and errors alone.
    #[arg(long)]
    quiet: bool,
    #[command(flatten)]
    repairs: Repairs,
}

/// Returns the exit status.
///
/// # Errors
/// A bad file, or a rig that cannot be fitted.
pub fn run(arguments: &Arguments) -> Result<u8> {
    let Recordings { fit: fitted, test } = &arguments.recordings;
    let fitted = fitted.iter().map(|path| ("--fit", path.as_path()));
    let tests = test.iter().map(|path| ("--test", path.as_path()));
    let of_fleet = arguments.fleet.iter();
    overwrite::refuse(
        std::iter::once(("the rig", arguments.rig.as_path()))
            .chain(of_fleet.map(|path| ("--fleet", path.as_path())))
            .chain(fitted)
            .chain(tests),
        [
            ("--out", arguments.out.as_deref()),
            ("--json", arguments.json.as_deref()),
            ("--report", arguments.report.as_deref()),
        ],
    )?;
    let rig = Rig::load(&arguments.rig)?;
    let options = FitOptions {
        fleet: fleet(arguments.fleet.as_deref(), &rig)?,
        ..FitOptions::default()
    };
    let kind = if arguments.at_rest {
        Kind::Rests
    } else {
        Kind::Motions
    };
    let (recordings, tests) = (
        kind.read(arguments, &arguments.recordings.fit)?,
        kind.read(arguments, &arguments.recordings.test)?,
    );
    let all = recordings.iter().chain(&tests);
    let checks = match kind {
        Kind::Rests => {
            require_rests(&rig, all)?;
            Vec::new()
        }
        Kind::Motions => {
            require(&rig, all.clone())?;
            arguments.repairs.before(&rig, all, arguments.quiet)?
        }
    };
    let title = format!("fit the rig to the {}", kind.files());
    let stage = Stage::begin(&title, arguments.quiet);
    let found = kind.fit(&rig, &recordings, &options, &mut |p| {
        stage.say(format!(
            "stage {}, step {}, {:.2} % of the signal",
            p.stage,
            p.step,
            100.0 * p.error
        ));
    })?;
    stage.end(count(found.steps, "step"));
    let said = Said::beside(
        [
            arguments.out.as_deref(),
            arguments.json.as_deref(),
            arguments.report.as_deref(),
        ],
        arguments.quiet,
    );

    for p in &found.parameters {
        let interval = match p.ci95 {
            Some([low, high]) => {
                format!("{} to {}", quantity(low, &p.unit), quantity(high, &p.unit))
            }
            None if p.at_bound => "at its bound".into(),
            None => format!("not determined by these {}", kind.files()),
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
        let [_, percent] = s.fit_percent();
        said.line(format!(
            "fit   {}: {} {} as written, {} refitted{}",
            s.signal,
            kind.error(),
            quantity(s.as_written_rms, &s.unit),
            quantity(s.rms, &s.unit),
            in_percent(percent)
        ));
    }
    let mut written_runs = Vec::new();
    let mut test_runs = Vec::new();
    let mut tested = Vec::new();
    if !tests.is_empty() {
        let runs = kind.runs(&found.rig, &tests)?;
        for own in runs.iter().flat_map(|run| &run.own) {
            said.line(format!(
                "test  {}: {} {}, from this recording alone",
                own.recording,
                own.name,
                own_value(own)
            ));
        }
        written_runs = kind.runs(&rig, &tests)?;
        let before = pool(&written_runs);
        tested = before.into_iter().zip(pool(&runs)).collect();
        test_runs = runs;
        for (before, after) in &tested {
            said.line(format!(
                "test  {}: {} {} as written, {} refitted{}",
                after.signal,
                kind.error(),
                quantity(before.rms, &after.unit),
                quantity(after.rms, &after.unit),
                in_percent(after.fit_percent())
            ));
        }
    }
    let unseen = unseen(&found, tested.iter().map(|(_, after)| after));
    for warning in warnings(&found).into_iter().chain(unseen) {
        said.warning(warning);
    }
    if let Some(path) = &arguments.json {
        let text = format!("{:#}\n", json(&found, &tested, &checks));
        sinew_files::write(path, text)?;
        said.wrote(path);
    }
    if let Some(path) = &arguments.report {
        let of_fit = recordings.iter().map(|recording| ("fit", recording));
        let of_test = tests.iter().map(|recording| ("test", recording));
        let runs = |of_fit: &[FreeRun], of_test: &[FreeRun]| [of_fit, of_test].concat();
        let before = runs(&found.as_written_runs, &written_runs);
        let after = runs(&found.runs, &test_runs);
        let page = fit_page(
            &FitPage {
                found: &found,
                written: &rig,
                recordings: of_fit.chain(of_test).collect(),
                runs: [&before, &after],
                at_rest: matches!(kind, Kind::Rests),
                next: kind.next(arguments, arguments.out.as_deref()),
            },
            &Provenance::typed(),
        )?;
        page.write(path)?;
        said.wrote(path);
    }
    match &arguments.out {
        Some(path) => {
            sinew_files::write(path, found.rig.to_toml())?;
            said.wrote(path);
            said.next(kind.next(arguments, Some(path)));
        }
        None => said.line("nothing written; --out RIG.toml keeps the fitted rig"),
    }
    Ok(if arguments.exit_code {
        exit_code::of_fit(&found)
    } else {
        0
    })
}

/// The fleet of a file, which is of this rig.
///
/// # Errors
/// A bad file, or parameters that are not the rig's free ones.
pub fn fleet(path: Option<&Path>, rig: &Rig) -> Result<Option<Fleet>> {
    let read = |path| {
        let fleet = Fleet::load(path)?;
        is_of(&fleet, rig)?;
        Ok(fleet)
    };
    path.map(read).transpose()
}

/// Kind of the files of a fit.
#[derive(Clone, Copy)]
enum Kind {
    /// Recordings of motions.
    Motions,
    /// Tables of rests.
    Rests,
}

impl Kind {
    fn read(self, arguments: &Arguments, paths: &[PathBuf]) -> Result<Vec<Recording>> {
        match self {
            Self::Motions => arguments.repairs.read(paths, arguments.quiet),
            Self::Rests => arguments.repairs.read_tables(paths),
        }
    }

    fn fit(
        self,
        rig: &Rig,
        recordings: &[Recording],
        options: &FitOptions,
        progress: &mut dyn FnMut(Progress),
    ) -> Result<Fit> {
        match self {
            Self::Motions => fit(rig, recordings, options, progress),
            Self::Rests => fit_rests(rig, recordings, options, progress),
        }
    }

    fn runs(self, rig: &Rig, recordings: &[Recording]) -> Result<Vec<FreeRun>> {
        match self {
            Self::Motions => free_runs(rig, recordings),
            Self::Rests => rests(rig, recordings),
        }
    }

    fn files(self) -> &'static str {
        match self {
            Self::Motions => "recordings",
            Self::Rests => "rests",
        }
    }

    fn error(self) -> &'static str {
        match self {
            Self::Motions => "free-run error",
            Self::Rests => "error at rest",
        }
    }

    /// Command line that comes next.
    fn next(self, arguments: &Arguments, written: Option<&Path>) -> String {
        match self {
            Self::Motions => diagnosis(arguments),
            Self::Rests => {
                let rig = written.unwrap_or(&arguments.rig);
                format!("sinew settle {}", rig.display())
            }
        }
    }
}

/// `, fit 97.3 %`; empty where there is none.
fn in_percent(percent: Option<f64>) -> String {
    percent.map_or_else(String::new, |_| format!(", fit {}", fit_text(percent)))
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

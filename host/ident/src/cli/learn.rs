//! `sinew learn`: laws of springs and dampers that other rigs take.

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::Args;
use sinew_sim::Rig;

use super::progress::Stage;
use super::repair::Repairs;
use super::said::Said;
use super::{overwrite, roles};
use crate::error::{Error, Result};
use crate::fit::{FreeRun, SensorError, free_runs, pool, require};
use crate::learn::{LearnOptions, Learned, Origin, Progress, json, law_file, learn, page};
use crate::recording::Recording;
use crate::report::{Provenance, quantity};

/// Arguments of `sinew learn`.
#[derive(Args)]
#[command(after_long_help = "Examples:\n  \
    sinew learn rig.toml --at foam --fit a.csv --check b.csv --out foam.law.toml\n  \
    sinew learn rig.toml --at foam --at oil --fit a.csv --check b.csv --rig-out learned.toml\n  \
    sinew learn rig.toml --at pad --asymmetric --fit a.csv --check b.csv --report pad.html")]
pub struct Arguments {
    /// The rig file (TOML), with a straight line where the law is.
    pub rig: PathBuf,
    /// Spring or damper whose law is learned; may be repeated.
    #[arg(long, value_name = "NAME", required = true)]
    at: Vec<String>,
    /// A recording (CSV) to learn from; may be repeated.
    #[arg(long, value_name = "CSV", required = true)]
    fit: Vec<PathBuf>,
    /// A recording that decides how smooth the law is; may be repeated.
    #[arg(long, value_name = "CSV", required = true)]
    check: Vec<PathBuf>,
    /// A recording that is only scored, once, at the end; may be repeated.
    #[arg(long, value_name = "CSV")]
    test: Vec<PathBuf>,
    /// Numbers of their own for each direction: the law need not be odd.
    #[arg(long)]
    asymmetric: bool,
    /// A spring's force may fall with its extension, as of a buckled beam or a magnet.
    #[arg(long)]
    any_slope: bool,
    /// File for the law (sinew-law/1), for `law` of another rig; one for each --at, in their order.
    #[arg(long, value_name = "TOML")]
    out: Vec<PathBuf>,
    /// File for the refitted rig with the laws in it; its comments are kept.
    #[arg(long, value_name = "TOML")]
    rig_out: Option<PathBuf>,
    /// File for the result as JSON (sinew-learn/1); `-` is standard output.
    #[arg(long, value_name = "JSON")]
    json: Option<PathBuf>,
    /// File for a page: plots and results.
    #[arg(long, value_name = "HTML")]
    report: Option<PathBuf>,
    /// Print warnings and errors alone.
    #[arg(long)]
    quiet: bool,
    #[command(flatten)]
    repairs: Repairs,
}

impl Arguments {
    fn roles(&self) -> [(&'static str, &Vec<PathBuf>); 3] {
        [
            ("--fit", &self.fit),
            ("--check", &self.check),
            ("--test", &self.test),
        ]
    }
}

/// Learns and writes.
///
/// # Errors
/// Arguments that contradict each other, a bad file, a rig that cannot be fitted, or no law that
/// explains the check recordings better than a straight line.
pub fn run(arguments: &Arguments) -> Result<()> {
    roles::refuse_two(arguments.roles())?;
    refuse_overwriting(arguments)?;
    let begun = Instant::now();
    let rig = Rig::load(&arguments.rig)?;
    let read = |paths: &[PathBuf]| arguments.repairs.read(paths, arguments.quiet);
    let recordings = read(&arguments.fit)?;
    let (check, test) = (read(&arguments.check)?, read(&arguments.test)?);
    let all = || recordings.iter().chain(&check).chain(&test);
    require(&rig, all())?;
    arguments.repairs.before(&rig, all(), arguments.quiet)?;
    let options = LearnOptions {
        odd: !arguments.asymmetric,
        monotone: !arguments.any_slope,
        ..LearnOptions::default()
    };
    let title = format!("learn the law of {}", arguments.at.join(" and "));
    let stage = Stage::begin(title, arguments.quiet);
    let learned = learn(
        &rig,
        &arguments.at,
        (&recordings, &check),
        options,
        &mut |progress| stage.say(line(&progress)),
    )?;
    stage.end(format!("bends of {} of the stiffness", learned.width));
    let tested = if test.is_empty() {
        Vec::new()
    } else {
        let before = pool(&free_runs(&learned.straight.rig, &test)?);
        let after = pool(&free_runs(&learned.rig, &test)?);
        before.into_iter().zip(after).collect()
    };
    leave(arguments, &learned, (&check, &test), &tested, begun)
}

fn line(progress: &Progress) -> String {
    let fit = |p: &crate::fit::Progress| {
        format!(
            "stage {}, step {}, {:.3} % of the signal",
            p.stage,
            p.step,
            100.0 * p.error
        )
    };
    match progress {
        Progress::Straight(p) => format!("straight line: {}", fit(p)),
        Progress::Law(index, count, p) => format!("law {index} of at most {count}: {}", fit(p)),
    }
}

/// Prints and writes what was asked for.
fn leave(
    arguments: &Arguments,
    learned: &Learned,
    (check, test): (&[Recording], &[Recording]),
    tested: &[(SensorError, SensorError)],
    begun: Instant,
) -> Result<()> {
    let outs = arguments.out.iter().map(|path| Some(path.as_path()));
    let said = Said::beside(
        outs.chain([
            arguments.rig_out.as_deref(),
            arguments.json.as_deref(),
            arguments.report.as_deref(),
        ]),
        arguments.quiet,
    );
    for (law, target) in learned.laws.iter().zip(&learned.targets) {
        let values = law.values();
        let places = law.shape().places(values.len());
        said.line(format!("{} of `{}`:", law.kind.key(), target.name()));
        for (place, value) in places.iter().zip(&values) {
            said.line(format!(
                "{:>14}  {:>14}",
                quantity(*place, target.unit()),
                quantity(*value, target.number_unit())
            ));
        }
    }
    for (role, errors) in [
        ("fit", &learned.fit[..]),
        ("check", &learned.check),
        ("test", tested),
    ] {
        for (straight, law) in errors {
            said.line(format!(
                "{role:<5} {}: free-run error {} with a straight line, {} with the law",
                law.signal,
                quantity(straight.rms, &law.unit),
                quantity(law.rms, &law.unit)
            ));
        }
    }
    let names = |paths: &[PathBuf]| paths.iter().map(|path| name(path)).collect();
    let origin = Origin {
        fit: names(&arguments.fit),
        check: names(&arguments.check),
    };
    for (index, path) in arguments.out.iter().enumerate() {
        sinew_files::write(path, law_file(learned, index, &origin))?;
        said.wrote(path);
    }
    if let Some(path) = &arguments.rig_out {
        sinew_files::write(path, learned.rig.to_toml())?;
        said.wrote(path);
    }
    if let Some(path) = &arguments.json {
        let seconds = begun.elapsed().as_secs_f64();
        sinew_files::write(path, format!("{:#}\n", json(learned, tested, seconds)))?;
        said.wrote(path);
    }
    if let Some(path) = &arguments.report {
        let mut runs: Vec<(&str, FreeRun)> = Vec::new();
        for (role, of) in [("check", check), ("test", test)] {
            let of = free_runs(&learned.rig, of)?;
            runs.extend(of.into_iter().map(|run| (role, run)));
        }
        page(learned, &runs, tested, &Provenance::typed()).write(path)?;
        said.wrote(path);
    }
    match arguments.out.first() {
        Some(path) => said.next(format!(
            "`law = \"{}\"` in the place of `{}` of another rig",
            name(path),
            learned.laws[0].kind.key()
        )),
        None if arguments.rig_out.is_none() => {
            said.line("nothing written; --out NAME.law.toml keeps the law");
        }
        None => {}
    }
    Ok(())
}

fn name(path: &Path) -> String {
    let name = path.file_name().unwrap_or(path.as_os_str());
    name.to_string_lossy().into_owned()
}

/// One law file for each law, and no result in the place of what it was made from or of another.
fn refuse_overwriting(arguments: &Arguments) -> Result<()> {
    let (laws, files) = (arguments.at.len(), arguments.out.len());
    if files > 0 && files != laws {
        return Err(Error::arguments(format!(
            "--out is given {files} times and --at {laws} times"
        ))
        .expected("one --out for each --at, in their order")
        .help("--rig-out keeps all laws in one file, the rig"));
    }
    let recordings = arguments.roles().into_iter();
    let recordings = recordings.flat_map(|(flag, paths)| paths.iter().map(move |p| (flag, p)));
    let recordings = recordings.map(|(flag, path)| (flag, path.as_path()));
    let outs = arguments
        .out
        .iter()
        .map(|path| ("--out", Some(path.as_path())));
    overwrite::refuse(
        std::iter::once(("the rig", arguments.rig.as_path())).chain(recordings),
        outs.chain([
            ("--rig-out", arguments.rig_out.as_deref()),
            ("--json", arguments.json.as_deref()),
            ("--report", arguments.report.as_deref()),
        ]),
    )
}

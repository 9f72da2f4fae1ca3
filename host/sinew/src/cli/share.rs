//! `sinew share`: recordings of a fleet that may be published, under a privacy budget.

use std::path::{Path, PathBuf};

use clap::Args;
use sinew_ident::cli::fleet::{devices, named};
use sinew_ident::cli::overwrite;
use sinew_ident::cli::progress::Stage;
use sinew_ident::cli::repair::Repairs;
use sinew_ident::cli::said::Said;
use sinew_ident::error::{Error, Result};
use sinew_ident::excite::{Kind, Options, design};
use sinew_ident::fleet::Recorded;
use sinew_ident::population::{FEWEST, Scale};
use sinew_ident::report::{Table, count, quantity, significant};
use sinew_share::json::{json, mean};
use sinew_share::statistics::expected_error;
use sinew_share::{Budget, Inputs, Region, Release, Shared};
use sinew_sim::{Plant, Rig};

use crate::rig_file;

/// File of the budget in the folder that is published.
const DOCUMENT: &str = "share.json";
/// Its copy of the rig.
const RIG: &str = "rig.toml";

/// Arguments of `sinew share`.
#[derive(Args)]
#[command(after_long_help = "Examples:\n  \
    sinew share rig.toml --device a=a1.csv,a2.csv --device b=b1.csv --epsilon 4 --out shared\n  \
    sinew share rig.toml --fit a.csv --fit b.csv --fit c.csv --epsilon 2 --within 1.5 --out shared")]
pub struct Arguments {
    /// The rig file (TOML). It is published: its numbers must not come from the devices.
    rig: PathBuf,
    /// The recording (CSV) of one device; may be repeated.
    #[arg(long, value_name = "CSV", required_unless_present = "device")]
    fit: Vec<PathBuf>,
    /// A device with its recordings; may be repeated. Its name is not published.
    ///
    /// A name that comes again has further recordings.
    #[arg(long, value_name = "NAME=CSV,CSV", value_parser = named)]
    device: Vec<(String, Vec<PathBuf>)>,
    /// Privacy of each device: largest logarithm of the odds that the result gives away.
    #[arg(long)]
    epsilon: f64,
    /// Probability with which that may fail; less than a tenth of 1 / devices.
    #[arg(long, default_value_t = 1e-6)]
    delta: f64,
    /// Public guess: each parameter is within this factor of the rig's value; may be repeated.
    ///
    /// A number is for all parameters, NAME=FACTOR for one. It must not come from the devices.
    #[arg(long, value_name = "FACTOR", value_parser = factor)]
    within: Vec<(Option<String>, f64)>,
    /// Largest expected error of a mean; refused where the fleet is too small for it.
    ///
    /// A fraction of the parameter; of half its range where that is `min` to `max`.
    #[arg(long, value_name = "FRACTION", default_value_t = 0.05)]
    tolerance: f64,
    /// Synthetic devices; without it as many as there are devices.
    #[arg(long, value_name = "COUNT")]
    count: Option<usize>,
    /// Duration of each recording, s.
    #[arg(long, default_value_t = 10.0)]
    seconds: f64,
    /// Samples a second.
    #[arg(long, value_name = "HZ", default_value_t = 120.0)]
    rate: f64,
    /// Fraction of each input's range that is used, about its middle.
    #[arg(long, value_name = "FRACTION", default_value_t = 0.8)]
    amplitude: f64,
    /// Standard deviation of white noise, as a fraction of each signal's range.
    #[arg(long, value_name = "FRACTION", default_value_t = 0.005)]
    noise: f64,
    /// Folder for the recordings, the rig and share.json: what may be published.
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// File for the same as share.json (sinew-shared/1); `-` is standard output.
    #[arg(long, value_name = "JSON")]
    json: Option<PathBuf>,
    /// Seed of the privacy noise, for tests alone: who knows it can take the noise away.
    #[arg(long)]
    seed: Option<u64>,
    /// Print warnings and errors alone.
    #[arg(long)]
    quiet: bool,
    #[command(flatten)]
    repairs: Repairs,
}

/// A factor as `--within` has it.
fn factor(text: &str) -> std::result::Result<(Option<String>, f64), String> {
    let (name, number) = match text.split_once('=') {
        Some((name, number)) => (Some(name.trim().to_owned()), number),
        None => (None, text),
    };
    let number = number.trim().parse();
    let number = number.map_err(|_| "not a factor such as 2 or mass.inertia=1.5".to_owned())?;
    Ok((name, number))
}

/// # Errors
/// A bad file or argument, a fleet that is too small for the budget, a release that is there.
pub fn run(arguments: &Arguments) -> Result<()> {
    let files = devices(&arguments.fit, &arguments.device)?;
    refuse(arguments, &files)?;
    let rig = rig_file::load(&arguments.rig)?;
    let plant = Plant::new(&rig)?;
    let budget = Budget {
        epsilon: arguments.epsilon,
        delta: arguments.delta,
    };
    budget.check(files.len())?;
    let region = region(arguments, &rig, &plant)?;
    is_enough(arguments, &region, &budget, files.len())?;
    let inputs = Inputs {
        design: Options {
            kind: Kind::Mixed,
            seconds: arguments.seconds,
            rate_hz: arguments.rate,
            amplitude: arguments.amplitude,
            ..Options::default()
        },
        noise: arguments.noise,
    };
    design(&plant, &arguments.rig, &inputs.design)?;
    let recorded = files.into_iter().map(|(name, paths)| {
        let recordings = arguments.repairs.read(&paths, arguments.quiet)?;
        Ok(Recorded { name, recordings })
    });
    let recorded = recorded.collect::<Result<Vec<Recorded>>>()?;
    sinew_ident::fit::require(&rig, recorded.iter().flat_map(|it| &it.recordings))?;
    // One by one: that devices differ is no fault here.
    for device in &recorded {
        let own = device.recordings.iter();
        arguments.repairs.before(&rig, own, arguments.quiet)?;
    }

    let quiet = arguments.quiet;
    let stage = Stage::begin("fit each device by itself", quiet);
    let of = recorded.len();
    let places = sinew_share::places(&rig, &region, &recorded, &|done| {
        stage.count(done.saturating_sub(1), of, "devices");
    })?;
    stage.end(count(of, "device"));
    if places.unfitted > 0 {
        Said::beside([arguments.json.as_deref()], arguments.quiet).warning(format!(
            "{} of {} could not be fitted and count as the rig's own numbers; this is private, and \
             no file says it",
            places.unfitted,
            count(of, "device")
        ));
    }
    let release = Release::new(&places.each, &budget, sinew_share::random(arguments.seed)?);
    // From here on nothing private is looked at.
    drop((recorded, places));
    let stage = Stage::begin("search for devices with the noisy statistics", quiet);
    let wanted = arguments.count.unwrap_or(release.devices);
    let shared = sinew_share::synthesise(&release, wanted, 1);
    stage.end(count(wanted, "synthetic device"));
    let stage = Stage::begin("simulate their recordings", quiet);
    let recordings = sinew_share::recordings(&rig, &region, &shared.places, &inputs)?;
    stage.end(count(recordings.len(), "recording"));
    for recording in &recordings {
        recording.write(arguments.out.join(recording.path()))?;
    }
    sinew_files::write(arguments.out.join(RIG), rig.to_toml())?;
    let document = json(
        &region,
        (&budget, &release, &shared),
        &inputs,
        arguments.seed,
    );
    let text = format!("{document:#}\n");
    sinew_files::write(arguments.out.join(DOCUMENT), &text)?;
    if let Some(path) = &arguments.json {
        sinew_files::write(path, &text)?;
    }
    said(arguments, &region, &budget, (&release, &shared));
    Ok(())
}

/// Refuses files that would be replaced, and numbers that make no sense.
fn refuse(arguments: &Arguments, files: &[(String, Vec<PathBuf>)]) -> Result<()> {
    let document = arguments.out.join(DOCUMENT);
    if document.exists() {
        let message = "a release is there already, and a second one spends its budget again";
        return Err(Error::file(&document, message)
            .expected("a new folder; two releases of one fleet add up: epsilon and delta of both")
            .help("publish what is there, or name another --out"));
    }
    // Its names are fixed, and may be those of the rig and of the recordings.
    let mut entries = std::fs::read_dir(&arguments.out);
    let is_empty = entries.as_mut().is_ok_and(|it| it.next().is_none());
    if arguments.out.exists() && !is_empty {
        let message = "something is there already, and what is published stands alone";
        return Err(Error::file(&arguments.out, message)
            .expected("a folder that is new or empty")
            .help("name another --out"));
    }
    let paths = files.iter().flat_map(|(_, paths)| paths);
    let paths = paths.map(|path| ("a recording", path.as_path()));
    overwrite::refuse(
        std::iter::once(("the rig", arguments.rig.as_path())).chain(paths),
        [
            ("--out", Some(document.as_path())),
            ("--json", arguments.json.as_deref()),
        ],
    )?;
    if files.len() < FEWEST {
        let message = format!("{} to hide among", count(files.len(), "device"));
        return Err(Error::arguments(message)
            .expected(format!(
                "at least {FEWEST} devices, and far more for a useful budget"
            ))
            .help("name each with --fit FILE, or --device NAME=FILE,FILE"));
    }
    if !(0.0..=1.0).contains(&arguments.noise) {
        let expectation = "a fraction of a signal's range in [0, 1]";
        return Err(Error::must_be("--noise", expectation, arguments.noise)
            .help("for example --noise 0.005: half a percent"));
    }
    if !(arguments.tolerance > 0.0 && arguments.tolerance <= 1.0) {
        return Err(
            Error::must_be("--tolerance", "in (0, 1]", arguments.tolerance)
                .help("for example --tolerance 0.05: means within 5 %"),
        );
    }
    if arguments
        .count
        .is_some_and(|it| !(1..=10_000).contains(&it))
    {
        let got = arguments.count.unwrap_or(0);
        return Err(Error::must_be("--count", "in [1, 10000]", got).help("for example --count 20"));
    }
    Ok(())
}

/// The public region of the options.
fn region(arguments: &Arguments, rig: &Rig, plant: &Plant) -> Result<Region> {
    let all = arguments.within.iter().rfind(|(name, _)| name.is_none());
    let own = arguments.within.iter();
    let own = own.filter_map(|(name, factor)| Some((name.clone()?, *factor)));
    let all = all.map_or(2.0, |(_, factor)| *factor);
    Region::new(rig, plant, all, &own.collect::<Vec<_>>())
}

/// Expected error of a mean, as `--tolerance` counts it, with an error of 1 in the unit ball.
fn weight(side: &sinew_share::region::Side) -> f64 {
    match side.axis.scale {
        Scale::Log => side.half,
        Scale::Linear => 1.0,
    }
}

/// Refuses a fleet whose means the noise would hide.
fn is_enough(
    arguments: &Arguments,
    region: &Region,
    budget: &Budget,
    devices: usize,
) -> Result<()> {
    let worst = region
        .sides
        .iter()
        .max_by(|a, b| weight(a).total_cmp(&weight(b)));
    let Some(worst) = worst else { return Ok(()) };
    let error = weight(worst) * expected_error(region.size(), devices, budget);
    if error <= arguments.tolerance {
        return Ok(());
    }
    let tolerance = arguments.tolerance / weight(worst);
    let enough = sinew_share::enough(region.size(), budget, tolerance);
    let percent = |part: f64| format!("{} %", significant(100.0 * part, 2));
    Err(Error::failed(format!(
        "{} are too few to hide one of them: the mean of {} would have an error of {}",
        count(devices, "device"),
        worst.axis.name,
        percent(error)
    ))
    .expected(format!(
        "at most {}: {enough} devices at epsilon {} and delta {:e}",
        percent(arguments.tolerance),
        budget.epsilon,
        budget.delta
    ))
    .help("record more devices, narrow --within, or raise --epsilon or --tolerance"))
}

/// Prints the release in words and numbers that are public.
fn said(
    arguments: &Arguments,
    region: &Region,
    budget: &Budget,
    (release, shared): (&Release, &Shared),
) {
    let said = Said::beside([arguments.json.as_deref()], arguments.quiet);
    let mut table = Table::new("", ["parameter", "mean", "expected error", "region"]);
    for (k, side) in region.sides.iter().enumerate() {
        let end = |at: f64| {
            let mut place = vec![0.0; region.size()];
            place[k] = at;
            quantity(region.values(&place)[k], &side.axis.unit)
        };
        let error = side.half * release.deviation();
        table = table.row([
            side.axis.name.clone(),
            quantity(mean(region, k, &shared.places), &side.axis.unit),
            match side.axis.scale {
                Scale::Log => format!("{} %", significant(100.0 * error, 2)),
                Scale::Linear => quantity(error, &side.axis.unit),
            },
            format!("{} to {}", end(-1.0), end(1.0)),
        ]);
    }
    said.line(table.text().trim_end());
    said.line(format!(
        "each of {} is protected as a whole: epsilon {}, delta {:e}",
        count(release.devices, "device"),
        budget.epsilon,
        budget.delta
    ));
    if arguments.seed.is_some() {
        said.warning("--seed is known, so the noise can be taken away: publish nothing of this");
    }
    said.line(format!(
        "{} in {}",
        count(shared.places.len(), "recording"),
        arguments.out.display()
    ));
    if let Some(path) = &arguments.json {
        said.wrote(path);
    }
    said.next(next(&arguments.out, shared.places.len()));
}

/// The verb for who receives the folder.
fn next(folder: &Path, of: usize) -> String {
    let fits = (1..=of.min(FEWEST)).map(|k| {
        let path = folder.join(sinew_share::recording_name(k, of));
        format!(" --fit {}", path.display())
    });
    let fits: String = fits.collect();
    let rig = folder.join(RIG);
    format!("sinew fleet {}{fits} --out fleet.toml", rig.display())
}

//! `sinew fleet`: the distribution of a fleet from recordings of its devices.

use std::path::{Path, PathBuf};

use clap::Args;
use sinew_sim::Rig;

use super::overwrite;
use super::progress::Stage;
use super::repair::Repairs;
use super::said::Said;
use crate::error::{Error, Result};
use crate::fit::student_95;
use crate::fleet::json::json;
use crate::fleet::{FleetFit, Recorded, estimate, one_second, page};
use crate::order;
use crate::population::Scale;
use crate::report::{Provenance, Table, count, quantity, significant};

/// Correlation from which on a pair of parameters is mentioned.
const NOTABLE: f64 = 0.3;

/// Arguments of `sinew fleet`.
#[derive(Args)]
pub struct Arguments {
    /// The rig file (TOML); its free parameters are those in which the devices differ.
    pub rig: PathBuf,
    /// The recording (CSV) of one device, which is called by its file; may be repeated.
    #[arg(long, value_name = "CSV", required_unless_present = "device")]
    fit: Vec<PathBuf>,
    /// A device with its name and its recordings; may be repeated.
    ///
    /// A name that comes again has further recordings.
    #[arg(long, value_name = "NAME=CSV,CSV", value_parser = named)]
    device: Vec<(String, Vec<PathBuf>)>,
    /// Leave no device out, however far from the others.
    #[arg(long)]
    keep_outliers: bool,
    /// File for the distribution (sinew-fleet/1).
    #[arg(long, value_name = "TOML")]
    out: PathBuf,
    /// File for the result as JSON (sinew-fleet-fit/1); `-` is standard output.
    #[arg(long, value_name = "JSON")]
    json: Option<PathBuf>,
    /// File for a page: the devices beside their distribution.
    #[arg(long, value_name = "HTML")]
    report: Option<PathBuf>,
    /// Print warnings and errors alone.
    #[arg(long)]
    quiet: bool,
    #[command(flatten)]
    repairs: Repairs,
}

/// A device as `--device` has it.
///
/// # Errors
/// Words about what a device is, for text of another shape.
pub fn named(text: &str) -> Result<(String, Vec<PathBuf>)> {
    let refused = || Error::arguments("not a name and files, such as left=left-1.csv,left-2.csv");
    let (name, files) = text.split_once('=').ok_or_else(refused)?;
    let files: Vec<&str> = files.split(',').map(str::trim).collect();
    if name.trim().is_empty() || files.contains(&"") {
        return Err(refused());
    }
    let files = files.into_iter().map(PathBuf::from);
    Ok((name.trim().into(), files.collect()))
}

/// Files of each device, in the order of the command line: those of `--fit`, then of `--device`.
///
/// # Errors
/// `Arguments` for a file that comes twice.
pub fn devices(
    by_file: &[PathBuf],
    by_name: &[(String, Vec<PathBuf>)],
) -> Result<Vec<(String, Vec<PathBuf>)>> {
    let mut all: Vec<(String, Vec<PathBuf>)> = Vec::new();
    let by_file = by_file.iter().map(|path| {
        let name = path.file_stem().unwrap_or(path.as_os_str());
        (name.to_string_lossy().into_owned(), vec![path.clone()])
    });
    all.extend(by_file);
    let by_hand = all.len();
    for (name, paths) in by_name {
        match all[by_hand..].iter_mut().find(|(known, _)| known == name) {
            Some((_, known)) => known.extend(paths.iter().cloned()),
            None => all.push((name.clone(), paths.clone())),
        }
    }
    let mut seen: Vec<&Path> = Vec::new();
    for path in all.iter().flat_map(|(_, paths)| paths) {
        if seen.contains(&path.as_path()) {
            return Err(Error::arguments(format!("{} comes twice", path.display()))
                .expected("each recording once: it is of one device"));
        }
        seen.push(path);
    }
    Ok(all)
}

/// Fits every device, and writes the distribution.
///
/// # Errors
/// Bad arguments, a bad file, or devices that no distribution follows from.
pub fn run(arguments: &Arguments) -> Result<()> {
    let devices = devices(&arguments.fit, &arguments.device)?;
    let paths = devices.iter().flat_map(|(_, paths)| paths);
    let paths = paths.map(|path| ("a recording", path.as_path()));
    overwrite::refuse(
        std::iter::once(("the rig", arguments.rig.as_path())).chain(paths),
        [
            ("--out", Some(arguments.out.as_path())),
            ("--json", arguments.json.as_deref()),
            ("--report", arguments.report.as_deref()),
        ],
    )?;
    let rig = Rig::load(&arguments.rig)?;
    let recorded = devices.into_iter().map(|(name, paths)| {
        let recordings = arguments.repairs.read(&paths, arguments.quiet)?;
        Ok(Recorded { name, recordings })
    });
    let recorded = recorded.collect::<Result<Vec<Recorded>>>()?;
    // One by one: that devices differ is no fault here.
    for device in &recorded {
        let own = device.recordings.iter();
        arguments.repairs.before(&rig, own, arguments.quiet)?;
    }
    let stage = Stage::begin("fit the rig to each device", arguments.quiet);
    let found = estimate(
        &rig,
        &recorded,
        arguments.keep_outliers,
        &mut |device, p| {
            stage.say(format!(
                "{} ({} of {}), stage {}, step {}, {:.2} % of the signal",
                recorded[device].name,
                device + 1,
                recorded.len(),
                p.stage,
                p.step,
                100.0 * p.error
            ));
        },
    )?;
    stage.end(count(found.devices.len(), "device"));
    let said = Said::beside(
        [
            Some(arguments.out.as_path()),
            arguments.json.as_deref(),
            arguments.report.as_deref(),
        ],
        arguments.quiet,
    );
    said.line(table(&found).text().trim_end());
    for line in correlations(&found) {
        said.line(line);
    }
    for device in &found.devices {
        for sensor in device.fit.sensors.iter().filter(|it| !it.is_explained()) {
            said.warning(format!(
                "{}: the rig does not explain {}: free-run error {}, of {}",
                device.name,
                sensor.signal,
                quantity(sensor.rms, &sensor.unit),
                quantity(sensor.spread, &sensor.unit)
            ));
        }
    }
    for line in found.outliers() {
        said.line(line);
    }
    said.line(found.said_of_few());
    if let Some(path) = &arguments.json {
        sinew_files::write(path, format!("{:#}\n", json(&found)))?;
        said.wrote(path);
    }
    if let Some(path) = &arguments.report {
        let stage = Stage::begin("fit the first second of each device", arguments.quiet);
        let second = one_second(&rig, &recorded, &found, |device| {
            stage.count(device, recorded.len(), "devices");
        })?;
        stage.end(count(recorded.len(), "device"));
        page::report(&found, &second, &Provenance::typed()).write(path)?;
        said.wrote(path);
    }
    sinew_files::write(&arguments.out, found.fleet.to_toml())?;
    said.wrote(&arguments.out);
    if !sinew_files::is_output(&arguments.out) {
        said.next(format!(
            "sinew fit {} --fit NEW.csv --fleet {}",
            arguments.rig.display(),
            arguments.out.display()
        ));
    }
    Ok(())
}

/// A line a parameter: mean, spread of the devices, and the interval of a new one.
fn table(found: &FleetFit) -> Table {
    let fleet = &found.fleet;
    let titles = [
        "parameter",
        "mean",
        "spread",
        "a new device, 95 %",
        "devices",
    ];
    let mut table = Table::new("", titles);
    let of_new = fleet.of_a_new_device();
    let tail = fleet.freedom as f64;
    let reach = student_95(tail) * ((tail - 2.0) / tail).sqrt();
    for (j, axis) in fleet.axes.iter().enumerate() {
        let deviation = found.population.covariance[(j, j)].sqrt();
        let half = reach * of_new[(j, j)].sqrt();
        let at = axis.coordinate(axis.mean);
        let mut ends = [axis.value(at - half), axis.value(at + half)];
        order::sort(&mut ends);
        let members = fleet.members.iter().filter(|it| it.outlier.is_none());
        let showing = members.filter(|it| it.values.iter().any(|(name, _)| *name == axis.name));
        table = table.row([
            axis.name.clone(),
            quantity(axis.mean, &axis.unit),
            match axis.scale {
                Scale::Log => format!("{} %", significant(100.0 * deviation, 3)),
                Scale::Linear => quantity(deviation, &axis.unit),
            },
            format!(
                "{} to {}",
                quantity(ends[0], &axis.unit),
                quantity(ends[1], &axis.unit)
            ),
            showing.count().to_string(),
        ]);
    }
    table
}

/// A sentence a pair of parameters that go together.
fn correlations(found: &FleetFit) -> Vec<String> {
    let (axes, covariance) = (&found.fleet.axes, &found.fleet.covariance);
    let mut lines = Vec::new();
    for row in 0..axes.len() {
        for column in 0..row {
            let size = (covariance[(row, row)] * covariance[(column, column)]).sqrt();
            let correlation = covariance[(row, column)] / size;
            if correlation.abs() >= NOTABLE {
                let (a, b) = (&axes[column].name, &axes[row].name);
                lines.push(format!(
                    "{a} and {b} go together: correlation {correlation:.2}"
                ));
            }
        }
    }
    lines
}

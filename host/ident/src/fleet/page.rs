//! A fleet as a page that stands alone.

use super::{FittedDevice, FleetFit, OneSecond};
use crate::order;
use crate::population::{Axis, Scale};
use crate::report::{
    Block, Plot, Provenance, Report, Section, Series, Stroke, Table, Tone, count, quantity,
    significant,
};

/// Shares of all devices between which the distribution is drawn.
const DRAWN: [f64; 2] = [0.025, 0.975];
/// Steps between them.
const STEPS: usize = 95;

/// The page of a fleet and of the first second of a device like its own; `made` is its command.
pub fn report(found: &FleetFit, second: &OneSecond, made: &Provenance) -> Report {
    let fleet = &found.fleet;
    let mut page = Report::new(format!("{}: a fleet", fleet.rig)).lead(found.said_of_few());
    for (j, axis) in fleet.axes.iter().enumerate() {
        page = page.fact(
            axis.name.clone(),
            quantity(axis.mean, &axis.unit),
            format!("spread of the devices {}", spread(found, j)),
        );
    }
    page.section(outliers(found))
        .section(parameters(found))
        .section(correlations(found))
        .section(next_device(found, second))
        .made(made)
}

/// Standard deviation of the devices in a parameter.
pub fn spread(found: &FleetFit, j: usize) -> String {
    said(
        &found.fleet.axes[j],
        found.population.covariance[(j, j)].sqrt(),
    )
}

/// A standard deviation of a coordinate: of a logarithm, as a part of the value.
fn said(axis: &Axis, deviation: f64) -> String {
    match axis.scale {
        Scale::Log => format!("{} %", significant(100.0 * deviation, 3)),
        Scale::Linear => quantity(deviation, &axis.unit),
    }
}

fn outliers(found: &FleetFit) -> Section {
    let section = Section::new("Outliers");
    let lines = found.outliers();
    if lines.is_empty() {
        return section.text("Every device is of this fleet.");
    }
    lines.into_iter().fold(section, |section, line| {
        section.with(Block::Notice(format!("{line}.")))
    })
}

/// A table of all devices, and a plot a parameter.
fn parameters(found: &FleetFit) -> Section {
    let mut section = Section::new("Devices").text(
        "Each device as its own recordings show it, with its interval of 95 %. The curve is the \
         distribution of a device that nobody has recorded: so many of all devices have less.",
    );
    section = section.with(Block::Table(table(found)));
    for j in 0..found.fleet.axes.len() {
        section = section.with(Block::Plot(plot(found, j)));
    }
    section
}

fn table(found: &FleetFit) -> Table {
    let axes = &found.fleet.axes;
    let titles: Vec<String> = std::iter::once("device".to_string())
        .chain(axes.iter().map(|axis| format!("#{}", axis.name)))
        .collect();
    let mut table = Table::new("", titles.iter().map(String::as_str));
    for device in &found.devices {
        let cells = axes.iter().enumerate().map(|(j, axis)| {
            let mark = if device.judged.outlier == Some(j) {
                "outlier: "
            } else {
                ""
            };
            match shown(device, axis) {
                Some((value, [low, high])) => format!(
                    "{mark}{} ({} to {})",
                    quantity(value, &axis.unit),
                    quantity(low, &axis.unit),
                    quantity(high, &axis.unit)
                ),
                None => "not shown".into(),
            }
        });
        let name = match device.judged.outlier {
            None => device.name.clone(),
            Some(_) => format!("{} (not of this fleet)", device.name),
        };
        let cells: Vec<String> = std::iter::once(name).chain(cells).collect();
        table = table.row(cells);
    }
    table
}

/// Value and interval of a device, where its recordings determine them.
fn shown(device: &FittedDevice, axis: &Axis) -> Option<(f64, [f64; 2])> {
    let found = device
        .fit
        .parameters
        .iter()
        .find(|it| it.name == axis.name)?;
    Some((found.value, found.ci95?))
}

/// The devices in the order of their values beside the quantiles of a new device.
fn plot(found: &FleetFit, j: usize) -> Plot {
    let axis = &found.fleet.axes[j];
    let steps = (0..=STEPS).map(|k| {
        let part = k as f64 / STEPS as f64;
        DRAWN[0] + (DRAWN[1] - DRAWN[0]) * part
    });
    let shares: Vec<f64> = steps.collect();
    let curve: Vec<f64> = shares
        .iter()
        .map(|share| found.fleet.quantile(j, *share))
        .collect();
    let mut devices: Vec<(f64, [f64; 2], bool)> = found
        .devices
        .iter()
        .filter_map(|device| {
            let (value, interval) = shown(device, axis)?;
            Some((value, interval, device.judged.outlier == Some(j)))
        })
        .collect();
    order::sort_up(&mut devices, |device| device.0);
    let count = devices.len() as f64;
    let place = |k: usize| 100.0 * (k as f64 + 0.5) / count;
    let mean = vec![axis.mean; 2];
    let mut plot = Plot::over_time(axis.name.clone())
        .x("devices with less, %", "")
        .y(axis.name.clone(), axis.unit.clone())
        .with(Series::new("mean", Stroke::Dashed, vec![0.0, 100.0], mean).tone(Tone::Ink))
        .with(
            Series::new(
                "95 % of new devices",
                Stroke::Solid,
                shares.iter().map(|share| 100.0 * share).collect(),
                curve,
            )
            .tone(Tone::Blue),
        );
    for (name, tone, outlier) in [
        ("device", Tone::Orange, false),
        ("outlier", Tone::Red, true),
    ] {
        let own = || {
            let all = devices.iter().enumerate();
            all.filter(move |(_, device)| device.2 == outlier)
        };
        if own().next().is_none() {
            continue;
        }
        let points = own().map(|(k, device)| (place(k), device.0)).unzip();
        let lines = own().flat_map(|(k, (_, [low, high], _))| {
            [(place(k), *low), (place(k), *high), (place(k), f64::NAN)]
        });
        let (x, y) = lines.unzip();
        plot = plot
            .with(Series::new(format!("{name}, its 95 %"), Stroke::Solid, x, y).tone(tone))
            .with(Series::new(name, Stroke::Points, points.0, points.1).tone(tone));
    }
    plot
}

/// Correlations of the devices' coordinates, those of few devices made smaller.
fn correlations(found: &FleetFit) -> Section {
    let (axes, covariance) = (&found.fleet.axes, &found.fleet.covariance);
    let section = Section::new("Correlations");
    if axes.len() < 2 {
        return section.text("There is one parameter.");
    }
    let titles: Vec<String> = std::iter::once(String::new())
        .chain(axes.iter().map(|axis| format!("#{}", axis.name)))
        .collect();
    let mut table = Table::new("", titles.iter().map(String::as_str));
    for (row, axis) in axes.iter().enumerate() {
        let cells = (0..axes.len()).map(|column| {
            let size = (covariance[(row, row)] * covariance[(column, column)]).sqrt();
            if size > 0.0 {
                format!("{:.2}", covariance[(row, column)] / size)
            } else {
                "—".into()
            }
        });
        let cells: Vec<String> = std::iter::once(axis.name.clone()).chain(cells).collect();
        table = table.row(cells);
    }
    section
        .text(format!(
            "Of the correlations of {}, {:.0} % were taken away as chance.",
            count(found.population.devices, "device"),
            100.0 * found.population.shrinkage
        ))
        .with(Block::Table(table))
}

/// Deviations of a new device after a second.
fn next_device(found: &FleetFit, second: &OneSecond) -> Section {
    let titles = [
        "parameter",
        "#no recording, fleet",
        "#1 s alone",
        "#1 s and the fleet",
    ];
    let mut table = Table::new("Standard deviation, median of the devices", titles);
    for (j, axis) in found.fleet.axes.iter().enumerate() {
        let deviation = |deviation: f64| {
            if deviation.is_finite() {
                said(axis, deviation)
            } else {
                "not shown".into()
            }
        };
        table = table.row([
            axis.name.clone(),
            deviation(second.fleet[j]),
            deviation(second.alone[j]),
            deviation(second.both[j]),
        ]);
    }
    Section::new("A new device of one second")
        .text(
            "The first second of each device was fitted alone. What the fleet adds to it is what it \
             would add to a new device that is recorded alike: \
             `sinew fit rig.toml --fit NEW.csv --fleet FLEET.toml`.",
        )
        .with(Block::Table(table))
}

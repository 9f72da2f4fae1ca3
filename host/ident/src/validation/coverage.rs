//! Places and speeds where the recordings have been, role by role.

use sinew_sim::Plant;

use super::free::{Free, Model};
use crate::error::Result;
use crate::order;
use crate::report::{Block, Plot, Section, Series, Stroke, Table, Tone, quantity, significant};

/// Points of one role in a plot: more only hide each other.
const POINTS: usize = 1200;
/// Sensors that are drawn at most.
const DRAWN: usize = 4;
/// Roles with their colours, in the order of drawing.
const ROLES: [(&str, Tone); 3] = [
    ("fit", Tone::Blue),
    ("check", Tone::Green),
    ("test", Tone::Orange),
];

/// One column of all recordings, SI.
struct Covered {
    name: String,
    unit: String,
    /// By recording.
    values: Vec<Vec<f64>>,
}

/// The chapter: a table of the recordings, and the rate of each signal over the signal.
///
/// # Errors
/// A column that a recording lacks.
pub(super) fn coverage(plant: &Plant, free: &Free<'_>, best: &Model<'_>) -> Result<Section> {
    let columns = columns(plant, free)?;
    let mut section = Section::new("Coverage of the recordings").text(
        "A model is as good as the places and speeds that its recordings have visited. The share \
         outside is of the samples that lie beyond the range of the fit recordings.",
    );
    section = section
        .with(Block::Table(recordings(free, &columns)))
        .with(Block::Table(ranges(free, &columns)));
    for sensor in 0..plant.sensors().len().min(DRAWN) {
        section = section.with(Block::Plot(rates(free, best, sensor)));
    }
    Ok(section)
}

/// Inputs that are columns, then sensors.
fn columns(plant: &Plant, free: &Free<'_>) -> Result<Vec<Covered>> {
    let mut columns: Vec<Covered> = Vec::new();
    for input in plant.inputs() {
        if columns.iter().any(|column| column.name == input.column) {
            continue;
        }
        let values = free.recordings.iter().map(|(_, recording)| {
            recording.si(&input.column, input.column_factor, &input.wanted_by())
        });
        columns.push(Covered {
            name: input.column.clone(),
            unit: input.unit().to_owned(),
            values: values.collect::<Result<_>>()?,
        });
    }
    for sensor in plant.sensors() {
        let values = free.recordings.iter().map(|(_, r)| r.sensor(sensor));
        columns.push(Covered {
            name: sensor.column.clone(),
            unit: sensor.unit.clone(),
            values: values.collect::<Result<_>>()?,
        });
    }
    Ok(columns)
}

fn range<'a>(values: impl Iterator<Item = &'a f64>) -> Option<[f64; 2]> {
    let finite = values.copied().filter(|value| value.is_finite());
    finite.fold(None, |ends: Option<[f64; 2]>, value| {
        let [low, high] = ends.unwrap_or([value; 2]);
        Some([low.min(value), high.max(value)])
    })
}

/// Duration, rate and missing samples of each recording, and what is new in it.
fn recordings(free: &Free<'_>, columns: &[Covered]) -> Table {
    let titles = [
        "recording",
        "role",
        "#rows",
        "#duration",
        "#rate",
        "#missing",
        "#outside",
    ];
    let mut table = Table::new("Recordings", titles);
    for (index, (role, recording)) in free.recordings.iter().enumerate() {
        let t = recording.t();
        let duration = t
            .last()
            .zip(t.first())
            .map_or(0.0, |(last, first)| last - first);
        let all = || columns.iter().flat_map(|column| &column.values[index]);
        let missing = all().filter(|value| !value.is_finite()).count();
        let share = 100.0 * missing as f64 / all().count().max(1) as f64;
        let outside = columns.iter().map(|column| outside(free, column, index));
        let outside = outside.fold(0.0, f64::max);
        table = table.row([
            recording.name(),
            (*role).to_owned(),
            recording.len().to_string(),
            quantity(duration, "s"),
            quantity((recording.len() - 1) as f64 / duration, "Hz"),
            format!("{} %", significant(share, 2)),
            match *role {
                "fit" => String::new(),
                _ => format!("{} %", significant(100.0 * outside, 2)),
            },
        ]);
    }
    table
}

/// Share of a recording's samples beyond what the fit recordings have met.
fn outside(free: &Free<'_>, column: &Covered, index: usize) -> f64 {
    let of_fit = free.recordings.iter().zip(&column.values);
    let of_fit = of_fit.filter(|((role, _), _)| *role == "fit");
    let Some([low, high]) = range(of_fit.flat_map(|(_, values)| values)) else {
        return 0.0;
    };
    let values = || column.values[index].iter().filter(|v| v.is_finite());
    let beyond = values().filter(|v| !(low..=high).contains(*v)).count();
    beyond as f64 / values().count().max(1) as f64
}

/// Ends of each column, role by role.
fn ranges(free: &Free<'_>, columns: &[Covered]) -> Table {
    let roles: Vec<&str> = ROLES
        .iter()
        .map(|(role, _)| *role)
        .filter(|role| free.recordings.iter().any(|(of, _)| of == role))
        .collect();
    let titles: Vec<String> = std::iter::once("column".to_owned())
        .chain(roles.iter().map(|role| format!("#{role}")))
        .collect();
    let table = Table::new("Ranges", titles.iter().map(String::as_str));
    columns.iter().fold(table, |table, column| {
        let cells = roles.iter().map(|role| {
            let of = free.recordings.iter().zip(&column.values);
            let of = of.filter(|((is, _), _)| is == role);
            range(of.flat_map(|(_, values)| values)).map_or_else(String::new, |[low, high]| {
                let [low, high] = [low, high].map(|end| quantity(end, &column.unit));
                format!("{low} to {high}")
            })
        });
        table.row(std::iter::once(column.name.clone()).chain(cells))
    })
}

/// Rate of a signal over the signal; the rate is the simulation's, which has no noise.
fn rates(free: &Free<'_>, best: &Model<'_>, sensor: usize) -> Plot {
    let known = &best.runs[0].sensors[sensor];
    let mut plot = Plot::over_time(format!("{}: where the recordings have been", known.signal))
        .x(&known.signal, &known.unit)
        .y("rate", format!("{}/s", known.unit));
    for (role, tone) in ROLES {
        let mut points: Vec<(f64, f64)> = Vec::new();
        for ((_, recording), run) in
            (free.recordings.iter().zip(best.runs)).filter(|((is, _), _)| *is == role)
        {
            let (t, of) = (recording.t(), &run.sensors[sensor]);
            for k in 1..t.len().saturating_sub(1) {
                let rate = (of.simulated[k + 1] - of.simulated[k - 1]) / (t[k + 1] - t[k - 1]);
                if rate.is_finite() && of.measured[k].is_finite() {
                    points.push((of.measured[k], rate));
                }
            }
        }
        let stride = points.len().div_ceil(POINTS).max(1);
        let mut points: Vec<(f64, f64)> = points.into_iter().step_by(stride).collect();
        order::sort_up(&mut points, |point| point.0);
        if !points.is_empty() {
            let (x, y) = points.into_iter().unzip();
            plot = plot.with(Series::new(role, Stroke::Points, x, y).tone(tone));
        }
    }
    plot
}

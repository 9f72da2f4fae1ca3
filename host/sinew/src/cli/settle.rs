//! `sinew settle`: where a rig rests under constant inputs.

use std::path::PathBuf;

use clap::Args;
use sinew_sim::{Plant, suggest};

use crate::rests::{Rests, Sweep, json, page, text};
use crate::rig_file;
use sinew_ident::cli::overwrite;
use sinew_ident::cli::said::Said;
use sinew_ident::error::{Error, Result};
use sinew_ident::report::{Provenance, count};

/// Most rests of a sweep.
const MOST_RESTS: usize = 100_000;
/// A sweep as it is written.
const SWEEP: &str = "an input column and its values NAME=FROM:TO:COUNT";
/// An input as it is written.
const INPUT: &str = "an input column and its value NAME=VALUE";

/// Arguments of `sinew settle`.
#[derive(Args)]
#[command(after_long_help = "Examples:\n  \
    sinew settle rig.toml --input u_N=2\n  \
    sinew settle rig.toml --sweep u_N=-20:20:81 --report rests.html\n  \
    sinew settle rig.toml --input u1_kV=4 --json -")]
pub struct Arguments {
    /// The rig file (TOML).
    rig: PathBuf,
    /// Constant value of an input column, in its unit; may be repeated. Others are 0.
    #[arg(long, value_name = "NAME=VALUE", allow_hyphen_values = true)]
    input: Vec<String>,
    /// A rest for each of so many values of an input column, the ends included.
    #[arg(long, value_name = "NAME=FROM:TO:COUNT", allow_hyphen_values = true)]
    sweep: Option<String>,
    /// File for inputs and readings, one line a rest.
    #[arg(long, value_name = "CSV")]
    out: Option<PathBuf>,
    /// File for the rests as JSON (sinew-settle/1); `-` is standard output.
    ///
    /// Holds the derivatives by all free parameters as well.
    #[arg(long, value_name = "JSON")]
    json: Option<PathBuf>,
    /// File for a page: the readings over the swept input, or the one rest.
    #[arg(long, value_name = "HTML")]
    report: Option<PathBuf>,
    /// Print warnings and errors alone.
    #[arg(long)]
    quiet: bool,
}

/// # Errors
/// Bad arguments, a bad rig, a rig that does not rest.
pub fn run(arguments: &Arguments) -> Result<()> {
    overwrite::refuse(
        [("the rig", arguments.rig.as_path())],
        [
            ("--out", arguments.out.as_deref()),
            ("--json", arguments.json.as_deref()),
            ("--report", arguments.report.as_deref()),
        ],
    )?;
    let rig = rig_file::load(&arguments.rig)?;
    let plant = Plant::new(&rig)?;
    if plant.has_imposed_motion() {
        return Err(
            Error::file(&arguments.rig, "a recording imposes a motion of this rig")
                .help("remove `motion_from` to ask where the rig rests"),
        );
    }
    let mut inputs = vec![None; plant.inputs().len()];
    for text in &arguments.input {
        let (name, value) = text.split_once('=').unwrap_or((text, ""));
        let index = input(&plant, "--input", INPUT, name)?;
        if inputs[index].is_some() {
            return Err(twice(name));
        }
        inputs[index] = Some(number("--input", INPUT, text, value)?);
    }
    let sweep = arguments
        .sweep
        .as_deref()
        .map(|text| sweep(&plant, text))
        .transpose()?;
    if let Some(sweep) = &sweep
        && inputs[sweep.input].is_some()
    {
        return Err(twice(&plant.inputs()[sweep.input].column));
    }
    let inputs: Vec<f64> = inputs
        .into_iter()
        .map(|value| value.unwrap_or(0.0))
        .collect();
    let files = [
        arguments.out.as_deref(),
        arguments.json.as_deref(),
        arguments.report.as_deref(),
    ];
    let said = Said::beside(files, arguments.quiet);
    warn_beyond_limits(said, &plant, &inputs, sweep.as_ref());
    let rests = Rests::find(plant, &inputs, sweep)?;
    match &rests.sweep {
        Some(_) => said.line(count(rests.rows.len(), "rest")),
        None => {
            let row = &rests.rows[0];
            said.line(text::table(&rests, row).text().trim_end());
            for line in text::remarks(&rests, row) {
                said.line(line);
            }
        }
    }
    if let Some(path) = &arguments.out {
        sinew_files::write(path, text::csv(&rests))?;
    }
    if let Some(path) = &arguments.json {
        let document = json::json(&rests, &rig.name);
        sinew_files::write(path, format!("{document:#}\n"))?;
    }
    if let Some(path) = &arguments.report {
        page::page(&rests, &rig.name, &Provenance::typed()).write(path)?;
    }
    files
        .into_iter()
        .flatten()
        .for_each(|path| said.wrote(path));
    let rig = arguments.rig.display();
    said.next(match arguments.sweep {
        Some(_) => format!("sinew fit {rig} --static --fit RESTS.csv --out fitted.toml"),
        None => format!("sinew plan {rig} --goal 'NAME = VALUE at 1 s' --out plan.csv"),
    });
    Ok(())
}

fn twice(name: &str) -> Error {
    Error::arguments(format!("the input `{name}` has two values"))
        .help("give each input one --input or one --sweep")
}

/// Index of an input column.
fn input(plant: &Plant, flag: &str, expectation: &str, name: &str) -> Result<usize> {
    let columns = || plant.inputs().iter().map(|input| input.column.as_str());
    columns().position(|column| column == name).ok_or_else(|| {
        let error = Error::must_be(flag, expectation, name);
        match suggest::nearest(name, columns()) {
            Some(near) => error.help(format!("did you mean `{near}`?")),
            None => error.help(format!(
                "the rig's inputs: {}",
                columns().collect::<Vec<_>>().join(", ")
            )),
        }
    })
}

fn number(flag: &str, expectation: &str, whole: &str, text: &str) -> Result<f64> {
    let value = text
        .trim()
        .parse::<f64>()
        .ok()
        .filter(|value| value.is_finite());
    value.ok_or_else(|| Error::must_be(flag, expectation, whole))
}

/// `NAME=FROM:TO:COUNT`.
fn sweep(plant: &Plant, text: &str) -> Result<Sweep> {
    let (name, values) = text.split_once('=').unwrap_or((text, ""));
    let index = input(plant, "--sweep", SWEEP, name)?;
    let parts: Vec<&str> = values.split(':').collect();
    let [from, to, steps] = parts[..] else {
        return Err(Error::must_be("--sweep", SWEEP, text)
            .help(format!("for example --sweep {name}=0:1:21")));
    };
    let ends = [
        number("--sweep", SWEEP, text, from)?,
        number("--sweep", SWEEP, text, to)?,
    ];
    if ends[0] == ends[1] {
        return Err(
            Error::must_be("--sweep", format!("{SWEEP}, FROM and TO apart"), text)
                .help(format!("for one rest --input {name}={from}")),
        );
    }
    let count = steps
        .trim()
        .parse()
        .ok()
        .filter(|count| (2..=MOST_RESTS).contains(count));
    let count = count.ok_or_else(|| {
        let expectation = format!("{SWEEP}, COUNT from 2 to {MOST_RESTS}");
        Error::must_be("--sweep", expectation, text)
    })?;
    Ok(Sweep {
        input: index,
        ends,
        count,
    })
}

/// Warns of what no controller would command.
fn warn_beyond_limits(said: Said, plant: &Plant, inputs: &[f64], sweep: Option<&Sweep>) {
    for (index, input) in plant.inputs().iter().enumerate() {
        let ends = match sweep {
            Some(sweep) if sweep.input == index => sweep.ends,
            _ => [inputs[index]; 2],
        };
        let beyond = |(low, high): (f64, f64)| {
            let outside = |value: &f64| !(low..=high).contains(&(value * input.column_factor));
            ends.iter().any(outside)
        };
        if input.limit.is_some_and(beyond) {
            said.warning(format!(
                "{} goes beyond the limits of `{}`",
                input.column, input.actuator
            ));
        }
    }
}

//! `sinew excite`: an experiment for identification, and what it would reveal.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use sinew_sim::{Plant, Rig};

use super::overwrite;
use super::progress::Stage;
use super::said::Said;
use crate::error::{Error, Result};
use crate::excite::json::json;
use crate::excite::optimal::{Optimal, lines, optimal};
use crate::excite::reveal::{self, Revelation};
use crate::excite::{Experiment, Kind, Options, design, table};
use crate::report::count;

/// Shapes of the inputs, by their names on the command line.
#[derive(Clone, Copy, ValueEnum)]
enum Shape {
    /// Sines of many frequencies at once, each input with frequencies of its own.
    Multisine,
    /// Levels at random, held for times at random.
    Steps,
    /// Slow triangles that grow: small and large loops, almost without inertia.
    Triangle,
    /// A sine whose frequency rises.
    Chirp,
    /// A quarter of each.
    Mixed,
}

impl From<Shape> for Kind {
    fn from(shape: Shape) -> Self {
        match shape {
            Shape::Multisine => Self::Multisine,
            Shape::Steps => Self::Steps,
            Shape::Triangle => Self::Triangle,
            Shape::Chirp => Self::Chirp,
            Shape::Mixed => Self::Mixed,
        }
    }
}

/// Arguments of `sinew excite`.
#[derive(Args)]
pub struct Arguments {
    /// The rig file (TOML); its actuators' limits are kept.
    pub rig: PathBuf,
    /// File for the input columns, which `sinew simulate --input` and a test bench take.
    #[arg(long, value_name = "CSV")]
    out: PathBuf,
    /// Shape of the inputs.
    #[arg(long, value_enum, default_value_t = Shape::Mixed)]
    kind: Shape,
    /// Search for the experiment that shows the hardest effects best.
    ///
    /// It is compared with every kind, and reported beside them.
    #[arg(long, conflicts_with_all = ["kind", "no_table"])]
    design: bool,
    /// Designs that `--design` simulates whole, beside the five kinds.
    #[arg(long, value_name = "N", default_value_t = 300, requires = "design")]
    evaluations: usize,
    /// Duration, s.
    #[arg(long, default_value_t = 30.0)]
    seconds: f64,
    /// Samples a second; without it the rig's `rate_hz`, or 120.
    #[arg(long, value_name = "HZ")]
    rate: Option<f64>,
    /// Seed of everything that is drawn.
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Fraction of each input's range that is used, about its middle.
    #[arg(long, value_name = "FRACTION", default_value_t = 0.8)]
    amplitude: f64,
    /// Lowest and highest frequency of its sines.
    ///
    /// Without it, two periods in all and a twelfth of the rate.
    #[arg(long, value_name = "LOW,HIGH")]
    band: Option<String>,
    /// Noise of the sensors that is reckoned with, as a fraction of what each signal ranges over.
    #[arg(long, value_name = "FRACTION", default_value_t = 0.005)]
    noise: f64,
    /// Write the inputs only, without measuring what they would reveal.
    #[arg(long)]
    no_table: bool,
    /// File for the experiment and what it would reveal as JSON (sinew-excite/1).
    ///
    /// `-` is standard output.
    #[arg(long, value_name = "JSON")]
    json: Option<PathBuf>,
    /// Print warnings and errors alone.
    #[arg(long)]
    quiet: bool,
}

/// Designs the experiment; without `--rate` at the control rate of the rig, where it has one.
///
/// # Errors
/// Bad arguments, a bad rig, one without limits or one that cannot be simulated.
pub fn run(arguments: &Arguments, control_rate_hz: Option<f64>) -> Result<()> {
    overwrite::refuse(
        [("the rig", arguments.rig.as_path())],
        [
            ("--out", Some(arguments.out.as_path())),
            ("--json", arguments.json.as_deref()),
        ],
    )?;
    let rig = Rig::load(&arguments.rig)?;
    let plant = Plant::new(&rig)?;
    let options = Options {
        kind: arguments.kind.into(),
        seconds: arguments.seconds,
        rate_hz: arguments.rate.or(control_rate_hz).unwrap_or(120.0),
        seed: arguments.seed,
        amplitude: arguments.amplitude,
        band_hz: arguments.band.as_deref().map(band).transpose()?,
    };
    let (experiment, revelation, compared) = if arguments.design {
        let found = searched(&rig, &options, arguments)?;
        (
            found.experiment,
            Some(found.revelation),
            Some(found.comparison),
        )
    } else {
        let experiment = design(&plant, &arguments.rig, &options)?;
        let found = (!arguments.no_table)
            .then(|| measured(&rig, &experiment, arguments))
            .transpose()?;
        (experiment, found, None)
    };
    experiment
        .recording(&plant, &arguments.out)?
        .write(&arguments.out)?;
    let said = Said::beside(
        [Some(arguments.out.as_path()), arguments.json.as_deref()],
        arguments.quiet,
    );
    if let Some(found) = &revelation {
        said.line(table(found).trim_end());
    }
    if let (Some(compared), Some(found)) = (&compared, &revelation) {
        said.line(lines(compared, found).trim_end());
    }
    said.line(format!(
        "{} of {} in {}",
        count(experiment.t.len(), "row"),
        count(experiment.inputs.len(), "input"),
        arguments.out.display()
    ));
    if let Some(path) = &arguments.json {
        let inputs = plant.inputs().iter().map(|input| input.column.as_str());
        let document = json(
            &experiment,
            &inputs.collect::<Vec<_>>(),
            revelation.as_ref(),
            compared.as_ref(),
        );
        sinew_files::write(path, format!("{document:#}\n"))?;
        said.wrote(path);
    }
    if !sinew_files::is_output(&arguments.out) {
        said.next(format!(
            "sinew record --port PORT --model DIR --input {} --out A.csv",
            arguments.out.display()
        ));
    }
    Ok(())
}

/// Searches for the experiment that shows most.
fn searched(rig: &Rig, options: &Options, arguments: &Arguments) -> Result<Optimal> {
    let stage = Stage::begin("search for the best experiment", arguments.quiet);
    let effort = (arguments.noise, arguments.evaluations);
    let found = optimal(rig, &arguments.rig, options, effort, &|done, of| {
        stage.share(done, of, "parts simulated");
    })?;
    stage.end(format!("{} tried", count(arguments.evaluations, "design")));
    Ok(found)
}

/// Measures what an experiment would reveal.
fn measured(rig: &Rig, experiment: &Experiment, arguments: &Arguments) -> Result<Revelation> {
    let stage = Stage::begin("measure what it would reveal", arguments.quiet);
    let found = reveal::reveal(rig, experiment, arguments.noise, &|done, of| {
        stage.share(done, of, "effects tried");
    })?;
    stage.end(format!("{} tried", count(found.effects.len(), "effect")));
    Ok(found)
}

/// `LOW,HIGH`.
fn band(text: &str) -> Result<[f64; 2]> {
    let ends = text
        .split_once(',')
        .map(|(a, b)| (a.trim().parse(), b.trim().parse()));
    match ends {
        Some((Ok(low), Ok(high))) => Ok([low, high]),
        _ => Err(
            Error::must_be("--band", "two frequencies LOW,HIGH in Hz", text)
                .help("for example --band 0.1,10"),
        ),
    }
}

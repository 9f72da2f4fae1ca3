//! `sinew prefer`: the weights that a person prefers, by ten questions "which loop is better?".

use std::io::{BufRead, IsTerminal};
use std::path::{Path, PathBuf};

use clap::Args;
use serde_json::json;
use sinew_model::fingerprint;
use sinew_model::spec::{ControlSpec, ModelSpec};
use sinew_prefer::{Candidates, Winner, predicted, two_people};

use super::conditions::Conditions;
use super::{Common, Recordings, recording_flags};
use crate::closed_loop::model_loop::ModelLoop;
use crate::pipeline::learn::save;
use crate::preference::{Document, Feature, Given, Loop, Settings, ask, candidates, pair_page};
use crate::project::{self, Board};
use crate::rig_file;
use crate::tuning::control_table::controlled;
use sinew_ident::cli::overwrite;
use sinew_ident::cli::said::Said;
use sinew_ident::error::{Error, Result};
use sinew_ident::report::{Provenance, Table, count, significant};

/// Fewest answers of which it is said that no feature explains them.
const ENOUGH: usize = 8;

/// Arguments of `sinew prefer`.
#[derive(Args)]
#[command(after_long_help = "Examples:\n  \
    sinew prefer rig.toml model --fit fit.csv --answers answers.json --page pair.html --out mine.toml\n  \
    sinew prefer rig.toml model --fit fit.csv --answers answers.json --who anna --out anna.toml")]
pub struct Arguments {
    /// The rig file (TOML), fitted.
    rig: PathBuf,
    /// Folder of the model: model.toml and weights.safetensors.
    model: PathBuf,
    #[command(flatten)]
    recordings: Recordings,
    /// File of candidates and answers (sinew-preferences/1).
    ///
    /// It is made where there is none, else continued.
    #[arg(long, value_name = "JSON")]
    answers: PathBuf,
    /// Name of the person who answers.
    #[arg(long, value_name = "NAME", default_value = "me")]
    who: String,
    /// Most questions of this session.
    ///
    /// It ends before, where no answer would change the winner.
    #[arg(long, value_name = "COUNT", default_value_t = 10)]
    questions: usize,
    /// Loops that are compared: the model's own weights and others about them.
    ///
    /// A file of answers keeps its own.
    #[arg(long, value_name = "COUNT", default_value_t = 48)]
    candidates: usize,
    /// Page with the two loops of the question, written anew for each.
    #[arg(long, value_name = "HTML")]
    page: Option<PathBuf>,
    /// File for the rig with the preferred [control] table.
    ///
    /// The rig's own text and comments are kept.
    #[arg(long, value_name = "TOML")]
    out: PathBuf,
    /// Folder for the model with the preferred weights, for `compare`, `pil` and `emit`.
    #[arg(long, value_name = "DIR")]
    model_out: Option<PathBuf>,
    /// File for the weights as JSON (sinew-preferred/1); `-` is standard output.
    #[arg(long, value_name = "JSON")]
    json: Option<PathBuf>,
    #[command(flatten)]
    conditions: Conditions,
    /// Folder of cargo's build outputs, if they are to be kept.
    #[arg(long, value_name = "DIR", env = "SINEW_BUILD_DIR")]
    build_dir: Option<PathBuf>,
    #[command(flatten)]
    common: Common,
}

/// # Errors
/// A bad file, a model that does not fit the rig, answers about another model.
pub fn run(arguments: &Arguments) -> Result<()> {
    refuse(arguments)?;
    let rig = rig_file::load(&arguments.rig)?;
    let Recordings { fit, test } = &arguments.recordings;
    let (seed, quiet) = (arguments.common.seed, arguments.common.quiet);
    let mut ready = ModelLoop::load(&arguments.rig, None, fit, test, seed, quiet)?;
    arguments.conditions.apply(&mut ready, quiet)?;
    let spec = ready.model(&arguments.model)?;
    let kept = Document::read(&arguments.answers)?;
    project::ready(Board::Host)?;
    let (mut document, loops) = asked_about(arguments, &ready, &spec, kept)?;
    let features: Vec<Vec<f64>> = loops.iter().map(|it| it.features.0.clone()).collect();
    let known = Candidates::new(&features).map_err(|e| Error::failed(e.to_string()))?;

    let said = Said::beside(
        [Some(arguments.out.as_path()), arguments.json.as_deref()],
        arguments.common.quiet,
    );
    let sheet = Sheet {
        rig: &rig.name,
        ready: &ready,
        loops: &loops,
        page: arguments.page.as_deref(),
        made: Provenance::typed().seed(arguments.common.seed),
        said,
    };
    let who = &arguments.who;
    let stdin = std::io::stdin();
    let talk = stdin.is_terminal();
    let mut input: Box<dyn BufRead> = Box::new(stdin.lock());
    let before = document.of(who);
    let asked = ask(
        &known,
        before,
        (arguments.questions, arguments.common.seed),
        &mut *input,
        &mut |number, a, b| sheet.show((number, arguments.questions), [a, b], talk),
        &mut |answer, winner| {
            document.answers.push(Given::new(who, answer));
            document.write(&arguments.answers)?;
            said.line(format!("best so far: {}", odds(winner)));
            Ok(())
        },
    )?;
    document.write(&arguments.answers)?;

    let chosen = &loops[asked.winner.index];
    let control = ControlSpec {
        tracking_weight: chosen.weights.tracking_weight.clone(),
        move_suppression: chosen.weights.move_suppression.clone(),
        disturbance_gain: chosen.weights.disturbance_gain,
        ..spec.control.clone()
    };
    sinew_files::write(&arguments.out, controlled(&rig, &control)?.to_toml())?;
    if let Some(folder) = &arguments.model_out {
        let liked = ModelSpec {
            control: control.clone(),
            ..spec.clone()
        };
        save(folder, &liked)?;
    }
    said.line(format!(
        "{who}, {}: {}",
        count(asked.answers.len(), "answer"),
        odds(asked.winner)
    ));
    if asked.settled {
        said.line("No further answer would change that.");
    }
    said.line(
        sheet
            .table([0, asked.winner.index], ["the model's own", "preferred"])
            .text()
            .trim_end(),
    );
    said.line(settings(&control));
    let right = predictions(&known, &asked.answers, arguments.common.seed)?;
    if let Some(right) = right.filter(|_| asked.answers.len() >= ENOUGH) {
        said.line(expectation(right));
    }
    let apart = others(&document, &known, who, arguments.common.seed)?;
    for (name, is) in &apart {
        said.line(if *is {
            format!("{name} wants something else: one choice does not explain both. Ask {name} for a table of their own (--who {name}).")
        } else {
            format!("{name}'s answers agree with these.")
        });
    }
    said.wrote(&arguments.answers);
    said.wrote(&arguments.out);
    if let Some(path) = &arguments.json {
        let value = json!({
            "format": "sinew-preferred/1",
            "who": who,
            "answers": asked.answers.len(),
            "settled": asked.settled,
            "odds": asked.winner.odds,
            "expected_regret": asked.winner.regret,
            "expected_answers": right.map(|(hits, _)| hits),
            "apart": apart.iter().map(|(name, is)| json!({ "who": name, "apart": is })).collect::<Vec<_>>(),
            "control": {
                "tracking_weight": control.tracking_weight,
                "move_suppression": control.move_suppression,
                "disturbance_gain": control.disturbance_gain,
            },
            "features": Feature::ALL.iter().zip(&chosen.features.0)
                .map(|(feature, value)| (feature.key.to_owned(), json!(value)))
                .collect::<serde_json::Map<_, _>>(),
        });
        sinew_files::write(path, format!("{value:#}\n"))?;
        said.wrote(path);
    }
    if let Some(model) = &arguments.model_out {
        said.next(format!(
            "sinew compare {} {}{} --out loop",
            arguments.out.display(),
            model.display(),
            recording_flags(&arguments.recordings)
        ));
    }
    Ok(())
}

/// The candidates of a file of answers, or of a new one, with their loops.
fn asked_about(
    arguments: &Arguments,
    ready: &ModelLoop,
    spec: &ModelSpec,
    kept: Option<Document>,
) -> Result<(Document, Vec<Loop>)> {
    let model = format!("{:08x}", fingerprint(spec));
    let (seed, drawn) = kept
        .as_ref()
        .map_or((arguments.common.seed, arguments.candidates), |kept| {
            (kept.seed, kept.drawn)
        });
    let other = |what: &str| {
        Error::file(&arguments.answers, format!("its answers are about {what}"))
            .help("name another file with --answers, or move this one away to begin again")
    };
    if kept.as_ref().is_some_and(|kept| kept.model != model) {
        return Err(other("another model"));
    }
    let bench = ready.bench();
    // A person is shown the fitted plant and a reference that no comparison reports on.
    let scenarios = bench.tuning_scenarios(&bench.tuning_plants(1))?;
    let scenario = scenarios
        .first()
        .ok_or_else(|| Error::failed("there is no loop to show"))?;
    let folder = tempfile::tempdir()
        .map_err(|e| Error::failed(format!("no temporary folder can be made: {e}")))?;
    let cache = arguments.build_dir.as_deref();
    let loops = candidates(
        spec,
        (&ready.task, scenario),
        (drawn, seed),
        (folder.path(), cache, arguments.common.quiet),
    )?;
    let settings = loops
        .iter()
        .map(|it| Settings::of(&it.weights, &it.features.0))
        .collect();
    let made = Document::new(model, (seed, drawn), settings);
    match kept {
        None => Ok((made, loops)),
        Some(kept) if alike(&kept, &made) => Ok((kept, loops)),
        Some(_) => Err(other(
            "other loops: of other recordings, conditions or another rig",
        )),
    }
}

/// Tells whether two documents are about the same loops; text keeps all but the last digits.
fn alike(a: &Document, b: &Document) -> bool {
    let near = |a: &[f64], b: &[f64]| {
        let close = |(a, b): (&f64, &f64)| (a - b).abs() <= 1e-6 * a.abs().max(b.abs());
        a.len() == b.len() && a.iter().zip(b).all(close)
    };
    let same = |(a, b): (&Settings, &Settings)| {
        near(&a.features, &b.features) && near(&a.move_suppression, &b.move_suppression)
    };
    a.features == b.features
        && a.candidates.len() == b.candidates.len()
        && a.candidates.iter().zip(&b.candidates).all(same)
}

/// Tables and pages of two loops.
struct Sheet<'a> {
    rig: &'a str,
    ready: &'a ModelLoop,
    loops: &'a [Loop],
    page: Option<&'a Path>,
    made: Provenance,
    said: Said,
}

impl Sheet<'_> {
    fn table(&self, pair: [usize; 2], titles: [&str; 2]) -> Table {
        let (task, sensors) = (&self.ready.task, self.ready.plant.sensors());
        let unit = task
            .outputs
            .first()
            .map_or("", |s| sensors[*s].unit.as_str());
        let [a, b] = titles.map(|title| format!("#{title}"));
        let mut table = Table::new("", ["loop", &a, &b]);
        for (i, feature) in Feature::ALL.iter().enumerate() {
            let [a, b] = pair.map(|k| self.loops[k].features.text(i, task, unit));
            table = table.row([feature.name.to_owned(), a, b]);
        }
        table
    }

    /// Shows a question: table, page, and the line that asks.
    fn show(&self, (number, most): (usize, usize), pair: [usize; 2], talk: bool) -> Result<()> {
        let table = self.table(pair, ["A", "B"]);
        let say = |text: String| {
            if talk {
                self.said.question(text);
            } else {
                self.said.line(text);
            }
        };
        say(format!("\nquestion {number} of at most {most}"));
        say(table.text().trim_end().to_string());
        if let Some(path) = self.page {
            let plant = &self.ready.plant;
            let (sensors, inputs) = (plant.sensors(), plant.inputs());
            let outputs = self.ready.task.outputs.iter();
            let outputs: Vec<(&str, &str)> = outputs
                .map(|s| (sensors[*s].column.as_str(), sensors[*s].unit.as_str()))
                .collect();
            let inputs: Vec<(&str, &str)> = inputs
                .iter()
                .map(|i| (i.column.as_str(), i.unit()))
                .collect();
            let loops = pair.map(|k| &self.loops[k]);
            pair_page(self.rig, loops, &outputs, &inputs, table, &self.made).write(path)?;
            say(format!("plots: {}", path.display()));
        }
        if talk {
            self.said
                .question("Which is better? a, b, = (alike), q (enough)");
        }
        Ok(())
    }
}

/// The winner with its odds, in words.
fn odds(winner: Winner) -> String {
    format!(
        "loop {}; odds that none is better {:.0} %; expected loss {:.0} % of the way from a \
         middling loop to the best",
        winner.index,
        100.0 * winner.odds,
        100.0 * winner.regret
    )
}

fn settings(control: &ControlSpec) -> String {
    let list = |values: &[f64]| {
        let texts: Vec<String> = values.iter().map(|v| significant(*v, 3)).collect();
        format!("[{}]", texts.join(", "))
    };
    format!(
        "MPC: Q {}, Lambda {}, disturbance gain {}",
        list(&control.tracking_weight),
        list(&control.move_suppression),
        significant(control.disturbance_gain, 3)
    )
}

/// Answers that were more probable beforehand than by chance, and their number; `None` without any.
fn predictions(
    known: &Candidates,
    answers: &[sinew_prefer::Answer],
    seed: u64,
) -> Result<Option<(usize, usize)>> {
    let all = predicted(known, answers, seed).map_err(|e| Error::failed(e.to_string()))?;
    // The first questions are asked of a person of whom nothing is known.
    let later = all.get(2..).unwrap_or_default();
    let hits = later.iter().filter(|p| **p > 0.5).count();
    Ok((!later.is_empty()).then_some((hits, later.len())))
}

fn expectation((hits, of): (usize, usize)) -> String {
    if 2 * hits > of {
        format!("{hits} of {of} answers were expected beforehand.")
    } else {
        format!(
            "{hits} of {of} answers were expected beforehand, no more than by chance: these \
             features do not show what you judge by, and the choice means little."
        )
    }
}

/// The other people of a file, and whether they want something else.
fn others(
    document: &Document,
    known: &Candidates,
    who: &str,
    seed: u64,
) -> Result<Vec<(String, bool)>> {
    let own = document.of(who);
    let others = document.people().into_iter().filter(|name| *name != who);
    let apart = |name: &str| -> Result<(String, bool)> {
        let evidence = two_people(known, &own, &document.of(name), seed);
        let evidence = evidence.map_err(|e| Error::failed(e.to_string()))?;
        Ok((name.to_owned(), evidence.apart()))
    };
    others.map(apart).collect()
}

/// Before anything is read: what would be overwritten, and counts that ask nothing.
fn refuse(arguments: &Arguments) -> Result<()> {
    let Recordings { fit, test } = &arguments.recordings;
    arguments.conditions.refuse()?;
    let recordings = fit
        .iter()
        .chain(test)
        .chain(&arguments.conditions.reference)
        .map(|path| ("a recording", path.as_path()));
    let file = |folder: &PathBuf| folder.join(sinew_model::store::MODEL_FILE);
    let model = file(&arguments.model);
    let model_out = arguments.model_out.as_ref().map(file);
    overwrite::refuse(
        recordings.chain([
            ("RIG", arguments.rig.as_path()),
            ("MODEL", arguments.model.as_path()),
            ("MODEL", model.as_path()),
        ]),
        [
            ("--answers", Some(arguments.answers.as_path())),
            ("--out", Some(arguments.out.as_path())),
            ("--model-out", model_out.as_deref()),
            ("--json", arguments.json.as_deref()),
            ("--page", arguments.page.as_deref()),
        ],
    )?;
    const MOST: usize = 500;
    if !(2..=MOST).contains(&arguments.candidates) {
        let expectation = format!("2 to {MOST}");
        return Err(
            Error::must_be("--candidates", expectation, arguments.candidates)
                .help("for example --candidates 48, the default"),
        );
    }
    if arguments.who.trim().is_empty() {
        return Err(
            Error::must_be("--who", "a name", format!("{:?}", arguments.who))
                .help("for example --who anna"),
        );
    }
    Ok(())
}

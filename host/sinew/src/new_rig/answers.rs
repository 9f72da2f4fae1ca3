//! Answers that the columns do not give: from options, from a person, or guessed.

use super::columns::Columns;
use super::{Motion, NewRigOptions, Terminal};
use sinew_ident::error::{Error, Result};
use sinew_ident::recording::Recording;

/// Everything that the rig's text needs beside the columns.
#[derive(Debug)]
pub(super) struct Answers {
    pub name: String,
    pub motion: Motion,
    pub inertia: f64,
    /// Somebody said so; otherwise the text calls it a guess.
    pub inertia_known: bool,
    /// `None`: nobody knows.
    pub spring: Option<bool>,
}

impl Answers {
    pub fn collect(
        options: &NewRigOptions,
        recording: &Recording,
        columns: &Columns,
        mut terminal: Option<Terminal>,
    ) -> Result<Self> {
        let stem = recording.path().file_stem().map_or_else(
            || "device".into(),
            |stem| stem.to_string_lossy().into_owned(),
        );
        let name = options.name.clone().unwrap_or(stem);
        let motion = match options.motion.or(columns.motion) {
            Some(motion) => motion,
            None => {
                let question = "Does it move along a line (no: about an axis)? [Y/n] ";
                match ask_either(&mut terminal, question)? {
                    Some(false) => Motion::Hinge,
                    Some(true) | None => Motion::Slide,
                }
            }
        };
        let (guess, unit) = match motion {
            Motion::Slide => (1.0, "kg"),
            Motion::Hinge => (0.01, "kg m^2"),
        };
        let told = match options.inertia {
            Some(inertia) => Some(inertia),
            None => ask_number(
                &mut terminal,
                &format!("How heavy is what moves, roughly, in {unit}?"),
            )?,
        };
        let spring = match options.spring {
            Some(spring) => Some(spring),
            None => ask_either(
                &mut terminal,
                "Does a spring, or its own elasticity, pull it back? [y/n, return: I do not know] ",
            )?,
        };
        Ok(Self {
            name,
            motion,
            inertia: told.unwrap_or(guess),
            inertia_known: told.is_some(),
            spring,
        })
    }
}

/// Yes or no; `None` where nobody is there or nothing is typed.
fn ask_either(terminal: &mut Option<Terminal>, question: &str) -> Result<Option<bool>> {
    loop {
        let Some(answer) = ask(terminal, question)? else {
            return Ok(None);
        };
        match answer.to_lowercase().as_str() {
            "" => return Ok(None),
            "y" | "yes" => return Ok(Some(true)),
            "n" | "no" => return Ok(Some(false)),
            _ => {}
        }
    }
}

/// A positive number; `None` where nobody is there or nothing is typed.
fn ask_number(terminal: &mut Option<Terminal>, question: &str) -> Result<Option<f64>> {
    loop {
        let Some(answer) = ask(terminal, &format!("{question} [return: I do not know] "))? else {
            return Ok(None);
        };
        if answer.is_empty() {
            return Ok(None);
        }
        match answer.parse::<f64>() {
            Ok(value) if value.is_finite() && value > 0.0 => return Ok(Some(value)),
            _ => {}
        }
    }
}

/// One line; `None` without a terminal and at its end.
fn ask(terminal: &mut Option<Terminal>, question: &str) -> Result<Option<String>> {
    let Some(Terminal { input, output }) = terminal else {
        return Ok(None);
    };
    let mut line = String::new();
    let read = write!(output, "{question}")
        .and_then(|()| output.flush())
        .and_then(|()| input.read_line(&mut line));
    match read {
        Ok(0) => Ok(None),
        Ok(_) => Ok(Some(line.trim().to_owned())),
        Err(error) => Err(
            Error::failed(format!("the terminal does not answer: {error}"))
                .help("use flags and --yes"),
        ),
    }
}

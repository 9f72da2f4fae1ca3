//! Errors: a file that cannot be understood, and a simulation that cannot be run.

use std::fmt;

/// A rig file that was refused, with the place in it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Error {
    /// The file as the user named it.
    pub file: String,
    /// Line, from 1; none when the whole file is meant.
    pub line: Option<usize>,
    /// Column in characters, from 1.
    pub column: Option<usize>,
    /// The fault, and what was expected.
    pub message: String,
    /// The name that was probably meant, or what would be right.
    pub help: Option<String>,
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:", self.file)?;
        if let Some(line) = self.line {
            write!(f, "{line}:")?;
        }
        if let (Some(_), Some(column)) = (self.line, self.column) {
            write!(f, "{column}:")?;
        }
        write!(f, " {}", self.message)?;
        if let Some(help) = &self.help {
            write!(f, "\n  help: {help}")?;
        }
        Ok(())
    }
}

impl std::error::Error for Error {}

/// A body of a rig and where its inertia stands in the rig's file: what to look at when it cannot
/// be simulated.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BodyPlace {
    /// The file as the user named it.
    pub file: String,
    /// Line, from 1.
    pub line: usize,
    /// The body's name.
    pub body: String,
}

/// A simulation that was refused or stopped.
///
/// ```
/// # let text = "format='sinew-rig/1'\nname='x'\n[[body]]\nname='m'\nmotion='slide'\ninertia=2.0\n";
/// use sinew_sim::{BodyPlace, InputTrajectory, Plant, Rig, SimulationError};
/// let plant = Plant::new(&Rig::parse(text, "x.toml")?)?;
/// let drive = InputTrajectory::new(&plant, 2, &[])?;
/// let refused = plant.simulate(&[-2.0], &[0.0, 0.0], &drive, &[0.0, 0.1]).unwrap_err();
/// let at = BodyPlace { file: "x.toml".into(), line: 6, body: "m".into() };
/// assert_eq!(refused, SimulationError::Inertia { at, value: -2.0 });
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub enum SimulationError {
    /// A slice of the wrong length.
    Shape {
        /// Name of the slice.
        what: String,
        /// The length that the plant has.
        expected: usize,
        /// The length that was given.
        found: usize,
    },
    /// A parameter value, state or input that is infinite or NaN.
    NotFinite {
        /// Name of the number.
        what: String,
    },
    /// A body whose inertia is zero or negative: its acceleration is not determined.
    Inertia {
        /// The body.
        at: BodyPlace,
        /// Its inertia, kg or kg m^2.
        value: f64,
    },
    /// Times that do not strictly increase.
    Time {
        /// The row, from 0, whose time is not after the one before it.
        row: usize,
    },
    /// The fastest motion of the rig needs more sub-steps per sample than are allowed.
    TooStiff {
        /// The body where the fastest motion sits.
        at: BodyPlace,
        /// Bound on the largest rate, 1/s.
        rate: f64,
        /// The interval between two samples, s.
        interval: f64,
        /// Most sub-steps that are taken in it.
        most: usize,
    },
    /// An input column without one valid sample.
    NoInput {
        /// The column's name.
        column: String,
    },
    /// A column that imposes a motion, with fewer than six valid samples.
    TooFewSamples {
        /// Name of the column.
        column: String,
    },
    /// No unique stable rest under constant inputs.
    NoRest {
        /// The body that moves most in the direction in question.
        at: BodyPlace,
        /// Reason.
        reason: NoRest,
    },
    /// The state became infinite or NaN.
    Diverged {
        /// The first body that did.
        at: BodyPlace,
        /// When, s.
        time: f64,
    },
}

/// Reason for which a plant has no unique stable rest under constant inputs.
///
/// ```
/// # let text = "format='sinew-rig/1'\nname='x'\n[[body]]\nname='m'\nmotion='slide'\ninertia=2.0\n";
/// use sinew_sim::{NoRest, Plant, Rig, SimulationError};
/// let plant = Plant::new(&Rig::parse(text, "x.toml")?)?;
/// let refused = plant.rest(&plant.values(), &[], &[0.0, 0.0]).unwrap_err();
/// assert!(matches!(refused, SimulationError::NoRest { reason: NoRest::Free, .. }));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoRest {
    /// No spring, tendon or stop holds the body: it rests anywhere, or nowhere.
    Free,
    /// The forces balance, but a small push leaves the balance.
    Unstable,
    /// The search did not end.
    NotFound {
        /// Steps that were taken.
        steps: usize,
    },
    /// A recording imposes the body's motion.
    Imposed,
}

impl fmt::Display for NoRest {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Free => write!(
                f,
                "no spring, taut tendon or stop holds it under these inputs, so that it rests \
                 anywhere or nowhere\n  help: add what holds it, or an input that pulls a tendon \
                 taut; dry friction alone does not fix a rest"
            ),
            Self::Unstable => write!(
                f,
                "the forces balance where a small push leads away\n  help: start elsewhere, or is \
                 something soft below zero there?"
            ),
            Self::NotFound { steps } => write!(
                f,
                "no balance of forces was found in {steps} steps\n  help: are the inputs within \
                 their limits?"
            ),
            Self::Imposed => write!(f, "a recording imposes its motion"),
        }
    }
}

impl fmt::Display for SimulationError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Shape {
                what,
                expected,
                found,
            } => write!(f, "{what}: expected {expected} numbers, found {found}"),
            Self::NotFinite { what } => write!(f, "{what} is not a finite number"),
            Self::Inertia { at, value } => write!(
                f,
                "{}:{}: body `{}` cannot be simulated: its inertia is {value}, and a force on it would \
                 have no finite acceleration",
                at.file, at.line, at.body
            ),
            Self::Time { row } => write!(
                f,
                "time does not increase at row {} of the samples",
                row + 1
            ),
            Self::TooStiff {
                at,
                rate,
                interval,
                most,
            } => write!(
                f,
                "{}:{}: too stiff to simulate: the fastest motion, at body `{}`, has a rate of up to \
                 {rate:.3e} 1/s, which needs more than {most} steps in a sample interval of \
                 {interval} s\n  help: is this inertia too small, or the stiffness or damping at `{}` \
                 too large?",
                at.file, at.line, at.body, at.body
            ),
            Self::NoInput { column } => {
                write!(f, "input column `{column}` has no valid sample to hold")
            }
            Self::TooFewSamples { column } => write!(
                f,
                "column `{column}`, which imposes a motion, has fewer than the six valid samples that \
                 are needed to smooth it"
            ),
            Self::NoRest { at, reason } => write!(
                f,
                "{}:{}: body `{}` has no unique rest: {reason}",
                at.file, at.line, at.body
            ),
            Self::Diverged { at, time } => write!(
                f,
                "{}:{}: the simulation left the finite numbers at t = {time} s, at body `{}`: with these \
                 parameter values the rig is unstable\n  help: is something at `{}` soft below zero, or \
                 driven without limit?",
                at.file, at.line, at.body, at.body
            ),
        }
    }
}

impl std::error::Error for SimulationError {}

//! The one error of the library: what went wrong, where, and what would mend it.
//!
//! Every message follows one form, so that a terminal, an editor and a person can all use it:
//! ```text
//! recording.csv:17:9: `1,3` is not a number
//!   expected: a decimal number such as -1.25e-3, or nothing (a missing sample)
//!   help: write the decimal point as `.`
//! ```
//! Lines and columns count from 1; the column counts characters. Only `main` turns an error into an
//! exit status, by [`Error::exit_code`].

use std::fmt;
use std::path::{Path, PathBuf};

use sinew_files::FileError;
use sinew_sim::SimulationError;
use sinew_sim::suggest::nearest_file;

/// Result of every fallible function of this crate.
pub type Result<T> = std::result::Result<T, Error>;

/// Why a command could not do its work. Opaque on purpose: look at [`Error::kind`].
///
/// ```
/// # use sinew_ident::error::Error;
/// let error = Error::arguments("no recording to fit the rig to").help("name one with --fit");
/// assert_eq!(
///     error.to_string(),
///     "no recording to fit the rig to\n  help: name one with --fit"
/// );
/// assert_eq!(error.exit_code(), 2);
/// assert_eq!(Error::failed("the firmware stopped").exit_code(), 1);
/// ```
#[derive(Debug)]
pub struct Error(Box<Kind>);

/// The kinds of failure; they decide the exit status.
#[derive(Debug)]
#[non_exhaustive]
pub enum Kind {
    /// The command line asks for something that cannot be had.
    Arguments(Complaint),
    /// A file of the user's says something that cannot be used.
    File(Complaint),
    /// A file of the user's was refused by its own reader.
    Refused(Box<dyn std::error::Error + Send + Sync>),
    /// A file of the user's cannot be read.
    Read {
        /// The file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
        /// The likely fix.
        help: Option<String>,
    },
    /// A result cannot be written.
    Write {
        /// The file or folder.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
        /// The likely fix.
        help: Option<String>,
    },
    /// A rig file that was refused, with its place.
    Rig(sinew_sim::Error),
    /// A simulation that was refused or stopped.
    Simulation(SimulationError),
    /// Everything asked was sound, and still it did not work out.
    Failed(Complaint),
    /// The person in front of it stopped it.
    Interrupted,
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let io = |f: &mut fmt::Formatter<'_>,
                  path: &Path,
                  what: &str,
                  source: &std::io::Error,
                  help: &Option<String>| {
            let help = HelpLine(help.as_deref());
            write!(f, "{}: cannot be {what}: {source}{help}", path.display())
        };
        match &*self.0 {
            Kind::Arguments(complaint) | Kind::File(complaint) | Kind::Failed(complaint) => {
                complaint.fmt(f)
            }
            Kind::Refused(source) => source.fmt(f),
            Kind::Read { path, source, help } => io(f, path, "read", source, help),
            Kind::Write { path, source, help } => io(f, path, "written", source, help),
            Kind::Rig(error) => error.fmt(f),
            Kind::Simulation(error) => error.fmt(f),
            Kind::Interrupted => f.write_str("stopped by the user"),
        }
    }
}

impl std::error::Error for Error {
    /// The cause of the error that this message repeats, where there is one.
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match &*self.0 {
            Kind::Refused(source) => Some(source.as_ref()),
            Kind::Read { source, .. } | Kind::Write { source, .. } => Some(source),
            Kind::Rig(source) => Some(source),
            Kind::Simulation(source) => Some(source),
            Kind::Arguments(_) | Kind::File(_) | Kind::Failed(_) | Kind::Interrupted => None,
        }
    }
}

/// One message: place, what is wrong, what was expected, what to try. Whatever is absent is left
/// out.
///
/// ```
/// use sinew_ident::error::{Error, Kind};
///
/// let error = Error::file("a.csv", "no column `q_m`").at(1, 1).expected("a column `q_m`");
/// let Kind::File(complaint) = error.kind() else { panic!("it is about a file") };
/// assert_eq!((complaint.line, complaint.help.as_deref()), (Some(1), None));
/// assert_eq!(complaint.to_string(), "a.csv:1:1: no column `q_m`\n  expected: a column `q_m`");
/// ```
#[derive(Debug, Default, Clone, PartialEq, Eq)]
pub struct Complaint {
    /// File, where the trouble is in one.
    pub path: Option<PathBuf>,
    /// Line, from 1.
    pub line: Option<usize>,
    /// Column in characters, from 1.
    pub column: Option<usize>,
    /// The fault, in one sentence without a full stop.
    pub message: String,
    /// The expected input.
    pub expected: Option<String>,
    /// The likely fix.
    pub help: Option<String>,
}

impl fmt::Display for Complaint {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(path) = &self.path {
            write!(f, "{}:", path.display())?;
            if let Some(line) = self.line {
                write!(f, "{line}:")?;
                if let Some(column) = self.column {
                    write!(f, "{column}:")?;
                }
            }
            write!(f, " ")?;
        }
        write!(f, "{}", self.message)?;
        if let Some(expected) = &self.expected {
            write!(f, "\n  expected: {expected}")?;
        }
        write!(f, "{}", HelpLine(self.help.as_deref()))
    }
}

/// The last line of a message, or nothing.
struct HelpLine<'a>(Option<&'a str>);

impl fmt::Display for HelpLine<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Some(help) => write!(f, "\n  help: {help}"),
            None => Ok(()),
        }
    }
}

impl Error {
    /// Bad arguments: exit status 2.
    pub fn arguments(message: impl Into<String>) -> Self {
        Self::from(Kind::Arguments(Complaint {
            message: message.into(),
            ..Default::default()
        }))
    }

    /// Refusal of an argument's value: exit status 2. [`Error::help`] gives an example of a good
    /// one.
    ///
    /// ```
    /// # use sinew_ident::error::Error;
    /// let error = Error::must_be("--spread", "in [0, 1)", 1.5).help("for example --spread 0.2");
    /// assert_eq!(
    ///     error.to_string(),
    ///     "`--spread` must be in [0, 1); got 1.5\n  help: for example --spread 0.2"
    /// );
    /// ```
    pub fn must_be(argument: &str, expectation: impl fmt::Display, got: impl fmt::Display) -> Self {
        Self::arguments(format!("`{argument}` must be {expectation}; got {got}"))
    }

    /// A bad file: exit status 2. Add the place with [`Error::at`].
    pub fn file(path: impl AsRef<Path>, message: impl Into<String>) -> Self {
        let path = Some(path.as_ref().to_path_buf());
        Self::from(Kind::File(Complaint {
            path,
            message: message.into(),
            ..Default::default()
        }))
    }

    /// A file that another reader refused: exit status 2. Its message names the file.
    pub fn refused(source: impl std::error::Error + Send + Sync + 'static) -> Self {
        Self::from(Kind::Refused(Box::new(source)))
    }

    /// Anything that is nobody's typing mistake: exit status 1.
    pub fn failed(message: impl Into<String>) -> Self {
        Self::from(Kind::Failed(Complaint {
            message: message.into(),
            ..Default::default()
        }))
    }

    /// Ctrl-C: exit status 1.
    pub fn interrupted() -> Self {
        Self::from(Kind::Interrupted)
    }

    /// A file that could not be opened or read: exit status 2.
    pub fn read(path: impl AsRef<Path>, source: std::io::Error) -> Self {
        let help = match source.kind() {
            std::io::ErrorKind::NotFound => nearest_file(path.as_ref()),
            _ => None,
        };
        Self::from(Kind::Read {
            path: path.as_ref().to_path_buf(),
            source,
            help,
        })
    }

    /// A file or folder that could not be written: exit status 1.
    pub fn write(path: impl AsRef<Path>, source: std::io::Error) -> Self {
        Self::from(Kind::Write {
            path: path.as_ref().to_path_buf(),
            source,
            help: None,
        })
    }

    /// Adds line and column, both from 1. No effect on a kind that has no place.
    #[must_use]
    pub fn at(mut self, line: usize, column: usize) -> Self {
        if let Some(complaint) = self.complaint_mut() {
            complaint.line = Some(line);
            complaint.column = Some(column);
        }
        self
    }

    /// Adds what would have been right.
    #[must_use]
    pub fn expected(mut self, expected: impl Into<String>) -> Self {
        if let Some(complaint) = self.complaint_mut() {
            complaint.expected = Some(expected.into());
        }
        self
    }

    /// Adds the likely fix.
    #[must_use]
    pub fn help(mut self, text: impl Into<String>) -> Self {
        match &mut *self.0 {
            Kind::Read { help, .. } | Kind::Write { help, .. } => *help = Some(text.into()),
            _ => {
                if let Some(complaint) = self.complaint_mut() {
                    complaint.help = Some(text.into());
                }
            }
        }
        self
    }

    /// The typed kind, for a caller that decides by it.
    pub fn kind(&self) -> &Kind {
        &self.0
    }

    /// 2 for bad arguments or bad files, 1 for anything else (docs/reference/results.md).
    pub fn exit_code(&self) -> u8 {
        match *self.0 {
            Kind::Arguments(_)
            | Kind::File(_)
            | Kind::Refused(_)
            | Kind::Read { .. }
            | Kind::Rig(_) => 2,
            // The rig's file says something that cannot be simulated.
            Kind::Simulation(
                SimulationError::Inertia { .. }
                | SimulationError::TooStiff { .. }
                | SimulationError::Diverged { .. },
            ) => 2,
            Kind::Write { .. } | Kind::Simulation(_) | Kind::Failed(_) | Kind::Interrupted => 1,
        }
    }

    fn complaint_mut(&mut self) -> Option<&mut Complaint> {
        match &mut *self.0 {
            Kind::Arguments(complaint) | Kind::File(complaint) | Kind::Failed(complaint) => {
                Some(complaint)
            }
            Kind::Refused(_)
            | Kind::Read { .. }
            | Kind::Write { .. }
            | Kind::Rig(_)
            | Kind::Simulation(_)
            | Kind::Interrupted => None,
        }
    }
}

impl From<Kind> for Error {
    fn from(kind: Kind) -> Self {
        Self(Box::new(kind))
    }
}

impl From<FileError> for Error {
    fn from(error: FileError) -> Self {
        match error {
            FileError::Read { file, error } => Self::read(file, error),
            FileError::Write { file, error } => Self::write(file, error),
            FileError::TooLarge { file, max } => Self::file(
                file,
                format!("larger than {max} bytes, the most that is read"),
            ),
        }
    }
}

impl From<sinew_sim::Error> for Error {
    fn from(error: sinew_sim::Error) -> Self {
        Self::from(Kind::Rig(error))
    }
}

impl From<SimulationError> for Error {
    fn from(error: SimulationError) -> Self {
        Self::from(Kind::Simulation(error))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_message_says_place_expectation_and_help() {
        let error = Error::file("a.csv", "`abc` is not a number")
            .at(3, 7)
            .expected("a number")
            .help("mend it");
        assert_eq!(
            error.to_string(),
            "a.csv:3:7: `abc` is not a number\n  expected: a number\n  help: mend it"
        );
        assert_eq!(error.exit_code(), 2);
    }

    #[test]
    fn a_missing_file_suggests_its_neighbour() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("train.csv"), "").unwrap();
        let wanted = folder.path().join("trian.csv");
        let error = Error::read(&wanted, std::fs::read(&wanted).unwrap_err());
        assert!(error.to_string().contains("train.csv?"), "{error}");
        assert_eq!(error.exit_code(), 2);
    }

    #[test]
    fn the_cause_is_kept() {
        use std::error::Error as _;
        let cause = std::io::Error::other("model.toml:3: no such layer");
        let error = Error::refused(cause);
        assert_eq!(error.to_string(), "model.toml:3: no such layer");
        assert_eq!(error.exit_code(), 2);
        let cause = error.source().expect("the reader's own error");
        assert!(cause.is::<std::io::Error>());
    }

    #[test]
    fn results_that_cannot_be_written_are_not_the_users_mistake() {
        assert_eq!(
            Error::write("x", std::io::Error::other("disk full")).exit_code(),
            1
        );
        assert_eq!(Error::interrupted().exit_code(), 1);
    }
}

//! Goals as they are typed: `NAME = VALUE at TIME s`.

use sinew_ident::error::{Error, Result};
use sinew_ident::report::exact;

/// Example of a goal, for errors.
const EXAMPLE: &str = "for example --goal \"mass.position = 0.12 at 1.5 s\"";

/// A value that a sensor or a state is to have at a time.
///
/// ```
/// use sinew_plan::Goal;
/// let goal = Goal::parse("second.position = 0.12 at 1.5 s")?;
/// assert_eq!((goal.name.as_str(), goal.value, goal.time_s), ("second.position", 0.12, 1.5));
/// assert!(Goal::parse("second.position 0.12").is_err());
/// # Ok::<(), sinew_ident::error::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Goal {
    /// Name of a sensor, of its column, or of a state (`BODY.position`, `BODY.velocity`).
    pub name: String,
    /// Wanted value: in the column's unit for a sensor, SI for a state.
    pub value: f64,
    /// Time from the start, s.
    pub time_s: f64,
}

impl Goal {
    /// Parses `NAME = VALUE at TIME s`.
    ///
    /// # Errors
    /// `Arguments` for text of another form.
    pub fn parse(text: &str) -> Result<Self> {
        Self::parts(text).ok_or_else(|| {
            Error::must_be(
                "--goal",
                "`NAME = VALUE at TIME s`, TIME more than 0",
                format!("`{text}`"),
            )
            .help(EXAMPLE)
        })
    }

    fn parts(text: &str) -> Option<Self> {
        let (name, rest) = text.split_once('=')?;
        let (value, time) = rest.split_once(" at ")?;
        let time = time.trim();
        let time = time.strip_suffix('s').unwrap_or(time);
        let number = |text: &str| text.trim().parse::<f64>().ok().filter(|x| x.is_finite());
        let (name, value, time_s) = (name.trim(), number(value)?, number(time)?);
        (!name.is_empty() && time_s > 0.0).then(|| Self {
            name: name.to_owned(),
            value,
            time_s,
        })
    }
}

impl std::fmt::Display for Goal {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [value, time] = [self.value, self.time_s].map(exact);
        write!(f, "{} = {value} at {time} s", self.name)
    }
}

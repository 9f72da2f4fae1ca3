//! Origin of a page: its last line.

use std::path::Path;
use std::time::{SystemTime, UNIX_EPOCH};

/// Command, seed and time that a page came from. The version and the commit are the program's.
#[derive(Debug, Clone, Default)]
pub struct Provenance {
    /// Command line that makes the page again.
    pub command: String,
    /// Seed, where anything was drawn at random and the command does not name it.
    pub seed: Option<u64>,
    /// Seconds that it took, where they were measured.
    pub seconds: Option<f64>,
}

/// Commit of the program, of a release build in a checkout or from a package.
const COMMIT: Option<&str> = option_env!("SINEW_COMMIT");

impl Provenance {
    /// Origin in a command.
    pub fn new(command: impl Into<String>) -> Self {
        Self {
            command: command.into(),
            ..Self::default()
        }
    }

    /// Origin in the command line of this process, as it was typed.
    pub fn typed() -> Self {
        let words = std::env::args_os().enumerate().map(|(index, word)| {
            let word = match index {
                0 => Path::new(&word)
                    .file_stem()
                    .map_or(word.clone(), Into::into),
                _ => word,
            };
            quoted(&word.to_string_lossy())
        });
        Self::new(words.collect::<Vec<_>>().join(" "))
    }

    /// Sets the seed.
    #[must_use]
    pub fn seed(mut self, seed: u64) -> Self {
        self.seed = Some(seed);
        self
    }

    /// Sets the seconds.
    #[must_use]
    pub fn seconds(mut self, seconds: f64) -> Self {
        self.seconds = Some(seconds);
        self
    }

    /// Command, seed, version and commit, date, seconds.
    ///
    /// The date is of now, or of `SOURCE_DATE_EPOCH` where that is set.
    pub fn line(&self) -> String {
        let version = env!("CARGO_PKG_VERSION");
        let commit = COMMIT.map_or("development build".to_owned(), |it| format!("commit {it}"));
        let mut parts = vec![self.command.clone()];
        parts.extend(self.seed.map(|seed| format!("seed {seed}")));
        parts.push(format!("sinew {version} ({commit})"));
        parts.push(date(now()));
        parts.extend(self.seconds.map(|seconds| format!("{seconds:.1} s")));
        parts.retain(|part| !part.is_empty());
        parts.join(" · ")
    }
}

/// A word as a shell takes it.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "-_./:=,+@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}

/// Seconds since 1970.
fn now() -> u64 {
    let asked = std::env::var("SOURCE_DATE_EPOCH");
    let asked = asked.ok().and_then(|text| text.parse().ok());
    asked.unwrap_or_else(|| {
        let since = SystemTime::now().duration_since(UNIX_EPOCH);
        since.map_or(0, |since| since.as_secs())
    })
}

/// `2026-11-28 21:40 UTC` of seconds since 1970.
fn date(seconds: u64) -> String {
    let (hour, minute) = (seconds / 3600 % 24, seconds / 60 % 60);
    let leap = |year: u64| {
        year.is_multiple_of(4) && (!year.is_multiple_of(100) || year.is_multiple_of(400))
    };
    let mut days = seconds / 86_400;
    let mut year = 1970;
    loop {
        let length = if leap(year) { 366 } else { 365 };
        // A clock that tells the year 9999 is wrong, and the page is worth more than its date.
        if days < length || year == 9999 {
            break;
        }
        days -= length;
        year += 1;
    }
    let february = if leap(year) { 29 } else { 28 };
    let mut month = 1;
    for length in [31, february, 31, 30, 31, 30, 31, 31, 30, 31, 30] {
        if days < length {
            break;
        }
        days -= length;
        month += 1;
    }
    format!(
        "{year}-{month:02}-{:02} {hour:02}:{minute:02} UTC",
        days + 1
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_are_those_of_the_calendar() {
        for (seconds, expected) in [
            (0, "1970-01-01 00:00 UTC"),
            (951_825_599, "2000-02-29 11:59 UTC"),
            (1_709_251_199, "2024-02-29 23:59 UTC"),
            (1_709_251_200, "2024-03-01 00:00 UTC"),
            (1_798_761_599, "2026-12-31 23:59 UTC"),
        ] {
            assert_eq!(date(seconds), expected);
        }
    }

    #[test]
    fn a_command_is_quoted_so_that_it_can_be_typed_again() {
        assert_eq!(quoted("--fit=a.csv"), "--fit=a.csv");
        assert_eq!(quoted("my rig.toml"), "'my rig.toml'");
        assert_eq!(quoted("it's"), "'it'\\''s'");
        assert_eq!(quoted(""), "''");
    }

    #[test]
    fn the_last_line_of_a_page_has_command_seed_version_and_date() {
        let line = Provenance::new("sinew fit rig.toml")
            .seed(7)
            .seconds(1.25)
            .line();
        let start = format!(
            "sinew fit rig.toml · seed 7 · sinew {}",
            env!("CARGO_PKG_VERSION")
        );
        assert!(line.starts_with(&start), "{line}");
        assert!(line.contains(" UTC · ") && line.ends_with(" s"), "{line}");
        assert!(
            line.contains("commit ") || line.contains("development build"),
            "{line}"
        );
    }
}

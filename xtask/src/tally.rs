//! Counting what `cargo test` prints.

use std::fmt;

/// Mark of a test that cannot run here, anywhere in a line of its output.
const SKIPPED: &str = "SKIPPED: ";

/// Tests counted over any number of test programs.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Reported as passed; those that only said why they cannot run are among them.
    reported: u64,
    /// Of those, the ones that said why they cannot run.
    early: u64,
    /// Did not.
    pub failed: u64,
    /// Why a test did not run, once per reason, and how often.
    pub skipped: Vec<(String, u64)>,
    /// Test programs that were not built or did not come to an end, by the command that said so.
    pub broken: Vec<String>,
}

impl Tally {
    /// Takes one line of output into account.
    pub fn see(&mut self, line: &str) {
        if let Some(counts) = line.trim_start().strip_prefix("test result: ") {
            self.reported += count(counts, "passed");
            self.failed += count(counts, "failed");
            let ignored = count(counts, "ignored");
            if ignored > 0 {
                self.skip("marked as ignored", ignored);
            }
        } else if let Some(at) = line.find(SKIPPED) {
            let reason = line[at + SKIPPED.len()..].trim();
            self.skip(reason, 1);
            // The function returns early, and the test program will report that as a pass.
            self.early += 1;
        }
    }

    /// Ended well, having tested something.
    pub fn passed(&self) -> u64 {
        self.reported.saturating_sub(self.early)
    }

    fn skip(&mut self, reason: &str, times: u64) {
        match self.skipped.iter_mut().find(|(known, _)| known == reason) {
            Some((_, count)) => *count += times,
            None => self.skipped.push((reason.to_string(), times)),
        }
    }

    /// No test failed and every program ran to its end.
    pub fn is_green(&self) -> bool {
        self.failed == 0 && self.broken.is_empty()
    }
}

impl fmt::Display for Tally {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (reason, times) in &self.skipped {
            writeln!(f, "skipped {times} x: {reason}")?;
        }
        for line in &self.broken {
            writeln!(f, "did not come to an end: {line}")?;
        }
        let skipped: u64 = self.skipped.iter().map(|(_, times)| times).sum();
        write!(
            f,
            "{} tests: {} passed, {} failed, {skipped} skipped{}",
            self.passed() + self.failed + skipped,
            self.passed(),
            self.failed,
            if self.broken.is_empty() {
                String::new()
            } else {
                format!(", {} not finished", self.broken.len())
            },
        )
    }
}

/// The number before `word` in "ok. 12 passed; 0 failed; 3 ignored; ...".
fn count(counts: &str, word: &str) -> u64 {
    let mut previous = "";
    for part in counts.split_whitespace() {
        if part.trim_end_matches(';') == word {
            return previous.parse().unwrap_or(0);
        }
        previous = part;
    }
    0
}

#[cfg(test)]
mod tests {
    use super::Tally;

    fn tally(text: &str) -> Tally {
        let mut tally = Tally::default();
        text.lines().for_each(|line| tally.see(line));
        tally
    }

    #[test]
    fn adds_up_programs() {
        let tally = tally(
            "running 3 tests\n\
             test result: ok. 3 passed; 0 failed; 0 ignored; 0 measured; 0 filtered out; finished in 0.1s\n\
             test result: FAILED. 10 passed; 2 failed; 1 ignored; 0 measured; 7 filtered out; finished in 2s\n",
        );
        assert_eq!((tally.passed(), tally.failed), (13, 2));
        assert_eq!(tally.skipped, [("marked as ignored".to_string(), 1)]);
        assert!(!tally.is_green());
        assert!(
            tally
                .to_string()
                .ends_with("16 tests: 13 passed, 2 failed, 1 skipped")
        );
    }

    #[test]
    fn a_skipped_test_is_not_a_passed_one() {
        let tally = tally(
            "test uart ... SKIPPED: no qemu-system-arm\n\
             SKIPPED: no qemu-system-arm\n\
             test result: ok. 5 passed; 0 failed; 0 ignored; 0 measured; 0 filtered out; finished in 0.1s\n",
        );
        assert_eq!(tally.passed(), 3);
        assert_eq!(tally.skipped, [("no qemu-system-arm".to_string(), 2)]);
        assert!(tally.is_green());
    }

    #[test]
    fn a_program_that_never_ran_is_not_green() {
        let mut tally = Tally::default();
        tally.broken.push("cargo test".to_string());
        assert!(!tally.is_green());
    }
}

//! Exit status by the result of a verb, for scripts (`--exit-code`; docs/reference/results.md).

use crate::check::Check;
use crate::diagnose::Verdict;
use crate::fit::{Fit, FittedParameter};

/// Something was found that a script wants to react to.
pub const FOUND: u8 = 3;
/// Something is wrong, and no result explains it.
pub const UNEXPLAINED: u8 = 4;

/// 0 for `consistent` and `parameters`, 3 for `missing_physics`, 4 for `unexplained`.
pub fn of_verdict(verdict: Verdict) -> u8 {
    match verdict {
        Verdict::Consistent | Verdict::Parameters => 0,
        Verdict::MissingPhysics => FOUND,
        Verdict::Unexplained => UNEXPLAINED,
    }
}

/// 0 without a fault, 3 with likely faults only. A certain fault that is not accepted is an error,
/// with its own status.
pub fn of_checks(checks: &[Check]) -> u8 {
    if checks.is_empty() { 0 } else { FOUND }
}

/// 0 where the refitted rig explains every signal and determines every parameter, 3 where it
/// explains them without determining all, 4 where it leaves a signal unexplained.
pub fn of_fit(found: &Fit) -> u8 {
    if !found.sensors.iter().all(|sensor| sensor.is_explained()) {
        return UNEXPLAINED;
    }
    let own = |p: &FittedParameter| p.recordings.iter().all(|o| o.ci95.is_some() || o.at_bound);
    let determined = |p: &FittedParameter| p.ci95.is_some() && own(p);
    let determined = found.parameters.iter().all(determined);
    if determined { 0 } else { FOUND }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn statuses_of_verdicts_are_those_of_the_reference() {
        let verdicts = [
            Verdict::Consistent,
            Verdict::Parameters,
            Verdict::MissingPhysics,
            Verdict::Unexplained,
        ];
        assert_eq!(verdicts.map(of_verdict), [0, 0, 3, 4]);
    }
}

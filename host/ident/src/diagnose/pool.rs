//! The pool of a search: every candidate that was fitted to all recordings, and the best acceptable
//! one.

use crate::diagnose::acceptance::{
    best_acceptable, best_acceptable_by_size, leaves_something, probabilities, simplest,
};
use crate::diagnose::candidate::{Candidate, Trial};
use crate::diagnose::case::Case;
use crate::diagnose::search::all_rows::select;
use crate::diagnose::term::Term;
use crate::error::Result;

/// Candidates of a search.
pub(crate) struct Pool {
    /// The rig without any added term.
    pub baseline: Candidate,
    /// Candidates, each set of terms once, in the order in which they were first found.
    pub candidates: Vec<Candidate>,
    /// Index of the best acceptable candidate.
    pub chosen: Option<usize>,
    /// Share of each candidate in the evidence; empty until the search has ended.
    pub probabilities: Vec<f64>,
    /// The refit of the rig alone had stopped short of what `baseline` is now.
    pub stopped_short: bool,
    /// Candidates that were taken out, and those that build on them, each with the reason.
    pub refuted: Vec<(Candidate, &'static str)>,
    /// Index of a candidate that may be named but for its share of the evidence.
    pub unsure: Option<usize>,
    /// Pairs of bare numbers that explain the recordings together, where no single one does.
    pub pairs: Vec<[String; 2]>,
    /// Single terms as they were screened over short intervals.
    pub short: ShortHorizon,
    /// Pairs whose halves have not been tried alone, where such were just proposed.
    pub undivided: Option<Vec<Candidate>>,
}

/// Screening over short intervals: the rig alone there and every single term, best first.
#[derive(Default)]
pub(crate) struct ShortHorizon {
    /// The rig alone; none where it cannot be simulated.
    pub parent: Option<Trial>,
    /// With one term each.
    pub singles: Vec<Trial>,
}

/// Candidates that a move adds to the pool, and what it leaves for the moves after it.
#[derive(Default)]
pub(crate) struct Proposal {
    /// Candidates fitted to all recordings.
    pub candidates: Vec<Candidate>,
    /// Screening over short intervals, where the move did one.
    pub short: Option<ShortHorizon>,
    /// The candidates are pairs whose halves have not been tried alone.
    pub undivided: bool,
}

/// Rule by which the best acceptable candidate is chosen after a move.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Selection {
    /// The choice stays as it is: another move follows first.
    Unchanged,
    /// The best against the baseline.
    Best,
    /// As `Best`, but two terms only where they are acceptable against the best single one.
    BestBySize,
}

impl Pool {
    /// A pool of the baseline alone.
    pub fn new(baseline: Candidate) -> Self {
        Self {
            baseline,
            candidates: Vec::new(),
            chosen: None,
            probabilities: Vec::new(),
            stopped_short: false,
            refuted: Vec::new(),
            unsure: None,
            pairs: Vec::new(),
            short: ShortHorizon::default(),
            undivided: None,
        }
    }

    /// The best acceptable candidate.
    pub fn best(&self) -> Option<&Candidate> {
        self.chosen.map(|index| &self.candidates[index])
    }

    /// Terms of the best acceptable candidate.
    pub fn best_terms(&self) -> Option<Vec<Term>> {
        self.best().map(|best| best.terms().to_vec())
    }

    /// Tells whether the best acceptable candidate leaves nothing but noise.
    pub fn is_explained(&self, case: &Case) -> bool {
        let best = self.best();
        best.is_some_and(|best| !leaves_something(case, best))
    }

    /// Tells whether it does so without a number of the rig far from its nominal value.
    pub fn is_explained_plainly(&self, case: &Case) -> bool {
        let plain = |best: &Candidate| !best.trial.implausible();
        self.is_explained(case) && self.best().is_some_and(plain)
    }

    /// Tells whether the rig alone leaves nothing but noise and no candidate is chosen.
    pub fn needs_nothing(&self, case: &Case) -> bool {
        self.chosen.is_none() && !leaves_something(case, &self.baseline)
    }

    /// Takes what a move proposes, each set of terms once.
    pub fn take(&mut self, proposal: Proposal) {
        self.undivided = proposal.undivided.then(|| proposal.candidates.clone());
        if let Some(short) = proposal.short {
            self.short = short;
        }
        for candidate in proposal.candidates {
            self.add(candidate);
        }
    }

    /// Of those that have the same terms, the one that was fitted to the most rows stays, and of
    /// those the one that was fitted best.
    fn add(&mut self, candidate: Candidate) {
        let mut known = self.candidates.iter_mut();
        match known.find(|known| candidate.has_terms_of(known)) {
            Some(known) if known.all_rows && !candidate.all_rows => {}
            Some(known) if known.trial.point.cost <= candidate.trial.point.cost => {}
            Some(known) => *known = candidate,
            None => self.candidates.push(candidate),
        }
    }

    /// Chooses the best acceptable candidate; one that needs more rows to be judged is refitted to
    /// all of them first.
    ///
    /// # Errors
    /// None that reading the recordings has not excluded.
    pub fn choose(&mut self, case: &Case, selection: Selection) -> Result<()> {
        let baseline = &self.baseline;
        self.chosen = match selection {
            Selection::Unchanged => self.chosen,
            Selection::Best => select(case, &mut self.candidates, |all| {
                best_acceptable(case, baseline, all)
            })?,
            Selection::BestBySize => select(case, &mut self.candidates, |all| {
                best_acceptable_by_size(case, baseline, all)
            })?,
        };
        Ok(())
    }

    /// Another baseline: the candidates are judged against it.
    ///
    /// # Errors
    /// As [`Pool::choose`].
    pub fn rebase(&mut self, case: &Case, baseline: Candidate) -> Result<()> {
        self.baseline = baseline;
        self.stopped_short = true;
        if leaves_something(case, &self.baseline) {
            return self.choose(case, Selection::BestBySize);
        }
        self.candidates.clear();
        self.chosen = None;
        Ok(())
    }

    /// Of what is the same motion by two names the simpler is chosen, and every candidate has its
    /// probability.
    pub fn conclude(&mut self, case: &Case) {
        let (base, all) = (&self.baseline, &self.candidates);
        self.chosen = self.chosen.map(|index| simplest(case, base, index, all));
        self.probabilities = probabilities(case, base, all, self.chosen);
    }
}

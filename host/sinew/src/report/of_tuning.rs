//! The page of a tuning: the loops before and after, side by side.

use crate::closed_loop::benchmark::Benchmark;
use sinew_ident::report::{Block, Provenance, Report, Section, Table};

/// Search and findings of a tuning, beside its loops.
pub struct TuningPage<'a> {
    /// Name of the rig.
    pub rig: &'a str,
    /// The finding in a sentence.
    pub verdict: String,
    /// Command line that comes next; may be empty.
    pub next: String,
    /// The objective, in words.
    pub objective: String,
    /// The objective of each controller before and after.
    pub objectives: Table,
    /// Sentences about the searches.
    pub courses: Vec<String>,
    /// The settings that were written.
    pub settings: Table,
    /// Gains of the controllers without a model, as the terminal shows them; may be empty.
    pub gains: String,
}

/// The page.
pub fn tuning_page(of: &TuningPage<'_>, contest: &Benchmark, made: &Provenance) -> Report {
    let mut loops = contest.report(made);
    let mut search = Section::new("The search")
        .text(of.objective.clone())
        .with(Block::Table(of.objectives.clone()));
    for course in &of.courses {
        search = search.text(course.clone());
    }
    let mut settings = Section::new("Settings").with(Block::Table(of.settings.clone()));
    if !of.gains.is_empty() {
        settings = settings.with(Block::Code(of.gains.trim_end().to_owned()));
    }
    let mut sections = vec![search];
    sections.append(&mut loops.sections);
    sections.push(settings);
    Report {
        title: format!("{}: tuning", of.rig),
        lead: of.verdict.clone(),
        next: of.next.clone(),
        sections,
        ..loops
    }
}

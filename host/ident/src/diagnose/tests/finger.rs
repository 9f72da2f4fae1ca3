//! A finger between two tendons with something hidden, and what is needed to look at one step of
//! its diagnosis.

use crate::diagnose::case::{Case, refit_settings};
use crate::diagnose::data::Data;
use crate::diagnose::search::subset::Subset;
use sinew_sim::Rig;
use sinew_sim::effects::Kind;

use super::alike::foreign;
use super::{compiled, recorded};
use crate::recording::Recording;

/// A rig and its recordings.
pub struct Finger {
    pub own: Rig,
    pub fit: Data,
    check: Data,
    both: Data,
}

impl Finger {
    /// Its tendons rub by these parts of their load.
    pub fn rubbing([east, west]: [f64; 2]) -> Self {
        let rubs = |at, level| effect(RUBS, at, &format!("coefficient = {level}"));
        Self::with(&(rubs("east", east) + &rubs("west", west)))
    }

    /// Two seconds each of fit and check recordings with these effects.
    pub fn with(effects: &str) -> Self {
        let own = Rig::load(foreign("finger/believed.toml")).expect("the rig is committed");
        let text = own.to_toml().to_owned() + effects;
        let real = Rig::parse(&text, "real.toml").expect("the rig is sound");
        let recording = |seed| recorded([&own, &real], (2.0, 100.0), 1e-4, seed);
        let recordings = [recording(1), recording(2)];
        let plant = compiled(&own);
        let data = |recordings: &[Recording]| {
            Data::new(&own, &plant, recordings).expect("the recordings have the columns of the rig")
        };
        Self {
            fit: data(&recordings[..1]),
            check: data(&recordings[1..]),
            both: data(&recordings),
            own,
        }
    }

    /// Full refits are fitted to the first rows.
    pub fn case(&self, rows: usize) -> Case<'_> {
        let data = [&self.fit, &self.check, &self.both];
        case(&self.own, data, vec![(0, 0..rows)])
    }
}

/// Judges explanations of fit and check recordings (and both), check recordings as a whole.
pub fn case<'a>(
    written: &'a Rig,
    [fit, check, both]: [&'a Data; 3],
    fit_intervals: Vec<(usize, std::ops::Range<usize>)>,
) -> Case<'a> {
    let plant = compiled(written);
    let (settings, _) = refit_settings(&plant, &plant.values(), fit, both);
    Case {
        written,
        fit,
        check,
        both,
        in_parts: false,
        settings,
        fit_intervals,
        check_intervals: check.cut(1),
        effects: Kind::ALL,
        without_moves: &[],
        seed: 0,
        trust: 1.0,
        progress: &|_, _, _| {},
        time: Default::default(),
        untried: Default::default(),
    }
}

pub const RUBS: &str = "load_dependent_friction";

/// An effect as a rig file has it.
pub fn effect(kind: &str, at: &str, parameter: &str) -> String {
    format!("\n[[effect]]\nkind = \"{kind}\"\ncomponent = \"{at}\"\n{parameter}\n")
}

/// A screening on all that full refits see.
pub fn subset<'a>(case: &Case<'a>) -> Subset<'a> {
    Subset {
        written: case.written,
        data: case.fit,
        intervals: case.fit_intervals.clone(),
        settings: case.settings,
    }
}

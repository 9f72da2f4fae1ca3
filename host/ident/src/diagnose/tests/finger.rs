//! A finger between two tendons with something hidden, and what is needed to look at one step of its diagnosis.

use sinew_sim::Rig;
use sinew_sim::effects::Kind;

use super::super::data::Data;
use super::super::race::Track;
use super::super::search::{self, Bench};
use super::super::suspect::Suspect;
use super::alike::foreign;
use super::{compiled, recorded};
use crate::recording::Recording;

/// A rig and its recordings.
pub struct Finger {
    pub believed: Rig,
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
        let believed = Rig::load(foreign("finger/believed.toml")).expect("it is committed");
        let text = believed.to_toml().to_owned() + effects;
        let real = Rig::parse(&text, "real.toml").expect("it is sound");
        let recording = |seed| recorded([&believed, &real], (2.0, 100.0), 1e-4, seed);
        let recordings = [recording(1), recording(2)];
        let plant = compiled(&believed);
        let data = |recordings: &[Recording]| {
            Data::new(&believed, &plant, recordings).expect("its columns are there")
        };
        Self {
            fit: data(&recordings[..1]),
            check: data(&recordings[1..]),
            both: data(&recordings),
            believed,
        }
    }

    /// Finals are fitted to the first rows.
    pub fn bench(&self, rows: usize) -> Bench<'_> {
        let data = [&self.fit, &self.check, &self.both];
        bench(&self.believed, data, vec![(0, 0..rows)])
    }
}

/// What judges explanations of fit and check recordings (and both), check recordings as a whole.
pub fn bench<'a>(
    written: &'a Rig,
    [fit, check, both]: [&'a Data; 3],
    fit_stretches: Vec<(usize, std::ops::Range<usize>)>,
) -> Bench<'a> {
    let plant = compiled(written);
    let (settings, _) = search::finals(&plant, &plant.values(), fit, both);
    Bench {
        written,
        fit,
        check,
        both,
        in_parts: false,
        settings,
        fit_stretches,
        check_stretches: check.cut(1),
        seed: 0,
        trust: 1.0,
        told: &|_, _, _| {},
    }
}

pub const RUBS: &str = "load_dependent_friction";

/// An effect as a rig file has it.
pub fn effect(kind: &str, at: &str, parameter: &str) -> String {
    format!("\n[[effect]]\nkind = \"{kind}\"\ncomponent = \"{at}\"\n{parameter}\n")
}

/// An effect at one component, or at all of several.
pub fn suspect(kind: &str, at: &[&str]) -> Suspect {
    let kind = Kind::named(kind).expect("it is in the vocabulary");
    match at {
        [one] => Suspect::Effect {
            kind,
            component: (*one).into(),
        },
        several => Suspect::Everywhere {
            kind,
            components: several.join("+"),
        },
    }
}

/// A race on all that finals see.
pub fn track<'a>(bench: &Bench<'a>) -> Track<'a> {
    Track {
        written: bench.written,
        data: bench.fit,
        stretches: bench.fit_stretches.clone(),
        settings: bench.settings,
    }
}

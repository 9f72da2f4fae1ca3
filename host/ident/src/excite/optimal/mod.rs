//! Optimal experiments: segments chosen and refined so that the effects that are hardest to see,
//! and the parameter known worst, show most (docs/explanation/experiments.md, eq. 7 and 8).
//!
//! The search counts with information that adds up over segments. Experiments are compared by
//! simulating them whole.

mod change;
mod exchange;
mod information;
mod score;
mod segment;
mod table;

use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use sinew_sim::{Plant, Rig};

use super::reveal::{Effort, Instance, Revelation, measure, weak_instances};
use super::{Experiment, Kind, Options, design};
use crate::error::Result;
use crate::order;
use crate::parallel;
use exchange::Library;
use information::Information;
use score::Goal;
use segment::{Segment, UNITS, assemble};
pub use table::lines;

/// Designs of the exchange that are simulated whole.
const SIMULATED: usize = 8;
/// Best experiments whose changes are tried.
const PARENTS: usize = 3;
/// Effort of an imitation: what a parameter imitates altogether must fall far below what shows.
const EFFORT: Effort = Effort {
    steps: 20,
    enough: 0.5,
    halvings: 5,
    worth: 0.97,
};
/// Families that a design is compared with.
const FAMILIES: [Kind; 5] = [
    Kind::Multisine,
    Kind::Steps,
    Kind::Triangle,
    Kind::Chirp,
    Kind::Mixed,
];

/// An optimal experiment beside the families of the same length, limits and noise.
#[derive(Clone, Debug)]
pub struct Optimal {
    /// The best experiment.
    pub experiment: Experiment,
    /// Visibility in it, of the same instances and under the same noise as in the families.
    pub revelation: Revelation,
    /// Measures of it beside those of the families.
    pub comparison: Comparison,
}

/// Measures of an experiment beside those of the families.
#[derive(Clone, Debug)]
pub struct Comparison {
    /// The family that no design improved on; none where a design is the best.
    pub family: Option<Kind>,
    /// Measures of the best experiment.
    pub chosen: Measures,
    /// Measures of each family.
    pub families: Vec<(Kind, Measures)>,
}

/// Measures by which experiments are compared.
#[derive(Clone, Debug)]
pub struct Measures {
    /// Effects that are hardest to see in this experiment, among those that any experiment shows:
    /// index of [`Revelation::effects`] and distance (5), the hardest first.
    pub hardest: Vec<(usize, f64)>,
    /// Geometric mean of those distances.
    pub mean_distance: f64,
    /// Free parameter with the widest 95 % interval beside its value: its name and half the
    /// interval as a part of the value. None where no experiment determines any.
    pub widest: Option<(String, f64)>,
    /// Objective (8); more is better.
    pub worth: f64,
}

impl Comparison {
    /// Mean distance of the hardest effects beside that of the best family, and that family.
    pub fn gain(&self) -> (f64, Kind) {
        let best = (self.families.iter())
            .max_by(|a, b| a.1.worth.total_cmp(&b.1.worth))
            .map_or((1.0, FAMILIES[0]), |(kind, found)| {
                (found.mean_distance, *kind)
            });
        (self.chosen.mean_distance / best.0, best.1)
    }
}

/// Searches for the experiment that shows most; `file` is the rig's, for errors, and `options.kind`
/// has no meaning. `progress` hears (done, of).
///
/// # Errors
/// As of [`design`] and of [`super::reveal::reveal`].
pub fn optimal(
    rig: &Rig,
    file: impl AsRef<Path>,
    options: &Options,
    (noise, evaluations): (f64, usize),
    progress: &(dyn Fn(usize, usize) + Sync),
) -> Result<Optimal> {
    let search = Search::new(rig, file.as_ref(), options, (noise, evaluations), progress)?;
    search.run()
}

/// A search: the rig, and what all experiments are measured with.
struct Search<'a> {
    rig: &'a Rig,
    plant: Plant,
    file: &'a Path,
    options: &'a Options,
    instances: Vec<Instance>,
    deviations: Vec<f64>,
    /// Most designs that are simulated whole.
    evaluations: usize,
    progress: &'a (dyn Fn(usize, usize) + Sync),
    done: AtomicUsize,
    steps: usize,
}

/// Experiments that were simulated whole, with the segments that they are made of.
#[derive(Default)]
struct Known {
    segments: Vec<Vec<Segment>>,
    experiments: Vec<Experiment>,
    found: Vec<Revelation>,
}

impl Known {
    /// Indices of the best experiments.
    fn best(&self, goal: &Goal) -> Vec<usize> {
        let mut order: Vec<usize> = (0..self.found.len()).collect();
        let worth: Vec<f64> = self
            .found
            .iter()
            .map(|found| goal.worth_of(found))
            .collect();
        order::sort_down(&mut order, |&index| worth[index]);
        order.truncate(PARENTS);
        order
    }
}

impl<'a> Search<'a> {
    fn new(
        rig: &'a Rig,
        file: &'a Path,
        options: &'a Options,
        (noise, evaluations): (f64, usize),
        progress: &'a (dyn Fn(usize, usize) + Sync),
    ) -> Result<Self> {
        let plant = Plant::new(rig)?;
        let mixed = Options {
            kind: Kind::Mixed,
            ..*options
        };
        let mixed = design(&plant, file, &mixed)?;
        let (instances, deviations) = weak_instances(rig, &mixed, noise)?;
        let library = Segment::library(options, plant.inputs().len());
        let units: usize = library.iter().map(|segment| segment.length).sum();
        let steps = (FAMILIES.len() + evaluations) * UNITS + units;
        Ok(Self {
            rig,
            plant,
            file,
            options,
            instances,
            deviations,
            evaluations,
            progress,
            done: AtomicUsize::new(0),
            steps,
        })
    }

    fn run(&self) -> Result<Optimal> {
        let mut random = ChaCha8Rng::seed_from_u64(self.options.seed);
        let mut known = Known::default();
        for kind in FAMILIES {
            let family = design(
                &self.plant,
                self.file,
                &Options {
                    kind,
                    ..*self.options
                },
            )?;
            let segment = Segment::family(kind, self.options);
            self.simulate(&mut known, vec![segment], family)?;
        }
        let library = self.library()?;
        let goal = self.goal(&known, &library);
        let chosen = exchange::designs(&library, &goal, &mut random);
        let first = SIMULATED.min(self.evaluations);
        for design in chosen.into_iter().take(first) {
            let segments = design
                .iter()
                .map(|&index| library.segments[index])
                .collect();
            self.simulate_segments(&mut known, segments)?;
        }
        for _ in first..self.evaluations {
            let goal = self.goal(&known, &library);
            let parents = known.best(&goal);
            let parent = &known.segments[parents[random.random_range(0..parents.len())]];
            let changed = change::changed(parent, &library, self.options, &mut random);
            self.simulate_segments(&mut known, changed)?;
        }
        let goal = self.goal(&known, &library);
        Ok(self.best(known, &goal))
    }

    fn simulate_segments(&self, known: &mut Known, segments: Vec<Segment>) -> Result<()> {
        let options = (self.options, self.options.seconds);
        let whole = assemble(&self.plant, self.file, options, &segments)?;
        self.simulate(known, segments, whole)
    }

    /// Counts a part of the search as done.
    fn count(&self, parts: usize) {
        let done = self.done.fetch_add(parts, Ordering::Relaxed) + parts;
        (self.progress)(done.min(self.steps), self.steps);
    }

    /// Simulates a whole experiment and keeps it, where the rig can be simulated so.
    ///
    /// # Errors
    /// `Simulation` where that is the first of all, and it cannot.
    fn simulate(
        &self,
        known: &mut Known,
        segments: Vec<Segment>,
        experiment: Experiment,
    ) -> Result<()> {
        let found = measure(
            self.rig,
            &experiment,
            &self.instances,
            (&self.deviations, EFFORT),
            &|_, _| {},
        );
        self.count(UNITS);
        match found {
            Ok(found) => {
                known.segments.push(segments);
                known.experiments.push(experiment);
                known.found.push(found);
                Ok(())
            }
            Err(error) if known.found.is_empty() => Err(error),
            Err(_) => Ok(()),
        }
    }

    fn library(&self) -> Result<Library> {
        let segments = Segment::library(self.options, self.plant.inputs().len());
        let information = parallel::try_map(&segments, |segment| {
            let seconds = self.options.seconds * segment.length as f64 / UNITS as f64;
            let options = (self.options, seconds);
            let alone = assemble(&self.plant, self.file, options, &[*segment])?;
            let found = Information::of(self.rig, &alone, &self.instances, &self.deviations);
            self.count(segment.length);
            found
        })?;
        Ok(Library {
            segments,
            information,
        })
    }

    /// Judges by what is known, and by what an average design would show.
    fn goal(&self, known: &Known, library: &Library) -> Goal {
        let units: usize = library.segments.iter().map(|segment| segment.length).sum();
        let part = UNITS as f64 / units.max(1) as f64;
        let sum = Information::sum(library.information.iter());
        Goal::of(
            &known.found,
            FAMILIES.len(),
            sum.map(|sum| sum.scaled(part).measure()),
        )
    }

    fn best(&self, known: Known, goal: &Goal) -> Optimal {
        let measures: Vec<Measures> = known.found.iter().map(|f| self.measures(goal, f)).collect();
        let best = (0..measures.len())
            .max_by(|&a, &b| {
                measures[a]
                    .worth
                    .total_cmp(&measures[b].worth)
                    .then(b.cmp(&a))
            })
            .unwrap_or(0);
        let families = FAMILIES.into_iter().zip(measures.iter().cloned()).collect();
        Optimal {
            experiment: known.experiments[best].clone(),
            revelation: known.found[best].clone(),
            comparison: Comparison {
                family: FAMILIES.get(best).copied(),
                chosen: measures[best].clone(),
                families,
            },
        }
    }

    fn measures(&self, goal: &Goal, found: &Revelation) -> Measures {
        let distances = found.distances();
        let hardest = goal.hardest(&distances);
        let hardest: Vec<(usize, f64)> = hardest.into_iter().map(|k| (k, distances[k])).collect();
        Measures {
            mean_distance: score::mean(hardest.iter().map(|(_, distance)| *distance)),
            hardest,
            widest: self.widest(found),
            worth: goal.worth_of(found),
        }
    }

    fn widest(&self, found: &Revelation) -> Option<(String, f64)> {
        let values = self.plant.values();
        let slots = self.plant.free_slots();
        let parts = slots.iter().zip(&found.half_widths).map(|(&slot, width)| {
            let name = self.plant.parameters()[slot].name.clone();
            (name, width / values[slot].abs())
        });
        parts
            .filter(|(_, part)| part.is_finite())
            .max_by(|a, b| a.1.total_cmp(&b.1))
    }
}

#[cfg(test)]
mod tests;

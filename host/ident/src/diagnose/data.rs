//! Recordings of one role, laid against the rig: SI, with what is known of their noise.

use crate::diagnose::config::CONFIG;
use std::collections::BTreeMap;
use std::ops::Range;

use sinew_sim::{Plant, Rig};

use crate::diagnose::noise;
use crate::error::Result;
use crate::fit::experiment::spreads;
use crate::fit::experiment::{Experiment, Views};
use crate::fit::segment::{Problem, Segment};
use crate::fit::{local, start};
use crate::recording::Recording;

/// Recordings as every candidate is held against them.
#[derive(Clone)]
pub(crate) struct Data {
    /// One entry a recording.
    pub experiments: Vec<Experiment>,
    /// Standard deviation of each sensor's measurement, SI; 0 where it has no noise.
    pub noise: Vec<f64>,
    /// Step of each sensor's scale where its samples lie on one (an encoder), SI; else 0.
    pub step: Vec<f64>,
    /// Standard deviation of each signal, SI.
    pub spread: Vec<f64>,
    /// One unit of residual, SI: the noise.
    pub sigma: Vec<f64>,
    /// Natural sizes of the baseline rig's states, by name.
    state_scale: BTreeMap<String, f64>,
    /// Largest of those that are no velocity, and of the velocities.
    largest_scale: [f64; 2],
    /// Natural sizes of its local parameters' deviations, by name.
    local_scale: BTreeMap<String, f64>,
}

/// Start states that were found for intervals.
#[derive(Clone, Copy)]
pub(crate) struct Starts<'a> {
    pub data: &'a Data,
    pub intervals: &'a [(usize, Range<usize>)],
    pub states: &'a [Vec<f64>],
}

impl Data {
    /// # Errors
    /// As [`Experiment::new`].
    pub fn new(rig: &Rig, plant: &Plant, recordings: &[Recording]) -> Result<Self> {
        let experiments = recordings
            .iter()
            .map(|recording| Experiment::new(plant, recording))
            .collect::<Result<Vec<_>>>()?;
        Ok(Self::of(rig, plant, experiments))
    }

    fn of(rig: &Rig, plant: &Plant, experiments: Vec<Experiment>) -> Self {
        let views = Views::new(rig, plant);
        let sensors = plant.sensors().len();
        let spread = spreads(&experiments);
        let level = |sensor: usize| {
            let levels = experiments
                .iter()
                .map(|e| noise::level(&e.t, &e.signals[sensor]))
                .filter(|level| level.is_finite());
            noise::median(levels.collect())
        };
        // Of all recordings together: a short one lands on few of its encoder's marks twice.
        let step: Vec<f64> = (0..sensors)
            .map(|sensor| {
                let columns = experiments.iter().map(|e| &e.signals[sensor][..]);
                noise::lattice(&columns.collect::<Vec<_>>().concat())
            })
            .collect();
        let noise: Vec<f64> = (0..sensors)
            .map(|s| {
                let rounding = step[s] / 12.0_f64.sqrt();
                level(s).max(rounding)
            })
            .collect();
        let scales = start::scales(&experiments, &views, &plant.values());
        let mut largest_scale = [0.0_f64; 2];
        for (index, scale) in scales.iter().enumerate() {
            let largest = &mut largest_scale[usize::from(plant.velocities().contains(&index))];
            *largest = largest.max(*scale);
        }
        Self {
            sigma: noise
                .iter()
                .zip(&spread)
                .map(|(noise, spread)| noise.max(CONFIG.model.finest_weight * spread))
                .collect(),
            state_scale: plant.state_names().into_iter().zip(scales).collect(),
            largest_scale,
            local_scale: local::names(plant)
                .zip(local::scales(plant, &experiments, &views, &plant.values()))
                .collect(),
            noise,
            step,
            spread,
            experiments,
        }
    }

    /// Takes over the steps of scales that other recordings of the same sensors show.
    pub fn learn_steps(&mut self, other: &Self) {
        for (step, known) in self.step.iter_mut().zip(&other.step) {
            *step = step.max(*known);
        }
        let rounding = self.step.iter().map(|step| step / 12.0_f64.sqrt());
        for ((noise, sigma), rounding) in self.noise.iter_mut().zip(&mut self.sigma).zip(rounding) {
            *noise = noise.max(rounding);
            *sigma = sigma.max(rounding);
        }
    }

    /// Takes over lower levels of noise where a sensor has one.
    pub fn correct_noise(&mut self, levels: &[Option<f64>]) {
        for (sensor, level) in levels.iter().enumerate() {
            let Some(level) = level else { continue };
            let level = level.max(self.step[sensor] / 12.0_f64.sqrt());
            if level < self.noise[sensor] {
                self.noise[sensor] = level;
                let finest = CONFIG.model.finest_weight * self.spread[sensor];
                self.sigma[sensor] = level.max(finest);
            }
        }
    }

    /// The same recordings with a steady drift (SI a second) taken out of one sensor.
    pub fn without_drift(&self, sensor: usize, rate: f64) -> Self {
        let mut still = self.clone();
        for experiment in &mut still.experiments {
            let begin = experiment.t[0];
            let signal = experiment.signals[sensor].iter_mut();
            for (value, t) in signal.zip(&experiment.t) {
                *value -= rate * (t - begin);
            }
        }
        still
    }

    /// The same recordings with one row more before the first, at which nothing was commanded and
    /// nothing was measured.
    pub fn after_no_command(&self, plant: &Plant) -> Self {
        let mut begun = self.clone();
        for experiment in &mut begun.experiments {
            let [first, second] = [experiment.t[0], experiment.t[1]];
            experiment.t.insert(0, 2.0 * first - second);
            for (column, input) in experiment.inputs.iter_mut().zip(plant.inputs()) {
                // A motion that is imposed is no command.
                let before = input.motion.map_or(0.0, |_| column[0]);
                column.insert(0, before);
            }
            for column in &mut experiment.signals {
                column.insert(0, f64::NAN);
            }
        }
        begun
    }

    /// Rows of all recordings.
    pub fn rows(&self) -> usize {
        self.experiments.iter().map(Experiment::rows).sum()
    }

    /// Valid samples of all sensors in some intervals.
    pub fn samples(&self, intervals: &[(usize, Range<usize>)]) -> f64 {
        let counts = intervals.iter().map(|(index, rows)| {
            let signals = self.experiments[*index].signals.iter();
            let of = |column: &Vec<f64>| {
                let valid = column[rows.clone()].iter().filter(|y| y.is_finite());
                valid.count()
            };
            signals.map(of).sum::<usize>()
        });
        counts.sum::<usize>() as f64
    }

    /// Each recording cut into at most `parts` equal intervals, none of them too short.
    pub fn cut(&self, parts: usize) -> Vec<(usize, Range<usize>)> {
        let mut intervals = Vec::new();
        for (index, experiment) in self.experiments.iter().enumerate() {
            let rows = experiment.rows();
            let count = parts.min(rows / CONFIG.split.interval_rows).max(1);
            for k in 0..count {
                intervals.push((index, k * rows / count..(k + 1) * rows / count));
            }
        }
        intervals
    }

    /// As [`Data::cut`], but of no more than about `budget` rows in all: intervals evenly spread
    /// over the recordings, as long as they may be.
    pub fn select(&self, parts: usize, budget: usize) -> Vec<(usize, Range<usize>)> {
        let rows = self.rows();
        if rows <= budget {
            return self.cut(parts);
        }
        let wanted = parts.max(CONFIG.split.fewest_intervals);
        let length = (budget / wanted).max(CONFIG.split.interval_rows);
        let mut intervals = Vec::new();
        for (index, experiment) in self.experiments.iter().enumerate() {
            let own = experiment.rows();
            let count = ((wanted * own) as f64 / rows as f64).round().max(1.0) as usize;
            let length = length.min(own / count).max(1);
            for k in 0..count {
                // The first begins where the recording does, the last ends where it ends.
                let begin = (k * (own - length)).checked_div(count - 1).unwrap_or(0);
                intervals.push((index, begin..begin + length));
            }
        }
        intervals
    }

    /// Intervals as a plant is driven over them.
    ///
    /// # Errors
    /// None that reading the recordings has not excluded.
    pub fn segments(
        &self,
        plant: &Plant,
        intervals: &[(usize, Range<usize>)],
    ) -> Result<Vec<Segment>> {
        let problem = self.judging(plant);
        intervals
            .iter()
            .map(|(index, rows)| problem.segment(*index, rows.clone()))
            .collect()
    }

    /// States that a plant has beyond those of the baseline rig: memories, lags and masses that
    /// effects bring.
    pub fn added(&self, plant: &Plant) -> Vec<usize> {
        let names = plant.state_names();
        let added = names.iter().enumerate();
        added
            .filter(|(_, name)| !self.state_scale.contains_key(*name))
            .map(|(index, _)| index)
            .collect()
    }

    /// Holds what effects have added to a start state where it is, to within the noise. A recording
    /// begins relaxed, as far as anybody knows; a state that no sensor shows and that is free at
    /// every start follows whatever the rig misses.
    pub fn hold(&self, plant: &Plant, segment: &mut Segment, state: &[f64]) {
        let scale = self.state_scale(plant);
        let shares = self.noise.iter().zip(&self.spread);
        let share = shares
            .map(|(noise, spread)| noise / spread)
            .filter(|share| share.is_finite())
            .fold(f64::INFINITY, f64::min)
            .clamp(CONFIG.model.finest_weight, 1.0);
        for index in self.added(plant) {
            segment.anchor.mean[index] = state[index] / scale[index];
            segment.anchor.weight[(index, index)] =
                (CONFIG.model.added_state_width * share).powi(-2);
        }
    }

    /// Start states for intervals as the recordings show them.
    ///
    /// # Errors
    /// None that reading the recordings has not excluded.
    pub fn starts(
        &self,
        rig: &Rig,
        plant: &Plant,
        segments: &[Segment],
        values: &[f64],
    ) -> Result<Vec<Vec<f64>>> {
        let problem = self.judging(plant);
        start::states(&problem, &Views::new(rig, plant), segments, values)
    }

    /// [`Data::starts`], less the guess: what was `found` for intervals of other data of the same
    /// recordings, where one of them begins at the same time; else what explains the first rows.
    ///
    /// # Errors
    /// None that reading the recordings has not excluded.
    pub fn carried(
        &self,
        (rig, plant): (&Rig, &Plant),
        values: &[f64],
        segments: &[Segment],
        found: Starts,
    ) -> Result<Vec<Vec<f64>>> {
        let mut states = self.starts(rig, plant, segments, values)?;
        let time = |data: &Self, index: usize, row: usize| data.experiments[index].t[row];
        for (segment, state) in segments.iter().zip(&mut states) {
            let begins = time(self, segment.experiment, segment.rows.start);
            for ((index, rows), known) in found.intervals.iter().zip(found.states) {
                if *index == segment.experiment && time(found.data, *index, rows.start) == begins {
                    state.clone_from(known);
                }
            }
        }
        let problem = self.judging(plant);
        Ok(start::near(&problem, segments, values, states))
    }

    /// [`Data::starts`], less the guess: where a interval begins within one whose start state was
    /// `found`, what the plant is in by then explains it better if anything of that was right;
    /// sliding or at rest, no measurement shows alone.
    ///
    /// # Errors
    /// None that reading the recordings has not excluded.
    pub fn along(
        &self,
        (rig, plant): (&Rig, &Plant),
        values: &[f64],
        segments: &[Segment],
        found: Starts,
    ) -> Result<Vec<Vec<f64>>> {
        let mut states = self.starts(rig, plant, segments, values)?;
        let here = self.judging(plant);
        let there = found.data.judging(plant);
        for (segment, state) in segments.iter().zip(&mut states) {
            let begins = self.experiments[segment.experiment].t[segment.rows.start];
            let times = &found.data.experiments[segment.experiment].t;
            let all = found.intervals.iter().zip(found.states);
            let covers = |rows: &Range<usize>| {
                let times = &times[rows.clone()];
                times.first().is_some_and(|t| *t <= begins)
                    && times.last().is_some_and(|t| begins <= *t)
            };
            let mut covering =
                all.filter(|((index, rows), _)| *index == segment.experiment && covers(rows));
            let Some(((index, rows), from)) = covering.next() else {
                continue;
            };
            let until = rows.start + times[rows.clone()].partition_point(|t| *t <= begins);
            let way = there.segment(*index, rows.start..until)?;
            let reached = there.final_state(&way, values, from);
            let whole = std::slice::from_ref(segment);
            let cost = |state: &Vec<f64>| here.cost(whole, values, std::slice::from_ref(state));
            if let Some(reached) = reached.filter(|reached| cost(reached) < cost(state)) {
                *state = reached;
            }
        }
        Ok(states)
    }

    /// The problem of simulating a plant over these recordings with its parameters held.
    pub fn judging<'a>(&'a self, plant: &'a Plant) -> Problem<'a> {
        let (sigma, sizes) = (self.sigma.clone(), self.state_scale(plant));
        Problem {
            local: local::slots(plant),
            ..Problem::of_states(plant, &self.experiments, sigma, sizes)
        }
    }

    /// Natural sizes of a body's position and velocity.
    pub fn size_of(&self, body: &str) -> Option<(f64, f64)> {
        let of = |what: &str| self.state_scale.get(&format!("{body}.{what}")).copied();
        of("position").zip(of("velocity"))
    }

    /// Natural sizes of a plant's states: of those that an effect adds, the largest of their sort.
    fn state_scale(&self, plant: &Plant) -> Vec<f64> {
        let velocities = plant.velocities();
        let names = plant.state_names();
        names
            .iter()
            .enumerate()
            .map(|(index, name)| match self.state_scale.get(name) {
                Some(scale) => *scale,
                None => self.largest_scale[usize::from(velocities.contains(&index))],
            })
            .chain(local::names(plant).map(|name| self.local_scale[&name]))
            .collect()
    }

    /// The same recordings with every `k`-th row: inputs averaged over what is left out, so that
    /// the plant gets the same impulse.
    pub fn thinned(&self, rig: &Rig, plant: &Plant, k: usize) -> Self {
        let experiments = self.experiments.iter().map(|full| {
            let rows: Vec<usize> = (0..full.rows()).step_by(k).collect();
            let mean = |column: &[f64], row: usize| {
                let part = &column[row..(row + k).min(column.len())];
                part.iter().sum::<f64>() / part.len() as f64
            };
            Experiment {
                name: full.name.clone(),
                t: rows.iter().map(|&row| full.t[row]).collect(),
                inputs: (full.inputs.iter().zip(plant.inputs()))
                    .map(|(column, input)| {
                        let thinned = rows.iter().map(|&row| match input.motion {
                            // An imposed motion is where it is at the row.
                            Some(_) => column[row],
                            None => mean(column, row),
                        });
                        thinned.collect()
                    })
                    .collect(),
                signals: full
                    .signals
                    .iter()
                    .map(|column| rows.iter().map(|&row| column[row]).collect())
                    .collect(),
                held: Vec::new(),
            }
        });
        let mut thin = Self::of(rig, plant, experiments.collect());
        thin.noise.clone_from(&self.noise);
        thin.sigma.clone_from(&self.sigma);
        thin.step.clone_from(&self.step);
        thin
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_start_within_a_known_stretch_is_where_the_plant_is_by_then() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../rigs/mass-spring-damper");
        let text = std::fs::read_to_string(format!("{folder}.toml"))
            .expect("the file ships with the project");
        // tests/foreign/mass_spring_damper.truth.json
        let friction = "\n[[effect]]\nkind = \"coulomb_friction\"\ncomponent = \"mass\"\nlevel = { value = 0.58 }\n";
        let rig = Rig::parse(&(text + friction), "rubbing.toml").expect("the text is a rig");
        let plant = Plant::new(&rig).expect("the rig can be simulated");
        let recording = Recording::read(format!("{folder}.fit.csv"))
            .expect("the recording ships with the project");
        let data = Data::new(&rig, &plant, &[recording]).expect("the rig is driven by the input");
        let values = plant.values();
        let whole = [(0, 0..600)];
        let first = data.segments(&plant, &whole).expect("rows are there");
        let states = data.starts(&rig, &plant, &first, &values).expect("a start");
        let found = Starts {
            data: &data,
            intervals: &whole,
            states: &states,
        };
        let later: Vec<_> = (1..6).map(|k| (0, 100 * k..100 * k + 40)).collect();
        let segments = data.segments(&plant, &later).expect("rows are there");
        let guessed = data
            .starts(&rig, &plant, &segments, &values)
            .expect("starts");
        let along = data
            .along((&rig, &plant), &values, &segments, found)
            .expect("starts");
        let problem = data.judging(&plant);
        let mut nearer = 0;
        for ((segment, guess), reached) in segments.iter().zip(&guessed).zip(&along) {
            let one = std::slice::from_ref(segment);
            let cost = |state: &Vec<f64>| problem.cost(one, &values, std::slice::from_ref(state));
            assert!(cost(reached) <= cost(guess));
            if reached != guess {
                nearer += 1;
                let way = problem.segment(0, 0..segment.rows.start + 1);
                let there = problem.final_state(&way.expect("rows"), &values, &states[0]);
                assert_eq!(Some(reached.clone()), there);
            }
        }
        assert!(nearer > 0, "every guess was better than the simulation");
    }
}

//! A rig that is being tried: its plant, which of its numbers may move, and how far.

use crate::diagnose::config::CONFIG;
use std::collections::BTreeMap;

use sinew_sim::{Plant, Rig, SimulationSettings};

use crate::diagnose::data::Data;
use crate::diagnose::term::{Term, Tried};
use crate::error::Result;
use crate::fit::bounds::bounds;
use crate::fit::levenberg::{DecisionVariables, Prior, Stop, StoppingCriteria, minimise};
use crate::fit::segment::{Problem, Segment};
use crate::fit::stages::fitted_slots;
use crate::fit::uncertainty;

/// A rig under trial.
#[derive(Clone)]
pub(crate) struct Model {
    /// The rig, effects under trial included.
    pub rig: Rig,
    /// Compiled.
    pub plant: Plant,
    /// Slots of the parameters that are fitted: those of the rig, then those of the effects.
    pub slots: Vec<usize>,
    /// Number of `slots` that belong to the rig itself; the others are under trial.
    pub own: usize,
    /// Nominal values of the rig, for the prior, one entry a slot of `slots`.
    written: Vec<f64>,
    bounds: Vec<[f64; 2]>,
    /// Standard deviation of the prior of what is under trial, in units of its scale.
    trial_width: f64,
    /// Indices into `slots` of parameters that change together.
    tied: Vec<Vec<usize>>,
    /// Slots of the rig's bare numbers that are not under trial.
    bare: Vec<usize>,
}

/// End of a search.
#[derive(Clone)]
pub(crate) struct Point {
    /// Every parameter of the plant, SI.
    pub values: Vec<f64>,
    /// One start state a interval, SI.
    pub states: Vec<Vec<f64>>,
    /// Half the squared residuals in units of the weights, prior included.
    pub cost: f64,
    /// Why the search ended.
    pub stop: Stop,
}

impl Model {
    /// A model in which the parameters of these terms are under trial: free, without prior or
    /// bounds but those of their law.
    ///
    /// # Errors
    /// A rig that cannot be compiled.
    pub fn new(
        rig: &Rig,
        written: &Rig,
        terms: &[Term],
        settings: SimulationSettings,
    ) -> Result<Self> {
        let plant = Plant::new(rig)?.with_settings(settings);
        let as_written = Plant::new(written)?;
        let trial: Vec<Tried> = terms.iter().flat_map(|term| term.tried(&plant)).collect();
        let mut slots: Vec<usize> = fitted_slots(&plant)
            .into_iter()
            .filter(|&slot| {
                let name = &plant.parameters()[slot].name;
                !trial.iter().any(|tried| tried.name == *name)
            })
            .collect();
        let own = slots.len();
        slots.extend(trial.iter().filter_map(|tried| plant.slot(&tried.name)));
        let known = plant.parameters();
        let said = as_written.values();
        let written = slots
            .iter()
            .map(|&slot| {
                as_written
                    .slot(&known[slot].name)
                    .map_or(known[slot].value, |at| said[at])
            })
            .collect();
        let limits = slots
            .iter()
            .enumerate()
            .map(|(index, &slot)| {
                if index < own {
                    bounds(&known[slot])
                } else {
                    trial[index - own].bounds
                }
            })
            .collect();
        let is_bare = |slot: &usize| {
            let parameter = &known[*slot];
            !parameter.free && as_written.slot(&parameter.name).is_some() && !slots.contains(slot)
        };
        let bare = (0..known.len()).filter(is_bare).collect();
        Ok(Self {
            rig: rig.clone(),
            slots,
            own,
            written,
            bounds: limits,
            trial_width: f64::INFINITY,
            tied: Vec::new(),
            bare,
            plant,
        })
    }

    /// The same with a prior of that width, in units of their scale, about what the rig says of
    /// what is under trial.
    pub fn doubting(self, width: f64) -> Self {
        Self {
            trial_width: width,
            ..self
        }
    }

    /// The same, with the parameters of each of these lists changing by the same part of their
    /// scales.
    pub fn tied(self, lists: &[Vec<String>]) -> Self {
        let known = self.plant.parameters();
        let index = |name: &String| {
            let named = |&slot: &usize| known[slot].name == *name;
            self.slots.iter().position(named)
        };
        let tied = lists
            .iter()
            .map(|names| names.iter().filter_map(index).collect());
        Self {
            tied: tied.collect(),
            ..self
        }
    }

    /// The same, with these parameters kept at zero or more.
    pub fn signed(mut self, names: &[String]) -> Self {
        for name in names {
            let slot = self.plant.slot(name);
            let at = self.slots.iter().position(|known| Some(*known) == slot);
            if let Some(at) = at {
                self.bounds[at][0] = self.bounds[at][0].max(0.0);
            }
        }
        self
    }

    /// These values, taken back within the bounds.
    pub fn within(&self, values: &[f64]) -> Vec<f64> {
        let mut values = values.to_vec();
        for (&slot, [low, high]) in self.slots.iter().zip(&self.bounds) {
            values[slot] = values[slot].clamp(*low, *high);
        }
        values
    }

    /// The same, integrated as `settings` say.
    pub fn integrated(&self, settings: SimulationSettings) -> Self {
        Self {
            plant: self.plant.clone().with_settings(settings),
            ..self.clone()
        }
    }

    /// The fitted parameters of the rig itself: slots, and what the rig says.
    pub fn own(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        let slots = self.slots.iter().zip(&self.written);
        slots
            .take(self.own)
            .map(|(slot, written)| (*slot, *written))
    }

    /// The problem of fitting this model to data, its scales taken at `values`.
    pub fn problem<'a>(
        &'a self,
        data: &'a Data,
        segments: &[Segment],
        point: &DecisionVariables,
    ) -> Problem<'a> {
        let mut problem = Problem {
            scale: self
                .slots
                .iter()
                .zip(&self.written)
                .map(|(&slot, written)| point.values[slot].abs().max(written.abs()))
                .collect(),
            slots: self.slots.clone(),
            ..data.judging(&self.plant)
        };
        if problem.scale.contains(&0.0) {
            give_scales(&mut problem, segments, point);
        }
        problem
    }

    fn prior(&self, problem: &Problem) -> Prior {
        Prior {
            bounds: self.bounds.clone(),
            written: self.written.clone(),
            widths: (0..problem.parameters())
                .map(|index| {
                    if index < self.own {
                        CONFIG.model.prior_width
                    } else {
                        self.trial_width
                    }
                })
                .collect(),
            tied: self.tied.clone(),
            sums: Vec::new(),
            fleet: None,
        }
    }

    /// The same with every parameter held: a fit is of start states alone.
    pub fn held(&self) -> Self {
        self.holding(|_| true)
    }

    /// The same with those parameters held whose names are.
    pub fn holding(&self, held: impl Fn(&str) -> bool) -> Self {
        let known = self.plant.parameters();
        let free = |&index: &usize| !held(&known[self.slots[index]].name);
        let free: Vec<usize> = (0..self.slots.len()).filter(free).collect();
        Self {
            slots: free.iter().map(|&index| self.slots[index]).collect(),
            own: free.iter().filter(|&&index| index < self.own).count(),
            bounds: free.iter().map(|&index| self.bounds[index]).collect(),
            written: free.iter().map(|&index| self.written[index]).collect(),
            tied: Vec::new(),
            ..self.clone()
        }
    }

    /// The start states fitted alone, where tendons may pull against each other. States that are
    /// far off are otherwise made up for by letting tendons hang, and those stay slack: one tendon
    /// of twice the stiffness moves a rig as two taut ones do.
    pub fn begun(
        &self,
        data: &Data,
        segments: &mut [Segment],
        from: DecisionVariables,
    ) -> DecisionVariables {
        if self.rig.tendons.len() < 2 {
            return from;
        }
        let point =
            self.held()
                .improve(data, segments, from.clone(), CONFIG.model.state_steps, 1e-4);
        point.map_or(from, |point| DecisionVariables {
            values: point.values,
            states: point.states,
        })
    }

    /// Improves a point by at most `steps` steps. `None` where it cannot be simulated.
    pub fn improve(
        &self,
        data: &Data,
        segments: &mut [Segment],
        from: DecisionVariables,
        steps: usize,
        relative: f64,
    ) -> Option<Point> {
        for (segment, state) in segments.iter_mut().zip(&from.states) {
            if segment.rows.start == 0 {
                data.hold(&self.plant, segment, state);
            }
        }
        let segments = &*segments;
        let problem = self.problem(data, segments, &from);
        let prior = self.prior(&problem);
        let mut unknowns = from;
        let effort = StoppingCriteria {
            iterations: steps,
            relative,
        };
        let (stop, _) = minimise(
            &problem,
            &prior,
            segments,
            &mut unknowns,
            &effort,
            &mut |_, _| {},
        )?;
        let cost = problem.cost(segments, &unknowns.values, &unknowns.states);
        cost.is_finite().then_some(Point {
            values: unknowns.values,
            states: unknowns.states,
            cost,
            stop,
        })
    }

    /// Half widths of the 95 % intervals of the fitted parameters, by name
    /// (docs/explanation/identification.md, eq. 12).
    pub fn half_widths(
        &self,
        data: &Data,
        segments: &[Segment],
        point: &Point,
    ) -> BTreeMap<String, f64> {
        let unknowns = DecisionVariables {
            values: point.values.clone(),
            states: point.states.clone(),
        };
        let problem = self.problem(data, segments, &unknowns);
        let prior = self.prior(&problem);
        let widths = uncertainty::half_widths(&problem, &prior, segments, &unknowns);
        let known = self.plant.parameters();
        self.slots
            .iter()
            .zip(widths.parameters)
            .filter_map(|(&slot, width)| Some((known[slot].name.clone(), width.half()?)))
            .collect()
    }

    /// The plant's parameters with those of another plant where the names agree. Bare numbers that
    /// are not under trial keep the rig's value, whatever was tried there.
    pub fn inherit(&self, other: &Plant, values: &[f64]) -> Vec<f64> {
        let inherited = self
            .plant
            .parameters()
            .iter()
            .map(|parameter| {
                other
                    .slot(&parameter.name)
                    .map_or(parameter.value, |slot| values[slot])
            })
            .collect();
        self.with_bare(inherited)
    }

    /// These values, with the rig's own of the bare numbers that are not under trial.
    pub fn with_bare(&self, mut values: Vec<f64>) -> Vec<f64> {
        for &slot in &self.bare {
            values[slot] = self.plant.parameters()[slot].value;
        }
        values
    }

    /// The rig with these values in it.
    ///
    /// # Errors
    /// A value that a rig file cannot hold.
    pub fn with(&self, values: &[f64]) -> Result<Rig> {
        let known = self.plant.parameters();
        let named: Vec<(&str, f64)> = self
            .slots
            .iter()
            .map(|&slot| (known[slot].name.as_str(), values[slot]))
            .collect();
        Ok(self.rig.with_values(&named)?)
    }
}

/// A parameter that is zero takes the size that would move the signals by their weight.
fn give_scales(problem: &mut Problem, segments: &[Segment], point: &DecisionVariables) {
    let silent: Vec<usize> = (0..problem.parameters())
        .filter(|&j| problem.scale[j] == 0.0)
        .collect();
    for &j in &silent {
        problem.scale[j] = 1.0;
    }
    let alone = Problem {
        slots: silent.iter().map(|&j| problem.slots[j]).collect(),
        scale: vec![1.0; silent.len()],
        ..problem.clone()
    };
    let Some((squares, samples)) = alone.sensitivities(segments, &point.values, &point.states)
    else {
        return;
    };
    for (&j, squares) in silent.iter().zip(squares) {
        let scale = (samples.max(1) as f64 / squares).sqrt();
        if scale.is_finite() && scale > 0.0 {
            problem.scale[j] = scale;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::term::term;

    /// Bounds of the only parameter of that name, with an effect at the demo's mass that begins
    /// like this.
    fn bounds(effect: &str, begun: &[f64], parameter: &str) -> [f64; 2] {
        let file = concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../../rigs/mass-spring-damper.toml"
        );
        let rig = Rig::load(file).expect("the demo's rig ships with the project");
        let term = term(&rig, effect, &["mass"]);
        let with = term
            .apply(&rig, begun)
            .expect("the effect can sit at the mass");
        let model = Model::new(&with, &rig, &[term], SimulationSettings::default())
            .expect("the model compiles");
        let named = |slot: &usize| model.plant.parameters()[*slot].name.ends_with(parameter);
        let at = model.slots.iter().position(named);
        model.bounds[at.expect("the parameter is under trial")]
    }

    /// A damping that is zero in truth ended a thousandth below it, and the friction was refused
    /// for its sign.
    #[test]
    fn what_a_trial_leaves_below_zero_is_taken_back_to_the_bound_and_the_rest_stays() {
        let file = concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../../rigs/mass-spring-damper.toml"
        );
        let rig = Rig::load(file).expect("the demo's rig ships with the project");
        let term = term(&rig, "direction_dependent_friction", &["mass"]);
        let with = term
            .apply(&rig, &[1.0, 2.0, 0.5, 0.5])
            .expect("the effect can sit at the mass");
        let terms = [term.clone()];
        let model = Model::new(&with, &rig, &terms, SimulationSettings::default())
            .expect("the model compiles");
        let damping = model
            .plant
            .slot("mass.direction_dependent_friction.damping_pos");
        let mut ended = model.plant.values();
        ended[damping.expect("the rig has a damping")] = -1e-3;
        assert_eq!(model.within(&ended), ended);
        let signed = model.clone().signed(&term.not_below_zero());
        let back = signed.within(&ended);
        ended[damping.expect("the rig has a damping")] = 0.0;
        assert_eq!(back, ended);
    }

    /// A ripple of 400 m over a fall of 47 m was once named where a ball only met the air.
    #[test]
    fn a_ripple_under_trial_gets_no_longer_than_the_motion_it_began_with() {
        let found = bounds("position_ripple", &[1.0, 20.0, 0.0], "wave_number");
        assert_eq!(found, [0.7 * 20.0, f64::INFINITY]);
    }

    /// As steep as it likes, it is dry friction, at the price of thousands of sub-steps.
    #[test]
    fn a_stribeck_friction_under_trial_gets_no_steeper_than_a_few_times_what_it_began_with() {
        let found = bounds("stribeck_friction", &[1.0, 2.0, 0.1], ".velocity");
        assert_eq!(found, [0.25 * 0.1, f64::INFINITY]);
    }
}

//! Regime of a mismatch: the region of states in which the force that a rig lacks acts
//! (docs/explanation/diagnosis.md, eq. 17a to 17c).

use serde::Serialize;
use sinew_sim::effects::Quantity as Unit;
use sinew_sim::rig::Drives;
use sinew_sim::{Plant, Rig};

use crate::diagnose::config::CONFIG;
use crate::diagnose::data::Data;
use crate::diagnose::locate::latent_force::{Place, Pushed, places};
use crate::diagnose::locate::traces::{recover_all, thin, wanders};
use crate::diagnose::wording::share_of;
use crate::error::Result;
use crate::fit::free_run;
use crate::recording::Recording;
use crate::report::quantity;

/// Region of states in which the missing force acts.
///
/// With `above` alone it acts above that value, with `below` alone below that one. With both it
/// acts outside of them where `below` is the smaller, and between them where it is the larger.
/// Without both it acts everywhere.
///
/// ```
/// use sinew_ident::diagnose::{Axis, Regime};
/// let stop = Regime {
///     component: "joint".into(),
///     axis: Axis::Position,
///     unit: "rad".into(),
///     below: Some(-0.4),
///     above: Some(0.4),
///     share: 0.1,
///     agreement: 0.97,
/// };
/// assert!(stop.holds(0.5) && stop.holds(-0.5) && !stop.holds(0.0));
/// ```
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Regime {
    /// The component at which the force acts.
    pub component: String,
    /// Quantity that the region is said in.
    pub axis: Axis,
    /// Its unit.
    pub unit: String,
    /// Value below which it acts.
    pub below: Option<f64>,
    /// Value above which it acts.
    pub above: Option<f64>,
    /// Part of the samples at which it acts (eq. 17a).
    pub share: f64,
    /// Agreement of the region with these samples, F1 (eq. 17c): 1 is all of them and no other.
    pub agreement: f64,
}

/// Quantity that a region is said in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Axis {
    /// Position at the component.
    Position,
    /// Velocity at the component.
    Velocity,
    /// Input of the actuator that drives it.
    Input,
    /// No quantity: it acts everywhere.
    Everywhere,
}

impl Axis {
    /// Its name in a sentence.
    pub fn name(self) -> &'static str {
        match self {
            Self::Position => "position",
            Self::Velocity => "velocity",
            Self::Input => "input",
            Self::Everywhere => "everywhere",
        }
    }
}

/// Force that is missing at one sample, and where the device was.
#[derive(Clone, Copy, Debug)]
pub struct ForceSample {
    /// Position at the component, SI.
    pub position: f64,
    /// Velocity at the component, SI.
    pub velocity: f64,
    /// Input of the actuator that drives it; `None` where nothing does.
    pub input: Option<f64>,
    /// The missing force, SI.
    pub force: f64,
}

impl ForceSample {
    /// Value of an axis; `None` where it has none.
    pub fn on(&self, axis: Axis) -> Option<f64> {
        match axis {
            Axis::Position => Some(self.position),
            Axis::Velocity => Some(self.velocity),
            Axis::Input => self.input,
            Axis::Everywhere => Some(0.0),
        }
    }
}

impl Regime {
    /// Tells whether the force acts where its axis has this value.
    pub fn holds(&self, value: f64) -> bool {
        holds([self.below, self.above], value)
    }

    /// For a person: the region, and the part of the samples at which the force acts.
    pub fn sentence(&self) -> String {
        let number = |value: f64| quantity(value, &self.unit);
        let axis = self.axis.name();
        let region = match (self.below, self.above) {
            (None, None) => "all along the motion".to_owned(),
            (None, Some(above)) => format!("where {axis} is above {}", number(above)),
            (Some(below), None) => format!("where {axis} is below {}", number(below)),
            (Some(below), Some(above)) if below <= above => format!(
                "where {axis} is below {} or above {}",
                number(below),
                number(above)
            ),
            (Some(below), Some(above)) => format!(
                "where {axis} is between {} and {}",
                number(above),
                number(below)
            ),
        };
        format!("{region} ({} of the samples)", share_of(self.share))
    }
}

/// Membership of a value in the region of two ends.
fn holds(ends: [Option<f64>; 2], value: f64) -> bool {
    match ends {
        [None, None] => true,
        [None, Some(above)] => value > above,
        [Some(below), None] => value < below,
        [Some(below), Some(above)] if below <= above => value < below || value > above,
        [Some(below), Some(above)] => value < below && value > above,
    }
}

/// Samples at which a missing force acts: it is larger than a part of its largest values (eq. 17a).
pub fn acting(samples: &[ForceSample]) -> Vec<bool> {
    let mut sizes: Vec<f64> = samples.iter().map(|s| s.force.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    let at = (CONFIG.locate.largest * sizes.len() as f64) as usize;
    let large = sizes.get(at).or(sizes.last()).copied().unwrap_or(0.0);
    let least = CONFIG.locate.acts * large;
    samples.iter().map(|s| s.force.abs() > least).collect()
}

/// Agreement of two selections of samples, F1 (eq. 17c); 1 where both are empty.
pub fn agreement(said: impl Iterator<Item = bool>, wanted: &[bool]) -> f64 {
    let (mut both, mut one) = (0_usize, 0_usize);
    for (said, &wanted) in said.zip(wanted) {
        both += usize::from(said && wanted);
        one += usize::from(said != wanted);
    }
    if both + one == 0 {
        return 1.0;
    }
    2.0 * both as f64 / (2 * both + one) as f64
}

/// The region that agrees best with the samples at which a force acts; one on an axis has to agree
/// better than everywhere by a margin. `None` where it acts nowhere.
pub(crate) fn regime(
    component: &str,
    units: &[String; 3],
    samples: &[ForceSample],
) -> Option<Regime> {
    let acts = acting(samples);
    let share = acts.iter().filter(|acts| **acts).count() as f64 / samples.len().max(1) as f64;
    if share == 0.0 {
        return None;
    }
    let mut best = Regime {
        component: component.to_owned(),
        axis: Axis::Everywhere,
        unit: "1".into(),
        below: None,
        above: None,
        share,
        agreement: agreement(samples.iter().map(|_| true), &acts),
    };
    for (axis, unit) in [Axis::Position, Axis::Velocity, Axis::Input]
        .into_iter()
        .zip(units)
    {
        let Some((ends, agreement)) = best_ends(axis, samples, &acts) else {
            continue;
        };
        if agreement > best.agreement + CONFIG.locate.plainer {
            best = Regime {
                axis,
                unit: unit.to_owned(),
                below: ends[0],
                above: ends[1],
                agreement,
                ..best
            };
        }
    }
    Some(best)
}

/// The ends on one axis that agree best, among quantiles of its values.
fn best_ends(
    axis: Axis,
    samples: &[ForceSample],
    acts: &[bool],
) -> Option<([Option<f64>; 2], f64)> {
    let values: Vec<f64> = samples
        .iter()
        .map(|s| s.on(axis))
        .collect::<Option<Vec<_>>>()?;
    let mut order: Vec<(f64, bool)> = values.into_iter().zip(acts.iter().copied()).collect();
    order.sort_by(|a, b| a.0.total_cmp(&b.0));
    // How many of the samples below a cut act, so that a pair of cuts costs nothing.
    let cuts: Vec<usize> = (1..CONFIG.locate.cuts)
        .map(|part| part * order.len() / CONFIG.locate.cuts)
        .collect();
    let before: Vec<usize> = std::iter::once(0)
        .chain(order.iter().scan(0, |sum, (_, acts)| {
            *sum += usize::from(*acts);
            Some(*sum)
        }))
        .collect();
    let all = *before.last()?;
    let score = |inside: usize, chosen: usize| {
        let one = chosen + all - 2 * inside;
        2.0 * inside as f64 / (2 * inside + one).max(1) as f64
    };
    let value = |cut: usize| 0.5 * (order[cut - 1].0 + order[cut].0);
    let mut best: Option<([Option<f64>; 2], f64)> = None;
    let mut offer = |ends: [Option<f64>; 2], score: f64| {
        if best.as_ref().is_none_or(|(_, most)| score > *most) {
            best = Some((ends, score));
        }
    };
    for (index, &low) in cuts.iter().enumerate().filter(|(_, cut)| **cut > 0) {
        offer([Some(value(low)), None], score(before[low], low));
        offer(
            [None, Some(value(low))],
            score(all - before[low], order.len() - low),
        );
        for &high in &cuts[index + 1..] {
            let inside = before[high] - before[low];
            let outside = score(all - inside, order.len() - (high - low));
            // Two ends have to earn the second one.
            offer(
                [Some(value(low)), Some(value(high))],
                outside - CONFIG.locate.second_end,
            );
            offer(
                [Some(value(high)), Some(value(low))],
                score(inside, high - low) - CONFIG.locate.second_end,
            );
        }
    }
    let (ends, _) = best?;
    let said = order.iter().map(|(value, _)| holds(ends, *value));
    let wanted: Vec<bool> = order.iter().map(|(_, acts)| *acts).collect();
    Some((ends, agreement(said, &wanted)))
}

/// Region in which the named effects act at a component: the corrected rig beside itself without
/// them. `None` where they are no force there.
///
/// # Errors
/// Recordings that do not fit the rig.
pub(crate) fn of_named(
    refitted: &Rig,
    corrected: &Rig,
    component: &str,
    recordings: &[Recording],
) -> Result<Option<Regime>> {
    let plant = Plant::new(refitted)?;
    let with = Plant::new(corrected)?;
    let values = plant.parameters().iter().filter_map(|own| {
        let slot = with.slot(&own.name)?;
        Some((own.name.as_str(), with.parameters()[slot].value))
    });
    let without = refitted.with_values(&values.collect::<Vec<_>>())?;
    let place = places(refitted)
        .into_iter()
        .find(|p| p.component == component);
    let Some(place) = place else {
        return Ok(None);
    };
    let samples = force_along(&without, corrected, component, recordings)?;
    let units = units(refitted, &plant, &place, driving(refitted, &plant, &place));
    Ok(samples.and_then(|samples| regime(component, &units, &samples)))
}

/// Force by which a rig with some physics differs from the one without it, at one component along
/// the motion of recordings (eq. 15a); `None` where it is no force, as of a sensor.
///
/// # Errors
/// Recordings that do not fit the rig.
pub fn force_along(
    without: &Rig,
    with: &Rig,
    component: &str,
    recordings: &[Recording],
) -> Result<Option<Vec<ForceSample>>> {
    let plant = Plant::new(without)?;
    let data = Data::new(without, &plant, recordings)?;
    let data = thin(&data, without, &plant);
    let Some(pushed) = Pushed::new(without) else {
        return Ok(None);
    };
    let found = places(without)
        .into_iter()
        .find(|p| p.component == component);
    let Some(place) = found else {
        return Ok(None);
    };
    let mut best = None;
    for wander in wanders(without, &data, &place) {
        if let Some(trace) = pushed.recover(without, &place, wander, &data, 0)?
            && best
                .as_ref()
                .is_none_or(|(_, evidence)| trace.evidence > *evidence)
        {
            best = Some((wander, trace.evidence));
        }
    }
    let Some((wander, _)) = best else {
        return Ok(None);
    };
    let traces = recover_all(&pushed, without, (&place, wander), &data)?;
    let column = driving(without, &plant, &place);
    let named = Plant::new(with)?;
    let mut samples = Vec::new();
    for (index, trace) in traces.iter().enumerate() {
        let experiment = &data.experiments[index];
        let Ok(run) = free_run(with, &recordings[index]) else {
            return Ok(None);
        };
        let law = pushed.named_law(&place, (&named, &run.values), experiment, trace);
        if law.is_empty() {
            return Ok(None);
        }
        samples.extend(law.iter().enumerate().map(|(row, force)| ForceSample {
            position: trace.position[row],
            velocity: trace.velocity[row],
            input: column.map(|column| experiment.inputs[column][row]),
            force: *force,
        }));
    }
    let largest = samples
        .iter()
        .fold(0.0, |most: f64, s| most.max(s.force.abs()));
    Ok((largest > CONFIG.locate.no_force * wander.size).then_some(samples))
}

/// Column of the input that drives a place, else of the first one.
pub(crate) fn driving(rig: &Rig, plant: &Plant, place: &Place) -> Option<usize> {
    let mut actuators = rig.actuators.iter();
    let driven = actuators.find(|actuator| actuator.drives == Drives::Body(place.to));
    let actuator = driven.or(rig.actuators.first())?;
    let mut inputs = plant.inputs().iter();
    inputs.position(|input| input.column == actuator.input)
}

/// Units of position, velocity and the input in this column at a place.
pub(crate) fn units(rig: &Rig, plant: &Plant, place: &Place, column: Option<usize>) -> [String; 3] {
    let motion = rig.bodies[place.to].motion;
    let input = column.map_or("", |column| plant.inputs()[column].unit());
    [
        Unit::Coordinate.unit(motion).to_owned(),
        Unit::Velocity.unit(motion).to_owned(),
        input.to_owned(),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A swing of two frequencies under a force.
    fn swing(force: impl Fn(f64, f64) -> f64) -> Vec<ForceSample> {
        let at = |k: u32| {
            let angle = 0.013 * f64::from(k);
            let (position, velocity) = (
                angle.sin() + 0.5 * (2.3 * angle).sin(),
                angle.cos() + 1.15 * (2.3 * angle).cos(),
            );
            ForceSample {
                position,
                velocity,
                input: Some((0.31 * angle).sin()),
                force: force(position, velocity),
            }
        };
        (0..1500).map(at).collect()
    }

    fn of(force: impl Fn(f64, f64) -> f64) -> Option<Regime> {
        let units = ["rad".to_owned(), "rad/s".to_owned(), "V".to_owned()];
        regime("joint", &units, &swing(force))
    }

    #[test]
    fn a_stop_acts_beyond_its_end() {
        let found = of(|q, _| -40.0 * (q - 0.6).max(0.0)).unwrap();
        assert_eq!((found.axis, found.below), (Axis::Position, None));
        let end = found.above.unwrap();
        // A fifth of the largest force is a little beyond.
        assert!((0.65..0.9).contains(&end), "{end}");
        assert!(found.agreement > 0.95, "{}", found.agreement);
        assert!(found.sentence().starts_with("where position is above 0."));
    }

    #[test]
    fn drag_acts_at_speed_in_both_directions() {
        let found = of(|_, v| -v * v.abs()).unwrap();
        assert_eq!(found.axis, Axis::Velocity);
        let (below, above) = (found.below.unwrap(), found.above.unwrap());
        // A fifth of the largest force: at the root of it of the speed.
        let end = 0.2_f64.sqrt() * 2.0;
        assert!((below + end).abs() < 0.15 && (above - end).abs() < 0.15);
        assert!(found.agreement > 0.97);
    }

    #[test]
    fn a_force_within_a_band_is_between_two_ends() {
        let found = of(|q, _| if q.abs() < 0.3 { 1.0 } else { 0.0 }).unwrap();
        assert_eq!(found.axis, Axis::Position);
        assert!(found.below.unwrap() > found.above.unwrap());
        assert!(found.holds(0.0) && !found.holds(0.5) && !found.holds(-0.5));
    }

    #[test]
    fn dry_friction_and_a_load_act_all_along_the_motion() {
        for found in [of(|_, v| -v.signum()), of(|_, _| 2.0)] {
            let found = found.unwrap();
            assert_eq!((found.axis, found.share), (Axis::Everywhere, 1.0));
            assert!(found.holds(-7.0));
        }
    }

    #[test]
    fn no_force_acts_nowhere() {
        assert_eq!(of(|_, _| 0.0), None);
        assert_eq!(regime("joint", &Default::default(), &[]), None);
    }

    #[test]
    fn agreement_counts_what_is_missed_and_what_is_too_much() {
        let wanted = [true, true, false, false];
        assert_eq!(
            agreement([true, false, true, false].into_iter(), &wanted),
            0.5
        );
        assert_eq!(agreement([false; 4].into_iter(), &[false; 4]), 1.0);
    }
}

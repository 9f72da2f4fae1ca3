//! Targets: what a plan is to reach, row by row.

use std::ops::Range;

use sinew_ident::error::{Error, Result};
use sinew_ident::recording::Recording;
use sinew_sim::Plant;

use crate::goal::Goal;
use crate::quantity::Quantity;

/// Wanted value of one quantity at one row.
#[derive(Clone, Debug)]
pub(crate) struct Target {
    pub row: usize,
    pub quantity: Quantity,
    /// SI.
    pub value: f64,
    /// Distance that counts as one, SI.
    pub scale: f64,
    /// Residual per distance, 1/SI; before the scale is known, the share of the target.
    pub weight: f64,
    /// Index of the goal; none for a sample of a path.
    pub goal: Option<usize>,
}

/// One target a goal, in the order of their rows.
///
/// # Errors
/// `Arguments` for a name that is not known.
pub(crate) fn of_goals(plant: &Plant, goals: &[Goal], t: &[f64]) -> Result<Vec<Target>> {
    let target = |(index, goal): (usize, &Goal)| {
        let quantity = Quantity::find(plant, &goal.name)?;
        Ok(Target {
            row: nearest_row(t, goal.time_s),
            quantity,
            value: goal.value * quantity.factor(plant),
            scale: 1.0,
            weight: 1.0,
            goal: Some(index),
        })
    };
    let targets: Vec<Target> = goals
        .iter()
        .enumerate()
        .map(target)
        .collect::<Result<_>>()?;
    for (later, target) in targets.iter().enumerate() {
        let contradicts = |other: &&Target| {
            (other.row, other.quantity) == (target.row, target.quantity)
                && other.value != target.value
        };
        if let Some(other) = targets[..later].iter().find(contradicts) {
            let [goal, other] =
                [target, other].map(|of| of.goal.and_then(|index| goals.get(index)));
            let words = |goal: Option<&Goal>| goal.map_or(String::new(), ToString::to_string);
            return Err(Error::arguments(format!(
                "the goal `{}` contradicts `{}`",
                words(goal),
                words(other)
            ))
            .help("one value of a signal at a time"));
        }
    }
    Ok(targets)
}

/// Targets along a path: each column that names a sensor or a state, linear between its samples,
/// at every row within its times. The squares of all targets of a column add up to their mean.
///
/// # Errors
/// `File` for a path in which no column is known.
pub(crate) fn of_path(plant: &Plant, path: &Recording, t: &[f64]) -> Result<Vec<Target>> {
    let mut targets = Vec::new();
    let mut known = None;
    for column in path.columns() {
        let Ok(quantity) = Quantity::find(plant, &column.name) else {
            continue;
        };
        known = Some(&column.name);
        let samples = path.t().iter().zip(&column.values);
        let samples: Vec<(f64, f64)> = samples
            .filter(|(_, value)| value.is_finite())
            .map(|(&t, &value)| (t, value))
            .collect();
        let rows: Vec<(usize, f64)> = t
            .iter()
            .enumerate()
            .skip(1)
            .filter_map(|(row, &t)| Some((row, between(&samples, t)?)))
            .collect();
        let weight = 1.0 / (rows.len().max(1) as f64).sqrt();
        targets.extend(rows.into_iter().map(|(row, value)| Target {
            row,
            quantity,
            value: value * quantity.factor(plant),
            scale: 1.0,
            weight,
            goal: None,
        }));
    }
    if let Some(name) = known.filter(|_| targets.is_empty()) {
        let message = format!("`{name}` has no value at a row of the plan");
        return Err(Error::file(path.path(), message)
            .at(path.header_line(), 1)
            .expected("two samples or more that are numbers, with a row between them"));
    }
    if targets.is_empty() {
        let names: Vec<&str> = path.columns().iter().map(|c| c.name.as_str()).collect();
        let message = "no column of the path names a sensor or a coordinate of the rig";
        return Err(Error::file(path.path(), message)
            .at(path.header_line(), 1)
            .expected(format!(
                "`t` and a column such as `{}`; this path has `{}`",
                plant
                    .sensors()
                    .first()
                    .map_or("BODY.position", |s| &s.column),
                names.join("`, `")
            )));
    }
    targets.sort_by_key(|target| target.row);
    Ok(targets)
}

/// Indices of the targets of a row.
pub(crate) fn at_row(targets: &[Target], row: usize) -> impl Iterator<Item = usize> {
    let matching = targets.iter().enumerate();
    matching.filter_map(move |(index, target)| (target.row == row).then_some(index))
}

/// Row whose time is nearest.
fn nearest_row(t: &[f64], time: f64) -> usize {
    let next = t.partition_point(|t| *t < time).min(t.len() - 1);
    let Range { start: first, end } = next.saturating_sub(1)..next;
    if time - t[first] < t[end] - time {
        first
    } else {
        end
    }
}

/// Linear between the samples around `at`; none outside of them.
fn between(samples: &[(f64, f64)], at: f64) -> Option<f64> {
    let next = samples.partition_point(|(t, _)| *t < at);
    let &(t1, y1) = samples.get(next)?;
    if t1 == at {
        return Some(y1);
    }
    let &(t0, y0) = samples.get(next.checked_sub(1)?)?;
    Some(y0 + (y1 - y0) * (at - t0) / (t1 - t0))
}

//! Choice of the rows of a screening: where the mismatch is, if the rows that were spread over the
//! recordings hold none of it (docs/explanation/diagnosis.md, "Successive halving").

use crate::diagnose::config::CONFIG;
use std::ops::Range;

use crate::diagnose::acceptance::stands_out;
use crate::diagnose::candidate::Trial;
use crate::diagnose::residuals::Residuals;
use crate::diagnose::search::subset::{Subset, screening_rows};
use crate::error::Result;
use crate::fit::local;
use crate::order;

/// The subset with as many intervals as it has, and no longer, where the fitted rig leaves most of
/// the squares. `None` where something stands out on the subset as it is: a stop that is met once
/// in a recording may lie between its intervals.
///
/// # Errors
/// None that fitting the rig has not excluded.
pub(crate) fn refocused<'a>(subset: &Subset<'a>, fitted: &Trial) -> Result<Option<Subset<'a>>> {
    let left = |intervals: &[(usize, Range<usize>)], states: Option<&[Vec<f64>]>| {
        Residuals::of(
            &fitted.model,
            &fitted.point.values,
            subset.data,
            intervals,
            states,
        )
    };
    let here = left(&subset.intervals, Some(&fitted.point.states))?;
    if here.is_none_or(|here| stands_out(&here, subset.data)) {
        return Ok(None);
    }
    let all = windows(subset);
    let Some(residuals) = left(&all, None)? else {
        return Ok(None);
    };
    let squares = |window: usize| -> f64 {
        let sensors = residuals.series.iter().zip(&subset.data.sigma);
        let of = |(series, sigma): (&Vec<Vec<f64>>, &f64)| {
            let beyond = series[window].iter().map(|r| (r / sigma).powi(2) - 1.0);
            beyond.sum::<f64>()
        };
        sensors.map(of).sum()
    };
    let mut worst: Vec<(f64, usize)> = (0..all.len()).map(|w| (squares(w), w)).collect();
    order::sort_down(&mut worst, |it| it.0);
    let mut kept: Vec<usize> = worst.into_iter().map(|(_, window)| window).collect();
    kept.truncate(subset.intervals.len());
    kept.sort_unstable();
    let intervals = kept.into_iter().map(|w| all[w].clone());
    Ok(Some(subset.on(intervals.collect())))
}

/// The whole of the recordings in windows no longer than the intervals of the subset.
fn windows(subset: &Subset) -> Vec<(usize, Range<usize>)> {
    let lengths = subset.intervals.iter().map(|(_, rows)| rows.len());
    let longest = lengths.max().unwrap_or(1).max(1);
    let of = |(index, rows): (usize, usize)| {
        let count = rows.div_ceil(longest);
        (0..count).map(move |k| (index, k * rows / count..(k + 1) * rows / count))
    };
    let rows = subset.data.experiments.iter().map(|e| e.rows());
    rows.enumerate().flat_map(of).collect()
}

/// The subset of a second effect: as many sub-steps as that of the first, counted in what the
/// parent takes, so fewer rows where it takes many for each.
pub(crate) fn affordable<'a>(subset: &Subset<'a>, parent: &Trial) -> Result<Subset<'a>> {
    let data = subset.data;
    let (mut rows, mut taken) = (0, 0);
    for ((index, range), start) in subset.intervals.iter().zip(&parent.point.states) {
        let experiment = &data.experiments[*index];
        let drive = experiment.drive(&parent.model.plant, range.clone())?;
        let times = &experiment.t[range.clone()];
        let plant = &parent.model.plant;
        // What was fitted to the subset can be simulated there.
        let values = local::values(plant, &parent.point.values, start);
        let start = &start[..plant.state_len()];
        if let Ok(run) = plant.simulate(&values, start, &drive, times) {
            rows += times.len();
            taken += run.report.substeps;
        }
    }
    let budget =
        (CONFIG.screening.work * rows / taken.max(1)).max(screening_rows(&parent.model.plant));
    let rows: usize = subset.intervals.iter().map(|(_, rows)| rows.len()).sum();
    Ok(subset.on(if budget < rows {
        data.select(CONFIG.screening.intervals, budget)
    } else {
        subset.intervals.clone()
    }))
}

#[cfg(test)]
mod tests {
    use sinew_sim::{Plant, Rig, SimulationSettings};

    use super::*;
    use crate::diagnose::data::Data;
    use crate::noise::gaussian;
    use crate::recording::{Column, Recording};
    use rand::SeedableRng;

    const ROWS: usize = 2000;

    /// The demo's mass, pushed hard once (rows 900 to 930) and gently before and after, with a stop
    /// that only the hard push reaches: small steps of symplectic Euler.
    fn stopped() -> Recording {
        let (step, parts) = (1.0 / 120.0, 64);
        let h = step / f64::from(parts);
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(1);
        let (mut q, mut v) = (0.0, 0.0);
        let (mut inputs, mut seen) = (Vec::new(), Vec::new());
        for k in 0..ROWS {
            let push = if (900..930).contains(&k) { 12.0 } else { 0.0 };
            let u = push + 2.0 * (0.03 * k as f64).sin();
            inputs.push(u);
            seen.push(q + 2e-4 * gaussian(&mut random));
            for _ in 0..parts {
                let stop = 4000.0 * f64::max(q - 0.15, 0.0);
                v += h * (u - 40.0 * q - 1.2 * v - stop);
                q += h * v;
            }
        }
        let column = |name: &str, values: Vec<f64>| Column {
            name: name.into(),
            values,
        };
        let t = (0..ROWS).map(|k| k as f64 * step).collect();
        let columns = vec![column("u_N", inputs), column("q_m", seen)];
        Recording::new("stopped.csv", t, columns).expect("the text is a recording")
    }

    #[test]
    fn a_race_goes_where_the_mismatch_is_and_stays_where_it_sees_some() {
        let file = concat!(
            env!("CARGO_MANIFEST_DIR"),
            "/../../rigs/mass-spring-damper.toml"
        );
        let rig = Rig::load(file).expect("the rig ships with the project");
        let plant = Plant::new(&rig).expect("the rig can be simulated");
        let data = Data::new(&rig, &plant, &[stopped()]).expect("the rig is driven by the input");
        let of = |intervals: &[Range<usize>]| {
            let subset = Subset {
                written: &rig,
                data: &data,
                intervals: intervals.iter().map(|rows| (0, rows.clone())).collect(),
                settings: SimulationSettings::default(),
            };
            let fitted = subset
                .first(&rig, &plant.values(), 15)
                .expect("the rig is sound");
            let fitted = fitted.expect("the rig can be simulated");
            let found = refocused(&subset, &fitted).expect("the weights were fitted");
            (subset.intervals.len(), found.map(|found| found.intervals))
        };
        let (count, moved) = of(&[0..200, 600..800, 1200..1400, 1800..2000]);
        let moved = moved.expect("the track sees nothing of the stop");
        assert_eq!(moved.len(), count);
        assert!(moved.iter().all(|(_, rows)| rows.len() <= 200));
        let covered = |row: usize| moved.iter().any(|(_, rows)| rows.contains(&row));
        assert!((905..940).all(covered), "{moved:?}");
        assert!(of(&[0..200, 800..1000]).1.is_none());
    }
}

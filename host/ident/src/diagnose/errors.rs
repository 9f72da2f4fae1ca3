//! Errors by signal and role, of the rig as written, refitted and corrected.

use std::collections::BTreeMap;
use std::ops::Range;

use sinew_sim::{Plant, Rig, SimulationSettings};

use crate::diagnose::case::Case;
use crate::diagnose::config::CONFIG;
use crate::diagnose::data::Data;
use crate::diagnose::finding::{Errors, SignalFit};
use crate::diagnose::model::Model;
use crate::diagnose::remainder::windows;
use crate::diagnose::residuals::Residuals;
use crate::diagnose::split::Roles;
use crate::error::Result;
use crate::fit::score;
use crate::recording::Recording;

/// Errors of each signal. `rigs` are the rig as written, refitted and corrected.
///
/// # Errors
/// As [`score`].
pub(super) fn signals(
    rigs: [&Rig; 3],
    case: &Case,
    roles: &Roles,
) -> Result<BTreeMap<String, SignalFit>> {
    let windows = windows(case);
    let fit = errors(rigs, &roles.fit, windows)?;
    let check = errors(rigs, &roles.check, windows)?;
    let test = if roles.test.is_empty() {
        None
    } else {
        Some(errors(rigs, &roles.test, windows)?)
    };
    let plant = Plant::new(rigs[0])?;
    let all = plant.sensors().iter().enumerate().map(|(sensor, known)| {
        let signal = SignalFit {
            unit: known.unit.clone(),
            fit: fit[sensor],
            check: check[sensor],
            test: test.as_ref().map(|test| test[sensor]),
            noise_rms: case.check.noise[sensor],
        };
        (known.column.clone(), signal)
    });
    Ok(all.collect())
}

/// One entry a sensor. `windows` is the length of those that were judged, s.
fn errors(rigs: [&Rig; 3], recordings: &[Recording], windows: Option<f64>) -> Result<Vec<Errors>> {
    let [written, before, after] = rigs.map(|rig| score(rig, recordings));
    let (written, before, after) = (written?, before?, after?);
    let judged = match windows {
        Some(seconds) => over_windows(rigs[2], recordings, seconds)?,
        None => None,
    };
    let all = written.iter().zip(&before).zip(&after).enumerate();
    Ok(all
        .map(|(sensor, ((written, before), after))| {
            // Infinite where the run could not be made.
            let means_nothing =
                windows.is_some() && (after.rms > after.spread || after.rms.is_nan());
            Errors {
                as_written_rms: written.rms,
                before_rms: before.rms,
                after_rms: (!means_nothing).then_some(after.rms),
                judged_rms: judged.as_ref().map(|judged| judged.rms(sensor)),
            }
        })
        .collect())
}

/// Residuals of a rig over windows of about these seconds, each from the start state that explains
/// it best, as candidates are judged; `None` where it cannot be simulated.
fn over_windows(rig: &Rig, recordings: &[Recording], seconds: f64) -> Result<Option<Residuals>> {
    let model = Model::new(rig, rig, &[], SimulationSettings::default())?;
    let data = Data::new(rig, &model.plant, recordings)?;
    let values = model.plant.values();
    let cut = recordings
        .iter()
        .enumerate()
        .flat_map(|(index, recording)| {
            let rows = window_rows(recording.len(), recording.duration() / seconds);
            rows.map(move |rows| (index, rows))
        });
    let intervals: Vec<_> = cut.collect();
    Residuals::of(&model, &values, &data, &intervals, None)
}

/// Rows of the nearest number of windows to `count` that leaves each of them long enough.
fn window_rows(rows: usize, count: f64) -> impl Iterator<Item = Range<usize>> {
    let most = (rows / CONFIG.report.window_rows).max(1);
    let count = (count.round() as usize).clamp(1, most);
    (0..count).map(move |k| k * rows / count..(k + 1) * rows / count)
}

#[cfg(test)]
mod tests {
    use sinew_sim::Rig;

    use super::{errors, window_rows};
    use crate::diagnose::tests;
    use crate::recording::{Column, Recording};

    #[test]
    fn a_free_run_that_misses_by_more_than_the_motion_says_nothing_beside_windows() {
        let text = std::fs::read_to_string(tests::shipped(".toml")).unwrap();
        let loud = Rig::parse(&text.replace("gain = 1.0", "gain = 10.0"), "loud.toml").unwrap();
        let fit = tests::recordings().fit;
        let with = |after: &Rig, windows| errors([after; 3], &fit, windows).unwrap()[0];
        let right = with(&tests::rig(), Some(2.0));
        assert_eq!(right.after_rms, Some(right.before_rms));
        assert!(right.judged_rms.unwrap() < 2.0 * right.before_rms);
        let wrong = with(&loud, Some(2.0));
        assert_eq!(wrong.after_rms, None);
        assert!(wrong.judged_rms.unwrap().is_finite());
        let judged_whole = with(&loud, None);
        assert!(judged_whole.after_rms.is_some() && judged_whole.judged_rms.is_none());
    }

    #[test]
    fn a_window_without_a_sample_is_passed_over() {
        let whole = &tests::recordings().fit[0];
        let columns = whole.columns().iter().map(|column| {
            let mut values = column.values.clone();
            if column.name == "q_m" {
                let from = values.len() / 2;
                values[from..].fill(f64::NAN);
            }
            Column {
                name: column.name.clone(),
                values,
            }
        });
        let half = Recording::new("half.csv", whole.t().to_vec(), columns.collect()).unwrap();
        let errors = errors([&tests::rig(); 3], &[half], Some(2.0)).unwrap();
        assert!(errors[0].judged_rms.unwrap().is_finite());
    }

    #[test]
    fn windows_cover_every_row_once_and_are_never_too_short() {
        for (rows, count) in [
            (1000, 4.2),
            (1000, 0.0),
            (90, 3.0),
            (250, 9.0),
            (1001, 10.0),
        ] {
            let all: Vec<_> = window_rows(rows, count).collect();
            assert_eq!(all[0].start, 0);
            assert_eq!(all[all.len() - 1].end, rows);
            assert!(all.windows(2).all(|pair| pair[0].end == pair[1].start));
            assert!(all.iter().all(|w| w.len() >= rows.min(100)), "{all:?}");
        }
    }
}

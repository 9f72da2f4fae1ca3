//! The tables of the page.

use std::collections::BTreeMap;

use sinew_sim::{Plant, Rig};

use super::text::{after, roles};
use super::{interval, percent, placed};
use crate::diagnose::wording::share_of;
use crate::diagnose::{Diagnosis, Estimate};
use crate::report::{Table, own_interval, quantity, significant};

/// Numbers with their intervals.
pub(super) fn estimates(caption: &str, of: &BTreeMap<String, Estimate>) -> Table {
    of.iter().fold(
        Table::new(caption, ["parameter", "#value", "#95 % interval"]),
        |table, (name, estimate)| {
            let value = quantity(estimate.value, &estimate.unit);
            let table = table.row([name.clone(), value, interval(estimate)]);
            estimate.recordings.iter().fold(table, |table, own| {
                let of = format!("{name} of {}", own.recording);
                table.row([of, quantity(own.value, &own.unit), own_interval(own)])
            })
        },
    )
}

/// The rig's own free parameters: as written, refitted, and beside the named effects.
pub(super) fn numbers(diagnosis: &Diagnosis, written: &Rig) -> Table {
    let value = |rig: &Rig, name: &str| {
        let plant = Plant::new(rig).ok()?;
        Some(plant.values()[plant.slot(name)?])
    };
    let titles = [
        "parameter",
        "#as written",
        "#refitted",
        "#corrected",
        "#95 % interval",
    ];
    let table = Table::new("The rig's own free parameters", titles);
    (diagnosis.parameters.iter()).fold(table, |table, (name, estimate)| {
        let cell = |rig: &Rig| {
            let value = value(rig, name);
            value.map_or_else(String::new, |value| quantity(value, &estimate.unit))
        };
        let corrected = quantity(estimate.value, &estimate.unit);
        let table = table.row([
            name.clone(),
            cell(written),
            cell(&diagnosis.refitted),
            corrected,
            interval(estimate),
        ]);
        estimate.recordings.iter().fold(table, |table, own| {
            let of = format!("{name} of {}", own.recording);
            let value = quantity(own.value, &own.unit);
            table.row([of, String::new(), String::new(), value, own_interval(own)])
        })
    })
}

/// Noise of each signal, which no model goes below.
pub(super) fn noise(diagnosis: &Diagnosis) -> Table {
    let table = Table::new("", ["signal", "#noise of the measurement"]);
    (diagnosis.fit.iter()).fold(table, |table, (signal, fit)| {
        table.row([signal.clone(), quantity(fit.noise_rms, &fit.unit)])
    })
}

/// Free-run errors before and after.
pub(super) fn errors(diagnosis: &Diagnosis) -> Table {
    let titles = [
        "signal",
        "recordings",
        "#rig as written",
        "#refitted",
        "#corrected",
        "#corrected, as judged",
        "#noise",
    ];
    let mut table = Table::new("Free-run error (RMS)", titles);
    for (signal, fit) in &diagnosis.fit {
        for (role, errors) in roles(fit) {
            let cell = |value: f64| quantity(value, &fit.unit);
            table = table.row([
                signal.clone(),
                role.to_owned(),
                cell(errors.as_written_rms),
                cell(errors.before_rms),
                after(errors, &fit.unit),
                errors.judged_rms.map_or_else(String::new, cell),
                cell(fit.noise_rms),
            ]);
        }
    }
    table
}

/// Explanations that reached the final.
pub(super) fn finalists(diagnosis: &Diagnosis) -> Table {
    let titles = [
        "explanation",
        "#parameters",
        "#error on fit recordings, refitted rig = 1",
        "#error on check recordings",
        "#mismatch left there",
        "#share of the evidence",
        "why it is not believed",
    ];
    let table = Table::new("Explanations that were fitted to all recordings", titles);
    diagnosis.candidates.iter().fold(table, |table, finalist| {
        table.row([
            finalist.name.clone(),
            finalist.parameters.to_string(),
            significant(finalist.fit_error, 3),
            significant(finalist.check_error, 3),
            share_of(finalist.remainder),
            percent(finalist.probability),
            finalist.lost.clone(),
        ])
    })
}

/// Rivals, and what the recordings cannot tell apart.
pub(super) fn rivals(diagnosis: &Diagnosis) -> Table {
    let titles = ["instead of", "it may be", "#confidence", "told apart"];
    let mut table = Table::new("Rivals", titles);
    for effect in &diagnosis.effects {
        let of = placed(&effect.kind, &effect.component);
        let rivals = effect
            .rivals
            .iter()
            .map(|rival| (rival, "by these recordings, more or less"));
        let twins = effect.indistinguishable_from.iter();
        for (other, told) in rivals.chain(twins.map(|twin| (twin, "not by these recordings"))) {
            table = table.row([
                of.clone(),
                placed(&other.kind, &other.component),
                percent(other.confidence),
                told.to_owned(),
            ]);
        }
    }
    table
}

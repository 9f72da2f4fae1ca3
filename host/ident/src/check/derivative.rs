//! A position beside its velocity: their ratio tells units of time and angle, and signs.

use super::finding::{Check, number};
use super::series::quantile;
use crate::recording::Recording;

/// Least correlation between a position's slope and the velocity beside it.
const ALIKE: f64 = 0.7;

/// Names of the pairs of position and velocity of one motion.
pub(super) fn pairs(recording: &Recording) -> Vec<(String, String)> {
    let unit = |name: &str| sinew_sim::unit::of_column(name).to_owned();
    let names: Vec<&str> = recording
        .columns()
        .iter()
        .map(|c| c.name.as_str())
        .collect();
    let mut found = Vec::new();
    for position in &names {
        let suffix = unit(position);
        if suffix.is_empty() || !matches!(suffix.as_str(), "m" | "mm" | "rad" | "deg") {
            continue;
        }
        let stem = position.trim_end_matches(&format!("_{suffix}"));
        let wanted = [
            format!("{stem}d"),
            format!("d{stem}"),
            format!("{stem}dot"),
            format!("{stem}_dot"),
        ];
        let velocity = names.iter().find(|name| {
            let its = unit(name);
            its == format!("{suffix}/s")
                && wanted.iter().any(|stem| {
                    let rest = name.strip_prefix(stem.as_str());
                    rest.is_some_and(|rest| rest.starts_with('_') && !rest[1..].contains("__"))
                })
        });
        if let Some(velocity) = velocity {
            found.push(((*position).to_owned(), (*velocity).to_owned()));
        }
    }
    found
}

/// `time_in_milliseconds` and its like, `degrees_for_radians`, `wrong_sign`, from one pair.
pub(super) fn detect(recording: &Recording, (q, qd): (&str, &str)) -> Option<Check> {
    let (ratio, alike) = ratio(recording, q, qd)?;
    if alike.abs() < ALIKE {
        return None;
    }
    let near = |wanted: f64| (ratio.abs() / wanted - 1.0).abs() < 0.2;
    let slope = format!("the slope of {q} is {} times {qd} beside it", number(ratio));
    let certain = |kind, what: &str, remedy: String| {
        let sentence = format!("{slope}: {what}");
        Some(Check::certain(recording, 0, kind, sentence, remedy))
    };
    if near(1e-3) {
        let remedy = "--time-unit ms".into();
        return certain("time_in_milliseconds", "t is in milliseconds", remedy);
    }
    if near(1e-6) {
        let remedy = "--time-unit us".into();
        return certain("time_in_microseconds", "t is in microseconds", remedy);
    }
    if near(180.0 / std::f64::consts::PI) {
        let remedy = format!("`unit = \"deg\"` in the rig's sensor of {q}");
        return certain("degrees_for_radians", &format!("{q} is in degrees"), remedy);
    }
    if near(std::f64::consts::PI / 180.0) {
        let remedy = format!("`unit = \"deg/s\"` in the rig's sensor of {qd}");
        let what = format!("{qd} is in degrees a second");
        return certain("degrees_for_radians", &what, remedy);
    }
    if ratio < 0.0 && near(1.0) {
        let remedy = format!("`gain = -1.0` in the rig's sensor of {q} or of {qd}");
        let what = "one of the two counts backwards";
        return certain("wrong_sign", what, remedy);
    }
    None
}

/// Slope of a position over the velocity, by least squares, and their correlation. The slope is
/// taken over several rows, so that noise and steps of an encoder do not hide it.
fn ratio(recording: &Recording, q: &str, qd: &str) -> Option<(f64, f64)> {
    let (t, q, qd) = (recording.t(), recording.column(q)?, recording.column(qd)?);
    let reach = 4;
    let middle = recording.interval()?;
    let (mut ss, mut sv, mut vv) = (0.0, 0.0, 0.0);
    let mut slopes = Vec::new();
    for k in 0..t.len().saturating_sub(reach) {
        let mean = qd[k..=k + reach].iter().sum::<f64>() / (reach + 1) as f64;
        let slope = (q[k + reach] - q[k]) / (t[k + reach] - t[k]);
        let even = t[k + reach] - t[k] < 1.5 * reach as f64 * middle;
        if even && slope.is_finite() && mean.is_finite() {
            slopes.push((slope, mean));
        }
    }
    // A counter that begins anew makes a few slopes that are none.
    let large = 8.0 * quantile(slopes.iter().map(|pair| pair.0.abs()), 0.9);
    for (slope, mean) in slopes.into_iter().filter(|pair| pair.0.abs() <= large) {
        ss += slope * slope;
        sv += slope * mean;
        vv += mean * mean;
    }
    (ss > 0.0 && vv > 0.0).then(|| (sv / vv, sv / (ss * vv).sqrt()))
}

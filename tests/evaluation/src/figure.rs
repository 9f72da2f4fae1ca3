//! The loops of each controller as dots on one axis, and as a row of the page's table.

use std::collections::BTreeSet;
use std::fmt::Write;

use anyhow::{Context, Result};
use serde_json::Value;

/// A controller's loops: errors in metres, of all outputs together.
pub struct Row {
    /// Name of the figure.
    pub name: String,
    /// Root mean square error of each loop.
    pub rms: Vec<f64>,
    /// Largest error of each loop.
    pub max: Vec<f64>,
}

impl Row {
    /// From an entry of `controllers` (docs/reference/results.md).
    ///
    /// # Errors
    /// It has no loops.
    pub fn of(controller: &Value) -> Result<Self> {
        let loops = controller["loops"]
            .as_array()
            .context("a controller without loops")?;
        let each = |what: &str| -> Vec<f64> {
            let one = |l: &Value| match l["distance"][what].as_f64() {
                Some(length) => Some(length),
                None => l[what][0].as_f64(),
            };
            loops.iter().filter_map(one).collect()
        };
        Ok(Self {
            name: controller["name"].as_str().unwrap_or_default().into(),
            rms: each("rms"),
            max: each("max"),
        })
    }

    /// A line of the page's table; `free_run` is the network's error at the end of the horizon.
    pub fn line(&self, controller: &Value, free_run: Option<f64>) -> String {
        let pair = |values: &[f64]| {
            let (median, worst) = middle(values);
            format!("{}, {}", millimetres(median), millimetres(worst))
        };
        let whole = |value: &Value| value.as_u64().map_or("–".into(), |v| v.to_string());
        let spread = &controller["instructions_per_step"];
        let instructions = match (spread["mean"].as_f64(), spread["max"].as_u64()) {
            (Some(mean), Some(max)) => format!("{mean:.0}, {max}"),
            _ => "–".into(),
        };
        format!(
            "| {} | {} | {} | {} | {} | {} | {instructions} |",
            self.name,
            pair(&self.rms),
            pair(&self.max),
            free_run.map_or("–".into(), millimetres),
            whole(&controller["parameters"]),
            whole(&controller["image"]["flash_bytes"]),
        )
    }
}

/// Median, the lower one of two, and largest.
pub fn middle(values: &[f64]) -> (f64, f64) {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let last = sorted.len().saturating_sub(1);
    let at = |i: usize| sorted.get(i).copied().unwrap_or(f64::NAN);
    (at(last / 2), at(last))
}

/// `0.512 mm`.
pub fn millimetres(value: f64) -> String {
    let value = 1e3 * value;
    let places = match value.abs() {
        v if v >= 10.0 => 1,
        v if v >= 1.0 => 2,
        _ => 3,
    };
    format!("{value:.places$} mm")
}

const WIDTH: f64 = 900.0;
/// Room for names at the left.
const LEFT: f64 = 170.0;
const LINE: f64 = 30.0;

/// RMS errors: one line a controller, a dot a loop.
pub fn loops(title: &str, rows: &[Row]) -> String {
    let lines: Vec<(&str, &[f64])> = rows
        .iter()
        .map(|row| (row.name.as_str(), row.rms.as_slice()))
        .collect();
    dots(title, &lines, tick_name)
}

/// One line a name, a dot a value, a bar at the median; the axis is logarithmic, since a bad one
/// would otherwise hide the differences of the good ones. Colours follow the reader's light or dark
/// setting.
pub fn dots(title: &str, rows: &[(&str, &[f64])], tick_name: fn(f64) -> String) -> String {
    let all = || rows.iter().flat_map(|(_, values)| values.iter().copied());
    let low = all().fold(f64::INFINITY, f64::min) * 0.8;
    let high = all().fold(0.0, f64::max) * 1.25;
    let x = |value: f64| LEFT + (WIDTH - LEFT - 30.0) * (value / low).ln() / (high / low).ln();
    let mut body = String::new();
    let bottom = 50.0 + LINE * rows.len() as f64;
    // Writing to a String cannot fail, here and below.
    let decades = (-6..7).flat_map(|d| [1.0, 2.0, 5.0].map(|m| m * 10_f64.powi(d)));
    for tick in decades.filter(|tick| (low..high).contains(tick)) {
        let _ = writeln!(
            body,
            "<path class=\"grid\" d=\"M{0:.1} 40V{bottom}\"/><text class=\"tick\" x=\"{0:.1}\" y=\"{1}\">{2}</text>",
            x(tick),
            bottom + 18.0,
            tick_name(tick)
        );
    }
    for (k, (name, values)) in rows.iter().enumerate() {
        let y = 60.0 + LINE * k as f64;
        let _ = writeln!(
            body,
            "<text class=\"name\" x=\"{}\" y=\"{}\">{}</text>",
            LEFT - 14.0,
            y + 4.0,
            name
        );
        // A thousand steps are not a thousand places.
        let places: BTreeSet<String> = values.iter().map(|v| format!("{:.1}", x(*v))).collect();
        for place in places {
            let _ = writeln!(
                body,
                "<circle class=\"loop\" cx=\"{place}\" cy=\"{y}\" r=\"4.5\"/>"
            );
        }
        let median = x(middle(values).0);
        let _ = writeln!(
            body,
            "<path class=\"median\" d=\"M{median:.1} {}v18\"/>",
            y - 9.0
        );
    }
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" width=\"{WIDTH}\" height=\"{height}\" \
         font-family=\"system-ui, sans-serif\" font-size=\"13\">\n<style>\n\
         svg {{ --ink: #1b1b1b; --ground: #ffffff; --line: #d8d8d8; --dot: #1f6fb2; }}\n\
         @media (prefers-color-scheme: dark) {{ svg {{ --ink: #e6e6e6; --ground: #16181b; --line: #3a3d42; --dot: #6db3ef; }} }}\n\
         text {{ fill: var(--ink); }} .name {{ text-anchor: end; }} .tick {{ text-anchor: middle; }}\n\
         .grid {{ stroke: var(--line); }} .loop {{ fill: var(--dot); fill-opacity: 0.45; }}\n\
         .median {{ stroke: var(--ink); stroke-width: 2.5; }} .title {{ font-size: 15px; font-weight: 600; }}\n</style>\n\
         <rect width=\"100%\" height=\"100%\" style=\"fill: var(--ground)\"/>\n\
         <text class=\"title\" x=\"20\" y=\"26\">{title}; bar: median</text>\n{body}</svg>\n",
        height = bottom + 32.0
    )
}

/// `0.5 mm`.
fn tick_name(value: f64) -> String {
    let value = 1e3 * value;
    format!("{} mm", (value * 1e6).round() / 1e6)
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn a_row_takes_the_length_of_the_error_where_there_is_one() {
        let one = json!({ "name": "a", "loops": [
            { "rms": [3e-3], "max": [9e-3], "distance": null },
            { "rms": [1e-3], "max": [7e-3], "distance": null },
            { "rms": [2e-3], "max": [8e-3], "distance": null } ] });
        let row = Row::of(&one).expect("the controller has loops");
        assert_eq!(middle(&row.rms), (2e-3, 3e-3));
        let two = json!({ "name": "b", "loops": [
            { "rms": [3e-3, 4e-3], "max": [1.0, 1.0], "distance": { "rms": 5e-3, "max": 0.011 } } ] });
        let row = Row::of(&two).expect("the controller has loops");
        assert_eq!((row.rms[0], row.max[0]), (5e-3, 0.011));
        assert!(
            row.line(&two, Some(4e-4))
                .starts_with("| b | 5.00 mm, 5.00 mm | 11.0 mm, 11.0 mm | 0.400 mm |")
        );
    }

    #[test]
    fn a_better_loop_lies_further_left() {
        let row = |name: &str, rms: Vec<f64>| Row {
            name: name.into(),
            max: rms.clone(),
            rms,
        };
        let svg = loops("t", &[row("a", vec![1e-3]), row("b", vec![2e-3])]);
        let at: Vec<f64> = svg
            .split("cx=\"")
            .skip(1)
            .filter_map(|rest| rest.split('"').next()?.parse().ok())
            .collect();
        assert!(at.len() == 2 && at[0] < at[1], "{at:?}");
    }
}

//! Runs of one loop side by side: as a table, plots and JSON. Nothing here decides anything.

use serde_json::{Value, json};

use super::closed_loop::{InputLimits, Run, Score};
use crate::report::{Plot, Series, Stroke, Table, Tone, quantity, significant};

/// A run and who made it.
pub struct Entry<'a> {
    /// `MPC`, `PID before`.
    pub name: String,
    /// The loop.
    pub run: &'a Run,
    /// Its score.
    pub score: &'a Score,
}

/// Runs of one loop.
pub struct Results<'a> {
    /// In the order of the table.
    pub entries: Vec<Entry<'a>>,
    /// Column and SI unit of each output.
    pub outputs: Vec<(String, String)>,
    /// Column of each input.
    pub inputs: Vec<String>,
    /// Of each input.
    pub limits: &'a [InputLimits],
    /// Control period, seconds.
    pub period_s: f64,
}

const TITLES: [&str; 9] = [
    "controller",
    "output",
    "#RMS error",
    "#largest error",
    "#command change",
    "#overshoot",
    "#settling",
    "#at limits",
    "#outside limits",
];

impl Results<'_> {
    /// One row a controller and output, as [`TITLES`].
    fn rows(&self) -> Vec<[String; TITLES.len()]> {
        let mut rows = Vec::new();
        for Entry { name, run, score } in &self.entries {
            for (i, (output, unit)) in self.outputs.iter().enumerate() {
                let transient = run.transient(i, self.period_s);
                let settling = match transient.map(|t| t.settling_s) {
                    Some(Some(seconds)) => quantity(seconds, "s"),
                    Some(None) => "not settled".into(),
                    None => "–".into(),
                };
                rows.push([
                    name.clone(),
                    output.clone(),
                    quantity(score.rms[i], unit),
                    quantity(score.max[i], unit),
                    significant(score.effort.get(i).copied().unwrap_or(f64::NAN), 3),
                    transient.map_or("–".into(), |t| format!("{:.1} %", 100.0 * t.overshoot)),
                    settling,
                    quantity(run.at_limits_s(self.limits, self.period_s), "s"),
                    score.outside_limits.to_string(),
                ]);
            }
        }
        rows
    }

    /// For a terminal.
    pub fn text(&self) -> String {
        let titles = TITLES.map(|title| title.trim_start_matches('#').to_string());
        let rows: Vec<_> = std::iter::once(titles).chain(self.rows()).collect();
        let width = |c: usize| {
            rows.iter()
                .map(|row| row[c].chars().count())
                .max()
                .unwrap_or(0)
        };
        let widths: Vec<usize> = (0..TITLES.len()).map(width).collect();
        let line = |row: &[String; TITLES.len()]| {
            let cells = row
                .iter()
                .zip(&widths)
                .zip(TITLES)
                .map(|((cell, width), title)| {
                    if title.starts_with('#') {
                        format!("{cell:>width$}")
                    } else {
                        format!("{cell:<width$}")
                    }
                });
            cells.collect::<Vec<_>>().join("  ") + "\n"
        };
        rows.iter().map(line).collect()
    }

    /// For a page.
    pub fn table(&self) -> Table {
        let caption = "Errors over the whole run; change: root mean square change of the command in one step; \
                       overshoot and settling (2 %): the worst of all moves";
        self.rows()
            .into_iter()
            .fold(Table::new(caption, TITLES), Table::row)
    }

    /// Each output with its reference, its error, and each command.
    pub fn plots(&self) -> Vec<Plot> {
        // The first of the table is drawn last, on top.
        let tones = [
            Tone::Blue,
            Tone::Orange,
            Tone::Green,
            Tone::Purple,
            Tone::Red,
        ];
        let entries: Vec<_> = self.entries.iter().zip(tones.into_iter().cycle()).collect();
        let add = |plot: Plot, stroke: Stroke, of: &dyn Fn(&Run) -> Vec<f64>| {
            entries.iter().rev().fold(plot, |plot, (entry, tone)| {
                let series = Series::new(&entry.name, stroke, entry.run.t.clone(), of(entry.run));
                plot.with(series.tone(*tone))
            })
        };
        let column =
            |rows: &[Vec<f64>], i: usize| rows.iter().map(|row| row[i]).collect::<Vec<_>>();
        let mut plots = Vec::new();
        for (i, (name, unit)) in self.outputs.iter().enumerate() {
            let mut tracking = Plot::over_time(format!("{name}: asked and done")).y(name, unit);
            if let Some(entry) = self.entries.first() {
                let asked = column(&entry.run.reference, i);
                let t = entry.run.t.clone();
                let asked = Series::new("reference", Stroke::Dashed, t, asked);
                tracking = tracking.with(asked.tone(Tone::Ink));
            }
            plots.push(add(tracking, Stroke::Solid, &|run| column(&run.y, i)));
            let error = Plot::over_time(format!("{name}: tracking error")).y("error", unit);
            plots.push(add(error, Stroke::Solid, &|run| {
                let pairs = run.y.iter().zip(&run.reference);
                pairs.map(|(y, r)| y[i] - r[i]).collect()
            }));
        }
        for (i, name) in self.inputs.iter().enumerate() {
            let unit = sinew_sim::unit::of_column(name);
            let command = Plot::over_time(format!("{name}: command")).y(name, unit);
            plots.push(add(command, Stroke::Steps, &|run| column(&run.u, i)));
        }
        plots
    }

    /// For programs (docs/files.md).
    pub fn json(&self) -> Value {
        let entries = self.entries.iter().map(|Entry { name, run, score }| {
            let outputs = self.outputs.iter().enumerate().map(|(i, (signal, unit))| {
                json!({
                    "signal": signal, "unit": unit, "rms": score.rms[i], "max": score.max[i],
                    "transient": run.transient(i, self.period_s),
                })
            });
            let inputs = self.inputs.iter().zip(&score.effort);
            let inputs = inputs.map(|(signal, effort)| json!({"signal": signal, "effort": effort}));
            json!({
                "name": name,
                "outputs": outputs.collect::<Value>(),
                "inputs": inputs.collect::<Value>(),
                "at_limits_s": run.at_limits_s(self.limits, self.period_s),
                "outside_limits": score.outside_limits,
            })
        });
        entries.collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_has_a_row_for_every_controller_and_output() {
        let mut run = Run::default();
        for k in 0..60 {
            let r = if k < 25 { 0.0 } else { 0.1 };
            run.t.push(0.01 * f64::from(k));
            run.reference.push(vec![r, f64::from(k)]);
            run.y.push(vec![
                if (25..30).contains(&k) { 0.12 } else { r },
                f64::from(k) - 0.5,
            ]);
            run.u.push(vec![if k < 10 { 1.0 } else { -0.5 }]);
        }
        let limits = [(-1.0, 1.0, f64::INFINITY)];
        let score = run.score(&limits);
        let entry = |name: &str| Entry {
            name: name.into(),
            run: &run,
            score: &score,
        };
        let results = Results {
            entries: vec![entry("MPC"), entry("PID before")],
            outputs: vec![("q_m".into(), "m".into()), ("q_rad".into(), "rad".into())],
            inputs: vec!["u_N".into()],
            limits: &limits,
            period_s: 0.01,
        };
        insta::assert_snapshot!(results.text(), @r"
        controller  output  RMS error  largest error  command change  overshoot  settling  at limits  outside limits
        MPC         q_m       5.77 mm        20.0 mm           0.194     20.0 %   50.0 ms    0.100 s               0
        MPC         q_rad   0.500 rad      0.500 rad               –          –         –    0.100 s               0
        PID before  q_m       5.77 mm        20.0 mm           0.194     20.0 %   50.0 ms    0.100 s               0
        PID before  q_rad   0.500 rad      0.500 rad               –          –         –    0.100 s               0
        ");
        assert_eq!(results.table().rows.len(), 4);
        assert_eq!(results.plots().len(), 5);
        assert_eq!(
            results.json()[1]["outputs"][0]["transient"]["settling_s"],
            0.05
        );
    }
}

//! Tables and plots of a validation.

use sinew_sim::{MotionQuantity, Plant};

use super::correlation::{Correlation, autocorrelation, cross_correlation};
use super::coverage::coverage;
use super::free::{Free, Model};
use super::motions::error;
use super::response::{self, Response, response};
use crate::error::Result;
use crate::fit::experiment::Experiment;
use crate::fit::pool;
use crate::order;
use crate::report::{Block, Plot, Section, Series, Stroke, Table, Tone, quantity, significant};

/// Pairs of signal and input that are drawn at most.
const DRAWN: usize = 6;
/// Coherence below which a response says nothing.
const COHERENT: f64 = 0.3;
/// Share of missing samples above which a recording has no spectrum.
const MISSING: f64 = 0.2;
/// Difference of two sampling times that are one.
const SAME_PERIOD: f64 = 0.01;

/// Free-run errors of every model, role by role: root mean square, and fit in per cent
/// (identification.md, eq. 14a).
pub fn fit_table(free: &Free<'_>) -> Table {
    let titles: Vec<String> = ["signal".to_owned(), "recordings".to_owned()]
        .into_iter()
        .chain((free.models.iter()).flat_map(|m| [format!("#{}, RMS", m.name), "#fit".into()]))
        .collect();
    let mut table = Table::new("Free runs", titles.iter().map(String::as_str));
    for role in ["test", "check", "fit"] {
        let pooled: Vec<_> = (free.models.iter())
            .map(|model| pool(&free.of(model, role)))
            .collect();
        let signals = pooled.first().map_or(0, Vec::len);
        for signal in 0..signals {
            let known = &pooled[0][signal];
            let cells = pooled.iter().flat_map(|of| {
                let error = &of[signal];
                [quantity(error.rms, &error.unit), error.fit_text()]
            });
            let row = [known.signal.clone(), role.to_owned()];
            table = table.row(row.into_iter().chain(cells));
        }
    }
    table
}

/// Residuals, frequency responses and coverage, a chapter each.
///
/// # Errors
/// A column that a recording lacks.
pub fn chapters(free: &Free<'_>) -> Result<Vec<Section>> {
    let Some(best) = free.models.last().filter(|best| !best.runs.is_empty()) else {
        return Ok(Vec::new());
    };
    let plant = Plant::new(free.rig)?;
    let experiments = free
        .recordings
        .iter()
        .map(|(_, recording)| Experiment::new(&plant, recording))
        .collect::<Result<Vec<_>>>()?;
    let inputs: Vec<(usize, String)> = plant
        .inputs()
        .iter()
        .enumerate()
        .filter(|(_, input)| matches!(input.motion, None | Some(MotionQuantity::Position)))
        .map(|(index, input)| (index, input.column.clone()))
        .collect();
    let shared = Shared {
        free,
        experiments: &experiments,
        inputs: &inputs,
    };
    Ok(vec![
        shared.residuals(),
        shared.responses(&plant),
        coverage(&plant, free, best)?,
    ])
}

struct Shared<'a> {
    free: &'a Free<'a>,
    experiments: &'a [Experiment],
    /// Index in the experiments, column.
    inputs: &'a [(usize, String)],
}

impl Shared<'_> {
    /// Sampling time: the median, s.
    fn period(&self, index: usize) -> f64 {
        let t = &self.experiments[index].t;
        let mut steps: Vec<f64> = t.windows(2).map(|pair| pair[1] - pair[0]).collect();
        order::sort(&mut steps);
        steps.get(steps.len() / 2).copied().unwrap_or(f64::NAN)
    }

    fn residuals(&self) -> Section {
        let role = self.free.judging();
        let judged: Vec<usize> = (0..self.experiments.len())
            .filter(|&index| self.free.recordings[index].0 == role)
            .collect();
        let mut section = Section::new("Residuals").text(format!(
            "Measured minus simulated, of the {role} recordings. If the model explains all but \
             white noise, 99 % of the coefficients lie between the dashed lines. Residuals that \
             remember themselves have unmodelled motion or coloured noise; those that follow an \
             input have an effect of this input that the model lacks. A positive lag is an input \
             that came before; at negative lags a controller that uses the signal shows."
        ));
        let period = judged.first().map_or(f64::NAN, |&index| self.period(index));
        let titles = [
            "signal",
            "against",
            "model",
            "#outside the band",
            "#largest coefficient",
            "#at lag",
        ];
        let mut table = Table::new("Correlation of residuals", titles);
        let (mut plots, mut left_out) = (Vec::new(), Vec::new());
        let sensors = self.free.models[0].runs[0].sensors.len();
        for sensor in 0..sensors {
            let signal = self.free.models[0].runs[0].sensors[sensor].signal.clone();
            let itself = [(None, "itself".to_owned())].into_iter();
            let others = self.inputs.iter().map(|(i, name)| (Some(*i), name.clone()));
            for (input, against) in itself.chain(others) {
                let found = self.correlations(&judged, sensor, input);
                for (name, _, of) in &found {
                    let zero = input.is_some();
                    let (lag, value) = of.largest(zero).unwrap_or((0, 0.0));
                    table = table.row([
                        signal.clone(),
                        against.clone(),
                        name.clone(),
                        format!("{} %", significant(100.0 * of.outside(zero), 2)),
                        significant(value, 2),
                        quantity(lag as f64 * period, "s"),
                    ]);
                }
                if found.is_empty() {
                    continue;
                }
                let title = match input {
                    None => format!("Residuals of {signal}: autocorrelation"),
                    Some(_) => format!("Residuals of {signal} against {against}"),
                };
                if plots.len() < DRAWN {
                    plots.push(correlation_plot(title, period, &found));
                } else {
                    left_out.push(title);
                }
            }
        }
        if plots.is_empty() {
            return section.text("There are too few samples, or no residual that moves.");
        }
        section = section.with(Block::Table(table));
        section = plots
            .into_iter()
            .map(Block::Plot)
            .fold(section, Section::with);
        if !left_out.is_empty() {
            section = section.text(format!("Not drawn: {}.", left_out.join("; ")));
        }
        section
    }

    /// Correlation of a sensor's residuals with themselves, or with an input, model by model.
    fn correlations(
        &self,
        judged: &[usize],
        sensor: usize,
        input: Option<usize>,
    ) -> Vec<(String, Tone, Correlation)> {
        // A rig far off has residuals that are the motion itself.
        let models = self.free.models.len();
        let models = self.free.models.iter().skip(models.saturating_sub(2));
        let of = |model: &Model<'_>| {
            let residuals: Vec<Vec<f64>> = judged
                .iter()
                .map(|&index| {
                    let run = &model.runs[index];
                    let of = &run.sensors[sensor];
                    let from = run.judged_from.min(run.t.len());
                    error(&of.measured[from..], &of.simulated[from..])
                })
                .collect();
            let residuals: Vec<&[f64]> = residuals.iter().map(Vec::as_slice).collect();
            let Some(input) = input else {
                return autocorrelation(&residuals);
            };
            let driving: Vec<&[f64]> = judged
                .iter()
                .map(|&index| {
                    let column = &self.experiments[index].inputs[input];
                    &column[model.runs[index].judged_from.min(column.len())..]
                })
                .collect();
            cross_correlation(&residuals, &driving)
        };
        let all = models.filter_map(|m| Some((m.name.to_owned(), m.tone, of(m)?)));
        all.collect()
    }

    fn responses(&self, plant: &Plant) -> Section {
        let section = Section::new("Frequency response").text(
            "Response of the signals to the inputs, estimated alike from what was measured and \
             from what each model made of the same inputs. It is linear: of a nonlinear device it \
             is the response at this size of motion. Coherence is the part of the signal's power \
             that the inputs explain linearly; below 0.3 nothing is drawn. In a closed loop the \
             estimate mixes the device with its controller.",
        );
        let mut plots = Vec::new();
        let mut left_out = Vec::new();
        for (sensor, known) in plant.sensors().iter().enumerate() {
            let all = self.estimated(sensor);
            let Some((_, _, measured)) = all.first() else {
                continue;
            };
            if measured.coherence.iter().all(|value| *value < COHERENT) {
                continue;
            }
            for (at, (index, column)) in self.inputs.iter().enumerate() {
                let moves = measured.gain[at].iter().any(|gain| gain.norm() > 0.0);
                if !moves {
                    continue;
                }
                let pair = format!("{} by {column}", known.column);
                if plots.len() >= DRAWN {
                    left_out.push(pair);
                    continue;
                }
                let over = plant.inputs()[*index].unit();
                plots.extend(bode(&pair, &format!("{} per {over}", known.unit), at, &all));
            }
            plots.push(coherence(&known.column, measured));
        }
        if plots.is_empty() {
            return section.text(
                "None can be estimated: the recordings are too short, no input moves, or nothing \
                 that was measured follows one linearly.",
            );
        }
        let section = plots
            .into_iter()
            .map(Block::Plot)
            .fold(section, Section::with);
        if left_out.is_empty() {
            return section;
        }
        section.text(format!("Not drawn: {}.", left_out.join(", ")))
    }

    /// Responses of a sensor as measured and by the models.
    fn estimated(&self, sensor: usize) -> Vec<(String, Tone, Response)> {
        let first = self.period(0);
        let chosen: Vec<usize> = (0..self.experiments.len())
            .filter(|&index| (self.period(index) / first - 1.0).abs() <= SAME_PERIOD)
            .filter(|&index| {
                let signal = &self.experiments[index].signals[sensor];
                let missing = signal.iter().filter(|v| !v.is_finite()).count();
                (missing as f64) <= MISSING * signal.len() as f64
            })
            .collect();
        let estimate = |of: &dyn Fn(usize) -> Vec<f64>| {
            let blocks = chosen.iter().map(|&index| {
                let experiment = &self.experiments[index];
                let even = |column: &[f64]| evenly(&experiment.t, column, first);
                let columns = self
                    .inputs
                    .iter()
                    .map(|(i, _)| even(&experiment.inputs[*i]));
                response::Block {
                    inputs: columns.collect(),
                    output: even(&of(index)),
                }
            });
            response(first, &blocks.collect::<Vec<_>>())
        };
        let mut all = Vec::new();
        let measured = estimate(&|index| self.experiments[index].signals[sensor].clone());
        let Some(measured) = measured else {
            return all;
        };
        all.push(("measured".to_owned(), Tone::Ink, measured));
        let models = self.free.models.len();
        for model in self.free.models.iter().skip(models.saturating_sub(2)) {
            let found = estimate(&|index| model.runs[index].sensors[sensor].simulated.clone());
            all.extend(found.map(|found| (model.name.to_owned(), model.tone, found)));
        }
        all
    }
}

fn correlation_plot(title: String, period: f64, found: &[(String, Tone, Correlation)]) -> Plot {
    let mut plot = Plot::over_time(title).x("lag", "s").y("coefficient", "");
    plot.height = 200;
    for (name, tone, of) in found {
        let lags: Vec<f64> = of.lags.iter().map(|lag| *lag as f64 * period).collect();
        plot = plot.with(Series::new(name, Stroke::Solid, lags, of.values.clone()).tone(*tone));
    }
    let Some((_, _, last)) = found.last() else {
        return plot;
    };
    let ends: Vec<f64> = [last.lags.first(), last.lags.last()]
        .into_iter()
        .flatten()
        .map(|lag| *lag as f64 * period)
        .collect();
    for (name, sign) in [("99 % of white noise", 1.0), ("", -1.0)] {
        let band = vec![sign * last.band; ends.len()];
        plot = plot.with(Series::new(name, Stroke::Dashed, ends.clone(), band).tone(Tone::Red));
    }
    plot
}

/// Gain in decibels and phase in degrees over frequency.
fn bode(pair: &str, unit: &str, input: usize, all: &[(String, Tone, Response)]) -> [Plot; 2] {
    let mut gain = Plot::over_time(format!("Gain of {pair}"))
        .x("frequency", "Hz")
        .y(format!("dB of 1 {unit}"), "")
        .logarithmic();
    let mut phase = Plot::over_time(format!("Phase of {pair}"))
        .x("frequency", "Hz")
        .y("phase (°)", "")
        .logarithmic();
    phase.height = 200;
    // Measured and modelled break at the same frequencies.
    let measured = &all[0].2;
    let coherent = |frequency: f64| {
        let at = measured.frequency.iter().position(|f| *f == frequency);
        at.is_some_and(|at| measured.coherence[at] >= COHERENT)
    };
    for (index, (name, tone, of)) in all.iter().enumerate() {
        let stroke = if index == 0 || index + 1 < all.len() {
            Stroke::Solid
        } else {
            Stroke::Dashed
        };
        let (mut decibels, mut degrees) = (Vec::new(), Vec::new());
        let mut last: Option<f64> = None;
        for (frequency, value) in of.frequency.iter().zip(&of.gain[input]) {
            if !coherent(*frequency) || value.norm() == 0.0 {
                decibels.push(f64::NAN);
                degrees.push(f64::NAN);
                continue;
            }
            decibels.push(20.0 * value.norm().log10());
            let angle = value.arg().to_degrees();
            let turns = last.map_or(0.0, |last| ((last - angle) / 360.0).round());
            let unwrapped = angle + 360.0 * turns;
            last = Some(unwrapped);
            degrees.push(unwrapped);
        }
        let line = |y: Vec<f64>| Series::new(name, stroke, of.frequency.clone(), y).tone(*tone);
        gain = gain.with(line(decibels));
        phase = phase.with(line(degrees));
    }
    [gain, phase]
}

fn coherence(signal: &str, measured: &Response) -> Plot {
    let line = Series::new(
        "measured",
        Stroke::Solid,
        measured.frequency.clone(),
        measured.coherence.clone(),
    );
    let mut plot = Plot::over_time(format!("Coherence of {signal} with the inputs"))
        .x("frequency", "Hz")
        .y("coherence", "")
        .between(0.0, 1.0)
        .logarithmic()
        .with(line.tone(Tone::Ink));
    plot.height = 160;
    plot
}

/// A column at equal distances in time, straight lines between its samples.
fn evenly(t: &[f64], column: &[f64], period: f64) -> Vec<f64> {
    let known: Vec<usize> = (0..t.len()).filter(|&k| column[k].is_finite()).collect();
    let (Some(&first), Some(&last)) = (t.first(), t.last()) else {
        return Vec::new();
    };
    if known.is_empty() {
        return Vec::new();
    }
    let count = ((last - first) / period + 0.5).floor() as usize + 1;
    let mut at = 0;
    let values = (0..count).map(|k| {
        let time = first + k as f64 * period;
        while at + 1 < known.len() && t[known[at + 1]] <= time {
            at += 1;
        }
        let here = known[at];
        let Some(&next) = known.get(at + 1).filter(|_| time >= t[here]) else {
            return column[here];
        };
        let part = (time - t[here]) / (t[next] - t[here]);
        column[here] + part * (column[next] - column[here])
    });
    values.collect()
}

#[cfg(test)]
mod tests {
    use sinew_sim::Rig;

    use super::*;
    use crate::fit::free_runs;
    use crate::recording::{Column, Recording};

    /// A mass on a spring, pushed by noise that is held over ten rows.
    fn rig(damping: f64) -> Rig {
        let text = format!(
            "format = \"sinew-rig/1\"\nname = \"m\"\n\
             [[body]]\nname = \"mass\"\nmotion = \"slide\"\ninertia = 1.0\n\
             [[spring]]\nname = \"coil\"\nfrom = \"ground\"\nto = \"mass\"\n\
             stiffness = 40.0\n\
             [[damper]]\nname = \"pot\"\nfrom = \"ground\"\nto = \"mass\"\n\
             damping = {damping}\n\
             [[actuator]]\nname = \"motor\"\ndrives = \"mass\"\ninput = \"u_N\"\n\
             hold = \"zero\"\ngain = 1.0\n\
             [[sensor]]\nname = \"q\"\nreads = \"mass.position\"\nsignal = \"q_m\"\n"
        );
        Rig::parse(&text, "rig.toml").expect("the rig is sound")
    }

    fn recording(name: &str, seed: u64) -> Recording {
        use rand::SeedableRng;
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        let t: Vec<f64> = (0..3000).map(|k| 0.01 * f64::from(k)).collect();
        let mut held = 0.0;
        let pushed: Vec<f64> = (0..t.len())
            .map(|k| {
                if k % 10 == 0 {
                    held = 5.0 * crate::noise::gaussian(&mut random);
                }
                held
            })
            .collect();
        let plant = Plant::new(&rig(2.0)).unwrap();
        let start = vec![0.0; plant.state_len()];
        let columns: Vec<&[f64]> = vec![&pushed];
        let drive = sinew_sim::InputTrajectory::new(&plant, t.len(), &columns).unwrap();
        let run = plant.simulate(&plant.values(), &start, &drive, &t).unwrap();
        let measured = run.column(0).into_iter();
        let measured = measured.map(|q| q + 1e-4 * crate::noise::gaussian(&mut random));
        let column = |name: &str, values: Vec<f64>| Column {
            name: name.into(),
            values,
        };
        let columns = vec![column("q_m", measured.collect()), column("u_N", pushed)];
        Recording::new(name, t, columns).expect("the recording is sound")
    }

    fn text(sections: &[Section]) -> String {
        let page = crate::report::Report::new("t");
        let page = sections
            .iter()
            .cloned()
            .fold(page, crate::report::Report::section);
        page.to_html()
    }

    #[test]
    fn a_wrong_damping_shows_in_the_residuals_and_the_right_one_does_not() {
        let recordings = [recording("A.csv", 1), recording("B.csv", 2)];
        let (wrong, right) = (rig(1.0), rig(2.0));
        let runs = [&wrong, &right].map(|rig| free_runs(rig, &recordings).unwrap());
        let free = Free {
            rig: &right,
            recordings: vec![("fit", &recordings[0]), ("test", &recordings[1])],
            models: vec![
                Model {
                    name: "wrong",
                    tone: Tone::Orange,
                    runs: &runs[0],
                },
                Model {
                    name: "right",
                    tone: Tone::Blue,
                    runs: &runs[1],
                },
            ],
        };
        let plant = Plant::new(&right).unwrap();
        let experiments: Vec<Experiment> = recordings
            .iter()
            .map(|r| Experiment::new(&plant, r).unwrap())
            .collect();
        let shared = Shared {
            free: &free,
            experiments: &experiments,
            inputs: &[(0, "u_N".to_owned())],
        };
        let found = shared.correlations(&[1], 0, None);
        assert_eq!(found.len(), 2);
        assert!(
            found[0].2.outside(false) > 0.5,
            "{}",
            found[0].2.outside(false)
        );
        assert!(
            found[1].2.outside(false) < 0.2,
            "{}",
            found[1].2.outside(false)
        );
        let found = shared.correlations(&[1], 0, Some(0));
        assert!(
            found[1].2.outside(true) < 0.2,
            "{}",
            found[1].2.outside(true)
        );

        // Near the resonance of 1 Hz the wrong one is nearly twice as high.
        let all = shared.estimated(0);
        let peak = |of: &Response| of.gain[0].iter().map(|g| g.norm()).fold(0.0, f64::max);
        let [measured, wrong, right] = [0, 1, 2].map(|k| peak(&all[k].2));
        assert!((right / measured - 1.0).abs() < 0.02, "{right} {measured}");
        assert!(wrong / measured > 1.3, "{wrong} {measured}");

        let fit = fit_table(&free);
        assert_eq!(fit.rows.len(), 2);
        assert_eq!(fit.rows[0][..2], ["q_m", "test"]);
        let page = text(&chapters(&free).unwrap());
        for expected in [
            "Residuals of q_m: autocorrelation",
            "Residuals of q_m against u_N",
            "99 % of white noise",
            "Gain of q_m by u_N",
            "Phase of q_m by u_N",
            "Coherence of q_m",
            "Coverage of the recordings",
            "where the recordings have been",
        ] {
            assert!(page.contains(expected), "{expected} is not on the page");
        }
    }

    #[test]
    fn uneven_and_missing_samples_are_bridged() {
        let even = evenly(&[0.0, 0.1, 0.25, 0.4], &[0.0, 1.0, f64::NAN, 4.0], 0.1);
        let expected = [0.0, 1.0, 2.0, 3.0, 4.0];
        assert!(
            even.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9),
            "{even:?}"
        );
        assert_eq!(evenly(&[0.0, 0.1], &[f64::NAN; 2], 0.1), [0.0; 0]);
    }
}

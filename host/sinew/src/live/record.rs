//! An excitation, played on a board, and what its sensors said meanwhile.
//!
//! Time is the board's. Every tick between the first row and the last is a row of the recording;
//! what is not known of it stays empty: a sample that the board missed, a whole tick whose frame
//! was lost on the way.

use std::collections::HashMap;
use std::path::Path;
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use sinew_device::mode::{Drive, Mode, State};
use sinew_device::protocol::{Parameters, Reason, Telemetry, ToDevice, ToHost};

use super::Names;
use super::topics::mode_word;
use crate::device::Device;
use sinew_ident::cli::progress::Stage;
use sinew_ident::error::{Error, Result};
use sinew_ident::recording::{Column, Recording};

/// Longest silence of a board that plays.
const SILENCE: Duration = Duration::from_secs(2);
/// Timeout of the answer to a row, after which the row is sent again.
const ANSWER: Duration = Duration::from_millis(200);

/// Period of the question what the board has learned.
const LEARNED: Duration = Duration::from_millis(250);

/// Decision of whoever watches a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Watch {
    /// Go on.
    Go,
    /// Disarm: the command ramps to the safe one.
    End,
    /// Emergency stop, which nobody acknowledges here.
    Stop,
}

/// A recording and its statistics.
#[derive(Debug)]
pub struct Recorded {
    /// Time, inputs as applied, outputs, channels, learned parameters.
    pub recording: Recording,
    /// Ticks whose frame was lost.
    pub lost_ticks: usize,
    /// Samples that the board itself missed, one for each output and channel.
    pub missing_samples: usize,
    /// Ticks for which no row of the excitation was there in time; the last command was held.
    pub held_ticks: usize,
    /// Rows whose command the limits changed.
    pub limited_rows: usize,
    /// Why the board stopped before the last row, if it did.
    pub ended: Option<State>,
}

impl Recorded {
    /// The figures for programs, `sinew-record/1`. `asked`: rows of the excitation.
    pub fn document(&self, out: &Path, asked: usize) -> Value {
        let columns = self.recording.columns().iter();
        json!({
            "format": "sinew-record/1",
            "recording": out.display().to_string(),
            "rows": self.recording.len(),
            "rows_asked": asked,
            "seconds": self.recording.duration(),
            "columns": columns.map(|column| column.name.as_str()).collect::<Vec<_>>(),
            "lost_ticks": self.lost_ticks,
            "missing_samples": self.missing_samples,
            "held_ticks": self.held_ticks,
            "limited_rows": self.limited_rows,
            "ended": self.ended.map(|state| json!({
                "mode": mode_word(state),
                "cause": format!("{:?}", state.cause),
            })),
        })
    }
}

/// Commands for each tick at `rate_mhz`, from a recording's input columns: each tick takes the row
/// that holds at its time.
///
/// # Errors
/// A column that is missing, or one without any value.
pub fn excitation(input: &Recording, names: &Names, rate_mhz: u32) -> Result<Vec<Vec<f32>>> {
    let mut columns = Vec::new();
    for name in &names.inputs {
        let factor = names.units.factor(name);
        let values = input.held(name, "the board")?.values.into_iter();
        columns.push(values.map(|value| value * factor).collect::<Vec<f64>>());
    }
    let t = input.t();
    let period_s = 1000.0 / f64::from(rate_mhz);
    let ticks = (input.duration() / period_s).floor() as usize + 1;
    let rows = (0..ticks).map(|k| {
        // A thousandth of a period for the rounding of the times in the file.
        let now = t[0] + (k as f64 + 1e-3) * period_s;
        let row = t.partition_point(|t| *t <= now).saturating_sub(1);
        columns.iter().map(|column| column[row] as f32).collect()
    });
    Ok(rows.collect())
}

/// Plays `rows` and records until the last of them; the board is disarmed afterwards, whatever
/// happens.
///
/// # Errors
/// The board cannot be reached, refuses, or falls silent.
pub fn record(
    device: &mut Device,
    names: &Names,
    rows: &[Vec<f32>],
    out: &Path,
    quiet: bool,
) -> Result<Recorded> {
    record_watched(device, names, rows, out, quiet, &mut |_| Watch::Go)
}

/// As [`record`], for somebody who may end it: `watch` is asked at every tick that is heard of, and
/// without one every few milliseconds. After [`Watch::Stop`] the board stays stopped, and `ended`
/// says so; after [`Watch::End`] the recording is shorter.
///
/// # Errors
/// As [`record`].
pub fn record_watched(
    device: &mut Device,
    names: &Names,
    rows: &[Vec<f32>],
    out: &Path,
    quiet: bool,
    watch: &mut dyn FnMut(Option<&Telemetry>) -> Watch,
) -> Result<Recorded> {
    let state = |answer: &ToHost| matches!(answer, ToHost::State(_));
    device.insist(&ToDevice::Disarm, state)?;
    device.insist(&ToDevice::Stream { every: 1 }, state)?;
    let stage = Stage::begin("record", quiet);
    let learns = !names.learned.is_empty();
    let played = play(device, rows, learns, &stage, watch);
    // Before anything is said about what went wrong.
    let stopped = matches!(
        &played,
        Ok(Played { ended: Some(state), .. }) if state.mode == Mode::Tripped
    );
    let disarmed = (!stopped).then(|| device.insist(&ToDevice::Disarm, state));
    let silenced = device.insist(&ToDevice::Stream { every: 0 }, state);
    let mut played = played?;
    disarmed.transpose()?;
    silenced?;
    if learns {
        let heard = played.telemetry.len();
        played
            .learned
            .extend(told(device)?.map(|known| (heard, known)));
    }
    stage.end(format!("{} ticks", played.telemetry.len()));
    table(&played, names, rows, out)
}

/// Answers of a board that played.
struct Played {
    telemetry: Vec<Telemetry>,
    /// Learned parameters, each with the number of ticks that had been heard of by then.
    learned: Vec<(usize, Parameters)>,
    /// Why the board stopped before the last row, if it did.
    ended: Option<State>,
}

/// Sends rows ahead of their ticks and takes what comes back, to the last row or to the end of
/// arming.
fn play(
    device: &mut Device,
    rows: &[Vec<f32>],
    learns: bool,
    stage: &Stage,
    watch: &mut dyn FnMut(Option<&Telemetry>) -> Watch,
) -> Result<Played> {
    let mut seen: Vec<Telemetry> = Vec::new();
    let mut learned = Vec::new();
    let mut asked_learned = Instant::now();
    let (mut next, mut armed) = (0, false);
    let mut asked: Option<Instant> = None;
    let mut heard = Instant::now();
    loop {
        let overdue = asked.is_none_or(|at| at.elapsed() > ANSWER);
        if next < rows.len() && overdue {
            device.send(&ToDevice::Excite {
                row: next as u32,
                u: rows[next].iter().copied().collect(),
            })?;
            asked = Some(Instant::now());
        }
        let mut full = false;
        match device.answer(Instant::now() + Duration::from_millis(2))? {
            Some(ToHost::Queued { row, room }) if row as usize == next => {
                next += 1;
                asked = None;
                full = room == 0;
            }
            Some(ToHost::Refused {
                reason: Reason::Full,
            }) => full = true,
            // Something on the way was damaged; the row is sent again in time.
            Some(ToHost::Refused {
                reason: Reason::Damaged | Reason::Order,
            }) => {}
            // It is asked again in time.
            Some(ToHost::Refused {
                reason: Reason::Parameters,
            }) => {}
            Some(ToHost::Parameters(known)) => learned.push((seen.len(), known)),
            // Armed, it has disarmed itself: the telemetry below says why.
            Some(ToHost::Refused { reason }) if !armed => {
                return Err(Error::failed(format!(
                    "the board refused a row: {reason:?}"
                )));
            }
            _ => {}
        }
        if !armed && (full || next == rows.len()) {
            let (drive, blend_steps) = (Drive::Excitation, 0);
            device.insist(&ToDevice::Arm { drive, blend_steps }, |answer| {
                matches!(answer, ToHost::State(_))
            })?;
            // What was told before belongs to no row.
            heard = Instant::now();
            armed = true;
        }
        if full {
            // Until there is room again: a tick or two.
            asked = Some(Instant::now() - ANSWER + Duration::from_millis(5));
        }
        if learns && !seen.is_empty() && asked_learned.elapsed() > LEARNED {
            device.send(&ToDevice::Parameters)?;
            asked_learned = Instant::now();
        }
        let mut verdict = watch(None);
        while verdict == Watch::Go
            && let Some(telemetry) = device.telemetry(Instant::now())?
        {
            heard = Instant::now();
            let state = telemetry.state;
            if armed {
                verdict = watch(Some(&telemetry));
            }
            let playing = telemetry.row.is_some() || !seen.is_empty();
            let last = telemetry.row.map(|row| row as usize + 1) == Some(rows.len());
            if playing && armed {
                stage.share(seen.len(), rows.len(), "ticks");
                seen.push(telemetry);
            }
            let stopped = !seen.is_empty() && !matches!(state.mode, Mode::Armed(_));
            if last || stopped {
                return Ok(Played {
                    telemetry: seen,
                    learned,
                    ended: (!last).then_some(state),
                });
            }
        }
        match verdict {
            Watch::Go => {}
            Watch::End => {
                // The answer to a row that was under way is no answer to what comes next.
                let until = Instant::now() + Duration::from_millis(20);
                while device.answer(until)?.is_some() {}
                return Ok(Played {
                    telemetry: seen,
                    learned,
                    ended: None,
                });
            }
            Watch::Stop => {
                let state = device.emergency_stop()?;
                return Ok(Played {
                    telemetry: seen,
                    learned,
                    ended: Some(state),
                });
            }
        }
        if heard.elapsed() > SILENCE {
            return Err(Error::failed("the board says nothing any more").help(
                "is it powered, and the cable in? It disarms itself when the line is silent",
            ));
        }
    }
}

/// Parameters that the board has learned by now; `None` where it does not say.
fn told(device: &mut Device) -> Result<Option<Parameters>> {
    device.send(&ToDevice::Parameters)?;
    let until = Instant::now() + ANSWER;
    while let Some(answer) = device.answer(until)? {
        if let ToHost::Parameters(known) = answer {
            return Ok(Some(known));
        }
    }
    Ok(None)
}

/// One row a tick, between the first and the last that were heard of.
fn table(played: &Played, names: &Names, rows: &[Vec<f32>], out: &Path) -> Result<Recorded> {
    let telemetry = &played.telemetry;
    let Some(first) = telemetry.first() else {
        return Err(Error::failed("the board played no row"));
    };
    let groups = [&names.inputs, &names.outputs, &names.channels];
    let mut columns: Vec<Column> = groups
        .into_iter()
        .flatten()
        .map(|name| Column {
            name: name.clone(),
            values: Vec::new(),
        })
        .collect();
    let signals = columns.len();
    columns.extend(names.learned.names().map(|name| Column {
        name,
        values: Vec::new(),
    }));
    // The newest of each tick.
    let learned: HashMap<usize, Vec<f64>> = (played.learned.iter())
        .filter_map(|(heard, known)| Some((*heard, names.learned.values(known)?)))
        .collect();
    let mut t = Vec::new();
    let (mut lost_ticks, mut missing, mut held, mut limited) = (0, 0, 0, 0);
    let mut before: Option<&Telemetry> = None;
    for (k, tick) in telemetry.iter().enumerate() {
        if let Some(before) = before {
            let gap = tick.tick.wrapping_sub(before.tick);
            for lost in 1..gap {
                // The timer's ticks are evenly spaced, so the time of a lost one is known. Nothing
                // else is.
                let share = f64::from(lost) / f64::from(gap);
                let us = (tick.at_us - before.at_us) as f64 * share
                    + (before.at_us - first.at_us) as f64;
                t.push(us * 1e-6);
                columns.iter_mut().for_each(|c| c.values.push(f64::NAN));
                lost_ticks += 1;
            }
        }
        t.push((tick.at_us - first.at_us) as f64 * 1e-6);
        let values = tick.u.iter().chain(&tick.y).chain(&tick.s);
        for (column, value) in columns.iter_mut().zip(values) {
            let value = f64::from(*value) / names.units.factor(&column.name);
            column.values.push(value);
        }
        let known = learned.get(&(k + 1));
        for (i, column) in columns[signals..].iter_mut().enumerate() {
            column.values.push(known.map_or(f64::NAN, |known| known[i]));
        }
        missing += tick.y.iter().chain(&tick.s).filter(|v| v.is_nan()).count();
        match tick.row.and_then(|row| rows.get(row as usize)) {
            Some(row) => limited += usize::from(row.as_slice() != tick.u.as_slice()),
            None => held += 1,
        }
        before = Some(tick);
    }
    Ok(Recorded {
        recording: Recording::new(out, t, columns)?,
        lost_ticks,
        missing_samples: missing,
        held_ticks: held,
        limited_rows: limited,
        ended: played.ended,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use sinew_device::mode::Cause;
    use sinew_mpc::status::Status;

    fn names() -> Names {
        Names::for_test(vec!["u_V".into()], vec!["q_m".into()])
    }

    fn tick(tick: u32, row: Option<u32>, u: f32, y: f32) -> Telemetry {
        let one = |v: f32| [v].into_iter().collect();
        Telemetry {
            tick,
            at_us: u64::from(tick) * 8_000 + 1_000_000,
            state: State {
                mode: Mode::Armed(Drive::Excitation),
                cause: Cause::Asked,
            },
            row,
            y: one(y),
            s: heapless::Vec::new(),
            u: one(u),
            reference: one(f32::NAN),
            estimate: one(y),
            disturbance: one(0.0),
            status: Status::OpenLoop,
            iterations: 0,
            ticks: 0,
            deadline_misses: 0,
            dropped: 0,
        }
    }

    /// A command of 250 mV and a reading of 90 degrees had been 250 V and 1.57 degrees.
    #[test]
    fn a_board_is_sent_si_and_a_file_has_the_units_of_its_rig() {
        let rig = sinew_sim::Rig::parse(
            "format = \"sinew-rig/1\"\nname = \"arm\"\n[[body]]\nname = \"arm\"\n\
             motion = \"hinge\"\ninertia = 0.1\n[[actuator]]\nname = \"motor\"\ndrives = \"arm\"\n\
             input = \"u_mNm\"\nunit = \"mNm\"\ngain = 1.0\n[[sensor]]\nname = \"encoder\"\n\
             reads = \"arm.position\"\nsignal = \"q_deg\"\nunit = \"deg\"\n",
            "arm.toml",
        )
        .unwrap();
        let mut names = Names::for_test(vec!["u_mNm".into()], vec!["q_deg".into()]);
        names.units = super::super::Units::of(&rig, ["u_mNm".to_owned()].iter()).unwrap();
        let columns = vec![Column {
            name: "u_mNm".into(),
            values: vec![250.0, -250.0],
        }];
        let input = Recording::new("in.csv", vec![0.0, 0.008], columns).unwrap();
        assert_eq!(
            excitation(&input, &names, 125_000).unwrap(),
            [[0.25], [-0.25]]
        );
        let played = Played {
            telemetry: vec![
                tick(1, Some(0), 0.25, std::f32::consts::FRAC_PI_2),
                tick(2, Some(1), -0.25, 0.0),
            ],
            learned: Vec::new(),
            ended: None,
        };
        let rows = [vec![0.25], vec![-0.25]];
        let recorded = table(&played, &names, &rows, Path::new("x.csv")).unwrap();
        let read = |name: &str| recorded.recording.column(name).unwrap()[0];
        assert!((read("q_deg") - 90.0).abs() < 1e-4 && (read("u_mNm") - 250.0).abs() < 1e-4);
        assert_eq!(recorded.limited_rows, 0);
    }

    #[test]
    fn what_was_lost_is_marked_and_never_invented() {
        let rows = vec![
            vec![0.1],
            vec![0.2],
            vec![0.3],
            vec![0.4],
            vec![0.5],
            vec![9.0],
        ];
        let telemetry = vec![
            tick(70, Some(0), 0.1, 1.0),
            tick(71, Some(1), 0.2, f32::NAN),
            // 72 and 73 were lost on the way; at 74 no row was there.
            tick(74, None, 0.4, 1.4),
            tick(75, Some(4), 0.5, 1.5),
            tick(76, Some(5), 1.0, 1.6),
        ];
        let played = Played {
            telemetry,
            learned: Vec::new(),
            ended: None,
        };
        let recorded = table(&played, &names(), &rows, Path::new("x.csv")).unwrap();
        let text = recorded.recording.to_csv();
        assert_eq!(
            text,
            "t,u_V,q_m\n0.0,0.10000000149011612,1.0\n0.008,0.20000000298023224,\n0.016,,\n0.024,,\n\
             0.032,0.4000000059604645,1.399999976158142\n0.04,0.5,1.5\n0.048,1.0,1.600000023841858\n"
        );
        assert_eq!(
            (
                recorded.lost_ticks,
                recorded.missing_samples,
                recorded.held_ticks,
                recorded.limited_rows
            ),
            (2, 1, 1, 1)
        );
    }

    #[test]
    fn what_the_board_learned_stands_at_the_tick_before_its_answer() {
        let mut names = names();
        names.learned = crate::adopt::examples::two();
        let known = |theta: f32| crate::adopt::examples::known(&[theta, 0.0], &[1.0, 1.0]);
        let rows = vec![vec![0.1]; 3];
        let played = Played {
            telemetry: (0..3).map(|k| tick(k, Some(k), 0.1, 1.0)).collect(),
            // Two answers at one tick: the newer counts.
            learned: vec![(2, known(1.0)), (2, known(2.0)), (3, known(-1.0))],
            ended: None,
        };
        let recorded = table(&played, &names, &rows, Path::new("x.csv")).unwrap();
        let learned = recorded.recording.column("learned_mass.inertia").unwrap();
        assert!(learned[0].is_nan());
        for (value, wanted) in learned[1..].iter().zip([2.6, 1.7]) {
            assert!((value - wanted).abs() < 1e-9, "{learned:?}");
        }
        assert_eq!(recorded.missing_samples, 0);
    }

    #[test]
    fn each_tick_takes_the_row_that_holds_then() {
        let csv = b"t,u_V\n5.0,1\n5.01,2\n5.1,\n5.2,4\n";
        let input = Recording::parse(csv, "excitation.csv").unwrap();
        // 50 Hz: 5.00, 5.02 .. 5.20.
        let rows = excitation(&input, &names(), 50_000).unwrap();
        let flat: Vec<f32> = rows.into_iter().flatten().collect();
        assert_eq!(
            flat,
            [1.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0, 4.0]
        );
    }
}

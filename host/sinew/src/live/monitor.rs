//! A run on a board, watched and steered from a terminal, and saved.
//!
//! A line typed is an order ([`order`]); what the board thinks of it is shown. Everything that is
//! shown is a row of the file, with the board's own time.

use std::fmt::Write as _;
use std::io::{BufRead, IsTerminal, Write};
use std::path::Path;
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::time::{Duration, Instant};

use sinew_device::mode::{Drive, Mode};
use sinew_device::protocol::{Health, Identity, Parameters, Reason, Telemetry, ToDevice, ToHost};

use super::Names;
use crate::device::Device;
use sinew_ident::error::{Error, Result};

/// Refresh interval of the terminal.
const REFRESH: Duration = Duration::from_millis(100);
/// Period of the lines that tell the board that somebody is there.
const ALIVE: Duration = Duration::from_millis(500);
/// Longest silence of a board.
const SILENCE: Duration = Duration::from_secs(3);

/// Message to the board for a typed line; `None`: disarm, save, end. `arm` reaches the reference in
/// a second.
///
/// # Errors
/// The fault in one line.
pub fn order(line: &str, identity: &Identity) -> std::result::Result<Option<ToDevice>, String> {
    let mut words = line.split_whitespace();
    let verb = words.next().unwrap_or_default();
    let numbers = words
        .map(|word| {
            let number = word.parse::<f32>().ok().filter(|number| number.is_finite());
            number.ok_or(format!("`{word}` is not a number"))
        })
        .collect::<std::result::Result<Vec<f32>, String>>()?;
    let count = |wanted: usize, what: &str| match numbers.len() {
        n if n == wanted => Ok(()),
        n => Err(format!("{what} takes {wanted} numbers, not {n}")),
    };
    let (n_u, n_y) = (usize::from(identity.n_u), usize::from(identity.n_y));
    let said = match verb {
        "arm" => {
            count(0, "arm")?;
            ToDevice::Arm {
                drive: Drive::Rig,
                blend_steps: u16::try_from(identity.rate_mhz.div_ceil(1000)).unwrap_or(u16::MAX),
            }
        }
        "disarm" => ToDevice::Disarm,
        "stop" | "" => ToDevice::EmergencyStop,
        "r" => {
            count(n_y, "r (a reference for each output)")?;
            let reference = numbers.iter().copied().collect();
            ToDevice::Follow { reference }
        }
        "limit" => {
            count(
                3 * n_u,
                "limit (lower, upper, rate a step, of each command)",
            )?;
            let part = |i: usize| numbers.chunks(3).map(|three| three[i]).collect();
            ToDevice::Limit {
                lower: part(0),
                upper: part(1),
                rate: part(2),
            }
        }
        "quit" => return Ok(None),
        other => {
            return Err(format!(
                "there is no `{other}`; arm, disarm, stop (or an empty line), r, limit, quit"
            ));
        }
    };
    Ok(Some(said))
}

/// Statistics of a watched run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Watched {
    /// Ticks that were told.
    pub ticks: u64,
    /// Ticks whose frame was lost.
    pub lost: u64,
}

/// Watches until `quit`, the end of the orders, or `seconds`; the board is disarmed at the end.
///
/// # Errors
/// The board is gone, or the file cannot be written.
pub fn monitor(
    device: &mut Device,
    names: &Names,
    identity: &Identity,
    out: Option<&Path>,
    seconds: Option<f64>,
) -> Result<Watched> {
    let mut file = match out {
        Some(path) => Some(Saved::create(path, names)?),
        None => None,
    };
    let typed = lines();
    let stream = ToDevice::Stream { every: 1 };
    device.insist(&stream, |answer| matches!(answer, ToHost::State(_)))?;
    let watched = watch(device, names, identity, &typed, seconds, &mut file);
    // Whatever happened.
    let disarmed = device.insist(&ToDevice::Disarm, |a| matches!(a, ToHost::State(_)));
    if let Some(file) = &mut file {
        file.flush()?;
    }
    let watched = watched?;
    disarmed?;
    Ok(watched)
}

fn watch(
    device: &mut Device,
    names: &Names,
    identity: &Identity,
    typed: &Receiver<String>,
    seconds: Option<f64>,
    file: &mut Option<Saved>,
) -> Result<Watched> {
    let began = Instant::now();
    let (mut heard, mut shown, mut said) = (began, began, began);
    let mut watched = Watched::default();
    let mut before: Option<u32> = None;
    let mut orders_end = false;
    // Until a board answers that it judges no channel.
    let mut judges = !names.channels.is_empty();
    let mut health = Health::default();
    let mut learned = Learned::new(names);
    let screen = std::io::stdout().is_terminal();
    loop {
        match typed.try_recv() {
            Ok(line) => match order(&line, identity) {
                Ok(None) => return Ok(watched),
                Ok(Some(message)) => device.send(&message)?,
                Err(what) => println!("{what}"),
            },
            // A terminal that was closed, or a script that has ended: with a time to end, go on
            // until then.
            Err(TryRecvError::Disconnected) => orders_end = true,
            Err(TryRecvError::Empty) => {}
        }
        let over = seconds.is_some_and(|s| began.elapsed().as_secs_f64() > s);
        if over || (orders_end && seconds.is_none()) {
            return Ok(watched);
        }
        if said.elapsed() > ALIVE {
            device.send(&ToDevice::Stream { every: 1 })?;
            if judges {
                device.send(&ToDevice::Health)?;
            }
            if learned.ask() {
                device.send(&ToDevice::Parameters)?;
            }
            said = Instant::now();
        }
        while let Some(answer) = device.answer(Instant::now())? {
            match answer {
                // So does a board of an earlier version, to which the frame is damaged.
                ToHost::Refused {
                    reason: Reason::Judges | Reason::Damaged,
                } if judges => judges = false,
                ToHost::Refused {
                    reason: Reason::Parameters | Reason::Damaged,
                } if learned.is_unanswered() => learned.refused(),
                ToHost::Refused { reason } => println!("refused, nothing changed: {reason:?}"),
                ToHost::Health(now) => {
                    for line in changed(&health, &now, &names.channels) {
                        println!("{line}");
                    }
                    health = now;
                }
                ToHost::Parameters(known) => learned.told(&known, names),
                ToHost::Hello(_) => println!("the board has restarted"),
                _ => {}
            }
        }
        if let Some(seen) = device.telemetry(Instant::now() + Duration::from_millis(5))? {
            heard = Instant::now();
            let gap = before.map_or(1, |before| seen.tick.wrapping_sub(before));
            // A board that restarted counts from the start again.
            watched.lost += u64::from(gap.saturating_sub(1)) * u64::from(gap < 1 << 31);
            watched.ticks += 1;
            before = Some(seen.tick);
            if let Some(file) = file {
                file.row(&seen, learned.take().as_deref())?;
            }
            if shown.elapsed() > REFRESH {
                shown = Instant::now();
                show(&seen, names, learned.latest(), screen);
            }
        }
        if heard.elapsed() > SILENCE {
            return Err(Error::failed("the board says nothing any more").help(
                "is it powered, and the cable in? It disarms itself when the line is silent",
            ));
        }
    }
}

/// Parameters that the board estimates, as it told them last.
struct Learned {
    /// Refusals in a row that end the asking; one may be a frame that the line has damaged.
    patience: u8,
    latest: Option<Vec<f64>>,
    /// It stands in no row yet.
    fresh: bool,
}

impl Learned {
    const PATIENCE: u8 = 3;

    fn new(names: &Names) -> Self {
        Self {
            patience: if names.learned.is_empty() {
                0
            } else {
                Self::PATIENCE
            },
            latest: None,
            fresh: false,
        }
    }

    /// The board is to be asked.
    const fn ask(&self) -> bool {
        self.patience > 0
    }

    /// It was asked and has not told anything: a refusal may be the answer.
    const fn is_unanswered(&self) -> bool {
        self.patience > 0 && self.latest.is_none()
    }

    const fn refused(&mut self) {
        self.patience = self.patience.saturating_sub(1);
    }

    fn told(&mut self, known: &Parameters, names: &Names) {
        let Some(values) = names.learned.values(known) else {
            return self.refused();
        };
        self.latest = Some(values);
        self.fresh = true;
    }

    /// Values for the next row of the file; each stands in one.
    fn take(&mut self) -> Option<Vec<f64>> {
        let fresh = std::mem::take(&mut self.fresh);
        self.latest.clone().filter(|_| fresh)
    }

    fn latest(&self) -> Option<&[f64]> {
        self.latest.as_deref()
    }
}

/// Lines of standard input, as they come.
fn lines() -> Receiver<String> {
    let (sender, receiver) = channel();
    std::thread::spawn(move || {
        for line in std::io::stdin().lock().lines().map_while(|line| line.ok()) {
            if sender.send(line).is_err() {
                break;
            }
        }
    });
    receiver
}

/// Lines about channels that have been left out, or taken in again, since the board was asked last.
fn changed(before: &Health, now: &Health, channels: &[String]) -> Vec<String> {
    let name = |i: usize| match channels.get(i) {
        Some(name) => name.clone(),
        None => format!("channel {i}"),
    };
    let of = |bits: u32| (0..32).filter(move |i| bits >> i & 1 == 1);
    let left_out = of(now.left_out & !before.left_out).map(|i| {
        format!(
            "{} contradicts the other channels: left out (the {}. time that one was)",
            name(i),
            now.times
        )
    });
    let back = of(before.left_out & !now.left_out)
        .map(|i| format!("{} agrees with the other channels again", name(i)));
    left_out.chain(back).collect()
}

/// The state of the run, over the lines of the last time where there is a screen.
fn show(seen: &Telemetry, names: &Names, learned: Option<&[f64]>, screen: bool) {
    let mode = match seen.state.mode {
        Mode::Disarmed => "disarmed".to_string(),
        Mode::Armed(drive) => format!("armed ({drive:?})"),
        Mode::Tripped => "EMERGENCY STOP (disarm acknowledges it)".to_string(),
    };
    let mut text = String::new();
    // Writing to a String cannot fail.
    let _ = writeln!(
        text,
        "{:9.3} s  {mode}, {:?}  {:?} after {} iterations, {} ticks, {} late, {} frames dropped",
        seen.at_us as f64 * 1e-6,
        seen.state.cause,
        seen.status,
        seen.iterations,
        seen.ticks,
        seen.deadline_misses,
        seen.dropped
    );
    for (i, name) in names.outputs.iter().enumerate() {
        let at = |values: &[f32]| values.get(i).copied().unwrap_or(f32::NAN);
        let _ = writeln!(
            text,
            "  {name:>12}  asked {:11.4e}  measured {:11.4e}  estimate {:11.4e}  disturbance {:10.3e}",
            at(&seen.reference),
            at(&seen.y),
            at(&seen.estimate),
            at(&seen.disturbance)
        );
    }
    for (name, u) in names.inputs.iter().zip(&seen.u) {
        let _ = writeln!(text, "  {name:>12}  command {u:11.4e}");
    }
    let learned = learned.unwrap_or_default().chunks_exact(2);
    for (parameter, values) in names.learned.parameters().iter().zip(learned) {
        let (value, deviation) = (values[0], values[1]);
        let name = &parameter.name;
        let _ = writeln!(
            text,
            "  {name:>12}  learned {value:11.4e} ± {deviation:9.2e}"
        );
    }
    if screen {
        let lines = text.lines().count();
        // Each line cleared to its end, and back to the first: the next turn writes over it.
        print!("{}\x1b[{lines}A", text.replace('\n', "\x1b[K\n"));
    } else {
        print!("{text}");
    }
    let _ = std::io::stdout().flush();
}

/// The file of a run, written as it goes, so that it is whole up to the moment when something
/// breaks.
struct Saved {
    path: std::path::PathBuf,
    file: std::io::BufWriter<Box<dyn std::io::Write + Send>>,
    /// Factors to SI of the columns of inputs, and of outputs.
    factors: [Vec<f64>; 2],
    /// Columns of learned parameters.
    learned: usize,
}

impl Saved {
    fn create(path: &Path, names: &Names) -> Result<Self> {
        let file = sinew_files::open(path)?;
        let mut saved = Self {
            path: path.to_path_buf(),
            file: std::io::BufWriter::new(file),
            factors: [&names.inputs, &names.outputs].map(|columns| names.units.factors(columns)),
            learned: names.learned.names().count(),
        };
        let of = |what: &str| {
            names
                .outputs
                .iter()
                .map(move |n| format!("{what}_{n}"))
                .collect()
        };
        let groups: [Vec<String>; 5] = [
            names.inputs.clone(),
            names.outputs.clone(),
            of("reference"),
            of("estimate"),
            of("disturbance"),
        ];
        let header = groups.concat().join(",");
        saved.line(&format!("# status: {}", statuses()))?;
        saved.line(&names.learned.model_line())?;
        let learned: String = names.learned.names().map(|it| format!(",{it}")).collect();
        saved.line(&format!(
            "t,{header},armed_1,status_1,iterations_1,step_ticks_1,late_1,tick_1{learned}"
        ))?;
        Ok(saved)
    }

    fn row(&mut self, seen: &Telemetry, learned: Option<&[f64]>) -> Result<()> {
        let mut line = format!("{}", seen.at_us as f64 * 1e-6);
        let [inputs, outputs] = &self.factors;
        for (values, factors) in [
            (&seen.u, inputs),
            (&seen.y, outputs),
            (&seen.reference, outputs),
            (&seen.estimate, outputs),
            (&seen.disturbance, outputs),
        ] {
            for (value, factor) in values.iter().zip(factors) {
                // A missing value is an empty field, and what is in SI keeps its digits.
                let text = if value.is_nan() {
                    String::new()
                } else if *factor == 1.0 {
                    value.to_string()
                } else {
                    (f64::from(*value) / factor).to_string()
                };
                let _ = write!(line, ",{text}");
            }
        }
        let armed = u8::from(matches!(seen.state.mode, Mode::Armed(_)));
        let _ = write!(
            line,
            ",{armed},{},{},{},{},{}",
            seen.status as u8, seen.iterations, seen.ticks, seen.deadline_misses, seen.tick
        );
        for i in 0..self.learned {
            let value = learned.and_then(|values| values.get(i));
            let _ = write!(line, ",{}", value.map_or(String::new(), f64::to_string));
        }
        self.line(&line)
    }

    fn line(&mut self, text: &str) -> Result<()> {
        writeln!(self.file, "{text}").map_err(|e| Error::write(&self.path, e))
    }

    fn flush(&mut self) -> Result<()> {
        self.file.flush().map_err(|e| Error::write(&self.path, e))
    }
}

/// Meanings of the numbers in the status column.
fn statuses() -> String {
    use sinew_mpc::status::Status;
    let all = [
        Status::Converged,
        Status::IterationLimit,
        Status::NoDecrease,
        Status::BadReference,
        Status::BadSettings,
        Status::NotFinite,
        Status::SignalLost,
        Status::Disarmed,
        Status::OpenLoop,
        Status::CutShort,
    ];
    all.map(|status| format!("{} {status:?}", status as u8))
        .join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn identity() -> Identity {
        Identity {
            protocol: 2,
            model: 0,
            n_u: 2,
            n_y: 3,
            n_s: 0,
            past_inputs: 1,
            past_outputs: 1,
            horizon: 5,
            control_horizon: 5,
            rate_mhz: 120_000,
        }
    }

    #[test]
    fn a_channel_that_is_left_out_and_comes_back_is_said_by_its_name() {
        let health = |left_out: u32, times: u32| Health { left_out, times };
        let names = ["light_1".to_string(), "light_2".into(), "light_3".into()];
        let of = |before: Health, now: Health| changed(&before, &now, &names);
        assert_eq!(of(health(0, 0), health(0, 0)), Vec::<String>::new());
        let lines = of(health(0b001, 1), health(0b110, 3));
        let wanted = [
            "light_2 contradicts the other channels: left out (the 3. time that one was)",
            "light_3 contradicts the other channels: left out (the 3. time that one was)",
            "light_1 agrees with the other channels again",
        ];
        assert_eq!(lines, wanted);
        assert!(of(health(0, 0), health(1 << 9, 1))[0].starts_with("channel 9 contradicts"));
    }

    #[test]
    fn what_the_board_has_learned_stands_in_the_row_after_its_answer() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("run.csv");
        let mut names = Names::for_test(vec!["u_N".into()], vec!["q_m".into()]);
        names.learned = crate::adopt::examples::two();
        let mut learned = Learned::new(&names);
        let one = |v: f32| [v].into_iter().collect();
        let mut tick = Telemetry {
            tick: 0,
            at_us: 0,
            state: sinew_device::mode::State {
                mode: Mode::Disarmed,
                cause: sinew_device::mode::Cause::Start,
            },
            row: None,
            y: one(0.5),
            s: heapless::Vec::new(),
            u: one(1.0),
            reference: one(f32::NAN),
            estimate: one(0.5),
            disturbance: one(0.0),
            status: sinew_mpc::status::Status::Disarmed,
            iterations: 0,
            ticks: 7,
            deadline_misses: 0,
            dropped: 0,
        };
        let mut saved = Saved::create(&path, &names).expect("a file");
        for k in 0..3 {
            if k == 1 {
                let known = crate::adopt::examples::known(&[1.0, 2.0], &[0.25, 0.0]);
                learned.told(&known, &names);
            }
            (tick.tick, tick.at_us) = (k, 8000 * u64::from(k));
            saved.row(&tick, learned.take().as_deref()).expect("a row");
        }
        saved.flush().expect("the rows");
        let text = std::fs::read_to_string(&path).expect("the file");
        let lines: Vec<&str> = text.lines().skip(1).collect();
        assert_eq!(
            lines,
            [
                "# model 00ab12cd",
                "t,u_N,q_m,reference_q_m,estimate_q_m,disturbance_q_m,armed_1,status_1,\
                 iterations_1,step_ticks_1,late_1,tick_1,learned_mass.inertia,\
                 deviation_mass.inertia,learned_load.level,deviation_load.level",
                "0,1,0.5,,0.5,0,0,7,0,7,0,0,,,,",
                "0.008,1,0.5,,0.5,0,0,7,0,7,0,1,2.3,0.15,-0.65,0",
                "0.016,1,0.5,,0.5,0,0,7,0,7,0,2,,,,",
            ]
        );
        // From here on a refusal is that of something else.
        assert!(learned.ask() && !learned.is_unanswered());
        // A board that has never told is asked three times and not again.
        let mut silent = Learned::new(&names);
        for _ in 0..3 {
            assert!(silent.ask() && silent.is_unanswered());
            silent.refused();
        }
        assert!(!silent.ask());
    }

    #[test]
    fn orders_are_understood_or_refused_with_the_reason() {
        let say = |line: &str| order(line, &identity());
        fn fixed<const L: usize>(values: &[f32]) -> heapless::Vec<f32, L> {
            values.iter().copied().collect()
        }
        assert_eq!(
            say("arm"),
            Ok(Some(ToDevice::Arm {
                drive: Drive::Rig,
                blend_steps: 120
            }))
        );
        // Whoever hits Return in a hurry means it.
        assert_eq!(say(""), Ok(Some(ToDevice::EmergencyStop)));
        assert_eq!(
            say(" r 0.1 -2e-3  0"),
            Ok(Some(ToDevice::Follow {
                reference: fixed(&[0.1, -2e-3, 0.0])
            }))
        );
        assert_eq!(
            say("limit -1 1 0.1 -2 2 0.2"),
            Ok(Some(ToDevice::Limit {
                lower: fixed(&[-1.0, -2.0]),
                upper: fixed(&[1.0, 2.0]),
                rate: fixed(&[0.1, 0.2]),
            }))
        );
        for (line, reason) in [
            (
                "r 0.1",
                "r (a reference for each output) takes 3 numbers, not 1",
            ),
            ("r 0.1 x 3", "`x` is not a number"),
            ("r 0.1 nan 3", "`nan` is not a number"),
            (
                "go",
                "there is no `go`; arm, disarm, stop (or an empty line), r, limit, quit",
            ),
        ] {
            assert_eq!(say(line), Err(reason.to_string()));
        }
    }
}

//! A run on a board, watched and steered from a terminal, saved, and served to viewers.
//!
//! A line typed is an order ([`order`]); what the board thinks of it is shown. Every tick goes to
//! the file and to the viewers, with the board's own time.

use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{Receiver, TryRecvError};
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use sinew_device::mode::State;
use sinew_device::protocol::{Health, Identity, Reason, Telemetry, ToDevice, ToHost};

use super::learned::Learned;
use super::orders::{order, ranges};
use super::saved::Saved;
use super::screen::Screen;
use super::serve::{Served, Server};
use super::topics::{Level, Topics, is_fault, mode_text};
use super::{Names, mcap, topics};
use crate::device::Device;
use sinew_ident::diagnose::Stop;
use sinew_ident::error::{Error, Result};

/// Refresh interval of the terminal.
const REFRESH: Duration = Duration::from_millis(100);
/// Period of the lines that tell the board that somebody is there.
const ALIVE: Duration = Duration::from_millis(500);
/// Longest silence of a board.
const SILENCE: Duration = Duration::from_secs(3);

/// Most events that a result lists.
const EVENTS: usize = 1000;

/// Something that happened while a run was watched.
#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// The board's clock, seconds; of the latest tick.
    pub board_s: f64,
    /// Weight.
    pub level: Level,
    /// One sentence.
    pub text: String,
}

/// A watched run.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Watched {
    /// Ticks that were told.
    pub ticks: u64,
    /// Ticks whose frame was lost.
    pub lost: u64,
    /// Control steps that ended after their period, and frames that the board dropped, both since
    /// it started.
    pub late: u32,
    /// Frames that the board dropped.
    pub dropped: u32,
    /// Mode and cause at the end, before it was disarmed.
    pub state: Option<State>,
    /// The first thousand events.
    pub events: Vec<Event>,
}

impl Watched {
    /// The run for programs, `sinew-monitor/1`.
    pub fn document(&self, file: Option<&Path>, served: Option<(SocketAddr, Served)>) -> Value {
        let events = self.events.iter().map(|event| {
            json!({
                "board_s": event.board_s,
                "level": match event.level {
                    Level::Info => "info",
                    Level::Warn => "warning",
                    Level::Error => "fault",
                },
                "sentence": event.text,
            })
        });
        json!({
            "format": "sinew-monitor/1",
            "ticks": self.ticks,
            "lost": self.lost,
            "late": self.late,
            "dropped": self.dropped,
            "state": self.state.map(|state| json!({
                "mode": topics::mode_word(state),
                "cause": format!("{:?}", state.cause),
            })),
            "events": events.collect::<Vec<Value>>(),
            "file": file.map(|path| path.display().to_string()),
            "served": served.map(|(address, served)| json!({
                "address": address.to_string(),
                "clients": served.clients,
                "missed": served.missed,
            })),
        })
    }
}

/// Places where a watched run goes.
#[derive(Default)]
pub struct Outputs<'a> {
    /// A file: MCAP by the end of its name, otherwise CSV.
    pub file: Option<PathBuf>,
    /// Clients.
    pub server: Option<&'a Server>,
    /// The terminal; nothing is shown without one.
    pub screen: Option<Screen>,
}

/// Watches until `quit`, the end of the orders (`typed`), `seconds` or a request to stop; the board
/// is disarmed at the end.
///
/// # Errors
/// The board is gone, or the file cannot be written.
pub fn monitor(
    device: &mut Device,
    names: &Names,
    identity: &Identity,
    outputs: Outputs<'_>,
    typed: &Receiver<String>,
    seconds: Option<f64>,
    stop: &Stop,
) -> Result<Watched> {
    let mut run = Run::begin(names, outputs)?;
    let stream = ToDevice::Stream { every: 1 };
    device.insist(&stream, |answer| matches!(answer, ToHost::State(_)))?;
    let watched = watch(device, names, identity, typed, seconds, stop, &mut run);
    // Whatever happened.
    let disarmed = device.insist(&ToDevice::Disarm, |a| matches!(a, ToHost::State(_)));
    let finished = run.finish();
    watched?;
    disarmed?;
    finished
}

/// Outputs of a run, and what is known of it.
struct Run<'a> {
    names: &'a Names,
    topics: Topics,
    csv: Option<Saved>,
    mcap: Option<mcap::File>,
    server: Option<&'a Server>,
    screen: Option<Screen>,
    watched: Watched,
    latest: Option<Telemetry>,
}

impl<'a> Run<'a> {
    fn begin(names: &'a Names, outputs: Outputs<'a>) -> Result<Self> {
        let topics = Topics::new(names);
        let (mut csv, mut file) = (None, None);
        match outputs.file {
            Some(path) if is_mcap(&path) => file = Some(mcap::File::create(&path, &topics.all)?),
            Some(path) => csv = Some(Saved::create(&path, names)?),
            None => {}
        }
        Ok(Self {
            names,
            topics,
            csv,
            mcap: file,
            server: outputs.server,
            screen: outputs.screen,
            watched: Watched::default(),
            latest: None,
        })
    }

    /// Takes a tick to every output.
    fn tick(&mut self, seen: Telemetry, learned: Option<&[f64]>) -> Result<()> {
        let gap = self
            .latest
            .as_ref()
            .map_or(1, |before| seen.tick.wrapping_sub(before.tick));
        // A board that restarted counts from the start again.
        let lost = u64::from(gap.saturating_sub(1)) * u64::from(gap < 1 << 31);
        self.watched.lost += lost;
        self.watched.ticks += 1;
        self.watched.late = seen.deadline_misses;
        self.watched.dropped = seen.dropped;
        let before = self.watched.state.replace(seen.state);
        if let Some(csv) = &mut self.csv {
            csv.row(&seen, learned)?;
        }
        if self.mcap.is_some() || self.server.is_some() {
            let messages = self.topics.tick(&seen, self.watched.lost, learned);
            self.send(messages)?;
        }
        let state = seen.state;
        self.latest = Some(seen);
        if lost > 0 {
            self.event(Level::Warn, format!("{lost} ticks were lost on the way"))?;
        }
        if before.is_some_and(|before| before != state) {
            let level = if is_fault(state.cause) {
                Level::Error
            } else {
                Level::Info
            };
            self.event(level, format!("{}: {:?}", mode_text(state), state.cause))?;
        }
        Ok(())
    }

    fn event(&mut self, level: Level, text: String) -> Result<()> {
        if self.mcap.is_some() || self.server.is_some() {
            let message = self.topics.event(level, &text);
            self.send(vec![message])?;
        }
        match &mut self.screen {
            Some(screen) => screen.say(&text),
            None => eprintln!("{text}"),
        }
        if self.watched.events.len() < EVENTS {
            let board_s = self
                .latest
                .as_ref()
                .map_or(0.0, |it| it.at_us as f64 * 1e-6);
            self.watched.events.push(Event {
                board_s,
                level,
                text,
            });
        }
        Ok(())
    }

    fn send(&mut self, messages: Vec<topics::Message>) -> Result<()> {
        if let Some(file) = &mut self.mcap {
            for message in &messages {
                file.message(message)?;
            }
        }
        if let Some(server) = self.server {
            server.publish(messages);
        }
        Ok(())
    }

    /// Draws what is known now on the terminal.
    fn show(&mut self, learned: Option<&[f64]>) {
        if let (Some(screen), Some(seen)) = (&mut self.screen, &self.latest) {
            let (names, lost) = (self.names, self.watched.lost);
            screen.draw(seen, names, self.topics.limits(), learned, lost);
        }
    }

    fn finish(self) -> Result<Watched> {
        if let Some(mut csv) = self.csv {
            csv.flush()?;
        }
        self.mcap.map_or(Ok(()), mcap::File::finish)?;
        Ok(self.watched)
    }
}

/// The name of a file is that of an MCAP.
pub fn is_mcap(path: &Path) -> bool {
    let end = path.extension();
    end.is_some_and(|end| end.eq_ignore_ascii_case("mcap"))
}

/// Carries out a typed order: `None` where it ends the run, otherwise the limits before it where
/// it changes them.
fn obey(
    device: &mut Device,
    run: &mut Run<'_>,
    line: &str,
    identity: &Identity,
) -> Result<Option<Option<Vec<[f64; 2]>>>> {
    let mut before = None;
    if let Some(screen) = &mut run.screen {
        screen.typed();
    }
    match order(line, identity) {
        Ok(None) => return Ok(None),
        Ok(Some(message)) => {
            if let Some(ranges) = ranges(&message) {
                before = Some(run.topics.limits().to_vec());
                run.topics.limit(&ranges);
            }
            device.send(&message)?;
        }
        Err(refused) => match &mut run.screen {
            Some(screen) => screen.say(&refused.to_string()),
            None => eprintln!("{refused}"),
        },
    }
    Ok(Some(before))
}

fn watch(
    device: &mut Device,
    names: &Names,
    identity: &Identity,
    typed: &Receiver<String>,
    seconds: Option<f64>,
    stop: &Stop,
    run: &mut Run<'_>,
) -> Result<()> {
    let began = Instant::now();
    let (mut heard, mut shown, mut said) = (began, began, began);
    let mut orders_end = false;
    // Until a board answers that it judges no channel.
    let mut judges = !names.channels.is_empty();
    let mut health = Health::default();
    let mut learned = Learned::new(names);
    // Limits before an order that is not answered yet.
    let mut limits_before: Option<Vec<[f64; 2]>> = None;
    loop {
        match typed.try_recv() {
            Ok(line) => {
                let Some(before) = obey(device, run, &line, identity)? else {
                    return Ok(());
                };
                limits_before = before.or(limits_before);
            }
            // A terminal that was closed, or a script that has ended: with a time to end, go on
            // until then.
            Err(TryRecvError::Disconnected) => orders_end = true,
            Err(TryRecvError::Empty) => {}
        }
        let over = seconds.is_some_and(|s| began.elapsed().as_secs_f64() > s);
        if over || stop.is_asked() || (orders_end && seconds.is_none()) {
            return Ok(());
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
                ToHost::Refused { reason } => {
                    if let Some(before) = limits_before.take() {
                        run.topics.limit(&before);
                    }
                    run.event(Level::Warn, format!("refused, nothing changed: {reason:?}"))?;
                }
                ToHost::Tuned => limits_before = None,
                ToHost::Health(now) => {
                    for line in changed(&health, &now, &names.channels) {
                        run.event(Level::Warn, line)?;
                    }
                    health = now;
                }
                ToHost::Parameters(known) => learned.told(&known, names),
                ToHost::Hello(_) => {
                    run.topics.limit(&names.input_range);
                    run.event(Level::Error, "the board has restarted".into())?;
                }
                _ => {}
            }
        }
        if let Some(seen) = device.telemetry(Instant::now() + Duration::from_millis(5))? {
            heard = Instant::now();
            run.tick(seen, learned.take().as_deref())?;
            if shown.elapsed() > REFRESH {
                shown = Instant::now();
                run.show(learned.latest());
            }
        }
        if heard.elapsed() > SILENCE {
            return Err(Error::failed("the board says nothing any more").help(
                "is it powered, and the cable in? It disarms itself when the line is silent",
            ));
        }
    }
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

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use sinew_device::mode::Mode;

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

    /// A tick of a board with so many inputs, and as many outputs.
    pub(crate) fn tick(signals: usize) -> Telemetry {
        let all = |v: f32| std::iter::repeat_n(v, signals).collect();
        Telemetry {
            tick: 0,
            at_us: 0,
            state: State {
                mode: Mode::Disarmed,
                cause: sinew_device::mode::Cause::Start,
            },
            row: None,
            y: all(0.5),
            s: heapless::Vec::new(),
            u: all(1.0),
            reference: all(f32::NAN),
            estimate: all(0.5),
            disturbance: all(0.0),
            status: sinew_mpc::status::Status::Disarmed,
            iterations: 0,
            ticks: 7,
            deadline_misses: 0,
            dropped: 0,
        }
    }
}

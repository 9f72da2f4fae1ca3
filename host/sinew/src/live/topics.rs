//! Topics of a watched board: what each holds, as a ROS 2 message in CDR, and the messages of a
//! tick. A client and a file of `mcap` get the same bytes.
//!
//! CDR and `ros2msg`, because viewers that take no JSON take these
//! (docs/decisions/0113-live-viewers.md). Numbers stand in the order of their size, so that CDR
//! needs no padding.

use std::time::{SystemTime, UNIX_EPOCH};

use sinew_device::mode::{Cause, Drive, Mode, State};
use sinew_device::protocol::Telemetry;
use sinew_mpc::status::Status;

use super::Names;

/// Encoding of every message.
pub const ENCODING: &str = "cdr";
/// Encoding of every schema.
pub const SCHEMA_ENCODING: &str = "ros2msg";
/// CDR of version 1, little endian.
const CDR: [u8; 4] = [0, 1, 0, 0];

/// Kind of a topic's messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// One output of the board.
    Output,
    /// One input of the board.
    Input,
    /// Mode, status and counters.
    State,
    /// One parameter that the controller estimates.
    Learned,
    /// Events: changes of mode, channels left out, lost ticks.
    Log,
}

impl Kind {
    /// Each of them.
    pub const ALL: [Self; 5] = [
        Self::Output,
        Self::Input,
        Self::State,
        Self::Learned,
        Self::Log,
    ];

    /// Name of the message type.
    pub const fn schema_name(self) -> &'static str {
        match self {
            Self::Output => "sinew_msgs/msg/Output",
            Self::Input => "sinew_msgs/msg/Input",
            Self::State => "sinew_msgs/msg/State",
            Self::Learned => "sinew_msgs/msg/Learned",
            Self::Log => "rcl_interfaces/msg/Log",
        }
    }

    /// Definition of the message type.
    pub fn schema(self) -> String {
        match self {
            Self::Output => "float64 reference\nfloat64 measured\nfloat64 estimate\n\
                 float64 disturbance\nfloat64 lower\nfloat64 upper\nuint32 tick\n"
                .into(),
            Self::Input => "float64 command\nfloat64 lower\nfloat64 upper\nuint32 tick\n".into(),
            Self::State => state_schema(),
            Self::Learned => "float64 estimate\nfloat64 deviation\nuint32 tick\n".into(),
            Self::Log => format!(
                "byte DEBUG=10\nbyte INFO=20\nbyte WARN=30\nbyte ERROR=40\nbyte FATAL=50\n\
                 builtin_interfaces/Time stamp\nuint8 level\nstring name\nstring msg\n\
                 string file\nstring function\nuint32 line\n{}\n\
                 MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n",
                "=".repeat(80)
            ),
        }
    }
}

/// Words of the numbers in a state's message.
fn state_schema() -> String {
    let mut text = String::from("float64 board_time\n");
    let mut group = |field: &str, words: Vec<String>| {
        for (number, word) in words.iter().enumerate() {
            text += &format!("uint8 {}_{}={number}\n", field.to_uppercase(), upper(word));
        }
        text += &format!("uint8 {field}\n");
    };
    // Counters first: they are wider.
    let counters = "uint32 tick\nuint32 lost\nuint32 step_ticks\nuint32 late\nuint32 dropped\n";
    group("mode", MODES.map(str::to_owned).to_vec());
    group("cause", CAUSES.map(|cause| format!("{cause:?}")).to_vec());
    let statuses = STATUSES.map(|status| format!("{status:?}"));
    group("status", statuses.to_vec());
    text += "uint8 iterations\n";
    text.replacen("board_time\n", &format!("board_time\n{counters}"), 1)
}

/// `SamplesLost` as `SAMPLES_LOST`.
fn upper(word: &str) -> String {
    let mut text = String::new();
    for (at, letter) in word.chars().enumerate() {
        if at > 0 && letter.is_uppercase() {
            text.push('_');
        }
        text.push(letter.to_ascii_uppercase());
    }
    text
}

/// Modes in the order of [`mode`].
const MODES: [&str; 5] = [
    "disarmed",
    "armed_host",
    "armed_rig",
    "armed_excitation",
    "tripped",
];

/// Causes in the order of their numbers.
const CAUSES: [Cause; 13] = [
    Cause::Start,
    Cause::Watchdog,
    Cause::Fault,
    Cause::BrownOut,
    Cause::Asked,
    Cause::EmergencyStop,
    Cause::SamplesLost,
    Cause::Diverged,
    Cause::Stuck,
    Cause::NoPlan,
    Cause::Late,
    Cause::LinkLost,
    Cause::Starved,
];

/// Statuses in the order of their numbers.
pub const STATUSES: [Status; 10] = [
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

const fn mode(state: State) -> u8 {
    match state.mode {
        Mode::Disarmed => 0,
        Mode::Armed(Drive::Host) => 1,
        Mode::Armed(Drive::Rig) => 2,
        Mode::Armed(Drive::Excitation) => 3,
        Mode::Tripped => 4,
    }
}

/// Word of a mode, as schemas have it.
pub const fn mode_word(state: State) -> &'static str {
    MODES[mode(state) as usize]
}

/// Mode for people.
pub fn mode_text(state: State) -> String {
    match state.mode {
        Mode::Disarmed => "disarmed".into(),
        Mode::Armed(drive) => format!("armed ({drive:?})"),
        Mode::Tripped => "EMERGENCY STOP (disarm acknowledges it)".into(),
    }
}

/// A cause that nobody asked for.
pub const fn is_fault(cause: Cause) -> bool {
    !matches!(cause, Cause::Start | Cause::Asked | Cause::EmergencyStop)
}

/// One topic.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Topic {
    /// Its name, `/outputs/q_m`.
    pub name: String,
    /// Kind of its messages.
    pub kind: Kind,
}

/// One message.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Message {
    /// Index of the topic.
    pub topic: usize,
    /// Time since 1970, nanoseconds: the computer's at the first tick, from there on the board's.
    pub at_ns: u64,
    /// CDR.
    pub data: Vec<u8>,
}

/// Weight of an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    /// As asked.
    Info = 20,
    /// Something was lost.
    Warn = 30,
    /// A fault.
    Error = 40,
}

/// Topics of a board and their messages.
pub struct Topics {
    /// The topics, each at its index.
    pub all: Vec<Topic>,
    /// Factors to SI of inputs and outputs.
    factors: [Vec<f64>; 2],
    /// Range of training of each output, SI.
    output_range: Vec<[f64; 2]>,
    /// Limits of each command that hold now, SI.
    input_range: Vec<[f64; 2]>,
    clock: Clock,
}

/// The board's clock on the computer's calendar.
struct Clock {
    now: fn() -> u64,
    /// Times of the board, us, and of the calendar, ns, that belong together.
    anchor: Option<(u64, u64)>,
    latest_ns: u64,
}

impl Clock {
    /// Never earlier than before, a restart of the board included.
    fn at(&mut self, at_us: u64) -> u64 {
        let (from_us, from_ns) = match self.anchor {
            Some(anchor) if anchor.0 <= at_us => anchor,
            _ => *self
                .anchor
                .insert((at_us, (self.now)().max(self.latest_ns + 1))),
        };
        self.latest_ns = from_ns.saturating_add((at_us - from_us).saturating_mul(1000));
        self.latest_ns
    }
}

/// Nanoseconds since 1970.
fn calendar() -> u64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH);
    since.map_or(0, |since| u64::try_from(since.as_nanos()).unwrap_or(0))
}

impl Topics {
    /// Topics of a model's signals.
    pub fn new(names: &Names) -> Self {
        let topic = |folder: &str, name: &str, kind| Topic {
            name: format!("/{folder}/{name}"),
            kind,
        };
        let outputs = names.outputs.iter();
        let outputs = outputs.map(|name| topic("outputs", name, Kind::Output));
        let inputs = names.inputs.iter();
        let inputs = inputs.map(|name| topic("inputs", name, Kind::Input));
        let learned = names.learned.parameters().iter();
        let learned = learned.map(|it| topic("learned", &it.name, Kind::Learned));
        let mut all: Vec<Topic> = outputs.chain(inputs).chain(learned).collect();
        for (name, kind) in [("/state", Kind::State), ("/log", Kind::Log)] {
            let name = name.to_owned();
            all.push(Topic { name, kind });
        }
        Self {
            all,
            factors: [&names.inputs, &names.outputs].map(|columns| names.units.factors(columns)),
            output_range: names.output_range.clone(),
            input_range: names.input_range.clone(),
            clock: Clock {
                now: calendar,
                anchor: None,
                latest_ns: 0,
            },
        }
    }

    /// Limits that hold from now on, SI.
    pub fn limit(&mut self, ranges: &[[f64; 2]]) {
        self.input_range = ranges.to_vec();
    }

    /// Limits that hold now, SI.
    pub fn limits(&self) -> &[[f64; 2]] {
        &self.input_range
    }

    /// Messages of a tick. `lost`: ticks that were lost so far; `learned`: what the board has told
    /// since the tick before.
    pub fn tick(&mut self, seen: &Telemetry, lost: u64, learned: Option<&[f64]>) -> Vec<Message> {
        let at_ns = self.clock.at(seen.at_us);
        let mut messages = Vec::with_capacity(self.all.len());
        let [inputs, outputs] = &self.factors;
        for (i, factor) in outputs.iter().enumerate() {
            let at = |values: &[f32]| values.get(i).map_or(f64::NAN, |v| f64::from(*v) / factor);
            let [lower, upper] = range(&self.output_range, i, *factor);
            let mut data = CDR.to_vec();
            put(
                &mut data,
                &[
                    at(&seen.reference),
                    at(&seen.y),
                    at(&seen.estimate),
                    at(&seen.disturbance),
                    lower,
                    upper,
                ],
            );
            data.extend(seen.tick.to_le_bytes());
            let topic = messages.len();
            messages.push(Message { topic, at_ns, data });
        }
        for (i, factor) in inputs.iter().enumerate() {
            let command = seen.u.get(i).map_or(f64::NAN, |u| f64::from(*u) / factor);
            let [lower, upper] = range(&self.input_range, i, *factor);
            let mut data = CDR.to_vec();
            put(&mut data, &[command, lower, upper]);
            data.extend(seen.tick.to_le_bytes());
            let topic = messages.len();
            messages.push(Message { topic, at_ns, data });
        }
        let first_learned = messages.len();
        for (i, pair) in learned.unwrap_or_default().chunks_exact(2).enumerate() {
            let mut data = CDR.to_vec();
            put(&mut data, pair);
            data.extend(seen.tick.to_le_bytes());
            let topic = first_learned + i;
            messages.push(Message { topic, at_ns, data });
        }
        let mut data = CDR.to_vec();
        put(&mut data, &[seen.at_us as f64 * 1e-6]);
        let lost = u32::try_from(lost).unwrap_or(u32::MAX);
        for counter in [
            seen.tick,
            lost,
            seen.ticks,
            seen.deadline_misses,
            seen.dropped,
        ] {
            data.extend(counter.to_le_bytes());
        }
        data.extend([
            mode(seen.state),
            seen.state.cause as u8,
            seen.status as u8,
            seen.iterations,
        ]);
        let topic = self.all.len() - 2;
        messages.push(Message { topic, at_ns, data });
        messages
    }

    /// Message of an event, at the time of the latest tick.
    pub fn event(&mut self, level: Level, text: &str) -> Message {
        if self.clock.anchor.is_none() {
            self.clock.latest_ns = (self.clock.now)();
        }
        let at_ns = self.clock.latest_ns;
        let mut data = CDR.to_vec();
        let seconds = i32::try_from(at_ns / 1_000_000_000).unwrap_or(i32::MAX);
        data.extend(seconds.to_le_bytes());
        data.extend(((at_ns % 1_000_000_000) as u32).to_le_bytes());
        data.push(level as u8);
        for text in ["sinew", text, "", ""] {
            align(&mut data);
            data.extend((text.len() as u32 + 1).to_le_bytes());
            data.extend(text.as_bytes());
            data.push(0);
        }
        align(&mut data);
        data.extend(0_u32.to_le_bytes());
        Message {
            topic: self.all.len() - 1,
            at_ns,
            data,
        }
    }
}

fn put(data: &mut Vec<u8>, values: &[f64]) {
    values.iter().for_each(|v| data.extend(v.to_le_bytes()));
}

/// To the next multiple of four behind the header.
fn align(data: &mut Vec<u8>) {
    while !(data.len() - CDR.len()).is_multiple_of(4) {
        data.push(0);
    }
}

fn range(ranges: &[[f64; 2]], i: usize, factor: f64) -> [f64; 2] {
    let range = ranges.get(i).copied().unwrap_or([f64::NAN; 2]);
    range.map(|end| end / factor)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The words of a schema are those of the numbers that the firmware sends.
    #[test]
    fn numbers_of_causes_and_statuses_are_those_of_their_words() {
        for (number, cause) in CAUSES.iter().enumerate() {
            assert_eq!(*cause as usize, number, "{cause:?}");
        }
        for (number, status) in STATUSES.iter().enumerate() {
            assert_eq!(*status as usize, number, "{status:?}");
        }
        let schema = Kind::State.schema();
        assert!(schema.contains("uint8 CAUSE_SAMPLES_LOST=6\n"), "{schema}");
        assert!(schema.contains("uint8 MODE_TRIPPED=4\nuint8 mode\n"));
        assert!(schema.starts_with("float64 board_time\nuint32 tick\n"));
    }

    #[test]
    fn times_never_go_back_when_a_board_restarts() {
        let mut clock = Clock {
            now: || 5_000,
            anchor: None,
            latest_ns: 0,
        };
        assert_eq!(clock.at(70), 5_000);
        assert_eq!(clock.at(71), 6_000);
        assert_eq!(clock.at(80), 15_000);
        assert_eq!(clock.at(1), 15_001);
        assert_eq!(clock.at(3), 17_001);
    }

    #[test]
    fn an_event_is_a_log_message_of_ros() {
        let names = Names::for_test(vec!["u_V".into()], vec!["q_m".into()]);
        let mut topics = Topics::new(&names);
        topics.clock.now = || 3_000_000_007;
        let event = topics.event(Level::Error, "stop");
        assert_eq!(topics.all[event.topic].name, "/log");
        let strings = b"\x06\0\0\0sinew\0\0\0\x05\0\0\0stop\0\0\0\0\x01\0\0\0\0\0\0\0\x01\0\0\0\0";
        let mut wanted = vec![0, 1, 0, 0, 3, 0, 0, 0, 7, 0, 0, 0, 40, 0, 0, 0];
        wanted.extend(strings);
        wanted.extend([0; 3 + 4]);
        assert_eq!(event.data, wanted);
    }
}

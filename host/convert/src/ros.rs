//! Messages of ROS 2 in CDR (OMG DDSI-RTPS 10.5): joint states, plain numbers, and messages whose
//! fields are numbers, by their definition.

use std::collections::BTreeMap;

use crate::contents::{Array, Contents};
use crate::cursor::Cursor;
use crate::error::{Error, Result};

/// Type of a message that is read.
#[derive(Clone, Debug, PartialEq, Eq)]
enum Kind {
    JointState,
    Float64,
    Float64Array,
    /// Fields that are numbers.
    Numbers(Vec<(String, Number)>),
    Unread,
}

/// Type of a field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Number {
    /// Integer of so many bytes.
    Unsigned(usize),
    Signed(usize),
    Float32,
    Float64,
}

impl Number {
    fn of(word: &str) -> Option<Self> {
        Some(match word {
            "bool" | "byte" | "uint8" | "char" => Self::Unsigned(1),
            "uint16" => Self::Unsigned(2),
            "uint32" => Self::Unsigned(4),
            "uint64" => Self::Unsigned(8),
            "int8" => Self::Signed(1),
            "int16" => Self::Signed(2),
            "int32" => Self::Signed(4),
            "int64" => Self::Signed(8),
            "float32" => Self::Float32,
            "float64" => Self::Float64,
            _ => return None,
        })
    }

    fn read(self, cdr: &mut Cdr<'_>) -> Result<f64> {
        let size = match self {
            Self::Unsigned(size) | Self::Signed(size) => size,
            Self::Float32 => 4,
            Self::Float64 => 8,
        };
        cdr.cursor.align(size.min(cdr.widest));
        Ok(match self {
            Self::Float64 => cdr.cursor.f64()?,
            Self::Float32 => f64::from(f32::from_bits(cdr.cursor.u32()?)),
            Self::Unsigned(1) => f64::from(cdr.cursor.take(1)?[0]),
            Self::Signed(1) => f64::from(cdr.cursor.take(1)?[0] as i8),
            Self::Unsigned(2) => f64::from(cdr.cursor.u16()?),
            Self::Signed(2) => f64::from(cdr.cursor.u16()? as i16),
            Self::Unsigned(4) => f64::from(cdr.cursor.u32()?),
            Self::Signed(4) => f64::from(cdr.cursor.i32()?),
            Self::Unsigned(_) => cdr.cursor.u64()? as f64,
            Self::Signed(_) => cdr.cursor.u64()? as i64 as f64,
        })
    }
}

/// Most fields of a message of numbers.
const MOST_FIELDS: usize = 1000;

/// Fields of a message definition that are all numbers; `None` for any other message.
fn numbers(definition: &str) -> Option<Vec<(String, Number)>> {
    let mut fields = Vec::new();
    for line in definition.lines() {
        let line = line.split('#').next().unwrap_or_default().trim();
        // A constant takes no room in a message.
        if line.is_empty() || line.contains('=') && !line.starts_with('=') {
            continue;
        }
        let mut words = line.split_whitespace();
        let number = words.next().and_then(Number::of)?;
        fields.push((words.next()?.to_owned(), number));
    }
    (1..=MOST_FIELDS).contains(&fields.len()).then_some(fields)
}

/// The three arrays of a joint state, and the units of a hinge.
const FIELDS: [(&str, &str); 3] = [
    ("position", "rad"),
    ("velocity", "rad/s"),
    ("effort", "N m"),
];

/// One topic and what was said on it.
pub struct Topic {
    pub name: String,
    schema: String,
    encoding: String,
    kind: Kind,
    messages: usize,
    /// Stamp and time of arrival of each message, ns.
    times: Vec<[i128; 2]>,
    /// Values by field and joint, each with its row.
    signals: BTreeMap<(usize, String), Vec<(usize, f64)>>,
    /// Keys of `signals` as they came.
    order: Vec<(usize, String)>,
}

impl Topic {
    pub fn new(name: String, schema: String, encoding: String, definition: &str) -> Self {
        let kind = match (schema.as_str(), encoding.as_str()) {
            ("sensor_msgs/msg/JointState", "cdr") => Kind::JointState,
            ("std_msgs/msg/Float64", "cdr") => Kind::Float64,
            ("std_msgs/msg/Float64MultiArray", "cdr") => Kind::Float64Array,
            (_, "cdr") => numbers(definition).map_or(Kind::Unread, Kind::Numbers),
            _ => Kind::Unread,
        };
        Self {
            name,
            schema,
            encoding,
            kind,
            messages: 0,
            times: Vec::new(),
            signals: BTreeMap::new(),
            order: Vec::new(),
        }
    }

    /// True for the same topic on another channel.
    pub fn is_same(&self, other: &Self) -> bool {
        (&self.name, &self.schema, &self.kind) == (&other.name, &other.schema, &other.kind)
    }

    pub fn is_read(&self) -> bool {
        self.kind != Kind::Unread && self.messages > 0
    }

    /// Words for a topic that is not read.
    pub fn unread(&self) -> String {
        format!(
            "{} messages of {} ({})",
            self.messages, self.schema, self.encoding
        )
    }

    /// Reads one message; the number of values that it brought.
    ///
    /// # Errors
    /// A message that is broken or cut off.
    pub fn message(&mut self, log_time: u64, data: &[u8]) -> Result<usize> {
        let row = self.messages;
        self.messages += 1;
        let read = match &self.kind {
            Kind::Unread => return Ok(0),
            Kind::Numbers(fields) => {
                let fields = fields.clone();
                self.fields(row, log_time, data, &fields)
            }
            Kind::JointState => self.joint_state(row, log_time, data),
            Kind::Float64 => self.number(row, log_time, data),
            Kind::Float64Array => self.numbers(row, log_time, data),
        };
        read.map_err(|error| {
            let (name, message) = (&self.name, error.message);
            Error::new(format!("message {} of {name}: {message}", row + 1))
        })
    }

    fn joint_state(&mut self, row: usize, log_time: u64, data: &[u8]) -> Result<usize> {
        let mut cdr = Cdr::new(data)?;
        let seconds = cdr.cursor.i32()?;
        let nanoseconds = cdr.u32()?;
        let _frame = cdr.text()?;
        let count = cdr.length(4)?;
        let names = (0..count).map(|_| cdr.text()).collect::<Result<Vec<_>>>()?;
        let stamp = i128::from(seconds) * 1_000_000_000 + i128::from(nanoseconds);
        self.times.push([stamp, i128::from(log_time)]);
        let mut read = 0;
        for (field, (what, _)) in FIELDS.iter().enumerate() {
            let values = cdr.doubles()?;
            if !values.is_empty() && values.len() != names.len() {
                let (found, wanted) = (values.len(), names.len());
                return Err(Error::new(format!(
                    "{found} values of {what} for {wanted} names"
                )));
            }
            read += values.len();
            for (name, value) in names.iter().zip(values) {
                self.put_value((field, name.clone()), row, value);
            }
        }
        Ok(read)
    }

    fn number(&mut self, row: usize, log_time: u64, data: &[u8]) -> Result<usize> {
        let mut cdr = Cdr::new(data)?;
        self.times.push([0, i128::from(log_time)]);
        let value = cdr.cursor.f64()?;
        self.put_value((0, String::new()), row, value);
        Ok(1)
    }

    fn numbers(&mut self, row: usize, log_time: u64, data: &[u8]) -> Result<usize> {
        let mut cdr = Cdr::new(data)?;
        let dimensions = cdr.length(12)?;
        for _ in 0..dimensions {
            let _label = cdr.text()?;
            let _size_and_stride = (cdr.u32()?, cdr.u32()?);
        }
        let _offset = cdr.u32()?;
        let values = cdr.doubles()?;
        self.times.push([0, i128::from(log_time)]);
        let read = values.len();
        for (index, value) in values.into_iter().enumerate() {
            self.put_value((0, (index + 1).to_string()), row, value);
        }
        Ok(read)
    }

    fn fields(
        &mut self,
        row: usize,
        log_time: u64,
        data: &[u8],
        fields: &[(String, Number)],
    ) -> Result<usize> {
        let mut cdr = Cdr::new(data)?;
        self.times.push([0, i128::from(log_time)]);
        for (name, number) in fields {
            let value = number.read(&mut cdr)?;
            self.put_value((0, name.clone()), row, value);
        }
        Ok(fields.len())
    }

    fn put_value(&mut self, key: (usize, String), row: usize, value: f64) {
        if !self.signals.contains_key(&key) {
            self.order.push(key.clone());
        }
        self.signals.entry(key).or_default().push((row, value));
    }

    /// Stamps where the topic has any, or else times of arrival; ns.
    fn clock(&self) -> usize {
        usize::from(self.times.iter().all(|[stamp, _]| *stamp == 0))
    }

    /// First time of the topic, ns.
    pub fn first(&self) -> Option<i128> {
        let clock = self.clock();
        self.times.iter().map(|times| times[clock]).min()
    }

    /// Adds the topic's signals in the order of their times, as seconds from `first`.
    ///
    /// # Errors
    /// More numbers than are taken from one file.
    pub fn put(self, first: i128, contents: &mut Contents) -> Result<()> {
        let clock = self.clock();
        if clock == 1 {
            let name = &self.name;
            let note = format!("{name} has no stamps: times are those of its recording");
            contents.notes.push(note);
        }
        let rows = self.times.len();
        let mut order: Vec<usize> = (0..rows).collect();
        order.sort_by_key(|row| self.times[*row][clock]);
        let moved = order
            .iter()
            .enumerate()
            .filter(|(place, row)| place != *row);
        let moved = moved.count();
        if moved > 0 {
            let name = &self.name;
            let note = format!("{name}: {moved} messages came out of order and were sorted");
            contents.notes.push(note);
        }
        let mut place = vec![0; rows];
        for (at, row) in order.iter().enumerate() {
            place[*row] = at;
        }
        let seconds = |row: &usize| (self.times[*row][clock] - first) as f64 / 1e9;
        contents.push(
            &format!("{}/t", self.name),
            &[rows],
            order.iter().map(seconds).collect(),
        )?;
        for key in self.order {
            contents.count(rows)?;
            let mut values = vec![f64::NAN; rows];
            for (row, value) in self.signals.get(&key).into_iter().flatten() {
                values[place[*row]] = *value;
            }
            let (field, joint) = key;
            let (what, unit) = FIELDS[field];
            let (path, unit) = match &self.kind {
                Kind::Numbers(_) => (format!("{}/{joint}", self.name), ""),
                Kind::JointState => (format!("{}/{what}/{joint}", self.name), unit),
                Kind::Float64Array => (format!("{}/data/{joint}", self.name), ""),
                _ => (format!("{}/data", self.name), ""),
            };
            contents.arrays.push(Array {
                name: Some(match &self.kind {
                    Kind::JointState => joint.clone(),
                    Kind::Numbers(_) => column(&self.schema, last_of(&self.name), &joint),
                    Kind::Float64Array => format!("{}{joint}", last_of(&self.name)),
                    _ => last_of(&self.name).to_owned(),
                }),
                path,
                rows,
                columns: 1,
                values,
                unit: unit.to_owned(),
            });
        }
        Ok(())
    }
}

/// Column of a field. The signal itself keeps its name in a run that `sinew monitor` saved.
fn column(schema: &str, topic: &str, field: &str) -> String {
    match (schema, field) {
        ("sinew_msgs/msg/Output", "measured") | ("sinew_msgs/msg/Input", "command") => topic.into(),
        _ => format!("{field}_{topic}"),
    }
}

/// Last name of a topic; of `/joint/command` it is `command`.
fn last_of(topic: &str) -> &str {
    topic.rsplit('/').next().unwrap_or(topic)
}

/// Common Data Representation behind its header of four bytes.
struct Cdr<'a> {
    cursor: Cursor<'a>,
    /// Largest alignment: version 1 has 8, version 2 has 4.
    widest: usize,
}

impl<'a> Cdr<'a> {
    fn new(data: &'a [u8]) -> Result<Self> {
        let mut header = Cursor::new(data, false);
        let kind = header.take(4)?;
        let (big_endian, widest) = match kind[1] {
            0 => (true, 8),
            1 => (false, 8),
            6 => (true, 4),
            7 => (false, 4),
            other => return Err(Error::new(format!("CDR of representation {other}"))),
        };
        Ok(Self {
            cursor: Cursor::new(&data[4..], big_endian),
            widest,
        })
    }

    fn u32(&mut self) -> Result<u32> {
        self.cursor.align(4);
        self.cursor.u32()
    }

    /// Count of elements that take `least` bytes each, which must be there.
    fn length(&mut self, least: usize) -> Result<usize> {
        let count = self.u32()? as usize;
        if count.saturating_mul(least) > self.cursor.left() {
            return Err(Error::new(format!(
                "{count} elements are announced in {} bytes",
                self.cursor.left()
            )));
        }
        Ok(count)
    }

    fn text(&mut self) -> Result<String> {
        let length = self.length(1)?;
        let bytes = self.cursor.take(length)?;
        let bytes = bytes.strip_suffix(&[0]).unwrap_or(bytes);
        Ok(String::from_utf8_lossy(bytes).into_owned())
    }

    fn doubles(&mut self) -> Result<Vec<f64>> {
        let count = self.length(8)?;
        if count == 0 {
            return Ok(Vec::new());
        }
        self.cursor.align(self.widest);
        (0..count).map(|_| self.cursor.f64()).collect()
    }
}

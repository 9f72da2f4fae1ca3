//! MCAP: records of a kind and a length, some of them compressed chunks of others
//! (mcap.dev/spec). Topics of `sensor_msgs/JointState` and of plain numbers become signals.

use std::collections::BTreeMap;
use std::io::Read;

use crate::contents::Contents;
use crate::cursor::Cursor;
use crate::error::{Error, Result};
use crate::ros::Topic;

/// First and last bytes of a file.
pub const MAGIC: [u8; 8] = *b"\x89MCAP0\r\n";

/// Bytes that the chunks of one file may unfold to.
const MOST_UNFOLDED: u64 = 2 << 30;
/// Topics of one file.
const MOST_TOPICS: usize = 10_000;

const SCHEMA: u8 = 3;
const CHANNEL: u8 = 4;
const MESSAGE: u8 = 5;
const CHUNK: u8 = 6;
const DATA_END: u8 = 15;

/// # Errors
/// A file that is broken, cut off or too large.
pub fn read(bytes: &[u8]) -> Result<Contents> {
    if !bytes.starts_with(&MAGIC) {
        return Err(Error::new("it is no MCAP file"));
    }
    let mut reader = Reader::default();
    if !reader.records(&bytes[MAGIC.len()..], false)? {
        return Err(
            Error::new("the MCAP file is cut off: it has no end of its data")
                .help("`mcap recover` writes what is there as a whole file"),
        );
    }
    reader.finish()
}

#[derive(Default)]
struct Reader {
    /// Names and definitions; a definition in another language than ROS 2's is empty.
    schemas: BTreeMap<u16, (String, String)>,
    topics: Vec<Topic>,
    /// Topic of each channel: several publishers of a topic have a channel each.
    channels: BTreeMap<u16, usize>,
    unfolded: u64,
    values: Contents,
}

impl Reader {
    /// Reads records up to the end of the data; true where that was met.
    fn records(&mut self, bytes: &[u8], in_chunk: bool) -> Result<bool> {
        let mut cursor = Cursor::new(bytes, false);
        while cursor.left() > 0 {
            let kind = cursor.take(1)?[0];
            let length = cursor.u64()?;
            let record = cursor.take_long(length)?;
            match kind {
                SCHEMA => self.schema(record)?,
                CHANNEL => self.channel(record)?,
                MESSAGE => self.message(record)?,
                CHUNK if in_chunk => return Err(Error::new("a chunk within a chunk")),
                CHUNK => self.chunk(record)?,
                DATA_END => return Ok(true),
                _ => {}
            }
        }
        Ok(false)
    }

    fn schema(&mut self, record: &[u8]) -> Result<()> {
        let mut cursor = Cursor::new(record, false);
        let id = cursor.u16()?;
        let name = text(&mut cursor)?;
        let encoding = text(&mut cursor)?;
        let definition = match encoding.as_str() {
            "ros2msg" => text(&mut cursor)?,
            _ => String::new(),
        };
        if self.schemas.len() > MOST_TOPICS {
            return Err(Error::new("more schemas than any recording has"));
        }
        self.schemas.insert(id, (name, definition));
        Ok(())
    }

    fn channel(&mut self, record: &[u8]) -> Result<()> {
        let mut cursor = Cursor::new(record, false);
        let id = cursor.u16()?;
        let schema = cursor.u16()?;
        let name = text(&mut cursor)?;
        let encoding = text(&mut cursor)?;
        if self.channels.contains_key(&id) {
            return Ok(());
        }
        if self.topics.len() > MOST_TOPICS {
            return Err(Error::new("more topics than any recording has"));
        }
        let (schema, definition) = self.schemas.get(&schema).cloned().unwrap_or_default();
        let topic = Topic::new(name, schema, encoding, &definition);
        let known = self.topics.iter().position(|other| other.is_same(&topic));
        let index = known.unwrap_or_else(|| {
            self.topics.push(topic);
            self.topics.len() - 1
        });
        self.channels.insert(id, index);
        Ok(())
    }

    fn message(&mut self, record: &[u8]) -> Result<()> {
        let mut cursor = Cursor::new(record, false);
        let channel = cursor.u16()?;
        let _sequence = cursor.u32()?;
        let log_time = cursor.u64()?;
        let _publish_time = cursor.u64()?;
        let data = cursor.take(cursor.left())?;
        let topic = self.channels.get(&channel);
        let Some(topic) = topic.and_then(|index| self.topics.get_mut(*index)) else {
            return Err(Error::new(format!(
                "a message of channel {channel}, which the MCAP file does not describe"
            )));
        };
        self.values.count(topic.message(log_time, data)?)
    }

    fn chunk(&mut self, record: &[u8]) -> Result<()> {
        let mut cursor = Cursor::new(record, false);
        let _times = (cursor.u64()?, cursor.u64()?);
        let size = cursor.u64()?;
        let checksum = cursor.u32()?;
        let compression = text(&mut cursor)?;
        let length = cursor.u64()?;
        let packed = cursor.take_long(length)?;
        self.unfolded = self.unfolded.saturating_add(size);
        if self.unfolded > MOST_UNFOLDED {
            return Err(Error::new(format!(
                "chunks of more than {MOST_UNFOLDED} bytes, the most that is read from one file"
            )));
        }
        let unfolded = match compression.as_str() {
            "" => packed.to_vec(),
            "lz4" => unfold(lz4_flex::frame::FrameDecoder::new(packed), size)?,
            "zstd" => {
                let decoder = ruzstd::decoding::StreamingDecoder::new(packed)
                    .map_err(|error| Error::new(format!("a broken zstd chunk: {error}")))?;
                unfold(decoder, size)?
            }
            other => {
                return Err(Error::new(format!("chunks are compressed by `{other}`"))
                    .help("`mcap compress --compression zstd` rewrites the file"));
            }
        };
        if unfolded.len() as u64 != size {
            let found = unfolded.len();
            return Err(Error::new(format!(
                "a chunk is broken: {found} bytes for {size}"
            )));
        }
        if checksum != 0 && crc32fast::hash(&unfolded) != checksum {
            return Err(Error::new("a chunk is broken: its checksum differs"));
        }
        self.records(&unfolded, true)?;
        Ok(())
    }

    fn finish(self) -> Result<Contents> {
        let mut contents = self.values;
        let topics = self.topics.into_iter();
        let (read, others): (Vec<Topic>, Vec<Topic>) = topics.partition(Topic::is_read);
        let first = read.iter().filter_map(Topic::first).min();
        let first = first.unwrap_or_default();
        if !read.is_empty() {
            let (seconds, rest) = (first / 1_000_000_000, first % 1_000_000_000);
            contents.notes.push(format!(
                "t = 0 is {seconds}.{rest:09} s of the recording's clock"
            ));
        }
        for topic in others {
            contents.other(&topic.name.clone(), topic.unread());
        }
        for topic in read {
            topic.put(first, &mut contents)?;
        }
        Ok(contents)
    }
}

/// No more bytes than a chunk announces, and one that tells of more.
fn unfold(decoder: impl Read, size: u64) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    decoder
        .take(size.saturating_add(1))
        .read_to_end(&mut bytes)
        .map_err(|error| Error::new(format!("a broken chunk: {error}")))?;
    Ok(bytes)
}

fn text(cursor: &mut Cursor) -> Result<String> {
    let length = cursor.u32()?;
    let bytes = cursor.take(length as usize)?;
    Ok(String::from_utf8_lossy(bytes).into_owned())
}

//! A watched run as an MCAP file (mcap.dev/spec): chunks with their indices, so that a viewer can
//! seek in it, and a summary at the end. What stands before the end is whole at any moment, up to
//! the last half second: `mcap recover` finishes the file of a run that was killed.

use std::collections::BTreeMap;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use super::topics::{ENCODING, Kind, Message, SCHEMA_ENCODING, Topic};
use sinew_ident::error::{Error, Result};

const MAGIC: [u8; 8] = *b"\x89MCAP0\r\n";
/// Longest time in one chunk, and most bytes.
const CHUNK_NS: u64 = 500_000_000;
const CHUNK_BYTES: usize = 1 << 20;

const HEADER: u8 = 1;
const FOOTER: u8 = 2;
const SCHEMA: u8 = 3;
const CHANNEL: u8 = 4;
const MESSAGE: u8 = 5;
const CHUNK: u8 = 6;
const MESSAGE_INDEX: u8 = 7;
const CHUNK_INDEX: u8 = 8;
const STATISTICS: u8 = 11;
const DATA_END: u8 = 15;

/// A file that is being written.
pub struct File {
    path: PathBuf,
    file: BufWriter<Box<dyn Write + Send>>,
    at: u64,
    /// Schemas and channels as records, for the summary.
    described: Vec<u8>,
    chunk: Chunk,
    indices: Vec<u8>,
    chunks: u32,
    /// Messages of each channel.
    counts: BTreeMap<u16, u64>,
    channels: usize,
    /// First and last time.
    span: Option<(u64, u64)>,
    sequence: u32,
}

#[derive(Default)]
struct Chunk {
    records: Vec<u8>,
    /// Times and offsets of the messages of each channel.
    places: BTreeMap<u16, Vec<(u64, u64)>>,
    span: Option<(u64, u64)>,
}

impl File {
    /// Begins a file with these topics.
    ///
    /// # Errors
    /// `Write`.
    pub fn create(path: &Path, topics: &[Topic]) -> Result<Self> {
        let mut described = Vec::new();
        for (id, kind) in (1_u16..).zip(Kind::ALL) {
            let mut body = id.to_le_bytes().to_vec();
            text(&mut body, kind.schema_name());
            text(&mut body, SCHEMA_ENCODING);
            text(&mut body, &kind.schema());
            record(&mut described, SCHEMA, &body);
        }
        for (id, topic) in (0_u16..).zip(topics) {
            let schema = Kind::ALL.iter().position(|kind| *kind == topic.kind);
            let schema = schema.map_or(0, |place| place as u16 + 1);
            let mut body = id.to_le_bytes().to_vec();
            body.extend(schema.to_le_bytes());
            text(&mut body, &topic.name);
            text(&mut body, ENCODING);
            body.extend(0_u32.to_le_bytes());
            record(&mut described, CHANNEL, &body);
        }
        let mut file = Self {
            path: path.to_path_buf(),
            file: BufWriter::new(sinew_files::open(path)?),
            at: 0,
            described,
            chunk: Chunk::default(),
            indices: Vec::new(),
            chunks: 0,
            counts: BTreeMap::new(),
            channels: topics.len(),
            span: None,
            sequence: 0,
        };
        let mut start = MAGIC.to_vec();
        let mut header = Vec::new();
        text(&mut header, "");
        text(&mut header, concat!("sinew ", env!("CARGO_PKG_VERSION")));
        record(&mut start, HEADER, &header);
        start.extend(&file.described);
        file.put(&start)?;
        Ok(file)
    }

    /// Adds a message.
    ///
    /// # Errors
    /// `Write`.
    pub fn message(&mut self, message: &Message) -> Result<()> {
        let Ok(channel) = u16::try_from(message.topic) else {
            return Ok(());
        };
        let at = message.at_ns;
        let begun = self.chunk.span.is_some_and(|(first, _)| {
            at.saturating_sub(first) > CHUNK_NS || self.chunk.records.len() > CHUNK_BYTES
        });
        if begun {
            self.end_chunk()?;
        }
        let offset = self.chunk.records.len() as u64;
        let mut body = channel.to_le_bytes().to_vec();
        body.extend(self.sequence.to_le_bytes());
        body.extend(at.to_le_bytes());
        body.extend(at.to_le_bytes());
        body.extend(&message.data);
        record(&mut self.chunk.records, MESSAGE, &body);
        self.sequence = self.sequence.wrapping_add(1);
        (self.chunk.places.entry(channel).or_default()).push((at, offset));
        *self.counts.entry(channel).or_default() += 1;
        for span in [&mut self.chunk.span, &mut self.span] {
            let (first, last) = span.unwrap_or((at, at));
            *span = Some((first.min(at), last.max(at)));
        }
        Ok(())
    }

    /// Writes the summary and the end.
    ///
    /// # Errors
    /// `Write`.
    pub fn finish(mut self) -> Result<()> {
        self.end_chunk()?;
        let mut data_end = Vec::new();
        record(&mut data_end, DATA_END, &0_u32.to_le_bytes());
        self.put(&data_end)?;
        let summary_at = self.at;
        let mut summary = std::mem::take(&mut self.described);
        summary.extend(&self.indices);
        record(&mut summary, STATISTICS, &self.statistics());
        let mut footer = Vec::new();
        footer.extend(summary_at.to_le_bytes());
        // No summary of offsets.
        footer.extend(0_u64.to_le_bytes());
        // No checksum of the summary; each chunk has its own.
        footer.extend(0_u32.to_le_bytes());
        record(&mut summary, FOOTER, &footer);
        summary.extend(MAGIC);
        self.put(&summary)?;
        let flushed = self.file.flush();
        flushed.map_err(|e| Error::write(&self.path, e))
    }

    fn statistics(&self) -> Vec<u8> {
        let (first, last) = self.span.unwrap_or_default();
        let mut body = self.counts.values().sum::<u64>().to_le_bytes().to_vec();
        body.extend((Kind::ALL.len() as u16).to_le_bytes());
        // Channels, attachments, metadata, chunks.
        for count in [self.channels as u32, 0, 0, self.chunks] {
            body.extend(count.to_le_bytes());
        }
        body.extend(first.to_le_bytes());
        body.extend(last.to_le_bytes());
        body.extend((10 * self.counts.len() as u32).to_le_bytes());
        for (channel, count) in &self.counts {
            body.extend(channel.to_le_bytes());
            body.extend(count.to_le_bytes());
        }
        body
    }

    fn end_chunk(&mut self) -> Result<()> {
        let chunk = std::mem::take(&mut self.chunk);
        let Some((first, last)) = chunk.span else {
            return Ok(());
        };
        let size = chunk.records.len() as u64;
        let mut body = first.to_le_bytes().to_vec();
        body.extend(last.to_le_bytes());
        body.extend(size.to_le_bytes());
        body.extend(crc32fast::hash(&chunk.records).to_le_bytes());
        text(&mut body, "");
        body.extend(size.to_le_bytes());
        body.extend(&chunk.records);
        let mut bytes = Vec::new();
        record(&mut bytes, CHUNK, &body);
        let (start, length) = (self.at, bytes.len() as u64);
        let mut offsets = Vec::new();
        for (channel, places) in &chunk.places {
            offsets.extend(channel.to_le_bytes());
            offsets.extend((start + bytes.len() as u64).to_le_bytes());
            let mut index = channel.to_le_bytes().to_vec();
            index.extend((16 * places.len() as u32).to_le_bytes());
            for (at, offset) in places {
                index.extend(at.to_le_bytes());
                index.extend(offset.to_le_bytes());
            }
            record(&mut bytes, MESSAGE_INDEX, &index);
        }
        let mut index = first.to_le_bytes().to_vec();
        index.extend(last.to_le_bytes());
        index.extend(start.to_le_bytes());
        index.extend(length.to_le_bytes());
        index.extend((offsets.len() as u32).to_le_bytes());
        index.extend(&offsets);
        index.extend((bytes.len() as u64 - length).to_le_bytes());
        text(&mut index, "");
        index.extend(size.to_le_bytes());
        index.extend(size.to_le_bytes());
        record(&mut self.indices, CHUNK_INDEX, &index);
        self.chunks += 1;
        self.put(&bytes)?;
        // Whole up to here, should the program be killed.
        let flushed = self.file.flush();
        flushed.map_err(|e| Error::write(&self.path, e))
    }

    fn put(&mut self, bytes: &[u8]) -> Result<()> {
        let written = self.file.write_all(bytes);
        written.map_err(|e| Error::write(&self.path, e))?;
        self.at += bytes.len() as u64;
        Ok(())
    }
}

fn record(to: &mut Vec<u8>, kind: u8, body: &[u8]) {
    to.push(kind);
    to.extend((body.len() as u64).to_le_bytes());
    to.extend(body);
}

fn text(to: &mut Vec<u8>, text: &str) {
    to.extend((text.len() as u32).to_le_bytes());
    to.extend(text.as_bytes());
}

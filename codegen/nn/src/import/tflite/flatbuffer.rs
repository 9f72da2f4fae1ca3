//! Reads FlatBuffers tables, every offset checked. The crate `flatbuffers` reads only what its
//! compiler has generated code for; the fields needed here are few.

use crate::NetworkError;

/// Elements of a vector of tables that are followed.
const MAX_TABLES: usize = 16_384;

/// Fields of a table that are looked for; the tables of an operator have fewer.
const MAX_FIELDS: usize = 32;

/// A table at a place in the buffer.
#[derive(Clone, Copy)]
pub(super) struct Table<'a> {
    buffer: &'a [u8],
    at: usize,
}

fn broken() -> NetworkError {
    NetworkError::malformed("TensorFlow Lite", "an offset points outside the file")
}

fn bytes<const N: usize>(buffer: &[u8], at: usize) -> Result<[u8; N], NetworkError> {
    let end = at.checked_add(N).ok_or_else(broken)?;
    let slice = buffer.get(at..end).ok_or_else(broken)?;
    slice.try_into().map_err(|_| broken())
}

fn word(buffer: &[u8], at: usize) -> Result<usize, NetworkError> {
    Ok(u32::from_le_bytes(bytes(buffer, at)?) as usize)
}

impl<'a> Table<'a> {
    /// The table that the buffer begins with.
    pub(super) fn root(buffer: &'a [u8]) -> Result<Self, NetworkError> {
        Ok(Self {
            buffer,
            at: word(buffer, 0)?,
        })
    }

    /// Offset of field `id`, if the table has it.
    fn field(&self, id: usize) -> Result<Option<usize>, NetworkError> {
        let back = i32::from_le_bytes(bytes(self.buffer, self.at)?);
        let table = i64::try_from(self.at)
            .ok()
            .and_then(|at| at.checked_sub(back.into()));
        let table = table
            .and_then(|at| usize::try_from(at).ok())
            .ok_or_else(broken)?;
        let length = usize::from(u16::from_le_bytes(bytes(self.buffer, table)?));
        let slot = 4 + 2 * id;
        if slot + 2 > length {
            return Ok(None);
        }
        let offset = u16::from_le_bytes(bytes(self.buffer, table + slot)?);
        Ok((offset != 0).then(|| self.at + usize::from(offset)))
    }

    /// Numbers of the fields that the table has.
    pub(super) fn fields(&self) -> Result<Vec<usize>, NetworkError> {
        let mut found = Vec::new();
        for id in 0..MAX_FIELDS {
            if self.field(id)?.is_some() {
                found.push(id);
            }
        }
        Ok(found)
    }

    pub(super) fn byte(&self, id: usize) -> Result<u8, NetworkError> {
        let Some(at) = self.field(id)? else {
            return Ok(0);
        };
        Ok(bytes::<1>(self.buffer, at)?[0])
    }

    pub(super) fn int(&self, id: usize, otherwise: i32) -> Result<i32, NetworkError> {
        let Some(at) = self.field(id)? else {
            return Ok(otherwise);
        };
        Ok(i32::from_le_bytes(bytes(self.buffer, at)?))
    }

    pub(super) fn float(&self, id: usize, otherwise: f32) -> Result<f32, NetworkError> {
        let Some(at) = self.field(id)? else {
            return Ok(otherwise);
        };
        Ok(f32::from_le_bytes(bytes(self.buffer, at)?))
    }

    /// The bytes of a vector of elements of `size` bytes; empty if the table has none.
    fn vector(&self, id: usize, size: usize) -> Result<&'a [u8], NetworkError> {
        let Some(at) = self.field(id)? else {
            return Ok(&[]);
        };
        let start = at.checked_add(word(self.buffer, at)?).ok_or_else(broken)?;
        let length = word(self.buffer, start)?
            .checked_mul(size)
            .ok_or_else(broken)?;
        let end = start
            .checked_add(4)
            .and_then(|start| start.checked_add(length));
        self.buffer
            .get(start + 4..end.ok_or_else(broken)?)
            .ok_or_else(broken)
    }

    pub(super) fn bytes(&self, id: usize) -> Result<&'a [u8], NetworkError> {
        self.vector(id, 1)
    }

    pub(super) fn ints(&self, id: usize) -> Result<Vec<i32>, NetworkError> {
        Ok(self
            .vector(id, 4)?
            .as_chunks()
            .0
            .iter()
            .map(|b| i32::from_le_bytes(*b))
            .collect())
    }

    pub(super) fn longs(&self, id: usize) -> Result<Vec<i64>, NetworkError> {
        Ok(self
            .vector(id, 8)?
            .as_chunks()
            .0
            .iter()
            .map(|b| i64::from_le_bytes(*b))
            .collect())
    }

    pub(super) fn floats(&self, id: usize) -> Result<Vec<f32>, NetworkError> {
        Ok(self
            .vector(id, 4)?
            .as_chunks()
            .0
            .iter()
            .map(|b| f32::from_le_bytes(*b))
            .collect())
    }

    pub(super) fn text(&self, id: usize) -> Result<String, NetworkError> {
        Ok(String::from_utf8_lossy(self.vector(id, 1)?).into())
    }

    pub(super) fn table(&self, id: usize) -> Result<Option<Self>, NetworkError> {
        let Some(at) = self.field(id)? else {
            return Ok(None);
        };
        let at = at.checked_add(word(self.buffer, at)?).ok_or_else(broken)?;
        Ok(Some(Self { at, ..*self }))
    }

    pub(super) fn tables(&self, id: usize) -> Result<Vec<Self>, NetworkError> {
        let Some(at) = self.field(id)? else {
            return Ok(Vec::new());
        };
        let start = at.checked_add(word(self.buffer, at)?).ok_or_else(broken)?;
        let count = word(self.buffer, start)?;
        if count > MAX_TABLES {
            return Err(broken());
        }
        (0..count)
            .map(|i| {
                let at = start + 4 + 4 * i;
                let at = at.checked_add(word(self.buffer, at)?).ok_or_else(broken)?;
                Ok(Self { at, ..*self })
            })
            .collect()
    }
}

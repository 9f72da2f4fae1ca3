//! MATLAB level 5 (`save -v6` and `-v7`): MAT-File Format, chapter 1.
//!
//! Every variable is an element: a tag of type and length, then that many bytes. A compressed
//! element is a zlib stream of another. Matrices hold elements: flags, dimensions, name, numbers;
//! cells and structures hold matrices.

use miniz_oxide::inflate::decompress_to_vec_zlib_with_limit;

use crate::contents::Contents;
use crate::cursor::Cursor;
use crate::error::{Error, Result};

/// Bytes before the first element.
const HEADER: usize = 128;
/// Matrices within matrices that are followed.
const MOST_DEPTH: usize = 16;
/// Matrices that are looked at in one file.
const MOST_MATRICES: usize = 20_000;
/// Bytes that one file may unfold to.
const MOST_UNFOLDED: usize = 1 << 30;
/// Bytes that zlib makes of one at most, a little rounded up.
const MOST_RATIO: usize = 1040;

const COMPRESSED: u32 = 15;
const MATRIX: u32 = 14;

/// True for the header of a level 5 file: version 1 and the mark of its byte order.
pub fn is_header(bytes: &[u8]) -> bool {
    matches!(
        bytes.get(124..HEADER),
        Some([0, 1, b'I', b'M'] | [1, 0, b'M', b'I'])
    )
}

/// # Errors
/// A file that is broken, cut off or too large.
pub fn read(bytes: &[u8]) -> Result<Contents> {
    if !is_header(bytes) {
        return Err(Error::new("it is no MATLAB file of level 5")
            .help("in MATLAB, `save -v7` writes one; level 4 files are not read"));
    }
    let big_endian = bytes[126] == b'M';
    let mut reader = Reader {
        big_endian,
        contents: Contents::default(),
        matrices: 0,
        unfolded: 0,
    };
    let mut cursor = Cursor::new(&bytes[HEADER..], big_endian);
    while cursor.left() > 0 {
        let element = Element::read(&mut cursor)?;
        match element.kind {
            COMPRESSED => reader.compressed(element.bytes)?,
            MATRIX => reader.variable(element.bytes)?,
            kind => {
                let what = format!("element of type {kind}");
                reader.contents.other("", what);
            }
        }
    }
    Ok(reader.contents)
}

/// One element: a type and its bytes.
struct Element<'a> {
    kind: u32,
    bytes: &'a [u8],
}

impl<'a> Element<'a> {
    fn read(cursor: &mut Cursor<'a>) -> Result<Self> {
        let first = cursor.u32()?;
        // A short element has its length in the upper half of its type, and four bytes.
        if first >> 16 != 0 {
            let (kind, length) = (first & 0xffff, (first >> 16) as usize);
            if length > 4 {
                return Err(broken(format!("a short element of {length} bytes")));
            }
            return Ok(Self {
                kind,
                bytes: &cursor.take(4)?[..length],
            });
        }
        let length = cursor.u32()? as usize;
        let bytes = cursor.take(length)?;
        if first != COMPRESSED {
            cursor.align(8);
        }
        Ok(Self { kind: first, bytes })
    }

    /// The next element, which must be of one of these types.
    fn expect(cursor: &mut Cursor<'a>, kinds: &[u32], what: &str) -> Result<Self> {
        let element = Self::read(cursor)?;
        if kinds.contains(&element.kind) {
            Ok(element)
        } else {
            Err(broken(format!("{what} of type {}", element.kind)))
        }
    }
}

fn broken(what: impl std::fmt::Display) -> Error {
    Error::new(format!("the MATLAB file is broken: {what}"))
}

struct Reader {
    big_endian: bool,
    contents: Contents,
    matrices: usize,
    unfolded: usize,
}

impl Reader {
    fn compressed(&mut self, bytes: &[u8]) -> Result<()> {
        let left = MOST_UNFOLDED - self.unfolded;
        let most = bytes.len().saturating_mul(MOST_RATIO).min(left);
        let unfolded = decompress_to_vec_zlib_with_limit(bytes, most)
            .map_err(|error| broken(format!("a compressed variable ({})", error.status as i8)))?;
        self.unfolded += unfolded.len();
        let mut cursor = Cursor::new(&unfolded, self.big_endian);
        let element = Element::expect(&mut cursor, &[MATRIX], "a compressed element")?;
        self.variable(element.bytes)
    }

    fn variable(&mut self, bytes: &[u8]) -> Result<()> {
        self.matrix(bytes, None, 0)
    }

    /// A matrix at `path`; a variable's path is its own name.
    fn matrix(&mut self, bytes: &[u8], path: Option<&str>, depth: usize) -> Result<()> {
        self.matrices += 1;
        if depth > MOST_DEPTH || self.matrices > MOST_MATRICES {
            return Err(broken("matrices within matrices without end"));
        }
        if bytes.is_empty() {
            self.contents.other(path.unwrap_or_default(), "empty");
            return Ok(());
        }
        let mut cursor = Cursor::new(bytes, self.big_endian);
        let flags = Element::expect(&mut cursor, &[6], "flags")?;
        let class = Cursor::new(flags.bytes, self.big_endian).u32()?;
        let (class, complex) = (class & 0xff, class & 0x800 != 0);
        if class == 17 {
            let name = Element::read(&mut cursor)?;
            let name = text_of(name.bytes);
            let what = "an object of a class (table, timeseries, ...), which only MATLAB reads";
            self.contents.other(path.unwrap_or(&name), what);
            return Ok(());
        }
        let shape = self.shape(&mut cursor)?;
        let name = Element::expect(&mut cursor, &[1, 2, 16], "a name")?;
        let own = text_of(name.bytes);
        let path = path.unwrap_or(&own).to_owned();
        match class {
            1 => self.cell(cursor, &path, &shape, depth),
            2 => self.structure(cursor, &path, &shape, depth),
            3 => {
                let _class = Element::read(&mut cursor)?;
                self.structure(cursor, &path, &shape, depth)
            }
            4 => {
                let text = Element::read(&mut cursor)?;
                self.text(&path, text.kind, text.bytes)
            }
            6..=15 => self.numbers(cursor, &path, &shape, complex),
            5 => {
                self.contents.other(&path, "a sparse matrix");
                Ok(())
            }
            _ => {
                let what = format!("MATLAB class {class}");
                self.contents.other(&path, what);
                Ok(())
            }
        }
    }

    fn shape(&self, cursor: &mut Cursor) -> Result<Vec<usize>> {
        let dimensions = Element::expect(cursor, &[5], "dimensions")?;
        let mut cursor = Cursor::new(dimensions.bytes, self.big_endian);
        let mut shape = Vec::new();
        while cursor.left() >= 4 {
            let size = cursor.i32()?;
            let size = usize::try_from(size).map_err(|_| broken(format!("a size of {size}")))?;
            shape.push(size);
        }
        Ok(shape)
    }

    fn cell(
        &mut self,
        mut cursor: Cursor,
        path: &str,
        shape: &[usize],
        depth: usize,
    ) -> Result<()> {
        for index in 1..=elements(shape)? {
            let element = Element::expect(&mut cursor, &[MATRIX], "a cell")?;
            self.matrix(element.bytes, Some(&format!("{path}[{index}]")), depth + 1)?;
        }
        Ok(())
    }

    fn structure(
        &mut self,
        mut cursor: Cursor,
        path: &str,
        shape: &[usize],
        depth: usize,
    ) -> Result<()> {
        let width = Element::expect(&mut cursor, &[5], "the length of field names")?;
        let width = Cursor::new(width.bytes, self.big_endian).u32()? as usize;
        let names = Element::expect(&mut cursor, &[1, 2], "field names")?;
        if width == 0 {
            return Err(broken("field names of no length"));
        }
        let names: Vec<String> = names.bytes.chunks(width).map(text_of).collect();
        let count = elements(shape)?;
        for index in 1..=count {
            let place = match count {
                1 => path.to_owned(),
                _ => format!("{path}[{index}]"),
            };
            for name in &names {
                let element = Element::expect(&mut cursor, &[MATRIX], "a field")?;
                self.matrix(element.bytes, Some(&format!("{place}/{name}")), depth + 1)?;
            }
            // Elements without fields would be counted for ever.
            if names.is_empty() {
                break;
            }
        }
        Ok(())
    }

    fn text(&mut self, path: &str, kind: u32, bytes: &[u8]) -> Result<()> {
        let text = match kind {
            4 | 17 => {
                let mut cursor = Cursor::new(bytes, self.big_endian);
                let mut units = Vec::new();
                while cursor.left() >= 2 {
                    units.push(cursor.u16()?);
                }
                String::from_utf16_lossy(&units)
            }
            _ => text_of(bytes),
        };
        self.contents.text_at(path, &text);
        Ok(())
    }

    fn numbers(
        &mut self,
        mut cursor: Cursor,
        path: &str,
        shape: &[usize],
        complex: bool,
    ) -> Result<()> {
        let element = Element::read(&mut cursor)?;
        let values = self.values(element.kind, element.bytes)?;
        if values.len() != elements(shape)? {
            let found = values.len();
            return Err(broken(format!(
                "`{path}` has {found} numbers for {shape:?}"
            )));
        }
        if complex {
            self.contents.other(path, "complex numbers");
            return Ok(());
        }
        self.contents.push(path, shape, values)
    }

    fn values(&self, kind: u32, bytes: &[u8]) -> Result<Vec<f64>> {
        let big = self.big_endian;
        macro_rules! of {
            ($number:ty) => {{
                const SIZE: usize = size_of::<$number>();
                if !bytes.len().is_multiple_of(SIZE) {
                    return Err(broken("numbers that are cut off"));
                }
                let number = |chunk: &[u8]| {
                    let mut array = [0; SIZE];
                    array.copy_from_slice(chunk);
                    let number = if big {
                        <$number>::from_be_bytes(array)
                    } else {
                        <$number>::from_le_bytes(array)
                    };
                    number as f64
                };
                bytes.chunks_exact(SIZE).map(number).collect()
            }};
        }
        Ok(match kind {
            1 => of!(i8),
            2 => of!(u8),
            3 => of!(i16),
            4 => of!(u16),
            5 => of!(i32),
            6 => of!(u32),
            7 => of!(f32),
            9 => of!(f64),
            12 => of!(i64),
            13 => of!(u64),
            kind => return Err(broken(format!("numbers of type {kind}"))),
        })
    }
}

/// Number of elements of a shape.
fn elements(shape: &[usize]) -> Result<usize> {
    (shape.iter())
        .try_fold(1_usize, |product, size| product.checked_mul(*size))
        .ok_or_else(|| broken(format!("a shape of {shape:?}")))
}

/// Text up to its first zero byte.
fn text_of(bytes: &[u8]) -> String {
    let end = bytes.iter().position(|byte| *byte == 0);
    String::from_utf8_lossy(&bytes[..end.unwrap_or(bytes.len())]).into_owned()
}

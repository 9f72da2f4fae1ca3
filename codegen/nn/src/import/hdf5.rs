//! Tensors and texts of an HDF5 file.

use std::panic::{AssertUnwindSafe, catch_unwind};

use hdf5_pure::{AttrValue, File, Group};

use super::tensor::{self, Tensor};
use crate::NetworkError;

/// Groups within groups that are followed.
const MAX_DEPTH: usize = 12;
/// Datasets that are looked at.
const MAX_DATASETS: usize = 4096;

/// A file in memory.
pub(super) struct Hdf5 {
    file: File,
    /// The file cannot hold more values than bytes.
    bytes: usize,
}

/// Runs the library, whose panics on a broken file are errors of the file.
fn guarded<T>(
    place: &str,
    work: impl FnOnce() -> Result<T, hdf5_pure::Error>,
) -> Result<T, NetworkError> {
    match catch_unwind(AssertUnwindSafe(work)) {
        Ok(Ok(value)) => Ok(value),
        Ok(Err(error)) => Err(NetworkError::caused(place, error)),
        Err(_) => Err(NetworkError::malformed(
            place,
            "the HDF5 structure is broken",
        )),
    }
}

/// The length that an HDF5 file says it has: the end-of-file address of its superblock (HDF5 File
/// Format Specification 3.0, II.A), where addresses have eight bytes.
fn said_length(bytes: &[u8]) -> Option<u64> {
    let (width, place) = match bytes.get(8)? {
        0 => (13, 40),
        1 => (13, 44),
        _ => (9, 28),
    };
    let address = bytes.get(place..)?.first_chunk()?;
    (*bytes.get(width)? == 8).then(|| u64::from_le_bytes(*address))
}

impl Hdf5 {
    /// # Errors
    /// It is no HDF5 file.
    pub(super) fn new(bytes: &[u8]) -> Result<Self, NetworkError> {
        if let Some(said) = said_length(bytes).filter(|said| *said > bytes.len() as u64) {
            let message = format!(
                "the file is cut off: {} of {said} bytes are here",
                bytes.len()
            );
            return Err(NetworkError::malformed("HDF5", message));
        }
        let file = guarded("HDF5", || File::from_bytes(bytes.to_vec()))?;
        Ok(Self {
            file,
            bytes: bytes.len(),
        })
    }

    /// A text attribute of the file; none if it has none of that name.
    ///
    /// # Errors
    /// The file is broken.
    pub(super) fn text(&self, name: &str) -> Result<Option<String>, NetworkError> {
        let mut attributes = guarded("HDF5 attributes", || self.file.root().attrs())?;
        Ok(match attributes.remove(name) {
            Some(
                AttrValue::String(text)
                | AttrValue::AsciiString(text)
                | AttrValue::VarLenString(text)
                | AttrValue::VarLenAsciiString(text)
                | AttrValue::StringSized { value: text, .. }
                | AttrValue::AsciiStringSized { value: text, .. },
            ) => Some(text),
            Some(other) => Some(format!("{other:?}")),
            None => None,
        })
    }

    /// Every dataset under a group: its path below the group, and its values.
    ///
    /// # Errors
    /// The file is broken, or a dataset is larger than a network's.
    pub(super) fn tensors(&self, group: &str) -> Result<Vec<(String, Tensor)>, NetworkError> {
        let group_of = || self.file.group(group);
        let Ok(root) = guarded(group, group_of) else {
            return Ok(Vec::new());
        };
        let mut found = Vec::new();
        self.walk(&root, "", 0, &mut found)?;
        Ok(found)
    }

    fn walk(
        &self,
        group: &Group,
        prefix: &str,
        depth: usize,
        found: &mut Vec<(String, Tensor)>,
    ) -> Result<(), NetworkError> {
        if depth > MAX_DEPTH || found.len() > MAX_DATASETS {
            return Err(NetworkError::malformed(
                prefix,
                "groups within groups without end",
            ));
        }
        for name in guarded(prefix, || group.datasets())? {
            let path = format!("{prefix}{name}");
            let dataset = guarded(&path, || group.dataset(&name))?;
            let shape = guarded(&path, || dataset.shape())?;
            let shape: Vec<usize> = shape
                .iter()
                .map(|&n| usize::try_from(n).unwrap_or(usize::MAX))
                .collect();
            if tensor::count(&path, &shape)? > self.bytes {
                let message = format!("{shape:?} are more values than the file has bytes");
                return Err(NetworkError::malformed(&path, message));
            }
            let values = guarded(&path, || dataset.read_f32())?;
            found.push((path.clone(), Tensor::new(&path, shape, values)?));
        }
        for name in guarded(prefix, || group.groups())? {
            let path = format!("{prefix}{name}/");
            let inner = guarded(&path, || group.group(&name))?;
            self.walk(&inner, &path, depth + 1, found)?;
        }
        Ok(())
    }
}

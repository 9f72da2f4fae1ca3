//! Damaged files: an error or a value, never a panic, and no more memory than stands to the file.

use std::alloc::{GlobalAlloc, Layout, System};
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use proptest::prelude::*;
use sinew_convert::{Format, Wanted, format, read, table};

/// The system's allocator, which remembers the largest piece that was asked for.
struct Counting;

static LARGEST: AtomicUsize = AtomicUsize::new(0);

#[allow(unsafe_code, reason = "an allocator is unsafe by its trait")]
// SAFETY: every call goes to the system's allocator as it came.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        LARGEST.fetch_max(layout.size(), Ordering::Relaxed);
        // SAFETY: as the caller promises.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: as the caller promises.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Most bytes in one piece for a fixture of some kilobytes: a zlib stream unfolds a thousandfold.
const MOST: usize = 64 << 20;

fn files() -> Vec<(String, Vec<u8>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/foreign/logs");
    let entries = std::fs::read_dir(folder).expect("the folder is committed");
    let paths = entries.map(|entry| entry.expect("an entry").path());
    let mut files: Vec<(String, Vec<u8>)> = paths
        .filter(|path| path.extension().is_some_and(|extension| extension != "csv"))
        .filter(|path| {
            let hdf5 = path.ends_with("v73.mat") || path.ends_with("plain.h5");
            cfg!(feature = "hdf5") || !hdf5
        })
        .map(|path| {
            let bytes = std::fs::read(&path).expect("the file is committed");
            (path.display().to_string(), bytes)
        })
        .collect();
    files.sort();
    files
}

fn attempt(bytes: &[u8], kind: Format) {
    if let Ok(contents) = read(bytes, kind) {
        let _ = table(&contents, &Wanted::default());
    }
}

fn kind(name: &str, bytes: &[u8]) -> Format {
    format(bytes, name.rsplit('.').next().unwrap_or("")).expect("a known format")
}

#[test]
fn a_file_that_is_cut_off_is_an_error() {
    for (name, bytes) in files() {
        let kind = kind(&name, &bytes);
        let step = (bytes.len() / 40).max(1);
        for end in (140..bytes.len() - 9).step_by(step) {
            let cut = &bytes[..end];
            // An MCAP file is whole once its data have ended; what follows is an index. Elements of
            // MATLAB are whole each for itself.
            if let (Err(error), _) = (read(cut, kind), kind) {
                assert!(!error.message.is_empty());
            } else {
                assert!(
                    matches!(kind, Format::Mcap | Format::Mat5),
                    "{name} at {end}"
                );
            }
        }
        // Its data alone end an MCAP file's reading; a quarter of any of them has lost some.
        let quarter = read(&bytes[..bytes.len() / 4], kind);
        assert!(quarter.is_err(), "{name}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn no_damage_panics_or_takes_memory(
        which in any::<prop::sample::Index>(),
        places in proptest::collection::vec((any::<prop::sample::Index>(), any::<u8>(), 0..5_u8), 1..6),
    ) {
        let files = files();
        let (name, bytes) = &files[which.index(files.len())];
        let kind = kind(name, bytes);
        let mut damaged = bytes.clone();
        for (place, value, how) in places {
            let at = place.index(damaged.len());
            match how {
                0 => damaged[at] = value,
                1 => damaged[at] ^= 1 << (value % 8),
                2 => damaged.truncate(at.max(1)),
                3 => drop(damaged.drain(at..(at + usize::from(value)).min(damaged.len() - 1).max(at))),
                _ => {
                    let end = (at + 4).min(damaged.len());
                    damaged[at..end].fill(0xff);
                }
            }
        }
        LARGEST.store(0, Ordering::Relaxed);
        attempt(&damaged, kind);
        let largest = LARGEST.load(Ordering::Relaxed);
        prop_assert!(largest < MOST, "{name}: {largest} bytes in one piece");
    }

    #[test]
    fn no_bytes_behind_a_header_panic(bytes in proptest::collection::vec(any::<u8>(), 0..300)) {
        let mut mat = vec![b' '; 124];
        mat.extend(b"\x00\x01IM");
        mat.extend(&bytes);
        attempt(&mat, Format::Mat5);
        let mut mcap = b"\x89MCAP0\r\n".to_vec();
        mcap.extend(&bytes);
        attempt(&mcap, Format::Mcap);
        attempt(&bytes, Format::Json);
    }
}

//! Damaged and hostile files: an error, never a panic, never more memory than the file is worth.

use std::alloc::{GlobalAlloc, Layout, System};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

use sinew_nn::{import, store};

/// Counts what is allocated at the same time.
struct Counting;

static NOW: AtomicUsize = AtomicUsize::new(0);
static MOST: AtomicUsize = AtomicUsize::new(0);

// SAFETY: the system's allocator, with counters beside it.
#[allow(unsafe_code, reason = "an allocator is unsafe by its trait")]
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let now = NOW.fetch_add(layout.size(), Ordering::Relaxed) + layout.size();
        MOST.fetch_max(now, Ordering::Relaxed);
        // SAFETY: as the caller promises.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        NOW.fetch_sub(layout.size(), Ordering::Relaxed);
        // SAFETY: as the caller promises.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// No file here is larger than 100 kB; nothing made from one may take more than this.
const MOST_BYTES: usize = 256 << 20;

fn files(folder: &str) -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
    let entries = fs::read_dir(folder).expect("the folder is committed");
    let mut files: Vec<PathBuf> = entries
        .map(|entry| entry.expect("the folder can be read").path())
        .collect();
    files.sort();
    files
}

fn models() -> Vec<PathBuf> {
    let models = files("tests/frameworks/models");
    models
        .into_iter()
        .filter(|path| path.extension().is_some_and(|e| e != "safetensors"))
        .collect()
}

struct Random(u64);

impl Random {
    fn below(&mut self, end: usize) -> usize {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % end.max(1)
    }
}

/// One file, damaged in one of several ways.
fn damaged(bytes: &[u8], random: &mut Random) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    let at = random.below(bytes.len());
    match random.below(5) {
        0 => bytes.truncate(at),
        1 => bytes[at] ^= 1 << random.below(8),
        2 => {
            // A length or an offset that is huge.
            let value = [u32::MAX, i32::MAX as u32, 0x4000_0000, 0][random.below(4)].to_le_bytes();
            for (place, byte) in bytes.iter_mut().skip(at).zip(value) {
                *place = byte;
            }
        }
        3 => {
            for _ in 0..20 {
                let at = random.below(bytes.len());
                bytes[at] = random.below(256) as u8;
            }
        }
        _ => {
            let end = (at + random.below(64)).min(bytes.len());
            bytes.drain(at..end);
        }
    }
    bytes
}

/// Numbers at which readers of text break.
const NUMBERS: [&str; 8] = [
    "0",
    "-1",
    "1e999",
    "nan",
    "18446744073709551615",
    "1e-320",
    "2147483648",
    "inf",
];

/// A text with one of its numbers another, or damaged as any file.
fn damaged_text(text: &str, random: &mut Random) -> String {
    let at = random.below(text.len());
    let digits = text.char_indices().skip_while(|(place, _)| *place < at);
    let mut digits = digits.skip_while(|(_, c)| !c.is_ascii_digit());
    if let (Some((start, _)), true) = (digits.next(), random.below(2) == 0) {
        let end = digits.find(|(_, c)| !c.is_ascii_digit());
        let end = end.map_or(text.len(), |(place, _)| place);
        let number = NUMBERS[random.below(NUMBERS.len())];
        return format!("{}{number}{}", &text[..start], &text[end..]);
    }
    String::from_utf8_lossy(&damaged(text.as_bytes(), random)).into_owned()
}

/// Outcomes of reading damaged files.
#[derive(Default)]
struct Tally {
    tried: usize,
    refused: usize,
}

impl Tally {
    /// Reads something damaged; `read` says whether it was taken.
    fn count(&mut self, name: &str, read: impl FnOnce() -> bool + std::panic::UnwindSafe) {
        let before = NOW.load(Ordering::Relaxed);
        MOST.store(before, Ordering::Relaxed);
        // What a library says before its panic is caught is of no use here.
        std::panic::set_hook(Box::new(|_| {}));
        let result = std::panic::catch_unwind(read);
        let most = MOST.load(Ordering::Relaxed) - before;
        let _ = std::panic::take_hook();
        let taken = result.unwrap_or_else(|_| panic!("{name}: a panic"));
        assert!(most < MOST_BYTES, "{name}: {most} bytes");
        self.refused += usize::from(!taken);
        self.tried += 1;
    }
}

/// One test, so that the counter of memory sees one thing at a time.
#[test]
fn damaged_files_are_errors_and_take_no_memory() {
    let (mut files, mut folders) = (Tally::default(), Tally::default());
    for path in models() {
        let bytes = fs::read(&path).expect("the file can be read");
        let name = path
            .file_name()
            .expect("the path has a name")
            .to_string_lossy()
            .into_owned();
        let mut random = Random(bytes.len() as u64);
        for round in 0..60 {
            let damaged = damaged(&bytes, &mut random);
            files.count(&format!("{name}, round {round}"), || {
                import::parse(&name, &damaged).is_ok()
            });
        }
        let folder = tempfile::tempdir().expect("a temporary folder can be made");
        let network = import::parse(&name, &bytes).expect("the rig is sound");
        store::save(folder.path(), &network).expect("the folder is writable");
        let text =
            fs::read_to_string(folder.path().join("network.toml")).expect("the file is there");
        let weights =
            fs::read(folder.path().join("weights.safetensors")).expect("the file is there");
        assert!(
            store::parse(&text, &weights).is_ok(),
            "{name}: what was written is read"
        );
        for round in 0..60 {
            let name = format!("{name} as a folder, round {round}");
            let (mut text, mut weights) = (text.clone(), weights.clone());
            if round % 3 == 0 {
                weights = damaged(&weights, &mut random);
            } else {
                text = damaged_text(&text, &mut random);
            }
            folders.count(&name, || store::parse(&text, &weights).is_ok());
        }
    }
    for (what, tally) in [("files", files), ("folders", folders)] {
        let Tally { tried, refused } = tally;
        println!(
            "{refused} of {tried} damaged {what} refused; the others are whole where it matters"
        );
        assert!(
            refused * 4 > tried,
            "damage is not seen: this tests nothing"
        );
    }
}

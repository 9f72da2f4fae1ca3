//! `cargo run --release --bin shake -- TARGET SECONDS FILE..`: the targets on a stable compiler,
//! without coverage. Files are damaged at random for so long; what panics, or takes very long, is
//! written to `found/`.

use std::panic::catch_unwind;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};

use sinew_fuzz::TARGETS;

/// Longer is a finding. By the clock on the wall: what takes 0.04 s alone took 2 s on a crowded
/// machine.
const SLOW: Duration = Duration::from_secs(20);

/// SplitMix64.
struct Random(u64);

impl Random {
    fn below(&mut self, end: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) % end.max(1) as u64) as usize
    }
}

/// Numbers at which parsers break.
const NUMBERS: [&str; 9] = [
    "0",
    "-1",
    "1e999",
    "nan",
    "18446744073709551615",
    "1e-320",
    "2147483648",
    "inf",
    "0.0",
];

fn damage(random: &mut Random, files: &[Vec<u8>]) -> Vec<u8> {
    let mut data = files[random.below(files.len())].clone();
    for _ in 0..=random.below(4) {
        let at = random.below(data.len() + 1);
        let end = (at + 1 + random.below(16)).min(data.len());
        match random.below(8) {
            0 => data.truncate(at),
            1 if at < data.len() => data[at] ^= 1 << random.below(8),
            2 if at < data.len() => data[at] = [0, 1, 0x7f, 0x80, 0xff][random.below(5)],
            3 if at < end => drop(data.drain(at..end)),
            4 if at < end => {
                let part = data[at..end].to_vec();
                let to = random.below(data.len());
                data.splice(to..to, part);
            }
            5 => {
                let other = &files[random.below(files.len())];
                let from = random.below(other.len());
                data.truncate(at);
                data.extend(&other[from.min(other.len())..]);
            }
            6 => {
                // A number of a text in the place of another.
                let digit = data.iter().skip(at).position(u8::is_ascii_digit);
                if let Some(start) = digit.map(|digit| at + digit) {
                    let number = data[start..].iter().take_while(|b| b.is_ascii_digit());
                    let end = start + number.count();
                    let new = NUMBERS[random.below(NUMBERS.len())].bytes();
                    data.splice(start..end, new);
                }
            }
            _ if end - at >= 4 => {
                let word = [0_u32, 1, u32::MAX, 1 << 31, 0xffff][random.below(5)];
                data[at..at + 4].copy_from_slice(&word.to_le_bytes());
            }
            _ => {}
        }
    }
    data
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let (name, seconds, paths) = match arguments.as_slice() {
        [name, seconds, paths @ ..] if !paths.is_empty() => (name, seconds, paths),
        _ => {
            eprintln!("usage: shake TARGET SECONDS FILE..");
            return ExitCode::from(2);
        }
    };
    let Some((_, target)) = TARGETS.iter().find(|(target, _)| target == name) else {
        eprintln!(
            "there is no target {name:?}: {:?}",
            TARGETS.map(|(name, _)| name)
        );
        return ExitCode::from(2);
    };
    let Ok(seconds) = seconds.parse() else {
        eprintln!("{seconds:?} is no number of seconds");
        return ExitCode::from(2);
    };
    let paths: Vec<PathBuf> = paths.iter().map(PathBuf::from).collect();
    let mut files = Vec::new();
    for path in &paths {
        match std::fs::read(path) {
            Ok(bytes) => files.push(bytes),
            Err(error) => {
                eprintln!("{}: {error}", path.display());
                return ExitCode::FAILURE;
            }
        }
    }
    let begin = Instant::now();
    let seed = std::time::UNIX_EPOCH
        .elapsed()
        .map_or(1, |t| t.as_nanos() as u64);
    let mut random = Random(seed);
    let (mut runs, mut found) = (0_u64, 0);
    while begin.elapsed() < Duration::from_secs(seconds) {
        let data = damage(&mut random, &files);
        let start = Instant::now();
        let survived = catch_unwind(|| target(&data)).is_ok();
        let slow = start.elapsed() > SLOW;
        runs += 1;
        if !survived || slow {
            found += 1;
            let file = Path::new("found").join(format!("{name}-{found}"));
            let written =
                std::fs::create_dir_all("found").and_then(|()| std::fs::write(&file, data));
            let what = if survived { "is slow" } else { "panics" };
            println!("{} {what} {written:?}", file.display());
        }
    }
    println!("{name}: {runs} inputs, {found} findings");
    if found > 0 {
        ExitCode::FAILURE
    } else {
        ExitCode::SUCCESS
    }
}

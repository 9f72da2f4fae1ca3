//! Thirteen kinds of faults put into sound recordings, and sound ones without: how many are named.
//!
//! `cargo test -p sinew-ident --test check seeded -- --ignored --nocapture` prints the table of
//! docs/evaluation/checks.md. Recordings are shipped (`rigs/*.csv`), simulated, and real
//! (`SINEW_DATA`, where it is set).

use std::collections::BTreeMap;
use std::path::PathBuf;

use sinew_ident::check::check;
use sinew_ident::excite::{Kind, Options, design};
use sinew_ident::noise::noise_level;
use sinew_ident::recording::{Column, Recording};
use sinew_sim::{InputTrajectory, Plant, Rig};

/// A recording beside the rig of its device, where there is one.
struct Sound {
    name: String,
    rig: Option<Rig>,
    recording: Recording,
}

impl Sound {
    /// Tells whether a column has levels finer than its noise.
    fn varies_finely(&self, values: &[f64], noise: f64) -> bool {
        let mut sorted = values.to_vec();
        sorted.sort_unstable_by(f64::total_cmp);
        let steps = sorted.windows(2).map(|pair| pair[1] - pair[0]);
        let least = steps.filter(|step| *step > 0.0);
        least.fold(f64::INFINITY, f64::min) < 0.3 * noise
    }
}

/// Numbers that look random and are the same in every run.
struct Draw(u64);

impl Draw {
    /// In 0 to 1.
    fn part(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Below `count`.
    fn below(&mut self, count: usize) -> usize {
        ((self.part() * count as f64) as usize).min(count - 1)
    }

    /// Nearly normal, of unit variance.
    fn normal(&mut self) -> f64 {
        (0..12).map(|_| self.part()).sum::<f64>() - 6.0
    }
}

const FAULTS: [(&str, &str); 13] = [
    ("milliseconds", "time_in_milliseconds"),
    ("degrees", "degrees_for_radians"),
    ("wrong sign", "wrong_sign"),
    ("late input", "input_lags"),
    ("jitter", "irregular_sampling"),
    ("jitter of the delay", "jittering_delay"),
    ("gap", "gap"),
    ("clipping", "clipped"),
    ("frozen sensor", "stuck_channel"),
    ("dead sensor", "dead_channel"),
    ("coarse steps", "quantised"),
    ("wrap", "wrapped_counter"),
    ("sentinel", "sentinel"),
];

const SLIDE: &str = "[[spring]]\nname = 'coil'\nfrom = 'ground'\nto = 'mass'\n\
    stiffness = { value = 40.0 }\n";
const HINGE: &str = "[[gravity]]\nname = 'weight'\nbody = 'mass'\namplitude = { value = 12.0 }\n";

/// A mass on a spring, or a pendulum with a motor.
fn rig(hinge: bool) -> Rig {
    let [motion, unit, force, part] = if hinge {
        ["hinge", "rad", "Nm", HINGE]
    } else {
        ["slide", "m", "N", SLIDE]
    };
    let text = format!(
        "format = 'sinew-rig/1'\nname = 'x'\n[[body]]\nname = 'mass'\nmotion = '{motion}'\n\
         inertia = {{ value = 1.0 }}\n{part}[[damper]]\nname = 'oil'\nfrom = 'ground'\n\
         to = 'mass'\ndamping = {{ value = 1.2 }}\n[[actuator]]\nname = 'push'\n\
         drives = 'mass'\ninput = 'u_{force}'\ngain = 1.0\nlimit = [-12.0, 12.0]\n\
         [[sensor]]\nname = 'encoder'\nreads = 'mass.position'\nsignal = 'q_{unit}'\n"
    );
    Rig::parse(&text, "x.toml").unwrap()
}

/// Ten seconds of a device whose numbers differ from the rig's by up to 40 %, with noise.
fn simulated(seed: u64) -> Sound {
    let mut draw = Draw(seed);
    let rig = rig(seed % 2 == 1);
    let plant = Plant::new(&rig).unwrap();
    let kinds = [Kind::Multisine, Kind::Steps, Kind::Chirp, Kind::Mixed];
    let options = Options {
        kind: kinds[draw.below(4)],
        seconds: 10.0,
        rate_hz: 100.0,
        seed,
        ..Options::default()
    };
    let experiment = design(&plant, "x.toml", &options).unwrap();
    let columns: Vec<&[f64]> = experiment.inputs.iter().map(Vec::as_slice).collect();
    let drive = InputTrajectory::new(&plant, experiment.t.len(), &columns).unwrap();
    let mut values = plant.values();
    for slot in plant.free_slots() {
        values[slot] *= 0.6 + 0.8 * draw.part();
    }
    let start = plant.initial_state(&values, &[None]).unwrap();
    let run = plant
        .simulate(&values, &start, &drive, &experiment.t)
        .unwrap();
    let signal = run.column(0);
    let high = signal.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let low = signal.iter().copied().fold(f64::INFINITY, f64::min);
    let noise = (high - low) * 10f64.powf(-4.0 + 2.0 * draw.part());
    let columns = vec![
        Column {
            name: plant.inputs()[0].column.clone(),
            values: experiment.inputs[0].clone(),
        },
        Column {
            name: plant.sensors()[0].column.clone(),
            values: signal.iter().map(|q| q + noise * draw.normal()).collect(),
        },
    ];
    let name = format!("simulated {seed}");
    Sound {
        recording: Recording::new(&name, experiment.t, columns).unwrap(),
        rig: Some(rig),
        name,
    }
}

/// The recordings that ship.
fn shipped() -> Vec<Sound> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../rigs");
    let names = ["fit", "test"].map(|role| format!("mass-spring-damper.{role}.csv"));
    let rig = Rig::load(folder.join("mass-spring-damper.toml")).unwrap();
    let sound = names.map(|name| Sound {
        recording: Recording::read(folder.join(&name)).unwrap(),
        rig: Some(rig.clone()),
        name,
    });
    sound.into()
}

/// Recordings of real devices without a fault that their own notes name (pauses of the logger).
fn real() -> Vec<Sound> {
    let Some(folder) = std::env::var_os("SINEW_DATA").map(PathBuf::from) else {
        return Vec::new();
    };
    let mut found = Vec::new();
    let mut sets: Vec<PathBuf> = std::fs::read_dir(&folder)
        .map(|entries| entries.flatten().map(|entry| entry.path()).collect())
        .unwrap_or_default();
    sets.sort();
    for set in sets.iter().filter(|set| set.is_dir()) {
        let mut files: Vec<PathBuf> = std::fs::read_dir(set)
            .map(|entries| entries.flatten().map(|entry| entry.path()).collect())
            .unwrap_or_default();
        files.retain(|file| file.extension().is_some_and(|end| end == "csv"));
        files.sort();
        for file in files {
            let Ok(recording) = Recording::read(&file) else {
                continue;
            };
            let steps = recording.t().windows(2).map(|pair| pair[1] - pair[0]);
            let longest = steps.fold(0.0, f64::max);
            if longest < 6.0 * recording.interval().unwrap_or(1.0) {
                found.push(Sound {
                    name: file
                        .strip_prefix(&folder)
                        .unwrap_or(&file)
                        .display()
                        .to_string(),
                    rig: None,
                    recording,
                });
            }
        }
    }
    found
}

/// Faults that recordings of real devices have by themselves, by their folder: the level sensor of
/// the tanks stops at 10 V, and a servo is asked for its position over a bus, 0.17 ms early or late
/// in every recording.
const REAL_FAULTS: [(&str, &str); 2] = [
    ("cascaded_tanks", "clipped"),
    ("bam_xl330", "jittering_delay"),
];

/// The recording with a fault, where the fault can be put in.
fn seeded(sound: &Sound, fault: &str, draw: &mut Draw) -> Option<Recording> {
    let recording = &sound.recording;
    let mut t = recording.t().to_vec();
    let mut columns = recording.columns().to_vec();
    let rows = t.len();
    let sensor = match &sound.rig {
        Some(rig) => {
            let name = &rig.sensors[0].signal;
            columns.iter().position(|column| column.name == *name)?
        }
        // Positions of real devices.
        None => columns.iter().position(|column| {
            matches!(sinew_sim::unit::of_column(&column.name), "m" | "rad") && rows > 400
        })?,
    };
    let angle = columns[sensor].name.ends_with("_rad");
    let mut sorted = columns[sensor].values.clone();
    sorted.sort_unstable_by(f64::total_cmp);
    let (low, high) = (sorted[0], sorted[rows - 1]);
    let step = recording.interval()?;
    let q = &mut columns[sensor].values;
    match fault {
        "milliseconds" => {
            sound.rig.as_ref()?;
            t.iter_mut().for_each(|t| *t *= 1e3);
        }
        "degrees" => {
            sound.rig.as_ref()?;
            if !angle {
                return None;
            }
            q.iter_mut().for_each(|q| *q = q.to_degrees());
        }
        "wrong sign" => {
            sound.rig.as_ref()?;
            q.iter_mut().for_each(|q| *q = -*q);
        }
        "late input" => {
            let input = &sound.rig.as_ref()?.actuators[0].input;
            let input = columns.iter_mut().find(|column| column.name == *input)?;
            let by = 2 + draw.below(4);
            input.values.rotate_right(by);
            let first = input.values[by];
            input.values[..by].fill(first);
        }
        "jitter" => {
            sound.rig.as_ref()?;
            t.iter_mut().for_each(|t| *t += 0.8 * step * draw.part());
        }
        "jitter of the delay" => {
            // Its own numbers, so that other faults keep theirs.
            let mut draw = Draw(rows as u64);
            let slopes = q.windows(3).map(|y| (y[2] - y[0]) / (2.0 * step));
            let speed = (slopes.map(|v| v * v).sum::<f64>() / rows as f64).sqrt();
            let noise = noise_level(&t, q);
            let jitter = (3.0 + 3.0 * draw.part()) * noise / speed;
            // An encoder's steps hide it, and so do few rows a period.
            if jitter > 0.6 * step || !sound.varies_finely(q, noise) {
                return None;
            }
            let straight = |k: usize, late: f64| {
                let to = if late < 0.0 { k - 1 } else { k + 1 };
                q[k] + (q[to] - q[k]) * late.abs() / step
            };
            let moved: Vec<f64> = (1..rows - 1)
                .map(|k| straight(k, (jitter * draw.normal()).clamp(-step, step)))
                .collect();
            q[1..rows - 1].copy_from_slice(&moved);
        }
        "gap" => {
            let begin = rows / 4 + draw.below(rows / 2);
            let end = (begin + 20 + draw.below(rows / 8)).min(rows - 8);
            t.drain(begin..end);
            columns
                .iter_mut()
                .for_each(|column| _ = column.values.drain(begin..end));
        }
        "clipping" => {
            let share = 0.03 + 0.07 * draw.part();
            let limit = sorted[((1.0 - share) * rows as f64) as usize];
            q.iter_mut().for_each(|q| *q = q.min(limit));
        }
        "frozen sensor" => {
            let count = 40 + draw.below(rows / 8);
            // Where the sensor moves: one that froze at rest shows nothing.
            let begin = (0..rows - count - 8).max_by(|a, b| {
                let moved = |k: usize| (q[k + count] - q[k]).abs();
                moved(*a).total_cmp(&moved(*b))
            })?;
            let held = q[begin];
            q[begin..begin + count].fill(held);
        }
        "dead sensor" => {
            sound.rig.as_ref()?;
            let value = q[0];
            q.fill(value);
        }
        "coarse steps" => {
            let unit = (high - low) / (8.0 + 20.0 * draw.part());
            q.iter_mut().for_each(|q| *q = (*q / unit).round() * unit);
        }
        "wrap" => {
            if !angle {
                return None;
            }
            // A turn of an encoder whose motion is that large.
            let turn = std::f64::consts::TAU;
            let gain = (1.5 * turn / (high - low)).max(1.0);
            q.iter_mut().for_each(|q| *q = (*q * gain).rem_euclid(turn));
        }
        "sentinel" => {
            let value = [-9999.0, -999.0, 65535.0, 99999.0][draw.below(4)];
            for _ in 0..1 + draw.below(5) {
                let row = draw.below(rows);
                q[row] = value;
            }
        }
        _ => return None,
    }
    Recording::new(recording.path(), t, columns).ok()
}

#[test]
#[ignore = "long run: cargo xtask survive"]
fn seeded_faults_are_named_and_sound_recordings_are_not() {
    let mut sound: Vec<Sound> = (0..8).map(simulated).collect();
    sound.extend(shipped());
    sound.extend(real());
    let mut table: BTreeMap<&str, [usize; 2]> = BTreeMap::new();
    let mut missed = Vec::new();
    let mut false_ones = Vec::new();
    let mut draw = Draw(7);
    for (index, sound) in sound.iter().enumerate() {
        let named = check(std::slice::from_ref(&sound.recording), sound.rig.as_ref());
        let kinds: Vec<&str> = named.iter().map(|check| check.kind).collect();
        let is_real = |kind: &str| {
            let real = |(set, fault): &(&str, &str)| sound.name.starts_with(set) && *fault == kind;
            REAL_FAULTS.iter().any(real)
        };
        if !kinds.iter().all(|kind| is_real(kind)) {
            false_ones.push(format!("{}: {named:?}", sound.name));
        }
        // Real recordings are many and alike: faults are put into every fourth.
        if sound.rig.is_none() && index % 4 != 0 {
            continue;
        }
        for (fault, kind) in FAULTS {
            // A fault that the recording has by itself cannot be put into it.
            if kinds.contains(&kind) {
                continue;
            }
            let Some(faulty) = seeded(sound, fault, &mut draw) else {
                continue;
            };
            let found = check(std::slice::from_ref(&faulty), sound.rig.as_ref());
            let count = table.entry(fault).or_default();
            count[1] += 1;
            if found.iter().any(|check| check.kind.starts_with(kind)) {
                count[0] += 1;
            } else {
                let kinds: Vec<&str> = found.iter().map(|check| check.kind).collect();
                missed.push(format!("{}: {fault} taken for {kinds:?}", sound.name));
            }
        }
    }
    println!("| fault | named | seeded |\n|---|---|---|");
    for (fault, [named, of]) in &table {
        println!("| {fault} | {named} | {of} |");
    }
    let (clean, wrong) = (sound.len(), false_ones.len());
    println!("sound recordings: {clean}, with a fault named: {wrong}");
    let named: usize = table.values().map(|count| count[0]).sum();
    let of: usize = table.values().map(|count| count[1]).sum();
    println!("named {named} of {of}");
    let report = [&missed[..], &false_ones].concat().join("\n");
    println!("{report}");
    assert_eq!(table.len(), FAULTS.len(), "a fault was never seeded");
    assert!(named * 100 >= of * 95, "{report}");
    assert!(false_ones.is_empty(), "{report}");
}

/// Faults that show in a column alone, without a fit: these take no time.
#[test]
fn faults_of_one_column_are_named_and_sound_columns_are_not() {
    let mut draw = Draw(11);
    let (mut named, mut missed) = (0, Vec::new());
    for sound in (0..16).map(simulated) {
        let alone = |recording: &Recording| check(std::slice::from_ref(recording), None);
        let own = alone(&sound.recording);
        assert!(own.is_empty(), "{}: {own:?}", sound.name);
        for (fault, kind) in FAULTS {
            let by_column = [
                "jitter",
                "jitter of the delay",
                "gap",
                "coarse steps",
                "sentinel",
            ]
            .contains(&fault);
            let Some(faulty) = by_column
                .then(|| seeded(&sound, fault, &mut draw))
                .flatten()
            else {
                continue;
            };
            if alone(&faulty).iter().any(|c| c.kind.starts_with(kind)) {
                named += 1
            } else {
                missed.push(format!("{}: {fault}", sound.name))
            }
        }
    }
    assert!(named == 73 && missed.is_empty(), "{named}: {missed:?}");
}

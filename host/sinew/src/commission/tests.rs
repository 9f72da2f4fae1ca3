//! The steps against a board that this computer simulates, with faults of the wiring.

use std::path::Path;

use sinew_sim::{Plant, Rig};

use super::bench::{Bench, Cut};
use super::journal::Journal;
use super::setup::Setup;
use super::simulated::{self, Driven};
use super::step::Step;
use super::{Commissioning, Settings};
use crate::live::Names;
use sinew_ident::error::Result;
use sinew_ident::recording::Recording;

/// Two joints with springs of their own and a soft one between them, a motor each.
pub(crate) const RIG: &str = r#"
format = "sinew-rig/1"
name = "two joints"

[[body]]
name = "a"
motion = "hinge"
inertia = { value = 0.01 }

[[body]]
name = "b"
motion = "hinge"
inertia = { value = 0.02 }

[[spring]]
name = "coil_a"
from = "ground"
to = "a"
stiffness = { value = 2.0 }

[[spring]]
name = "coil_b"
from = "ground"
to = "b"
stiffness = { value = 3.0 }

[[spring]]
name = "between"
from = "a"
to = "b"
stiffness = { value = 0.2 }

[[damper]]
name = "oil_a"
from = "ground"
to = "a"
damping = { value = 0.1 }

[[damper]]
name = "oil_b"
from = "ground"
to = "b"
damping = { value = 0.15 }

[[actuator]]
name = "motor_a"
drives = "a"
input = "u1_V"
gain = 0.5
limit = [-2.0, 2.0]
rate_limit = 40.0

[[actuator]]
name = "motor_b"
drives = "b"
input = "u2_V"
gain = 0.5
limit = [-2.0, 2.0]
rate_limit = 40.0

[[sensor]]
name = "encoder_a"
reads = "a.position"
signal = "q1_rad"

[[sensor]]
name = "encoder_b"
reads = "b.position"
signal = "q2_rad"

[control]
rate_hz = 100.0
"#;

fn rig(text: &str) -> Rig {
    Rig::parse(text, "rig.toml").unwrap_or_else(|error| panic!("{error}"))
}

fn settings() -> Settings {
    Settings {
        rest_s: 1.0,
        sweep_s: 4.0,
        excite_s: 4.0,
        ..Settings::default()
    }
}

fn open(folder: &Path, declared: &str) -> Commissioning {
    let setup = Setup::new(rig(declared), &[]).unwrap_or_else(|error| panic!("{error}"));
    Commissioning::open(setup, folder, false, settings()).unwrap_or_else(|error| panic!("{error}"))
}

/// Takes the steps up to `last` on a plant whose sensors may be broken.
fn commissioned(
    folder: &Path,
    (declared, plant): (&str, &str),
    sensors: impl FnMut(&mut [f32; 2]) + Send + 'static,
    last: Step,
) -> (Result<Vec<String>>, Driven) {
    let mut work = open(folder, declared);
    let plant = Plant::new(&rig(plant)).expect("a plant");
    let (device, driven) = simulated::start(&work.bare, &plant, sensors);
    let result = (|| {
        let mut bench = Bench::new(device, Names::of(&work.bare))?;
        let mut lines = Vec::new();
        for step in Step::ALL.into_iter().filter(|step| *step <= last) {
            if !work.has(step) || step == Step::Stop {
                lines.extend(work.on_board(step, &mut bench)?);
            }
        }
        Ok(lines)
    })();
    (result, driven)
}

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().expect("a temporary folder")
}

fn journal(folder: &Path) -> Journal {
    Journal::open(folder, "two joints", false).unwrap_or_else(|error| panic!("{error}"))
}

/// Largest command of each actuator that reached the rig.
fn largest(driven: &Driven) -> [f64; 2] {
    let driven = driven.lock().expect("the board still runs");
    driven.iter().fold([0.0, 0.0], |m: [f64; 2], u| {
        [m[0].max(u[0].abs()), m[1].max(u[1].abs())]
    })
}

/// Kinds and signals of the causes of a fault.
type Causes = Vec<(String, Vec<String>)>;

/// Kinds of the causes of the fault that `step` found, and what moved.
fn fault(
    rigs: (&str, &str),
    sensors: impl FnMut(&mut [f32; 2]) + Send + 'static,
    step: Step,
) -> (Causes, [f64; 2], String) {
    let folder = folder();
    let (result, driven) = commissioned(folder.path(), rigs, sensors, Step::Excite);
    let error = result.expect_err("the fault was not found").to_string();
    let journal = journal(folder.path());
    let fault = journal
        .fault
        .clone()
        .unwrap_or_else(|| panic!("no fault is noted: {error}"));
    assert_eq!(fault.step, step.name(), "{error}");
    assert!(
        !journal.done.contains_key(step.name()),
        "a step with a fault is not finished"
    );
    // Nothing moves afterwards.
    let before = driven.lock().expect("the board still runs").len();
    std::thread::sleep(std::time::Duration::from_millis(100));
    let after = driven.lock().expect("the board still runs").len();
    assert!(
        after <= before + 1,
        "it still moves: {before} then {after} ticks"
    );
    let causes = fault
        .causes
        .into_iter()
        .map(|cause| (cause.kind, cause.signals));
    (causes.collect(), largest(&driven), error)
}

fn is(causes: &[(String, Vec<String>)], kind: &str, signals: &[&str]) -> bool {
    causes.iter().any(|(k, s)| k == kind && s == signals)
}

#[test]
fn a_sound_rig_goes_from_the_emergency_stop_to_recordings_inside_its_soft_limits() {
    let folder = folder();
    // The first joint meets a stop at 0.3 rad, of the 0.43 that it could reach.
    let stop = "[[effect]]\nkind = \"end_stop\"\ncomponent = \"a\"\nposition = { value = 0.3 }\n\
                stiffness = { value = 400.0 }\ndamping = { value = 1.0 }\nside = 1\n";
    let plant = format!("{RIG}\n{stop}");
    let (result, driven) = commissioned(folder.path(), (RIG, &plant), |_| {}, Step::Excite);
    let lines = result.unwrap_or_else(|error| panic!("{error}"));
    let journal = journal(folder.path());
    assert_eq!(journal.done.len(), 5, "{lines:?}");
    let stop = journal.stop.expect("the stop was proven");
    assert!(stop.armed_s > 0.0 && stop.disarmed_s > 0.0);
    for sensor in &journal.sensors {
        // The simulated converter's noise.
        let span = 2.0 * 1.1 / 2.0;
        assert!(
            sensor.noise > 1e-5 && sensor.noise < 1e-3 * span,
            "{sensor:?}"
        );
    }
    for (moved, signal) in journal.actuators.iter().zip(["q1_rad", "q2_rad"]) {
        let ratio = moved.ratios[signal];
        assert!((ratio - 1.0).abs() < 0.1, "{moved:?}");
    }
    let ends = journal.actuators[0]
        .ends
        .as_ref()
        .expect("ends were sought");
    assert!(!ends[0].saturated && ends[0].command == -2.0, "{ends:?}");
    // The stop is met at 0.3 rad: by 2.19 N m/rad, that of `b` between, at 1.31 V.
    assert!(
        ends[1].saturated && (1.1..1.4).contains(&ends[1].command),
        "{ends:?}"
    );
    assert!((ends[1].readings["q1_rad"] - 0.3).abs() < 0.03, "{ends:?}");
    let second = journal.actuators[1]
        .ends
        .as_ref()
        .expect("ends were sought");
    assert!(second.iter().all(|end| !end.saturated), "{second:?}");

    let limited = rig(&std::fs::read_to_string(folder.path().join("rig.toml")).expect("the rig"));
    assert_eq!(limited.actuators[0].limit, Some((-2.0, ends[1].command)));
    for name in super::RECORDINGS {
        let recording = Recording::read(folder.path().join(name)).expect("a recording");
        assert!(recording.len() > 300, "{name}: {} rows", recording.len());
        let u = recording.column("u1_V").expect("an input");
        let (low, high) = u
            .iter()
            .fold((0.0, 0.0), |(l, h): (f64, f64), u| (l.min(*u), h.max(*u)));
        assert!(
            high <= ends[1].command + 1e-6,
            "beyond the soft limit: {high}"
        );
        assert!(
            high > 0.5 * ends[1].command && low < -1.0,
            "not excited: {low} to {high}"
        );
    }
    assert!(
        largest(&driven).iter().all(|u| *u > 1.5),
        "the ends were never sought"
    );
}

#[test]
fn nothing_moves_before_the_emergency_stop_is_proven_and_while_sensors_are_at_rest() {
    let folder = folder();
    let (result, driven) = commissioned(folder.path(), (RIG, RIG), |_| {}, Step::Rest);
    result.unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(largest(&driven), [0.0; 2]);
}

#[test]
fn a_reversed_sensor_is_named_before_the_other_actuator_moves() {
    let reversed = |y: &mut [f32; 2]| y[0] = -y[0];
    let (causes, largest, error) = fault((RIG, RIG), reversed, Step::Move);
    assert!(is(&causes, "reversed_sensor", &["q1_rad"]), "{error}");
    assert!(!is(&causes, "scaled_sensor", &["q1_rad"]), "{error}");
    assert!(largest[0] > 0.05 && largest[0] <= 0.401, "{largest:?}");
    assert_eq!(largest[1], 0.0, "the other actuator moved");
}

#[test]
fn sensors_that_one_actuator_has_confirmed_tell_that_the_next_one_is_reversed() {
    let coupled = RIG.replace("stiffness = { value = 0.2 }", "stiffness = { value = 4.0 }");
    let plant = coupled.replace(
        "input = \"u2_V\"\ngain = 0.5",
        "input = \"u2_V\"\ngain = -0.5",
    );
    assert_ne!(plant, coupled);
    let (causes, _, error) = fault((&coupled, &plant), |_| {}, Step::Move);
    let wanted = [("reversed_actuator".to_string(), vec!["u2_V".to_string()])];
    assert_eq!(causes, wanted, "{error}");
    // Joints that hardly see each other leave both.
    let plant = RIG.replace(
        "input = \"u2_V\"\ngain = 0.5",
        "input = \"u2_V\"\ngain = -0.5",
    );
    let (causes, _, error) = fault((RIG, &plant), |_| {}, Step::Move);
    assert!(is(&causes, "reversed_actuator", &["u2_V"]), "{error}");
    assert!(is(&causes, "reversed_sensor", &["q2_rad"]), "{error}");
    assert_eq!(causes.len(), 2, "{error}");
}

#[test]
fn crossed_actuators_are_named() {
    let plant = RIG
        .replace("drives = \"a\"", "drives = \"A\"")
        .replace("drives = \"b\"", "drives = \"a\"")
        .replace("drives = \"A\"", "drives = \"b\"");
    let (causes, largest, error) = fault((RIG, &plant), |_| {}, Step::Move);
    assert!(
        is(&causes, "crossed_actuators", &["u1_V", "u2_V"]),
        "{error}"
    );
    assert!(
        !causes.iter().any(|(kind, _)| kind.starts_with("reversed")),
        "{error}"
    );
    assert_eq!(largest[1], 0.0, "the other actuator moved");
}

#[test]
fn a_dead_sensor_is_named_by_its_missing_samples_or_by_the_motion_that_it_does_not_show() {
    let (causes, largest, error) = fault((RIG, RIG), |y| y[1] = f32::NAN, Step::Rest);
    assert_eq!(
        causes,
        [("dead_sensor".to_string(), vec!["q2_rad".to_string()])],
        "{error}"
    );
    assert_eq!(largest, [0.0; 2], "something moved");
    let (causes, _, error) = fault((RIG, RIG), |y| y[1] = 0.01, Step::Move);
    assert!(is(&causes, "dead_sensor", &["q2_rad"]), "{error}");
}

#[test]
fn a_wrong_scale_is_named_with_the_factor_and_its_likely_reason() {
    let degrees = |y: &mut [f32; 2]| y[0] = y[0].to_degrees();
    let (causes, largest, error) = fault((RIG, RIG), degrees, Step::Move);
    assert!(is(&causes, "scaled_sensor", &["q1_rad"]), "{error}");
    assert!(error.contains("degrees in place of radians"), "{error}");
    assert_eq!(largest[1], 0.0, "the other actuator moved");
}

#[test]
fn a_dead_actuator_is_named_after_the_largest_motion_that_is_allowed() {
    let plant = RIG.replace(
        "input = \"u1_V\"\ngain = 0.5",
        "input = \"u1_V\"\ngain = 1e-9",
    );
    let (causes, largest, error) = fault((RIG, &plant), |_| {}, Step::Move);
    assert!(is(&causes, "dead_actuator", &["u1_V"]), "{error}");
    // 20 % of 2 V and no more.
    assert!((largest[0] - 0.4).abs() < 1e-3, "{largest:?}");
}

#[test]
fn a_finished_step_is_not_taken_again_unless_it_is_asked_for() {
    let folder = folder();
    let (result, _) = commissioned(folder.path(), (RIG, RIG), |_| {}, Step::Move);
    result.unwrap_or_else(|error| panic!("{error}"));
    let before = journal(folder.path());
    // A second run: the emergency stop alone.
    let (result, driven) = commissioned(folder.path(), (RIG, RIG), |_| {}, Step::Move);
    assert_eq!(result.map(|lines| lines.len()).ok(), Some(1));
    assert_eq!(largest(&driven), [0.0; 2]);
    let after = journal(folder.path());
    assert_eq!(
        (&after.actuators, &after.sensors),
        (&before.actuators, &before.sensors)
    );

    let mut work = open(folder.path(), RIG);
    work.forget(Step::Move).expect("the folder is writable");
    assert!(work.has(Step::Rest) && !work.has(Step::Move));
    let (result, driven) = commissioned(folder.path(), (RIG, RIG), |_| {}, Step::Move);
    result.unwrap_or_else(|error| panic!("{error}"));
    assert!(largest(&driven)[0] > 0.05, "it was not taken again");
}

#[test]
fn a_number_of_the_rig_that_changes_keeps_the_board_and_repeats_the_motions() {
    let folder = folder();
    let (result, _) = commissioned(folder.path(), (RIG, RIG), |_| {}, Step::Move);
    result.unwrap_or_else(|error| panic!("{error}"));
    let bare = open(folder.path(), RIG).bare;
    let softer = rig(&RIG.replace("stiffness = { value = 2.0 }", "stiffness = { value = 1.5 }"));
    let setup = Setup::new(softer, &[]).expect("a setup");
    let work = Commissioning::open(setup, folder.path(), false, settings()).expect("it goes on");
    assert_eq!(work.bare, bare, "the board would have to be flashed again");
    assert!(work.has(Step::Rest) && !work.has(Step::Move));
    // Other limits are another board.
    let wider = rig(&RIG.replace("limit = [-2.0, 2.0]", "limit = [-3.0, 3.0]"));
    let setup = Setup::new(wider, &[]).expect("a setup");
    let refused = Commissioning::open(setup, folder.path(), false, settings());
    assert!(refused.is_err_and(|e| e.to_string().contains("flash the board again")));
}

#[test]
fn a_folder_of_a_rehearsal_is_not_one_of_a_device() {
    let folder = folder();
    let setup = || Setup::new(rig(RIG), &[]).expect("a setup");
    let mut work =
        Commissioning::open(setup(), folder.path(), true, settings()).expect("a new one");
    work.finish(Step::Stop).expect("the folder is writable");
    let refused = Commissioning::open(setup(), folder.path(), false, settings());
    let error = refused
        .err()
        .expect("a rehearsal was taken for a device")
        .to_string();
    assert!(
        error.contains("it is about a rehearsal, not about a device"),
        "{error}"
    );
    let file = folder.path().join(super::journal::FILE);
    std::fs::write(&file, "{ \"format\": 1 }").expect("the folder is writable");
    assert!(Commissioning::open(setup(), folder.path(), true, settings()).is_err());
}

#[test]
fn a_range_narrows_the_commands_and_one_beyond_the_limit_is_refused() {
    let range = |low, high| [("u1_V".to_string(), low, high)];
    let setup = Setup::new(rig(RIG), &range(-0.5, 1.0)).expect("a setup");
    assert_eq!(
        (setup.actuators[0].low, setup.actuators[0].high),
        (-0.5, 1.0)
    );
    assert_eq!(
        (setup.actuators[1].low, setup.actuators[1].high),
        (-2.0, 2.0)
    );
    for (bad, why) in [
        (range(-3.0, 1.0).to_vec(), "within the limit of `u1_V`"),
        (range(1.0, 1.0).to_vec(), "LOWER < UPPER"),
        (
            vec![("u3_V".to_string(), 0.0, 1.0)],
            "the rig's inputs: u1_V, u2_V",
        ),
    ] {
        let error = Setup::new(rig(RIG), &bad)
            .expect_err("it was taken")
            .to_string();
        assert!(error.contains(why), "{error}");
    }
}

#[test]
fn the_board_keeps_every_other_actuator_where_it_is_whatever_is_sent() {
    let folder = folder();
    let work = open(folder.path(), RIG);
    let (device, driven) = simulated::start(&work.bare, &work.setup.plant, |_| {});
    let bench = Bench::new(device, Names::of(&work.bare));
    let mut bench = bench.unwrap_or_else(|error| panic!("{error}"));
    let ranges = [(-0.3, 0.3), (0.0, 0.0)];
    let limited = bench.limit(&work.setup, &ranges, &[4.0, 4.0]);
    limited.unwrap_or_else(|error| panic!("{error}"));
    let rows = vec![vec![1.0, 1.0]; 60];
    let free = [(f64::NEG_INFINITY, f64::INFINITY); 2];
    let played = bench.play(&rows, &free, &mut |_| false);
    let played = played.unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(played.recorded.limited_rows, 60);
    let [first, second] = largest(&driven);
    assert!((first - 0.3).abs() < 1e-3, "{first}");
    assert_eq!(second, 0.0);
}

#[test]
fn a_reading_that_runs_away_stops_the_board_until_somebody_acknowledges_it() {
    let folder = folder();
    let work = open(folder.path(), RIG);
    let (device, driven) = simulated::start(&work.bare, &work.setup.plant, |_| {});
    let bench = Bench::new(device, Names::of(&work.bare));
    let mut bench = bench.unwrap_or_else(|error| panic!("{error}"));
    let rows: Vec<Vec<f64>> = (0..400).map(|k| vec![0.005 * f64::from(k), 0.0]).collect();
    let narrow = [(-0.1, 0.1), (-1.0, 1.0)];
    let played = bench.play(&rows, &narrow, &mut |_| false);
    let played = played.unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(played.cut, Some(Cut::RanAway(0)));
    let [first, _] = largest(&driven);
    assert!(first > 0.2 && first < 1.5, "stopped at {first} V of 2 V");
    assert!(
        bench
            .refuses_to_arm()
            .unwrap_or_else(|error| panic!("{error}"))
    );
    bench.settle().unwrap_or_else(|error| panic!("{error}"));
    bench
        .arm_at_rest()
        .unwrap_or_else(|error| panic!("{error}"));
}
